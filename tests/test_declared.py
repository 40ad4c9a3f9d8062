"""pyproject.toml has a lower bound for what it asks for, as .ci/run reads, and packs every file."""

from __future__ import annotations

import importlib.util
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = DECLARED["project"]


@pytest.fixture(scope="module")
def declared():
    """The script of .ci/run as a module."""
    spec = importlib.util.spec_from_file_location("declared", ROOT / ".ci" / "declared.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_lowest_versions_are_those_of_the_bounds(declared):
    pins = dict(pin.split("==") for pin in declared.lowest(PROJECT))
    assert len(pins) == len(PROJECT["dependencies"]) + len(declared.EXTRAS)
    for text in PROJECT["dependencies"]:
        name, _, bound = text.partition(">=")
        assert pins[name] == bound


def test_a_requirement_without_a_bound_is_refused(declared):
    project = {"dependencies": ["numpy"], "optional-dependencies": {e: [] for e in declared.EXTRAS}}
    with pytest.raises(ValueError, match="no lower bound: numpy"):
        declared.lowest(project)


def test_what_is_installed_here_is_allowed(declared):
    for pin in declared.lowest(PROJECT):
        name, _, bound = pin.partition("==")
        here = [int(part) for part in version(name).split(".")[:2]]
        assert here >= [int(part) for part in bound.split(".")[:2]]


def test_classifiers_begin_with_the_python_that_is_required(declared):
    lowest, _ = declared.pythons(PROJECT)
    assert PROJECT["requires-python"] == f">={lowest}"


def test_versions_are_compared_as_numbers(declared):
    classifiers = [f"Programming Language :: Python :: 3.{k}" for k in (9, 10, 11)]
    assert declared.pythons({"classifiers": classifiers}) == ("3.9", "3.11")


def test_an_interpreter_that_is_not_there_is_said(declared, capsys):
    assert declared.main(["interpreter", "3.99"]) == 1
    assert "no Python 3.99" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["lowest"], ["pythons"]])
def test_words_for_the_shell(declared, capsys, words):
    assert declared.main(words) == 0
    assert len(capsys.readouterr().out.split()) >= 2


def test_ci_reads_versions_from_there():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert ".ci/declared.py pythons" in script
    assert ".ci/declared.py lowest" in script
    assert "LEFT OUT" in script


def test_packages_hold_every_file_that_is_no_module():
    package = ROOT / "lagrange_cli"
    patterns = DECLARED["tool"]["setuptools"]["package-data"]["lagrange_cli"]
    packed = {path for pattern in patterns for path in package.glob(pattern)}
    files = {p for p in package.rglob("*") if p.is_file() and p.parent.name != "__pycache__"}
    assert {path for path in files if path.suffix != ".py"} == packed
    assert {"de.yaml", "fr.yaml", "sign.c.in"} <= {path.name for path in packed}
