"""The same scene gives the same equations in every process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[3]

PROGRAM = """
import sys
from dataclasses import fields
from pathlib import Path
import sympy
from lagrange_cli.errors import LagrangeError
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_file, read_text

def told(value):
    if isinstance(value, sympy.Basic):
        return sympy.srepr(value)
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(map(told, value)) + "]"
    if hasattr(value, "__dataclass_fields__"):
        parts = (f.name + "=" + told(getattr(value, f.name)) for f in fields(value))
        return "{" + ", ".join(parts) + "}"
    return told(value()) if callable(value) else repr(value)

for path in sys.argv[1:]:
    try:
        print(path, told(derive(read_file(path))))
    except LagrangeError as error:
        print(path, error)
"""

SCENES = [
    "lecture/masses_through_hole",
    "lecture/rigid_triangle",
    "pendulums/double_pendulum",
    "pendulums/swinging_spring",
    "pulleys/double_atwood",
    "beads/bead_on_rotating_hoop",
    "rigid/heavy_top",
    "fields/charged_particle",
    "refused/inconsistent_constraints",
    "refused/branch_not_chosen",
    "refused/too_many_coordinates",
]

WIDE = """
name: wide
parameters: {a: 1, b: 2, c: 3, d: {value: 4, positive: true}}
plane: xz
particles:
  p: {mass: a, position: [x, y, z]}
  q: {mass: b, position: [u, v, w]}
constraints: {one: x + u = c, two: a*z + b*w = d, three: b*z + 2*w*b^2/a = b*d/a}
potentials: {s: {spring: [p, q], stiffness: c, length: d}, k: sin(x*z)*exp(-x^2)*c}
"""


def run(seed: str, paths: list[str]) -> str:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *paths],
        env={**os.environ, "PYTHONHASHSEED": seed},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_hash_seeds_do_not_show(tmp_path: Path) -> None:
    wide = tmp_path / "wide.yaml"
    wide.write_text(WIDE)
    paths = [str(ROOT / "systems" / f"{name}.yaml") for name in SCENES] + [str(wide)]
    first = run("1", paths)
    assert first.count("\n") >= len(paths)
    assert run("2", paths) == first
