"""The measure of how far a motion is from its constraints."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli.simulate.verification.drifts import constraint_drift

TIMES = np.linspace(0.0, 6.0, 100)

#: On a circle of radius 2 about (5, 0), with velocities; and the scales of motion on it.
CIRCLE = np.column_stack(
    [5 + 2 * np.cos(TIMES), 2 * np.sin(TIMES), -2 * np.sin(TIMES), 2 * np.cos(TIMES)]
)
SCALES = np.array([4.0, 2.0, 2.0, 2.0])


def circle(t, y):
    x, z, vx, vz = y.T
    return np.column_stack([(x - 5) ** 2 + z**2 - 4, 2 * (x - 5) * vx + 2 * z * vz])


def distance(t, y):
    x, z, vx, vz = y.T
    r = np.hypot(x - 5, z)
    return np.column_stack([r - 2, ((x - 5) * vx + z * vz) / r])


@pytest.mark.parametrize("constraints", [circle, distance])
def test_none_on_the_circle(constraints):
    assert constraint_drift(constraints, TIMES, CIRCLE, SCALES) < 1e-15


@pytest.mark.parametrize("constraints", [circle, distance])
@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-12])
@pytest.mark.parametrize("component", [0, 2])
def test_as_far_as_one_state_is_off(constraints, off, component):
    """Between a part and all of the displacement, however the circle is written."""
    states = CIRCLE.copy()
    states[37, component] += off * SCALES[component]
    found = constraint_drift(constraints, TIMES, states, SCALES)
    assert 0.1 * off < found < 1.5 * off


@pytest.mark.parametrize("unit", [1e-12, 1e16])
def test_units_do_not_matter(unit):
    states = CIRCLE.copy()
    states[50, 1] += 1e-5
    found = constraint_drift(circle, TIMES, states, SCALES)

    def scaled(t, y):
        return circle(t, y / unit) * unit**2

    assert constraint_drift(scaled, TIMES, states * unit, SCALES * unit) == pytest.approx(found)


def test_no_constraints():
    assert constraint_drift(lambda t, y: np.empty((len(t), 0)), TIMES, CIRCLE, SCALES) is None


def test_a_residual_that_does_not_exist():
    assert constraint_drift(lambda t, y: y[:, :1] * np.nan, TIMES, CIRCLE, SCALES) is None


def test_one_sample():
    assert constraint_drift(circle, TIMES[:1], CIRCLE[:1], SCALES) == 0.0
