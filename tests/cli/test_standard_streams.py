"""Results alone stand on stdout, and a stderr that cannot be written changes no exit code."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from lagrange_cli.cli.terminal.streams import ForgivingFile
from tests.cli.terminal import ROOT

pytestmark = pytest.mark.slow

SCENE = "systems/pendulums/pendulum.yaml"

#: Runs the command line where a package prints on both ways: Python's, and that of C.
NOISY = """
import os
import lagrange_cli.scene.reader as scene
def noisy(read):
    def reading(*a, **k):
        print("printed by Python")
        os.write(1, b"printed by C\\n")
        return read(*a, **k)
    return reading
scene.read_text, scene.read_file = noisy(scene.read_text), noisy(scene.read_file)
from lagrange_cli.cli.main import main
main()
"""

#: Commands and their exit codes.
COMMANDS = [
    ("derive SCENE", 0),
    ("emit SCENE --to c -o OUT", 0),
    ("simulate SCENE -v -o OUT/t.csv --method RK4 --step 1 --until 2", 0),
    ("check SCENE -p g=nothing", 1),
    ("derive nowhere.yaml", 2),
    ("derive", 2),
    ("cache", 0),
]


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")


def shell(command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=120
    )


@pytest.mark.parametrize("words", [("derive", SCENE, "--json"), ("check", SCENE, "--json")])
def test_what_packages_print_goes_to_stderr(words):
    done = subprocess.run(
        [sys.executable, "-c", NOISY, *words], cwd=ROOT, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert "printed" not in done.stdout
    assert json.loads(done.stdout)
    assert "printed by Python\n" in done.stderr
    assert "printed by C\n" in done.stderr


def test_help_and_formats_go_to_stdout():
    for words in ("--help", "derive --help", "emit --list", "--version"):
        done = shell(f"{sys.executable} -m lagrange_cli {words}")
        assert done.returncode == 0
        assert done.stdout
        assert done.stderr == ""


@pytest.mark.parametrize(
    ("words", "code", "stderr"),
    [
        *((words, code, "2>/dev/full") for words, code in COMMANDS),
        *((*COMMANDS[k], stderr) for k in (0, 4) for stderr in ("2>&-", "2> >(true)")),
    ],
)
def test_an_stderr_that_cannot_be_written_changes_no_exit_code(words, code, stderr, tmp_path):
    (tmp_path / "out").mkdir()
    words = words.replace("SCENE", SCENE).replace("OUT", str(tmp_path / "out"))
    done = shell(f"{sys.executable} -m lagrange_cli {words} {stderr}")
    assert done.returncode == code
    assert done.stderr == ""


def test_messages_never_end_in_a_file_that_was_opened_in_their_place(tmp_path):
    """A file that is opened while descriptors 0 to 2 are closed would have the number of stderr."""
    command = f"{sys.executable} -m lagrange_cli derive {SCENE} -v -o {tmp_path}"
    assert shell(f"{command}/with").returncode == 0
    assert shell(f"{command}/without <&- >&- 2>&-").returncode == 0
    assert (tmp_path / "with").read_text() == (tmp_path / "without").read_text()


def test_a_closed_stdout_is_refused_and_said():
    done = shell(f"{sys.executable} -m lagrange_cli derive {SCENE} >&-")
    assert done.returncode == 2
    assert done.stderr == "cannot write standard output: it is closed\n"


def test_what_is_not_written_counts_as_written():
    with ForgivingFile("/dev/full", "wb") as full:
        assert full.write(b"abc") == 3
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    with ForgivingFile(writing, "wb") as pipe:
        block = b"x" * 2**20
        assert 0 < pipe.write(block) < len(block)
        assert pipe.write(block) == len(block)
    os.close(reading)
