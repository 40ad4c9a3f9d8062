"""The coarse first run: scales and steps of motions whose pace changes by many powers of ten."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lagrange_cli.simulate.accuracy.coarse_run import FIRST_STEP
from lagrange_cli.simulate.accuracy.method_selection import coarse_result
from lagrange_cli.simulate.checkpoint.progress import Watch
from tests.simulate.accuracy.accuracy_systems import problem


def comet(near, until):
    """A body at its perihelion, 1 the half axis of its orbit."""

    def rhs(t, y):
        return np.concatenate([y[2:], -y[:2] / (y[0] ** 2 + y[1] ** 2) ** 1.5])

    speed = math.sqrt((2 - near) / near)
    return problem(rhs, [near, 0.0, 0.0, speed], until, ("length", "length"), samples=11)


@pytest.mark.parametrize("near", [1e-3, 1e-6, 1e-9])
def test_a_start_at_a_perihelion_is_resolved(near):
    """What matters there happens in the time that the body takes for its distance."""
    with np.errstate(all="ignore"):
        found = coarse_result(comet(near, 2.0), 1e-11, Watch())
    assert found.first_step < 100 * near**1.5


def test_noise_of_a_step_is_that_of_the_step_that_is_made_there():
    """At the perihelion steps are short, and accelerations large."""
    with np.errstate(all="ignore"):
        found = coarse_result(comet(1e-6, 2.0), 1e-11, Watch())
    speed = math.sqrt(2e6)
    # The last place of the start moves the velocity by about one of its own in a step.
    assert found.noise[0, 3] < 1e3 * np.spacing(speed)


def test_a_slow_start_has_the_usual_first_step():
    def rhs(t, y):
        return np.array([y[1], -y[0]])

    of = problem(rhs, [1.0, 0.0], 10.0, ("length",))
    found = coarse_result(of, 1e-9, Watch())
    assert found.scales == pytest.approx([2.0, 1.0], rel=1e-2)
    assert found.first_step > FIRST_STEP * of.span


def test_a_coarse_run_that_falls_into_a_singularity_is_left():
    """It would need more steps than anyone makes; evaluations are counted."""
    count = 0
    of = comet(1e-8, 2.0)

    def counted(t, y):
        nonlocal count
        count += 1
        return of.rhs(t, y)

    with np.errstate(all="ignore"):
        coarse_result(problem(counted, of.y0, 2.0, of.kinds, samples=11), 1e-11, Watch())
    assert count < 600_000


def test_a_time_whose_square_is_beyond_doubles_is_begun():
    def free(t, y):
        return np.array([y[1], 0.0])

    with np.errstate(all="ignore"):
        found = coarse_result(problem(free, [1.0, 1e-300], 1e300, ("length",)), 1e-9, Watch())
    assert found.scales == pytest.approx([1.0, 1e-300])
