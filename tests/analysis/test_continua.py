"""Continua of equilibria: one of each is listed, and several are told apart by their potential."""

from __future__ import annotations

import math

import mpmath
import pytest
from mpmath import mpf

from lagrange_cli.analysis.equilibria.existence import EquilibriumProver
from lagrange_cli.analysis.equilibria.rest_system import rest_system
from lagrange_cli.analysis.values import DIGITS
from lagrange_cli.api import loads
from tests.mechanics.dynamics.test_euler_form import TOP

#: A bead on a sphere that turns about z, in a potential with rings at two heights and the equator.
RINGS = """
name: bead_on_sphere
parameters: {m: 1.0, g: 9.81}
particles: {bead: {mass: m, position: [x, y, z]}}
coordinates: [x, y, z]
constraints: {sphere: x^2 + y^2 + z^2 = 1}
potentials: {V: m*g*(z^2 - 1/4)^2}
initial: {x: 0.8, y: 0, z: 0.6}
"""


@pytest.mark.slow
def test_a_top_by_a_quaternion_stands_and_hangs() -> None:
    """Every turn about the vertical, or about its axis, is the same equilibrium; −q is q."""
    points = loads(TOP).derive().analyze("equilibria").equilibria.points
    heights = []
    for point in points:
        a, b, c, d = map(float, point.position)
        heights.append(round(a**2 - b**2 - c**2 + d**2))
        assert not point.isolated
    assert sorted(heights) == [-1, 1]


@pytest.mark.parametrize("position", ["1 0 0 0", "0.6 0 0 0.8", "0 0 1 0"])
def test_turns_that_coincide_at_an_equilibrium_show_a_continuum(position: str) -> None:
    """About z and about the axis of the top, which is vertical."""
    system = rest_system(loads(TOP).derive().equations, {})
    with mpmath.workdps(DIGITS):
        quaternion = [mpf(part) for part in position.split()]
        weight = mpf("0.2") * mpf("9.81") * mpf("0.05") * (1 - 2 * quaternion[2])
    point = EquilibriumProver(system).established([*quaternion, weight])
    assert point is not None
    assert not point.isolated


@pytest.mark.slow
def test_continua_at_several_heights_are_several() -> None:
    """Of the bead on a sphere: both poles, the equator, and a circle of latitude at |z| = ½."""
    points = loads(RINGS).derive().analyze("equilibria").equilibria.points
    circles = sorted(round(float(p.position[2]), 6) for p in points if not p.isolated)
    poles = sorted(round(float(p.position[2]), 6) for p in points if p.isolated)
    assert poles == [-1, 1]
    assert 0 in circles
    assert any(math.isclose(abs(z), 0.5) for z in circles)
