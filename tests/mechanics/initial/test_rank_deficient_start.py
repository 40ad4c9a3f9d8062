"""A start at which constraints restrict less than elsewhere is named."""

from __future__ import annotations

import pytest

from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text

PARALLELOGRAM = """
name: parallelogram
parameters: {m: 1, a: 1, b: 2, g: 9.81}
plane: xz
particles:
  first: {mass: m, position: [x1, y1, z1]}
  second: {mass: m, position: [x2, y2, z2]}
points: {O: [0, 0, 0], P: [b, 0, 0]}
constraints:
  crank: {distance: [O, first], equals: a}
  coupler: {distance: [first, second], equals: b}
  rocker: {distance: [P, second], equals: a}
potentials: {weight: {gravity: g}}
initial: START
"""


def warnings(start, scene=PARALLELOGRAM):
    found = derive(read_text(scene.replace("START", start))).derivation.warnings
    return [w for w in found if w.rule == "singular"]


def test_folded_parallelogram():
    (warning,) = warnings("{x1: 1, z1: 0, x2: 3, z2: 0}")
    assert warning.severity == "warning"
    assert "'crank', 'coupler', 'rocker' are singular at the initial configuration" in (
        warning.message
    )
    assert warning.mark.line == 10


@pytest.mark.parametrize(
    "start", ["{x1: 0.6, z1: 0.8, x2: 2.6, z2: 0.8}", "{x1: 0, z1: -1, x2: 2, z2: -1}"]
)
def test_open_parallelogram(start):
    assert warnings(start) == []


def test_tip_of_a_cusp():
    cusp = """
name: cusp
plane: xz
particles: {bead: {mass: 1, position: [x, y, z]}}
constraints: {wire: x^5 + x^3 = z^2 + z^4}
initial: START
"""
    (warning,) = warnings("{x: 0, z: 0}", cusp)
    assert "'wire' is singular at the initial configuration: its gradient vanishes" in (
        warning.message
    )
    assert warnings("{x: 1, z: 1}", cusp) == []
