"""On machines that lack something every command still works, and says what it did."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.cli.terminal import ROOT, lagrange

pytestmark = pytest.mark.slow

DOUBLE = "systems/pendulums/double_pendulum.yaml"
#: What stands behind the states; heyoka makes the steps where it is installed.
INTERPRETED = r"^Code +(series compiled by heyoka, and )?interpreted Python"

COMMANDS = [
    ("derive", DOUBLE),
    ("emit", DOUBLE, "--to", "python"),
    ("simulate", DOUBLE, "--until", "1"),
    ("simulate", DOUBLE, "--until", "1", "--json"),
    ("check", DOUBLE),
    ("cache",),
]


@pytest.fixture
def bare(monkeypatch, tmp_path, without_packaged_compiler):
    """No compiler on the path, no home, and no other place for a cache."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setenv("HOME", str(tmp_path / "file"))
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.delenv("CC", raising=False)


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_without_compiler_and_home_every_command_works(bare, words):
    for _ in range(2):
        done = lagrange(*words)
        assert done.returncode == 0, done.stderr
        assert done.stdout
        assert "Traceback" not in done.stderr


def test_simulate_says_that_it_interprets_and_keeps_nothing(bare):
    done = lagrange("simulate", "-v", DOUBLE, "--until", "1")
    assert re.search(rf"{INTERPRETED}: no C compiler was found$", done.stdout, re.MULTILINE)
    assert "nothing is kept in the cache" in done.stderr


def test_both_ways_give_the_same_motion(monkeypatch, tmp_path, without_packaged_compiler):
    if shutil.which("cc") is None and shutil.which("gcc") is None:
        assert os.environ.get("CI") != "true"
        pytest.skip("no C compiler was found")
    words = ("simulate", DOUBLE, "--until", "1", "--accuracy", "1e-9")
    compiled = lagrange(*words)
    assert "Code      compiled C" in compiled.stdout
    monkeypatch.setenv("PATH", str(tmp_path))
    interpreted = lagrange(*words)
    assert re.search(INTERPRETED, interpreted.stdout, re.MULTILINE)
    for ours, theirs in zip(
        compiled.stdout.splitlines()[3:5], interpreted.stdout.splitlines()[3:5], strict=True
    ):
        assert ours.split()[0] == theirs.split()[0]
        assert [float(x) for x in ours.split()[1:]] == pytest.approx(
            [float(x) for x in theirs.split()[1:]], abs=2e-8
        )


def modules(*words: str) -> set[str]:
    """What a command imports in a fresh interpreter."""
    program = (
        "import sys\nbefore = set(sys.modules)\nfrom lagrange_cli.cli.main import run\n"
        f"assert run({list(words)}) == 0\nprint(*set(sys.modules) - before, file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split())


@pytest.mark.usefixtures("cache_folder")
def test_a_repeated_simulation_imports_numpy_and_no_other_mathematics():
    if shutil.which("cc") is None and shutil.which("gcc") is None:
        assert os.environ.get("CI") != "true"
        pytest.skip("no C compiler was found")
    assert "sympy" in modules("simulate", DOUBLE)
    heavy = {"sympy", "mpmath", "scipy", "scipy.integrate", "yaml", "matplotlib", "subprocess"}
    few_runs_need = {"numpy.polynomial", "pathlib", "shutil", "tempfile", "click._termui_impl"}
    for options in ((), ("--until", "3"), ("--json",), ("--accuracy", "1e-10")):
        warm = modules("simulate", DOUBLE, *options)
        assert "numpy" in warm
        assert warm & (heavy | few_runs_need) == set(), options
