"""The commands as a user runs them: results, remarks, exit codes."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from tests.cli.terminal import ROOT, lagrange, succeed

BEAD = "systems/lecture/bead_on_parabola.yaml"
HOLE = "systems/lecture/masses_through_hole.yaml"
DOUBLE = "systems/pendulums/double_pendulum.yaml"

SLOW = """\
name: slow
parameters: {m: 1, k: 1}
particles:
  bob: {mass: m, position: [x, 0, 0]}
coordinates: [x]
potentials:
  spring: k*x^2/2
initial: {x: 1}
simulate: {until: 1e8, accuracy: 1e-4}
"""


class TestDerive:
    @pytest.mark.slow
    def test_text_names_everything_a_person_asks_for(self):
        text = succeed("derive", HOLE)
        assert "3N = 6, K = 4, DOF = 2" in text
        assert "θ is cyclic" in text
        assert "Certified at 8 random states to 30 digits" in text
        assert "\x1b" not in text

    def test_latex_beside_json(self):
        plain = json.loads(succeed("derive", HOLE, "--json"))
        written = succeed("derive", HOLE, "--json", "--with", "latex")
        assert written == succeed("derive", HOLE, "--json", "--with", "latex")
        found = json.loads(written)
        typeset = found.pop("latex")
        assert found == plain
        assert typeset["potential"] == "m g (r - l)"
        assert typeset["symbols"]["ddot(theta)"] == r"\ddot{\theta}"
        done = lagrange("derive", HOLE, "--with", "latex")
        assert done.returncode == 2
        assert "format 'text' has no option 'latex'" in done.stderr

    def test_json_is_the_contract(self):
        found = json.loads(succeed("derive", HOLE, "--format", "json"))
        assert (found["cartesian"], found["constraints"], found["dof"]) == (6, 4, 2)
        assert found["cyclic"] == ["theta"]
        assert {"name": "p_theta", "expression": "M*r^2*dot(theta)"}.items() <= next(
            c for c in found["conserved"] if c["name"] == "p_theta"
        ).items()
        assert found["certificate"]["mismatch"] < 1e-25
        assert found == json.loads(succeed("derive", HOLE, "--json"))

    @pytest.mark.slow
    def test_latex_is_a_document(self):
        assert r"\begin{document}" in succeed("derive", HOLE, "--format", "latex")

    def test_explicit_form_is_solved_for_the_accelerations(self):
        text = succeed("derive", HOLE, "--form", "explicit", "--ascii")
        assert text.isascii()
        assert text != succeed("derive", HOLE, "--ascii")

    def test_digits_reach_the_certificate(self):
        found = json.loads(succeed("derive", BEAD, "--digits", "50", "--json"))
        assert found["certificate"]["digits"] == 50
        assert found["certificate"]["mismatch"] < 1e-45

    def test_ascii_where_the_terminal_has_no_more(self):
        assert succeed("derive", HOLE, encoding="ascii") == succeed("derive", HOLE, "--ascii")

    @pytest.mark.slow
    @pytest.mark.parametrize("setting", [{"LC_ALL": "C"}, {"PYTHONIOENCODING": "ascii"}])
    def test_poor_locales_do_not_crash(self, setting):
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("LC_", "LANG"))}
        done = subprocess.run(
            [sys.executable, "-m", "lagrange_cli", "derive", HOLE],
            cwd=ROOT,
            env=environment | setting,
            capture_output=True,
            timeout=120,
        )
        assert (done.returncode, done.stderr) == (0, b"")
        assert b"DOF = 2" in done.stdout

    @pytest.mark.slow
    def test_json_is_json_in_poor_locales(self):
        done = subprocess.run(
            [sys.executable, "-m", "lagrange_cli", "check", "-", "--json"],
            input="parameters: {\u00e9: 1}\n".encode(),
            cwd=ROOT,
            env=os.environ | {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
            capture_output=True,
            timeout=120,
        )
        (scene,) = json.loads(done.stdout.decode("ascii"))["scenes"]
        assert "'\u00e9'" in scene["problems"][0]["message"]

    def test_output_file_holds_what_the_terminal_shows(self, tmp_path):
        assert succeed("derive", HOLE, "-o", str(tmp_path / "hole.txt")) == ""
        assert (tmp_path / "hole.txt").read_text(encoding="utf-8") == succeed("derive", HOLE)

    def test_standard_input(self):
        scene = (ROOT / BEAD).read_text(encoding="utf-8")
        assert "DOF = 1" in succeed("derive", "-", input=scene)

    def test_parameter_by_an_expression(self):
        found = lagrange("derive", BEAD, "-p", "a=1/2 + 1", "--json")
        assert found.returncode == 0, found.stderr

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            (("-p", "a"), "'a' is not of the form NAME=VALUE"),
            (("-p", "a="), "'a=' is not of the form NAME=VALUE"),
            (("-p", "a=1", "-p", "a=2"), "'a' is given twice"),
            (("-p", "aa=1"), "did you mean 'a'?"),
            (("-p", "a=b+"), "a=b+"),
            (("--digits", "3"), "15<=x<=1000"),
            (("--form", "hamilton"), "hamilton"),
            (("--form", "routhian"), "there is no Routhian: no coordinate is cyclic"),
        ],
    )
    def test_wrong_usage_exits_2(self, words, said):
        done = lagrange("derive", BEAD, *words)
        assert (done.returncode, done.stdout) == (2, "")
        assert said in done.stderr
        assert "Traceback" not in done.stderr


class TestWarnings:
    SCENE = "systems/lecture/rigid_tetrahedron_centre.yaml"

    @pytest.mark.slow
    def test_a_warning_goes_to_stderr(self):
        done = lagrange("derive", self.SCENE)
        assert done.returncode == 0
        assert "warning: " in done.stderr
        assert "DOF = 6" in done.stdout

    @pytest.mark.slow
    def test_quiet_says_nothing(self):
        assert lagrange("derive", self.SCENE, "-q").stderr == ""

    @pytest.mark.slow
    def test_strict_refuses(self):
        done = lagrange("derive", self.SCENE, "--strict")
        assert (done.returncode, done.stdout) == (2, "")
        assert "--strict: warnings are refused" in done.stderr

    def test_verbose_says_more(self):
        assert "derived and certified in" in lagrange("derive", BEAD, "-v").stderr


class TestEmit:
    @pytest.mark.parametrize("name", EMITTERS)
    def test_files_are_named_after_the_scene(self, name, tmp_path):
        succeed("emit", HOLE, "--to", name, "-o", str(tmp_path / "out"))
        expected = {"masses_through_hole" + e for e in EMITTERS[name].extensions}
        assert set(os.listdir(tmp_path / "out")) == expected

    @pytest.mark.parametrize("name", [n for n, f in EMITTERS.items() if f.single_file])
    def test_one_file_prints(self, name, tmp_path):
        printed = succeed("emit", HOLE, "--to", name)
        succeed("emit", HOLE, "--to", name, "-o", str(tmp_path))
        (path,) = tmp_path.iterdir()
        assert path.read_text(encoding="utf-8") == printed

    def test_several_files_need_a_folder_and_the_fix_can_be_pasted(self, tmp_path):
        done = lagrange("emit", HOLE, "--to", "c")
        assert done.returncode == 2
        fix = re.search(r"^  lagrange (emit .* -o )out/$", done.stderr, re.MULTILINE)
        succeed(*fix.group(1).split(), str(tmp_path))
        assert len(os.listdir(tmp_path)) == 2

    def test_list_names_every_format(self):
        head, *listed = succeed("emit", "--list").splitlines()
        assert head.split() == ["format", "files", "content"]
        assert [line.split()[0] for line in listed] == list(EMITTERS)
        column = head.index("content")
        assert [line[column:] for line in listed] == [one.title for one in EMITTERS.values()]

    def test_style_snippet(self):
        assert r"\documentclass" not in succeed("emit", HOLE, "--to", "latex", "--style", "snippet")

    def test_option_of_another_format_exits_2(self):
        done = lagrange("emit", HOLE, "--to", "c", "-o", "out", "--style", "snippet")
        assert done.returncode == 2
        assert "format 'c' has no option 'style'" in done.stderr

    def test_file_in_the_way_exits_2(self, tmp_path):
        (tmp_path / "out").write_text("kept")
        done = lagrange("emit", HOLE, "--to", "c", "-o", "out", cwd=tmp_path)
        assert done.returncode == 2


class TestSimulate:
    @pytest.mark.slow
    def test_json_is_the_contract(self):
        found = json.loads(succeed("simulate", HOLE, "--accuracy", "1e-9", "--json"))
        assert found["status"] == "ok"
        assert found["t"] == found["holds_until"] == 10.0
        assert found["accuracy"]["requested"] == 1e-9
        assert 0 < found["accuracy"]["estimated"] <= 1e-9
        assert found["energy_drift"] < 1e-8
        assert found["constraint_drift"] is None
        assert set(found["seconds"]) >= {"derive", "compile", "integrate", "estimate"}
        assert {"r", "dot(r)", "theta", "x1", "dot(z2)"} <= set(found["state"])

    def test_csv_ends_with_the_state_of_the_report(self, tmp_path):
        path = tmp_path / "traj.csv"
        report = json.loads(
            succeed("simulate", HOLE, "--until", "2", "--samples", "11", "--json", "-o", str(path))
        )
        rows = list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))
        assert len(rows) == 11
        last = {name: float(value) for name, value in rows[-1].items()}
        assert last.pop("t") == 2.0
        assert {name: last[name] for name in report["state"]} == report["state"]

    def test_npz_holds_the_same_as_csv(self, tmp_path):
        for name in ("traj.csv", "traj.npz"):
            succeed("simulate", HOLE, "--until", "1", "-o", str(tmp_path / name))
        rows = list(csv.DictReader(io.StringIO((tmp_path / "traj.csv").read_text())))
        with np.load(tmp_path / "traj.npz", allow_pickle=False) as arrays:
            for name in rows[0]:
                assert arrays[name].tolist() == [float(row[name]) for row in rows]

    @pytest.mark.slow
    def test_initial_values_replace_those_of_the_scene(self):
        still = json.loads(
            succeed("simulate", BEAD, "-i", "x=0", "-i", "dot(x)=0", "--until", "1", "--json")
        )
        assert still["state"]["x"] == 0.0

    def test_summary_for_a_person(self):
        text = succeed("simulate", HOLE, "--accuracy", "1e-9")
        assert "t = 10" in text
        assert "Energy    relative drift" in text
        assert "theta" in text

    def test_unknown_ending_exits_2_before_the_work(self, tmp_path):
        done = lagrange("simulate", HOLE, "-o", str(tmp_path / "traj.txt"))
        assert done.returncode == 2
        assert ".csv" in done.stderr
        assert ".npz" in done.stderr

    def test_no_until_exits_2_with_a_fix(self, tmp_path):
        (tmp_path / "s.yaml").write_text(re.sub("simulate.*\n", "", SLOW))
        done = lagrange("simulate", "s.yaml", cwd=tmp_path)
        assert done.returncode == 2
        assert "--until" in done.stderr

    def test_accuracy_that_doubles_cannot_hold_is_not_claimed(self):
        done = lagrange("simulate", DOUBLE, "--accuracy", "1e-17", "--json")
        assert done.returncode in (1, 2)
        assert "Traceback" not in done.stderr

    def test_unknown_method_exits_2(self):
        done = lagrange("simulate", BEAD, "--method", "Euler")
        assert done.returncode == 2
        assert "DOP853" in done.stderr

    def test_capitals_of_methods_do_not_matter(self):
        for name in ("Taylor", "dop853", "AUTO"):
            how = ("--method", name, *(() if name == "AUTO" else ("--rtol", "1e-6")))
            done = lagrange("simulate", BEAD, *how, "--until", "0.1", "--json")
            assert done.returncode == 0, done.stderr

    @pytest.mark.slow
    def test_a_chosen_method_says_that_the_scenes_accuracy_is_not_promised(self):
        for how in (("--method", "RK4", "--step", "0.01"), ("--rtol", "1e-6")):
            done = lagrange("simulate", HOLE, *how)
            assert done.returncode == 0
            assert "the scene's accuracy 1e-09 is not promised" in done.stderr
            assert "nothing is promised or estimated: a method was chosen" in done.stdout
            assert lagrange("simulate", HOLE, *how, "-q").stderr == ""
        assert "promised" not in lagrange("simulate", HOLE, "--accuracy", "1e-6").stderr

    @pytest.mark.slow
    def test_plot(self, tmp_path):
        pytest.importorskip("matplotlib")
        path = tmp_path / "plot.png"
        succeed("simulate", BEAD, "--until", "1", "--plot", str(path))
        assert path.read_bytes().startswith(b"\x89PNG")


class TestHelp:
    def test_version(self):
        assert re.fullmatch(r"lagrange, version \d+\.\d+\.\d+\n", succeed("--version"))

    def test_unknown_command_exits_2(self):
        assert lagrange("deriv", BEAD).returncode == 2


class TestInterruption:
    @pytest.fixture
    def running(self, tmp_path):
        """A simulation that takes minutes, since its phase stays known, writing into a folder."""
        (tmp_path / "slow.yaml").write_text(SLOW)
        (tmp_path / "out").mkdir()
        words = ["simulate", "slow.yaml", "-v", "-o", "out/t.csv"]
        process = subprocess.Popen(
            [sys.executable, "-m", "lagrange_cli", *words],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        assert process.stderr.readline()  # it has its equations
        yield process
        if process.poll() is None:
            process.kill()
        process.wait()

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("number", "code"),
        [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)],
        ids=["int", "term", "hup"],
    )
    def test_what_is_done_is_kept_and_said(self, running, tmp_path, number, code):
        running.send_signal(number)
        _, stderr = running.communicate(timeout=30)
        assert running.returncode == code
        assert b"Traceback" not in stderr
        if os.listdir(tmp_path / "out"):
            assert b"what is kept ends at t = " in stderr
            rows = (tmp_path / "out" / "t.csv").read_text().splitlines()
            assert {row.count(",") for row in rows} == {rows[0].count(",")}

    def test_a_reader_that_went_away(self):
        command = f"{sys.executable} -m lagrange_cli derive {HOLE} | true; echo ${{PIPESTATUS[0]}}"
        done = subprocess.run(
            ["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=60
        )
        assert done.stdout.strip() in ("0", "141")
        assert "Traceback" not in done.stderr


@pytest.mark.usefixtures("cache_folder")
class TestInternalErrors:
    def run(self, *words: str):
        program = (
            "import sys, lagrange_cli.scene.reader as s\n"
            "def broken(*a, **k): raise KeyError('no such thing\\x1b')\n"
            "s.read_text = broken\n"
            "from lagrange_cli.cli.main import main\n"
            "main()"
        )
        return subprocess.run(
            [sys.executable, "-c", program, "derive", BEAD, *words],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=60,
        )

    def test_unexpected_exception_exits_3_and_asks_for_a_report(self):
        done = self.run()
        assert done.returncode == 3
        assert "internal error: KeyError" in done.stderr
        assert "please report it" in done.stderr
        assert "Traceback" not in done.stderr
        assert "\x1b" not in done.stderr

    def test_traceback_on_request(self):
        assert "Traceback (most recent call last)" in self.run("--traceback").stderr


@pytest.mark.slow
@pytest.mark.parametrize("option", ["-o", "--plot"])
def test_a_file_that_cannot_be_written_is_refused_before_the_scene_is_read(option, tmp_path):
    if option == "--plot":
        pytest.importorskip("matplotlib")
    ending = ".svg" if option == "--plot" else ".csv"
    folder = (tmp_path / "folder").with_suffix(ending)
    folder.mkdir()
    for path, why in (
        ((tmp_path / "missing" / "t").with_suffix(ending), "No such file"),
        (folder, "is a folder"),
    ):
        done = lagrange("simulate", str(tmp_path / "no-scene.yaml"), option, str(path))
        assert done.returncode == 2
        assert done.stderr.startswith(f"cannot write '{path}': ")
        assert why in done.stderr
        assert "no-scene" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "label"),
    [("beads/bead_on_rotating_hoop", "Jacobi"), ("pendulums/pendulum", "Energy")],
)
def test_the_drift_is_of_the_quantity_that_it_names(scene, label):
    done = lagrange("simulate", f"systems/{scene}.yaml", "--until", "0.1")
    assert done.returncode == 0
    assert f"\n{label}    relative drift" in done.stdout
