"""What is imported when: help and errors must not wait for the mathematics."""

from __future__ import annotations

import subprocess
import sys

import pytest

import lagrange_cli
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import COMMANDS
from tests.systems.shipped import SCENES

HEAVY = {"sympy", "numpy", "scipy", "yaml", "mpmath", "matplotlib"}


def modules_after(program: str) -> set[str]:
    """Names of the top-level modules that a fresh interpreter holds after a program."""
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{program}\nprint(*sys.modules, file=sys.stderr)"],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return {name.partition(".")[0] for name in done.stderr.split()}


def after_command(*words: str) -> set[str]:
    return modules_after(f"from lagrange_cli.cli.main import run\nassert run({list(words)}) == 0")


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("--help",),
        ("--version",),
        ("derive", "--help"),
        ("emit", "--help"),
        ("emit", "--list"),
        ("check", "--help"),
        ("cache", "--help"),
        ("cache",),
        ("cache", "--clear"),
    ],
)
def test_help_imports_click_alone(words):
    loaded = after_command(*words)
    assert "click" in loaded
    assert loaded & HEAVY == set()


@pytest.mark.parametrize(("word", "imported"), [("cache", {"cache"}), ("--help", set())])
def test_a_command_imports_no_other_command(word, imported):
    program = (
        f"from lagrange_cli.cli.main import run\nassert run([{word!r}]) == 0\n"
        "print(*(n for n in sys.modules if n.startswith('lagrange_cli.cli.')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{program}"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    loaded = {name.rpartition(".")[2] for name in done.stdout.splitlines()[-1].split()}
    assert loaded & set(COMMANDS) == imported


@pytest.mark.slow
@pytest.mark.parametrize("words", [("derive", "--steps"), ("emit", "--to", "c")])
def test_derivations_need_no_numerical_methods(words, tmp_path, monkeypatch):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")
    command, *rest = words
    output = ("-o", str(tmp_path / "out.txt" if command == "derive" else tmp_path))
    loaded = after_command(command, str(SCENES["pendulum"]), *rest, *output)
    assert "sympy" in loaded
    assert "scipy" not in loaded


def test_python_package_imports_nothing_heavy():
    assert modules_after("import lagrange_cli") & (HEAVY | {"click"}) == set()


def test_english_phrases_are_read_from_no_catalogue():
    program = "from lagrange_cli.report.phrases.language import language; language({!r})"
    assert modules_after(program.format("en")) & HEAVY == set()
    assert modules_after(program.format("de")) & HEAVY == {"yaml"}


def test_python_package_offers_its_interface_when_it_is_used():
    program = "import lagrange_cli\nassert lagrange_cli.load and set(lagrange_cli.__all__) <= set("
    assert "lagrange_cli" in modules_after(program + "dir(lagrange_cli))")
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = lagrange_cli.nothing
    assert {name: getattr(lagrange_cli, name) for name in lagrange_cli.__all__}


def test_registry_of_formats_imports_no_format():
    assert modules_after("import lagrange_cli.api.emitters") & HEAVY == set()
    assert len(EMITTERS) >= 3


def test_reading_a_scene_needs_no_mathematics():
    assert modules_after("import lagrange_cli.scene") & (HEAVY - {"yaml"}) == set()
