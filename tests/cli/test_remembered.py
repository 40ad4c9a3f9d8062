"""What was asked before is answered from the cache: the same, sooner, and never something else."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from lagrange_cli.api import remembered
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cache import Cache
from lagrange_cli.files import read_bytes
from tests.campaign import values_of
from tests.cli.terminal import ROOT, Done, lagrange, succeed

DOUBLE = "systems/pendulums/double_pendulum.yaml"
HOLE = "systems/lecture/masses_through_hole.yaml"
WARNED = "systems/lecture/rigid_tetrahedron_centre.yaml"

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("cache_folder")]

HEAVY = {"sympy", "mpmath", "numpy", "scipy", "yaml", "tempfile", "subprocess"}

#: A particle on a line in a potential that depends on the last word.
SCENE = """\
name: line
parameters: {{k: 2, m: 3}}
particles:
  p: {{mass: m, position: [x, 0, 0]}}
constraints: {{}}
coordinates: [x]
potentials: {{spring: {}}}
"""

COMMANDS = [
    ("derive", HOLE),
    ("derive", HOLE, "--json"),
    ("derive", HOLE, "--format", "latex", "--form", "explicit"),
    ("derive", HOLE, "--digits", "40", "-p", "m=2", "-p", "M=2*m"),
    ("derive", WARNED, "-v"),
    ("derive", WARNED, "-q"),
    ("emit", DOUBLE, "--to", "python"),
    ("emit", DOUBLE, "--to", "latex", "--style", "snippet"),
]


def untimed(done: Done) -> Done:
    """Without the lines of ``-v`` that tell how the answer was found."""
    told = [
        line
        for line in done.stderr.splitlines()
        if not line.startswith(("derived and", "from the cache", "nothing is kept in the cache"))
    ]
    return Done(done.returncode, done.stdout, "\n".join(told))


def answers(cache_folder: Path) -> list[Path]:
    """Entries that answer a command; those of derivations are no JSON."""
    entries = sorted(cache_folder.glob("*.json"))
    return [entry for entry in entries if entry.read_bytes().startswith(b"{")]


def kept(cache_folder: Path) -> int:
    return len(answers(cache_folder))


@pytest.mark.parametrize("words", COMMANDS)
def test_the_same_with_and_without_the_cache(words, monkeypatch, cache_folder):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")
    without = lagrange(*words)
    assert without.returncode == 0
    assert not cache_folder.exists()
    monkeypatch.delenv("LAGRANGE_CACHE")
    first, second = lagrange(*words), lagrange(*words)
    assert untimed(first) == untimed(second) == untimed(without)
    if "-v" in words:
        assert "from the cache" in second.stderr
        assert "from the cache" not in first.stderr
    else:
        assert first == second == without


@pytest.mark.parametrize("name", EMITTERS)
def test_files_are_the_same_and_are_announced_again(name, tmp_path):
    command = ("emit", HOLE, "--to", name, "-o")
    first, second = (lagrange(*command, str(tmp_path / folder)) for folder in "ab")
    assert first.stderr == second.stderr.replace(str(tmp_path / "b"), str(tmp_path / "a"))
    assert "wrote " in second.stderr
    names = sorted(os.listdir(tmp_path / "a"))
    assert names == sorted(os.listdir(tmp_path / "b"))
    for file in names:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def imported(words, **settings):
    """Names of the modules that a process has imported when it has run a command."""
    program = (
        "import sys\nfrom lagrange_cli.cli.main import run\n"
        f"assert run({words!r}) == 0\nprint(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env=os.environ | settings,
        input=(ROOT / DOUBLE).read_bytes(),
        capture_output=True,
        timeout=120,
        check=True,
    )
    return set(done.stderr.decode().split())


@pytest.mark.parametrize(
    "words",
    [
        ("derive", DOUBLE),
        ("derive", DOUBLE, "--json"),
        ("derive", "-"),
        *[("emit", DOUBLE, "--to", name, "-o", "OUT") for name in EMITTERS],
    ],
)
def test_again_without_mathematics(words, tmp_path):
    words = [str(tmp_path) if word == "OUT" else word for word in words]
    modules = imported(words, LAGRANGE_CACHE="off") if words == ["derive", DOUBLE] else {"sympy"}
    assert "sympy" in modules
    succeed(*words, input=(ROOT / DOUBLE).read_text())
    modules = imported(words)
    # A unit holds a library, which is compiled anew.
    compiling = {"subprocess", "tempfile"} if "fmu" in words else set()
    assert {name.partition(".")[0] for name in modules} & HEAVY <= compiling
    rooms = {".".join(name.split(".")[:2]) for name in modules if name.startswith("lagrange_cli.")}
    assert rooms.isdisjoint({f"lagrange_cli.{room}" for room in ("scene", "mechanics", "simulate")})


def test_standard_input_is_told_apart_by_its_content():
    texts = [SCENE.format(f"k*x^{n}") for n in (2, 4)]
    outputs = [succeed("derive", "-", input=text) for text in (*texts, *texts)]
    assert outputs[:2] == outputs[2:]
    assert outputs[0] != outputs[1]


class TestWhatCounts:
    """Each of these is another question."""

    @pytest.fixture
    def scene(self, tmp_path, monkeypatch) -> Path:
        monkeypatch.chdir(tmp_path)
        path = tmp_path / "scene.yaml"
        path.write_text(SCENE.format("k*x^2"))
        return path

    def ask(self, path: Path, *words: str, **more) -> Done:
        return lagrange("derive", path.name, "-v", *words, cwd=path.parent, **more)

    def test_the_scene(self, scene):
        first = self.ask(scene)
        before = scene.stat()
        scene.write_text(SCENE.format("k*x^4"))
        os.utime(scene, ns=(before.st_atime_ns, before.st_mtime_ns))
        second = self.ask(scene)
        assert "from the cache" not in second.stderr
        assert first.stdout != second.stdout
        scene.write_text(SCENE.format("k*x^2"))
        assert self.ask(scene).stdout == first.stdout

    def test_its_name_which_messages_show(self, scene):
        scene.write_text(SCENE.format("k*x^2").replace("m: 3", "m: 3, unused: 1"))
        other = scene.with_name("other.yaml")
        shutil.copy(scene, other)
        for path in (scene, other, scene, other):
            told = self.ask(path)
            assert f"{path.name}:2:26: warning: " in told.stderr
        assert "from the cache" in told.stderr

    @pytest.mark.parametrize(
        "words",
        [
            ("--json",),
            ("--format", "latex"),
            ("--form", "explicit"),
            ("--digits", "40"),
            ("--ascii",),
            ("-p", "k=5"),
            ("-p", "k=6"),
        ],
    )
    def test_options(self, words, scene):
        assert "from the cache" not in self.ask(scene).stderr
        assert "from the cache" not in self.ask(scene, *words).stderr
        again = self.ask(scene, *words)
        assert "from the cache" in again.stderr
        assert again.stdout == self.ask(scene, *words).stdout

    def test_what_the_terminal_can_show(self, scene):
        scene.write_text(scene.read_text().replace("x", "theta"))
        unicode, ascii = self.ask(scene), self.ask(scene, encoding="ascii")
        assert "θ" in unicode.stdout
        assert ascii.stdout.isascii()
        assert self.ask(scene).stdout == unicode.stdout
        assert self.ask(scene, encoding="ascii").stdout == ascii.stdout
        self.ask(scene, "-o", "out.txt", encoding="ascii")
        assert (scene.parent / "out.txt").read_text(encoding="utf-8") == unicode.stdout

    def test_options_of_a_format(self):
        whole = succeed("emit", HOLE, "--to", "latex")
        part = succeed("emit", HOLE, "--to", "latex", "--style", "snippet")
        assert whole != part
        assert succeed("emit", HOLE, "--to", "latex") == whole


class TestWarnings:
    def test_they_are_shown_again_at_their_places(self):
        first, second = lagrange("derive", WARNED), lagrange("derive", WARNED)
        assert first == second
        assert f"{WARNED}:28:12: warning: " in second.stderr
        assert "^^^^" in second.stderr

    def test_strict_refuses_what_was_kept(self):
        fresh = lagrange("derive", WARNED, "--strict")
        assert lagrange("derive", WARNED).returncode == 0
        again = lagrange("derive", WARNED, "--strict")
        assert (fresh.returncode, again.returncode, again.stdout) == (2, 2, "")
        assert fresh == again

    def test_strict_keeps_no_refusal(self, cache_folder):
        lagrange("derive", WARNED, "--strict")
        assert kept(cache_folder) == 0


@pytest.mark.parametrize(
    "words",
    [
        ("derive", "missing.yaml"),
        ("derive", DOUBLE, "-p", "nothing=1"),
        ("emit", DOUBLE, "--to", "python", "--style", "snippet"),
    ],
)
def test_refusals_are_not_kept(words, cache_folder):
    first, second = lagrange(*words), lagrange(*words)
    assert first.returncode == 2
    assert first == second
    assert not cache_folder.exists() or kept(cache_folder) == 0


def test_what_is_hashed_is_what_is_derived(tmp_path, monkeypatch):
    """A scene that changes while it is derived is answered, and kept, as it was read."""
    path = tmp_path / "scene.yaml"
    texts = [SCENE.format(f"k*x^{n}") for n in (2, 4)]
    path.write_text(texts[0])

    def read_and_change(name: str) -> bytes:
        data = read_bytes(name)
        path.write_text(texts[1])
        return data

    with monkeypatch.context() as patch:
        patch.setattr(remembered, "read_bytes", read_and_change)
        first = succeed("derive", str(path))
    second = succeed("derive", str(path))
    assert first != second
    path.write_text(texts[0])
    assert succeed("derive", str(path)) == first


def test_damaged_answers_are_worked_out_again(cache_folder):
    first = lagrange("derive", HOLE)
    (entry,) = answers(cache_folder)
    intact = entry.read_bytes()
    for damage in (b"", intact[:-10], intact.replace(b"DOF = 2", b"DOF = 3"), b"\0" * 99, b"[]"):
        entry.write_bytes(damage)
        assert lagrange("derive", HOLE) == first
        assert entry.read_bytes() == intact


UNUSABLE = {
    "off": {"LAGRANGE_CACHE": "off"},
    "misspelt": {"LAGRANGE_CACHE": "no\x1b"},
    "file": {"XDG_CACHE_HOME": str(Path(__file__).resolve())},
    "device": {"XDG_CACHE_HOME": "/dev/null"},
    "no home": {"XDG_CACHE_HOME": "relative", "HOME": "/nonexistent"},
    "empty home": {"XDG_CACHE_HOME": "", "HOME": ""},
}


@pytest.mark.parametrize(
    ("name", "words"),
    values_of(list(UNUSABLE), [("derive", HOLE), ("emit", HOLE, "--to", "python")]),
)
def test_without_a_usable_cache_all_is_well(name, words, monkeypatch):
    expected = succeed(*words)
    for variable, value in UNUSABLE[name].items():
        monkeypatch.setenv(variable, value)
    for _ in range(2):
        assert lagrange(*words) == Done(0, expected, "")
    told = lagrange(*words, "-v")
    assert told.stdout == expected
    assert told.stderr.count("nothing is kept in the cache: ") == 1
    assert "\x1b" not in told.stderr


def test_a_disk_that_is_full_is_told_once_and_harms_nothing(monkeypatch):
    def refuse(path, target):
        raise OSError(28, "No space left on device")

    expected = succeed("derive", HOLE)
    Cache(os.path.join(os.environ["XDG_CACHE_HOME"], "lagrange")).clear()
    monkeypatch.setattr(os, "replace", refuse)
    assert lagrange("derive", HOLE) == Done(0, expected, "")
    told = lagrange("derive", HOLE, "-v").stderr
    assert told.count("No space left on device") == 1


def test_an_intact_answer_to_another_question_is_not_believed(cache_folder):
    ask = ("derive", HOLE, "--json", "-p")
    other = succeed(*ask, "m=1")
    (answer,) = answers(cache_folder)
    expected = succeed(*ask, "m=3")
    assert other != expected
    (entry,) = set(answers(cache_folder)) - {answer}
    (cache_folder / (entry.name[:64] + answer.name[64:])).write_bytes(answer.read_bytes())
    entry.unlink()
    assert succeed(*ask, "m=3") == expected


class TestCompiledCode:
    """What ``simulate`` says where the answer can be kept and compiled code cannot."""

    WORDS = ("simulate", HOLE, "--until", "0.1", "--samples", "3")
    TOLD = "no compiled code is kept in the cache: "

    @pytest.fixture(autouse=True)
    def compiler(self):
        if shutil.which("cc") is None and shutil.which("gcc") is None:
            pytest.skip("no C compiler was found")

    def test_a_disk_without_room_for_it(self, monkeypatch, cache_folder):
        def refuse(path, target, replace=os.replace):
            if str(target).endswith(".so"):
                raise OSError(28, "No space left on device")
            replace(path, target)

        monkeypatch.setattr(os, "replace", refuse)
        for _ in range(2):
            told = lagrange(*self.WORDS, "-v")
            assert "Code      compiled C" in told.stdout
            assert told.stderr.count(self.TOLD) == 1
            assert f"'{cache_folder}' cannot be written: No space left on device" in told.stderr
            assert "nothing is kept" not in told.stderr
        assert "from the cache" in told.stderr
        assert lagrange(*self.WORDS).stderr == ""
        assert (kept(cache_folder), len(list(cache_folder.glob("*.so")))) == (1, 0)

    @pytest.mark.skipif(not hasattr(os, "ST_NOEXEC"), reason="this system does not tell")
    def test_a_disk_without_execution(self, monkeypatch, cache_folder):
        inert = os.statvfs_result([0] * 8 + [os.ST_NOEXEC, 255])
        monkeypatch.setattr(os, "statvfs", lambda path: inert)
        told = lagrange(*self.WORDS, "-v")
        assert "Code      compiled C" in told.stdout
        assert told.stderr.count(self.TOLD) == 1
        assert f"code in '{cache_folder}' cannot be run" in told.stderr
        assert (kept(cache_folder), len(list(cache_folder.glob("*.so")))) == (1, 0)

    def test_a_full_disk_is_told_once(self, monkeypatch):
        def refuse(path, target):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(os, "replace", refuse)
        told = lagrange(*self.WORDS, "-v").stderr
        assert told.count("No space left on device") == 1
        assert "nothing is kept in the cache: " in told

    def test_all_is_well(self, cache_folder):
        told = lagrange(*self.WORDS, "-v").stderr
        assert "kept in the cache" not in told
        assert len(list(cache_folder.glob("*.so"))) == 2


def test_two_processes_at_the_same_time():
    command = [sys.executable, "-m", "lagrange_cli", "derive", HOLE, "--json"]
    pair = [
        subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for _ in range(2)
    ]
    told = [process.communicate(timeout=120) for process in pair]
    assert told[0] == told[1]
    assert told[0][0] == succeed("derive", HOLE, "--json").encode()
    assert "from the cache" in lagrange("derive", HOLE, "--json", "-v").stderr
