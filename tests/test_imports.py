"""What is imported when: help and errors must not wait for the mathematics."""

from __future__ import annotations

import subprocess
import sys

import pytest

from lagrange_cli.emit.registry import EMITTERS

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


@pytest.mark.parametrize(
    "words",
    [
        ("--help",),
        ("--version",),
        ("derive", "--help"),
        ("emit", "--help"),
        ("emit", "--list"),
        ("check", "--help"),
    ],
)
def test_help_imports_click_alone(words):
    loaded = after_command(*words)
    assert "click" in loaded
    assert loaded & HEAVY == set()


def test_python_package_imports_nothing_heavy():
    assert modules_after("import lagrange_cli") & (HEAVY | {"click"}) == set()


def test_registry_of_formats_imports_no_format():
    assert modules_after("import lagrange_cli.emit.registry") & HEAVY == set()
    assert len(EMITTERS) >= 3


def test_reading_a_scene_needs_no_mathematics():
    assert modules_after("import lagrange_cli.scene") & (HEAVY - {"yaml"}) == set()
