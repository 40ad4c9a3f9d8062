"""The disturbed program is off by rounding errors, all of them and nothing more."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted
from lagrange_cli.simulate.system.rounding import off_by_one_ulp
from tests.simulate.compiling import compiled_or_skip

SCENE = """
name: sliding_pendulum
parameters: {M: 2.0, m: 1.0, l: 0.7, g: 9.81, k: 3.0}
particles:
  cart: {mass: M, position: [s, 0, 0]}
  bob: {mass: m, position: [x, y, z]}
coordinates: [s, theta]
definitions: {x: s + l*sin(theta), y: 0, z: -l*cos(theta)}
potentials: {weight: m*g*z, spring: k*s^2/2}
initial: {s: 0.1, theta: 1.0}
"""


@pytest.fixture(scope="module", params=["compiled", "interpreted"])
def compiled(request):
    model = model_of(loads(SCENE).derive().equations)
    if request.param == "interpreted":
        return interpreted(model, "as a test asks for it")
    return compiled_or_skip(model)


def one(table, y):
    """The row of a table at one state, at t = 0."""
    return table(np.zeros(1), y[None, :])[0]


def states(count):
    return np.random.default_rng(3).uniform(-2, 2, size=(count, 4))


def test_right_hand_side_agrees_with_newton(compiled):
    """Momentum along x changes by the spring alone; energy does not change."""
    for y in states(20):
        s, theta, ds, dtheta = y
        rate = compiled.rhs(0.0, y)
        assert rate[:2].tolist() == [ds, dtheta]
        a, b = rate[2:]
        push = 3.0 * a + 0.7 * (b * np.cos(theta) - dtheta**2 * np.sin(theta))
        assert push == pytest.approx(-3.0 * s, abs=1e-12)
        h = 1e-5
        forward, back = (one(compiled.energy, y + d * h * rate)[0] for d in (1, -1))
        assert (forward - back) / (2 * h) == pytest.approx(0.0, abs=1e-7)


def test_cartesian_velocities_are_derivatives_of_positions(compiled):
    for y in states(5):
        h = 1e-6
        step = np.concatenate([y[2:], [0, 0]]) * h
        ahead, behind = (one(compiled.positions, y + d * step) for d in (1, -1))
        rate = (ahead - behind) / (2 * h)
        assert one(compiled.velocities, y) == pytest.approx(rate, abs=1e-8)


def test_disturbed_by_rounding_and_no_more(compiled):
    changed = [[], []]
    for y in states(50):
        right = compiled.rhs(0.0, y)
        for k, off in enumerate(compiled.perturbed):
            moved = np.abs(off(0.0, y) - right) / np.abs(right).max()
            assert moved.max() < 1e-13
            changed[k].append(moved.max())
    assert all(np.median(c) > 1e-17 for c in changed)
    y = states(1)[0]
    assert (compiled.perturbed[0](0.0, y) != compiled.perturbed[1](0.0, y)).any()


def test_undefined_values_are_nan_not_exceptions(compiled):
    for bad in (np.inf, np.nan, 1e308):
        result = compiled.rhs(0.0, np.full(4, bad))
        assert result.shape == (4,)
        assert not np.isfinite(result).all()


def test_one_unit_in_the_last_place():
    values = np.array([1.0, -3.0, 0.0, 1e300, 5e-324])
    for pattern in (1, 2):
        moved = off_by_one_ulp(values, pattern)
        assert moved[2] == 0
        assert (
            np.abs(moved - values) == np.where(values == 0, 0, np.spacing(np.abs(values)))
        ).all()
        assert (moved == off_by_one_ulp(values, pattern)).all()
