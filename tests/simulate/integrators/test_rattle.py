"""RATTLE: its order, what it preserves, its twin in Python, and what it refuses."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from lagrange_cli.api import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.base import UnfitError
from lagrange_cli.simulate.integrators.right_hand_side import FunctionRhs
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.system.functions import interpreted, right_hand_side

L, G = 2.0, 9.81

ROD = """
name: rod
parameters: {m: 1.3, l: 2, g: 9.81}
particles: {bob: {mass: m, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: m*g*z}
initial: {x: 0, z: -l, dot(x): 9.5}
simulate: {until: 4, samples: 41}
"""

RODS = """
name: rods
parameters: {g: 9.81}
particles:
  a: {mass: 1, position: [x1, 0, z1]}
  b: {mass: 1, position: [x2, 0, z2]}
constraints:
  upper: x1^2 + z1^2 = 1
  lower: (x2 - x1)^2 + (z2 - z1)^2 = 1
potentials: {weight: g*(z1 + z2)}
initial: {x1: 1, z1: 0, x2: 1, z2: -1}
simulate: {until: 10}
"""


@cache
def model(text):
    return model_of(loads(text).derive().equations)


def refusal(text, **how):
    with pytest.raises(InputError) as refused:
        simulate(model(text), method="RATTLE", step=0.01, **how)
    return refused.value.problems[0].message


def at(angle, rate):
    """A state of the rod."""
    s, c = math.sin(angle), math.cos(angle)
    return np.array([L * s, -L * c, L * c * rate, L * s * rate])


def flow(y0, steps=50, h=0.02):
    """The state after some steps."""
    rhs = right_hand_side(model(ROD)).rhs
    how = Control(np.zeros(4), np.ones(4), 1.0, 1.0, h)
    run = start_integrator(INTEGRATORS["RATTLE"], rhs, 0.0, y0, h * steps, how)
    for _ in range(steps):
        run.step(h * steps)
    return run.y


@pytest.mark.slow
def test_the_order():
    fine = simulate(model(ROD), method="DOP853", rtol=1e-13)
    errors = []
    for step in (0.01, 0.005):
        found = simulate(model(ROD), method="RATTLE", step=step, samples=41)
        errors.append(np.abs(found.columns["x"] - fine.columns["x"]).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(INTEGRATORS["RATTLE"].order, abs=0.1)


@pytest.mark.slow
def test_constraints_hold_to_rounding():
    found = simulate(model(RODS), method="RATTLE", step=0.002)
    assert found.constraint_drift < 1e-15
    assert found.steps == found.rhs_evaluations - 1


def test_the_map_is_symplectic_on_the_circle():
    """In angle and rate its Jacobian has determinant 1."""
    d = 1e-5
    columns = []
    for a, b in ((1, 0), (0, 1)):
        ends = [flow(at(1.0 + s * d * a, 2.0 + s * d * b)) for s in (1, -1)]
        rates = [(y[2] * -y[1] + y[3] * y[0]) / L**2 for y in ends]
        angles = [math.atan2(y[0], -y[1]) for y in ends]
        columns.append(np.array([angles[0] - angles[1], rates[0] - rates[1]]) / (2 * d))
    assert abs(np.linalg.det(np.array(columns)) - 1) < 1e-8


def test_it_runs_back_to_where_it_began():
    start_state = at(1.0, 2.0)
    there = flow(start_state)
    back = flow(np.concatenate([there[:2], -there[2:]]))
    assert np.abs(back - np.concatenate([start_state[:2], -start_state[2:]])).max() < 1e-12


@pytest.mark.slow
def test_energy_stays_bounded_where_it_grows_with_runge_kutta():
    """The double pendulum in Cartesian coordinates, two hundred thousand steps of RATTLE."""
    of, grown = model(RODS), {}
    for name, step in (("RATTLE", 0.002), ("RK4", 0.01)):
        found = simulate(of, method=name, step=step, until=400.0, samples=801)
        off = np.abs(found.energy - found.energy[0])
        grown[name] = off[-160:].max() / off[:160].max()
    assert grown["RATTLE"] < 2.0
    assert grown["RK4"] > 3.0


@pytest.mark.slow
@pytest.mark.parametrize("text", [ROD, RODS])
def test_the_twin_in_python_makes_the_same_steps(text):
    ways = right_hand_side(model(text)), interpreted(model(text), "asked for")
    mine, theirs = (
        simulate(model(text), method="RATTLE", step=0.01, until=2.0, functions=f) for f in ways
    )
    for column in mine.scales:
        assert np.abs(mine.columns[column] - theirs.columns[column]).max() < 1e-11


def test_it_goes_on_from_a_state_bit_by_bit():
    rhs, y0 = right_hand_side(model(ROD)).rhs, at(1.0, 2.0)
    how = Control(np.zeros(4), np.ones(4), 1.0, 1.0, 0.02)
    whole, other = (
        start_integrator(INTEGRATORS["RATTLE"], rhs, 0.0, y0, 9.0, how) for _ in range(2)
    )
    for _ in range(5):
        whole.step(9.0)
    other.restore(whole.state())
    for run in (whole, other):
        run.step(9.0)
    assert (whole.t, *whole.y) == (other.t, *other.y)


@pytest.mark.slow
def test_without_constraints_it_is_verlet():
    text = """
name: free
coordinates: [x]
kinetic: {inertia: dot(x)^2/2}
potentials: {spring: 2*x^2 + x^4}
initial: {x: 1, dot(x): 0}
"""
    ours, other = (
        simulate(model(text), method=m, step=0.01, until=5.0) for m in ("RATTLE", "Verlet")
    )
    assert np.abs(ours.columns["x"] - other.columns["x"]).max() < 1e-13


@pytest.mark.parametrize(
    "more",
    [
        "dissipation: {oil: dot(x)^2}\n",
        "forces: {wind: {on: x, force: dot(z)}}\n",
        "potentials: {weight: m*g*z, current: m*x*dot(z)}\n",
    ],
)
def test_forces_of_velocities_are_refused(more):
    text = ROD.replace("potentials: {weight: m*g*z}\n", "") if "potentials" in more else ROD
    assert "constraints of positions that do not move" in refusal(
        text.replace("initial", f"{more}initial")
    )


def test_moving_constraints_and_contacts_are_refused():
    moving = ROD.replace("x^2 + z^2", "(x - sin(t)/9)^2 + z^2")
    assert "constraints of positions that do not move" in refusal(moving)
    assert "constraints of positions that do not move" in refusal(ROD.replace("= l^2", "<= l^2"))


def test_constraints_that_are_only_projected_on_are_not_for_it():
    rhs = FunctionRhs(lambda t, y: y, lambda t, y: y)
    how = Control(np.zeros(2), np.ones(2), 1.0, 1.0, 0.1)
    with pytest.raises(UnfitError, match="constraints"):
        start_integrator(INTEGRATORS["RATTLE"], rhs, 0.0, np.zeros(2), 1.0, how)
