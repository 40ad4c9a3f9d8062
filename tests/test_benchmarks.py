"""The benchmarks run, and what they time is right."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def test_derivation_compares_every_method_with_the_closed_form(tmp_path: Path) -> None:
    output = tmp_path / "derivation.json"
    sizes = ["--sizes", "2", "3", "--largest-sympy", "2", "--repetitions", "1"]
    command = [sys.executable, str(BENCHMARKS / "derivation.py"), *sizes, "--json", str(output)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    rows = json.loads(output.read_text())["rows"]
    taking_part = {(row["n"], row["method"]) for row in rows}
    assert {(2, "SymPy LagrangesMethod"), (3, "lagrange, certified")} <= taking_part
    assert (3, "SymPy LagrangesMethod") not in taking_part
    assert all(row["mismatch"] < 1e-12 for row in rows)
    assert run.stdout.count("\n| 2 |") == 1


def test_startup_compares_whole_commands_cold_and_warm(tmp_path: Path) -> None:
    output = tmp_path / "startup.json"
    words = ["--repetitions", "1", "--json", str(output), "--mechanicsdsl", ""]
    command = [sys.executable, str(BENCHMARKS / "startup.py"), *words]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    rows = json.loads(output.read_text())["rows"]
    taking_part = {(row["program"], row["cache"]) for row in rows}
    commands = ("derive", "emit --to c", "simulate")
    assert {(f"lagrange {c}", cache) for c in commands for cache in ("cold", "warm")} < taking_part
    assert all(row["same_output"] for row in rows)
    (reference,) = [row for row in rows if row["program"] == "import numpy"]
    assert reference["ratio"] == 1
    assert run.stdout.count("\n| `") == len(rows)


def test_right_hand_sides_agree_with_the_closed_form(tmp_path: Path) -> None:
    if shutil.which("cc") is None:
        message = "no C compiler is installed"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip(message)
    output = tmp_path / "right_hand_side.json"
    command = [sys.executable, str(BENCHMARKS / "right_hand_side.py"), "--quick"]
    run = subprocess.run(
        [*command, "--json", str(output)], capture_output=True, text=True, timeout=300, check=False
    )
    assert run.returncode == 0, run.stderr
    found = json.loads(output.read_text())
    taking_part = {(row["n"], row["method"]) for row in found["rows"]}
    assert {(2, "lagrange, C"), (2, "written by hand, C"), (4, "lagrange, C")} <= taking_part
    assert (4, "NumPy, lambdify and solve") in taking_part
    assert all(row["mismatch"] < 1e-12 for row in found["rows"])
    assert "-O2" in found["about"]["options"]
