"""Zeros that event functions fall through along compiled runs, against closed forms."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.events import RISES
from tests.simulate.native_systems import native, native_events

METHODS = [INTEGRATORS[name] for name in ("DOP853", "Gauss16")]
names = {"ids": lambda method: method.name}


def watched(method, rhs, y0, until, events, *, tolerance=1e-14, first_step=1e-3, max_step=1e9):
    n = len(y0)
    how = Control(np.full(n, tolerance), np.full(n, tolerance), first_step, max_step)
    run = start_integrator(method, rhs, 0.0, np.array(y0, dtype=float), until, how)
    run.stop_at(events)
    return run


def run_to(run, until, **limits):
    """Step on in as many calls as it takes to the end or an event; return the event's number."""
    how = {"most_steps": 10**6, "most_evaluations": math.inf, **limits}
    filled = 0
    while not filled and run.end_event is None:
        done = run.advance(np.array([until]), np.empty((1, len(run.y))), **how)
        assert done.failure is None
        filled = done.filled
    return run.end_event


def period(amplitude):
    """Of the pendulum of unit length in unit gravity, released at rest."""
    return float(4 * mpmath.ellipk(mpmath.sin(mpmath.mpf(amplitude) / 2) ** 2))


@pytest.mark.parametrize("method", METHODS, **names)
def test_a_run_ends_where_a_function_falls_through_zero(method):
    run = watched(method, native("pendulum"), [2.0, 0.0], 60.0, native_events("bottom"))
    times = np.linspace(0.0, 60.0, 601)
    out = np.full((601, 2), np.nan)
    done = run.advance(times, out, most_steps=10**6, most_evaluations=math.inf)
    assert (run.end_event, done.failure) == (0, None)
    assert run.t == pytest.approx(period(2.0) / 4, abs=1e-13)
    assert run.y == pytest.approx([0.0, -2 * math.sin(1.0)], abs=1e-12)
    assert times[done.filled - 1] <= run.t < times[done.filled]
    assert np.isfinite(out[: done.filled]).all()
    end = run.t
    again = run.advance(times[done.filled :], out, most_steps=5, most_evaluations=math.inf)
    assert (again.filled, run.t) == (0, end)
    # Samples before the event remain within reach.
    inside = np.array([run.t - 1e-3])
    assert run.advance(inside, out, most_steps=5, most_evaluations=math.inf).filled == 1


@pytest.mark.parametrize("method", METHODS, **names)
@pytest.mark.parametrize(("first", "number"), [(1.5, 1), (0.25, 0)])
def test_a_run_ends_at_the_first_of_zeros_in_one_step(method, first, number):
    """Zeros at ``first``, 1, and half a time after ``first``."""
    events = native_events("three_times", first, signs=(1.0,) * 3)
    run = watched(
        method, native("constant"), [0.0, 0.0], 9.0, events, tolerance=1e3, first_step=9.0
    )
    assert run_to(run, 9.0) == number
    assert run.t == pytest.approx(min(first, 1.0), abs=1e-15)
    assert run.y[0] == pytest.approx(run.t, abs=1e-14)


@pytest.mark.parametrize("method", METHODS, **names)
def test_a_zero_at_the_start_that_is_risen_from_is_none(method):
    """Released at the bottom: it comes back there half a period later."""
    events = native_events("bottom", signs=(RISES,), noise=1e-15)
    run = watched(method, native("oscillator", 1.0), [0.0, 1.0], 7.0, events)
    assert run_to(run, 7.0) == 0
    assert run.t == pytest.approx(math.pi, abs=1e-12)


@pytest.mark.parametrize("method", METHODS, **names)
@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-10])
def test_the_first_of_two_zeros_at_a_graze(method, depth):
    """cos t falls below −1 + depth for a time of 2·acos(1 − depth), within one step."""
    events = native_events("level", -1.0 + depth)
    run = watched(method, native("oscillator", 1.0), [1.0, 0.0], 5.0, events)
    assert run_to(run, 5.0) == 0
    away = math.acos(1 - depth)
    # The time of a graze is as uncertain as the square root of the depth is steep.
    assert run.t == pytest.approx(math.pi - away, abs=1e-13 / away)


@pytest.mark.parametrize("method", METHODS, **names)
def test_a_near_miss_is_told_within_reach(method):
    for reach in (1e-11, 1e-9):
        events = native_events("level", -1.0 - 1e-10, reach=(reach,))
        run = watched(method, native("oscillator", 1.0), [1.0, 0.0], 12.0, events)
        assert run_to(run, 12.0) is None
        times = [math.pi, 3 * math.pi] if reach > 1e-10 else []
        # The value is known to 1e-16, and so the time of the least one to a root of that.
        assert [dip.time for dip in run.dips] == pytest.approx(times, abs=1e-6)
        assert all(dip.index == 0 for dip in run.dips)


@pytest.mark.parametrize("method", METHODS, **names)
def test_a_zero_in_any_part_of_a_step(method):
    """cos(7t − phase) along steps of 0.6 or less, so that two zeros lie in every part."""
    for phase in np.linspace(0.0, 1.5, 31):
        events = native_events("wave", 7.0, phase)
        run = watched(method, native("oscillator", 1.0), [1.0, 0.0], 9.0, events, max_step=0.6)
        assert run_to(run, 9.0) == 0
        assert abs(run.t - (math.pi / 2 + phase) / 7) < 4e-15


@pytest.mark.parametrize("method", METHODS, **names)
def test_interruptions_change_no_event(method):
    def found(**limits):
        events = native_events("level", -0.4, reach=(2.0,))
        run = watched(method, native("pendulum"), [0.39, 0.0], 30.0, events, tolerance=1e-10)
        assert run_to(run, 30.0, **limits) is None
        return [(dip.time, *dip.state) for dip in run.dips]

    whole = found()
    assert len(whole) >= 4
    assert found(most_steps=1) == whole


def test_fixed_steps_have_no_events():
    how = Control(np.zeros(2), np.zeros(2), 1.0, 1.0, 0.1)
    run = start_integrator(
        INTEGRATORS["RK4"], native("pendulum"), 0.0, np.array([1.0, 0.0]), 1.0, how
    )
    with pytest.raises(ValueError, match="no interpolant"):
        run.stop_at(native_events("bottom"))
