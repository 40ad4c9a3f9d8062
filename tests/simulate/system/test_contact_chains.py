"""Chains of many contacts: ropes that stay taut are rods, and what lands at once lands at once."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.results.trajectory import Trajectory

pytestmark = pytest.mark.slow

#: A chain that hangs, drawn aside by an angle that keeps every link taut.
HANGING = """
name: hanging
sizes: {n: 24}
parameters: {m: 1.0, l: 0.1, g: 9.81, a: 0.2}
plane: xz
particles:
  p[i=1..n]: {mass: m, position: ["x[i]", "y[i]", "z[i]"]}
definitions: {"x[0]": 0, "z[0]": 0}
constraints:
  link[i=1..n]: LINK
potentials: {weight: {gravity: g}}
initial:
  x[i=1..n]: l*i*sin(a)
  z[i=1..n]: -l*i*cos(a)
simulate: {until: 0.6, accuracy: 1e-8, samples: 7}
"""

LENGTH = "(x[i] - x[i-1])^2 + (z[i] - z[i-1])^2"

#: A chain that falls flat on a floor, with a contact for each of its masses.
LANDING = """
name: landing
sizes: {n: 20}
parameters: {m: 1.0, l: 0.1, g: 9.81, h: 0.5}
plane: xz
particles:
  p[i=1..n]: {mass: m, position: ["x[i]", "y[i]", "z[i]"]}
constraints:
  rod[i=2..n]: {distance: ["p[i-1]", "p[i]"], equals: l}
  floor[i=1..n]: {unilateral: "z[i] >= 0"}
potentials: {weight: {gravity: g}}
initial:
  x[i=1..n]: l*i
  z[i=1..n]: h
simulate: {until: 0.5, accuracy: 1e-6, samples: 11}
"""


def run(text: str) -> Trajectory:
    return simulate(loads(text).derive().equations)


def test_ropes_that_stay_taut_are_rods():
    ropes = run(HANGING.replace("LINK", f'{{unilateral: "{LENGTH} <= l^2"}}'))
    rods = run(HANGING.replace("LINK", f"{LENGTH} = l^2"))
    assert ropes.status == rods.status == "ok"
    assert not ropes.events
    for name, expected in rods.columns.items():
        if name.startswith(("x", "z")):
            assert np.abs(ropes.columns[name] - expected).max() <= 2e-8 * 2.4
    # Gaps are l² minus the square: their multipliers are positive where those of rods are not.
    for k in (1, 12, 24):
        tension = ropes.multipliers[f"link[{k}]"]
        assert tension.min() > 0
        assert tension == pytest.approx(-rods.multipliers[f"link[{k}]"], rel=1e-5)
    assert ropes.constraint_drift is not None
    assert ropes.constraint_drift < 1e-13


@pytest.mark.parametrize("n", [20, 48])
def test_all_masses_land_at_once(n: int):
    """More events at one time than any two contacts have one upon the other."""
    found = run(LANDING.replace("n: 20", f"n: {n}"))
    assert found.status == "ok", found.reason
    assert {event.name for event in found.events} == {
        f"contact:floor[{k}]" for k in range(1, n + 1)
    }
    for event in found.events:
        assert event.t == pytest.approx(math.sqrt(2 * 0.5 / 9.81), abs=5e-7)
    for k in range(1, n + 1):
        assert found.state[f"z[{k}]"] == pytest.approx(0, abs=1e-12)
        assert found.state[f"x[{k}]"] == pytest.approx(0.1 * k, abs=1e-9)
        assert found.multipliers[f"floor[{k}]"][-1] == pytest.approx(9.81, rel=1e-9)
