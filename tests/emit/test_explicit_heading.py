"""What the explicit form says of itself is true of the rows below it."""

from __future__ import annotations

import pytest

from lagrange_cli import loads
from lagrange_cli.emit.text import derivation_text
from lagrange_cli.mechanics.dynamics.accelerations import explicit_accelerations

BOB = "particles: {bob: {mass: 2, position: [x, y, z]}}\n"
CHAIN = """
sizes: {n: %d}
plane: xz
points: {"p[0]": [0, 0, 0]}
particles: {"p[i=1..n]": {mass: 1, position: ["x[i]", "y[i]", "z[i]"]}}
coordinates: ["th[i=1..n]"%s]
definitions:
  x[0]: 0
  z[0]: 0
  x[i=1..n]: x[i-1] + sin(th[i])
  z[i=1..n]: z[i-1] - cos(th[i])
%s
"""
#: Scene → the heading in text, and the line above the rows in LaTeX.
SCENES = {
    "solved": (
        BOB + "coordinates: [x, y]\ndefinitions: {z: x^2}\n",
        "Accelerations",
        "Solved for the accelerations:",
    ),
    "multipliers": (
        BOB + "plane: xz\nconstraints: {rod: x^2 + z^2 = 1}\n",
        "Accelerations (the closure equations, differentiated, determine their multipliers)",
        "Solved for the accelerations; the closure equations, differentiated, determine their"
        " multipliers:",
    ),
    "contacts": (
        BOB + "constraints: {floor: z >= 0}\n",
        "Accelerations (contacts determine the multipliers)",
        "Solved for the accelerations; contacts determine the multipliers:",
    ),
    "coupled": (
        CHAIN % (3, "", ""),
        "Accelerations",
        "Not solved for the accelerations, in the form $M a = f$:",
    ),
    "partly": (
        CHAIN % (3, ", u", "kinetic: {u: dot(u)^2}"),
        "Accelerations",
        "Solved for the accelerations where at most two are coupled, the others as $M a = f$:",
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_what_is_solved_is_said(name: str) -> None:
    scene, heading, line = SCENES[name]
    system = loads("name: s\n" + scene).derive()
    text = derivation_text(system.equations, form="explicit")
    assert f"\n{heading}\n" in text
    (document,) = system.emit("latex", form="explicit").values()
    assert f"\n{line}\n" in document
    solved = explicit_accelerations(system.equations)
    assert ("M a = f" in line) == (None in solved)
    unknown = {c.multiplier for c in system.equations.pushing}
    held = {s for value in solved if value is not None for s in value.free_symbols}
    assert ("multipliers" in line) == bool(held & unknown)
