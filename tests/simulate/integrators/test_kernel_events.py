"""Zeros of event functions along compiled runs, against closed forms."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from tests.simulate.native_systems import native, native_events

METHODS = [INTEGRATORS[name] for name in ("DOP853", "Gauss16")]
names = {"ids": lambda method: method.name}


def watched(method, rhs, y0, until, events, *, tolerance=1e-14, max_step=1e9):
    n = len(y0)
    how = Control(np.full(n, tolerance), np.full(n, tolerance), 1e-3, max_step)
    run = start_integrator(method, rhs, 0.0, np.array(y0, dtype=float), until, how)
    run.watch(events)
    return run


def run_to(run, until, **limits):
    """Samples and calls until the end or a terminal event."""
    how = {"most_steps": 10**6, "most_evaluations": math.inf, **limits}
    filled = 0
    while not filled and not run.ended:
        done = run.advance(np.array([until]), np.empty((1, len(run.y))), **how)
        assert done.failure is None
        filled = done.filled
    return run.events


def period(amplitude):
    """Of the pendulum of unit length in unit gravity, released at rest."""
    return float(4 * mpmath.ellipk(mpmath.sin(mpmath.mpf(amplitude) / 2) ** 2))


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS, **names)
def test_passages_through_the_bottom_are_half_periods_apart(method):
    run = watched(method, native("pendulum"), [2.0, 0.0], 60.0, native_events("bottom"))
    found = run_to(run, 60.0)
    half = period(2.0) / 2
    expected = np.arange(half / 2, 60.0, half)
    assert len(found) == len(expected)
    times = np.array([event.time for event in found])
    assert np.abs(times - expected).max() < 1e-12 * 60
    speed = 2 * math.sin(1.0)
    for k, event in enumerate(found):
        assert event.index == 0
        assert abs(event.state[0]) < 1e-13
        assert event.state[1] == pytest.approx((-1) ** (k + 1) * speed, abs=1e-12)


@pytest.mark.parametrize("method", METHODS, **names)
@pytest.mark.parametrize("direction", [1, -1])
def test_one_direction(method, direction):
    events = native_events("bottom", directions=(direction,))
    found = run_to(watched(method, native("pendulum"), [2.0, 0.0], 60.0, events), 60.0)
    first = period(2.0) * (0.25 if direction < 0 else 0.75)
    expected = np.arange(first, 60.0, period(2.0))
    assert [event.time for event in found] == pytest.approx(expected, abs=1e-10)
    assert all(np.sign(event.state[1]) == direction for event in found)


@pytest.mark.parametrize("method", METHODS, **names)
def test_a_terminal_event_ends_the_run_there(method):
    events = native_events("bottom", terminal=(True,))
    run = watched(method, native("pendulum"), [2.0, 0.0], 60.0, events)
    times = np.linspace(0.0, 60.0, 601)
    out = np.full((601, 2), np.nan)
    done = run.advance(times, out, most_steps=10**6, most_evaluations=math.inf)
    quarter = period(2.0) / 4
    assert run.ended
    assert run.t == pytest.approx(quarter, abs=1e-13)
    assert len(run.events) == 1
    assert (run.y == run.events[0].state).all()
    assert done.failure is None
    assert times[done.filled - 1] <= run.t < times[done.filled]
    assert np.isfinite(out[: done.filled]).all()
    again = run.advance(times[done.filled :], out, most_steps=5, most_evaluations=math.inf)
    assert (again.filled, run.t, len(run.events)) == (0, run.events[0].time, 1)
    # Samples before the event remain within reach.
    inside = np.array([run.t - 1e-3])
    assert run.advance(inside, out, most_steps=5, most_evaluations=math.inf).filled == 1


@pytest.mark.parametrize("method", METHODS, **names)
def test_events_after_a_terminal_one_are_forgotten(method):
    """All three times lie in one step; the terminal one is in the middle."""
    events = native_events("three_times", 1.5, directions=(0, 0, 0), terminal=(False, True, False))
    how = Control(np.full(2, 1e-3), np.full(2, 1e3), 9.0, 9.0)
    run = start_integrator(method, native("constant"), 0.0, np.zeros(2), 9.0, how)
    run.watch(events)
    found = run_to(run, 9.0)
    assert [event.index for event in found] == [2, 1]
    assert [event.time for event in found] == pytest.approx([0.5, 1.0], abs=1e-15)
    assert run.t == found[-1].time
    assert run.y[0] == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("method", METHODS, **names)
def test_events_of_one_step_are_in_order(method):
    events = native_events("three_times", 1.5, directions=(0, 0, 0), terminal=(False, False, False))
    how = Control(np.full(2, 1e-3), np.full(2, 1e3), 9.0, 9.0)
    run = start_integrator(method, native("constant"), 0.0, np.zeros(2), 9.0, how)
    run.watch(events)
    found = run_to(run, 9.0)
    assert run.steps == 1
    assert [(event.index, event.time) for event in found] == [
        (2, pytest.approx(0.5, abs=4e-16)),
        (1, pytest.approx(1.0, abs=4e-16)),
        (0, pytest.approx(1.5, abs=4e-16)),
    ]
    assert all(event.state[0] == pytest.approx(event.time, abs=1e-13) for event in found)


@pytest.mark.parametrize("method", METHODS, **names)
def test_an_event_at_the_start_is_no_crossing(method):
    """Released at the bottom: the first passage is half a period later."""
    run = watched(method, native("oscillator", 1.0), [0.0, 1.0], 7.0, native_events("bottom"))
    found = run_to(run, 7.0)
    assert [event.time for event in found] == pytest.approx([math.pi, 2 * math.pi], abs=1e-12)


@pytest.mark.parametrize("method", METHODS, **names)
@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-10])
def test_two_crossings_at_a_graze(method, depth):
    """cos t falls below −1 + depth for a time of 2·acos(1 − depth), within one step."""
    events = native_events("level", -1.0 + depth)
    run = watched(method, native("oscillator", 1.0), [1.0, 0.0], 5.0, events)
    found = run_to(run, 5.0)
    away = math.acos(1 - depth)
    assert len(found) == 2
    expected = [math.pi - away, math.pi + away]
    # The time of a graze is as uncertain as the square root of the depth is steep.
    assert [event.time for event in found] == pytest.approx(expected, abs=1e-13 / away)


@pytest.mark.parametrize("method", METHODS, **names)
def test_a_near_miss_is_no_event(method):
    events = native_events("level", -1.0 - 1e-10)
    run = watched(method, native("oscillator", 1.0), [1.0, 0.0], 30.0, events)
    assert run_to(run, 30.0) == []


@pytest.mark.parametrize("method", METHODS, **names)
def test_two_zeros_in_every_part_of_a_step(method):
    """cos 7t along steps of 0.6 or less: every one of its zeros is found once."""
    events = native_events("wave", 7.0)
    run = watched(method, native("oscillator", 1.0), [1.0, 0.0], 40.0, events, max_step=0.6)
    times = np.array([event.time for event in run_to(run, 40.0)])
    expected = np.arange(math.pi / 14, 40.0, math.pi / 7)
    assert len(times) == len(expected)
    assert np.abs(times - expected).max() < 4e-14


@pytest.mark.parametrize("method", METHODS, **names)
def test_interruptions_change_no_event(method):
    def found(**limits):
        events = native_events(
            "bottom_and_speed", directions=(0, 1, 0), terminal=(False, False, False)
        )
        run = watched(method, native("pendulum"), [2.0, 0.0], 30.0, events, tolerance=1e-10)
        return [(e.time, e.index, *e.state) for e in run_to(run, 30.0, **limits)]

    whole = found()
    assert {index for _, index, *_ in whole} == {0, 1, 2}
    assert whole == sorted(whole)
    assert found(most_steps=1) == whole


@pytest.mark.parametrize("method", METHODS, **names)
def test_more_events_than_one_call_has_room_for(method):
    """Thousands of zeros: the buffer is emptied between calls."""
    events = native_events("wave", 60.0)
    run = watched(method, native("oscillator", 1.0), [1.0, 0.0], 200.0, events, max_step=0.1)
    times = np.array([event.time for event in run_to(run, 200.0)])
    assert len(times) == len(np.arange(math.pi / 120, 200.0, math.pi / 60))
    assert (np.diff(times) > 0).all()


def test_fixed_steps_have_no_events():
    how = Control(np.zeros(2), np.zeros(2), 1.0, 1.0, 0.1)
    run = start_integrator(
        INTEGRATORS["RK4"], native("pendulum"), 0.0, np.array([1.0, 0.0]), 1.0, how
    )
    with pytest.raises(ValueError, match="no interpolant"):
        run.watch(native_events("bottom"))
