"""No output of a command takes the place of what the command reads, whatever it is called."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.cli.terminal import ROOT, lagrange

SCENE = """\
name: swing
parameters: {l: 1}
particles: {bob: {mass: 1, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
inputs: {u: {file: push.csv, column: u}}
potentials: {weight: 9.81*z_bob}
forces: {push: {on: bob, force: [u, 0, 0]}}
initial: {theta: 2.0}
simulate: {until: 1}
"""

#: Option and ending of the output, and the words before it.
OUTPUTS = {
    "derive": (("derive", "SCENE"), "-o", ""),
    "samples": (("simulate", "SCENE"), "-o", ".csv"),
    "npz": (("simulate", "SCENE"), "-o", ".npz"),
    "picture": (("simulate", "SCENE"), "--plot", ".svg"),
    "checkpoint": (("simulate", "SCENE"), "--checkpoint", ""),
    "ensemble": (("simulate", "SCENE", "--ensemble", "MEMBERS"), "-o", ".npz"),
    "analysis": (("analyze", "SCENE"), "-o", ".json"),
    "tradeoff": (("tradeoff", "SCENE"), "-o", ".json"),
    "tradeoff picture": (("tradeoff", "SCENE"), "--plot", ".svg"),
    "stress": (("stress", "SCENE"), "-o", ".json"),
    "check": (("check", "SCENE"), "-o", ""),
    "junit": (("check", "SCENE"), "--junit", ".xml"),
    "c": (("emit", "SCENE", "--to", "c"), "-o", "/swing.c"),
    "header": (("emit", "SCENE", "--to", "c"), "-o", "/swing.h"),
    "python": (("emit", "SCENE", "--to", "python"), "-o", "/swing.py"),
    "latex": (("emit", "SCENE", "--to", "latex"), "-o", "/swing.tex"),
}

READ = {"scene": "scene.yaml", "recording": "push.csv", "members": "members.csv"}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")
    (tmp_path / "scene.yaml").write_text(SCENE)
    (tmp_path / "push.csv").write_text("t,u\n0,0\n1,1\n")
    (tmp_path / "members.csv").write_text("l\n1\n2\n")
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "read"),
    [(kind, read) for kind in OUTPUTS for read in READ if read != "members" or kind == "ensemble"],
)
def test_what_is_read_is_not_replaced(folder, kind, read):
    words, option, ending = OUTPUTS[kind]
    words = [{"SCENE": "scene.yaml", "MEMBERS": "members.csv"}.get(word, word) for word in words]
    output = f"out{ending}"
    (folder / output).parent.mkdir(exist_ok=True)
    if read == "recording":
        # A recording has to lie within the folder, so that its link is hard.
        os.link(folder / READ[read], folder / output)
    else:
        (folder / output).symlink_to(folder / READ[read])
    before = {name: (folder / name).read_bytes() for name in READ.values()}
    done = lagrange(*words, option, output.partition("/")[0], cwd=folder)
    assert done.returncode == 2, done.stdout
    assert "would replace" in done.stderr
    assert done.stdout == ""
    assert {name: (folder / name).read_bytes() for name in READ.values()} == before


def test_a_scene_on_standard_input_that_is_a_file(folder):
    command = f"{sys.executable} -m lagrange_cli derive - -o scene.yaml < scene.yaml"
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 2
    assert "would replace the scene, on standard input" in done.stderr
    assert (folder / "scene.yaml").read_text() == SCENE


def test_samples_of_a_checkpoint_are_an_output_too(folder):
    os.link(folder / "push.csv", folder / "c.samples1")
    done = lagrange("simulate", "scene.yaml", "--checkpoint", "c", cwd=folder)
    assert done.returncode == 2
    assert "--checkpoint (c.samples1) 'c.samples1' would replace a recorded input" in done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("check", "scene.yaml", "-o", "a", "--junit", "./a"),
        ("simulate", "scene.yaml", "-o", "a.csv", "--checkpoint", "a.csv"),
        ("simulate", "scene.yaml", "--plot", "a.tex", "--checkpoint", "a.tex"),
    ],
)
def test_two_outputs_in_one_file(folder, words):
    done = lagrange(*words, cwd=folder)
    assert done.returncode == 2
    assert "name one file" in done.stderr
    assert sorted(os.listdir(folder)) == sorted(READ.values())


def test_a_scene_in_the_folder_of_outputs_that_has_another_name(folder):
    """A scene may be called as code is, where no code of that name is written."""
    (folder / "scene.yaml").rename(folder / "other.py")
    assert lagrange("emit", "other.py", "--to", "python", "-o", ".", cwd=folder).returncode == 0
    assert (folder / "swing.py").exists()
    assert (folder / "other.py").read_text() == SCENE


def test_a_name_in_escapes_is_still_a_recording(folder):
    (folder / "scene.yaml").write_text(SCENE.replace("file:", r'"\x66ile":'))
    done = lagrange("derive", "scene.yaml", "-o", "push.csv", cwd=folder)
    assert done.returncode == 2
    assert "would replace a recorded input" in done.stderr


def test_answers_of_before_are_guarded_as_well(folder, monkeypatch, tmp_path):
    monkeypatch.setenv("LAGRANGE_CACHE", "on")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert lagrange("derive", "scene.yaml", "-o", "a", cwd=folder).returncode == 0
    assert lagrange("derive", "scene.yaml", "-o", "push.csv", cwd=folder).returncode == 2
    assert (folder / "push.csv").read_text() == "t,u\n0,0\n1,1\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "lock"),
    [
        (("-o", "a.npz", "--vary", "l=[1,2]", "-j", "1"), "a.npz"),
        (("--checkpoint", "c", "--method", "RK4", "--step", "0.1"), "c"),
    ],
)
def test_an_output_that_another_process_makes(folder, words, lock):
    program = (
        "import sys, time; from lagrange_cli.files import sole_writer\n"
        "with sole_writer(sys.argv[1]): print(flush=True); time.sleep(60)"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, str(folder / lock)], stdout=subprocess.PIPE
    ) as holder:
        assert holder.stdout is not None
        holder.stdout.readline()
        done = lagrange("simulate", "scene.yaml", *words, cwd=folder)
        assert done.returncode == 2
        assert f"process {holder.pid} is making '{lock}'" in done.stderr
        assert done.stdout == ""
        holder.kill()
    assert lagrange("simulate", "scene.yaml", *words, cwd=folder).returncode == 0
    assert not (folder / f"{lock}.lock").exists()


@pytest.mark.slow
def test_a_checkpoint_stays_where_the_result_cannot_be_written(folder, monkeypatch):
    """The work of days must not go with a disk that is full at its end."""
    from lagrange_cli.simulate.checkpoint import checkpoint

    monkeypatch.setattr(checkpoint, "INTERVAL", 0.0)
    run = ("simulate", "scene.yaml", "--method", "RK4", "--step", "0.001", "--samples", "11")
    (folder / "full.csv").symlink_to("/dev/full")
    done = lagrange(*run, "-o", "full.csv", "--checkpoint", "c", cwd=folder)
    assert done.returncode == 2
    assert "No space left" in done.stderr
    assert (folder / "c").exists()
    assert lagrange(*run, "-o", "a.csv", "--resume", "c", cwd=folder).returncode == 0
    assert lagrange(*run, "-o", "b.csv", cwd=folder).returncode == 0
    assert (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()
    assert not (folder / "c").exists()


@pytest.mark.slow
def test_a_folder_of_parts_without_any_is_no_obstacle(folder):
    """A run can be killed just after it has made the folder of its blocks."""
    (folder / "a.npz.parts").mkdir()
    (folder / "a.npz.parts" / f".lagrange-1-{0:032x}.tmp").write_bytes(b"half")
    words = ("simulate", "scene.yaml", "--vary", "l=[1,2]", "-j", "1", "-o", "a.npz")
    assert lagrange(*words, cwd=folder).returncode == 0
    assert sorted(os.listdir(folder)) == sorted([*READ.values(), "a.npz"])
