"""Pieces of motion with events between them, over right-hand sides written by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli import loads
from lagrange_cli.simulate.accuracy.event_agreement import (
    event_agreement,
    first_zeno_time,
    near_toggles,
)
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.events import RISES, EventSearch, TerminalEvents
from lagrange_cli.simulate.integrators.hybrid.contact_motion import (
    ENDLESS,
    UNDETERMINED,
    ContactMotion,
)
from lagrange_cli.simulate.integrators.hybrid.contact_system import ModeChange, Stuck
from lagrange_cli.simulate.integrators.hybrid.sliding import is_diagonally_stable
from lagrange_cli.simulate.integrators.right_hand_side import ON_SURFACE, SurfaceRates
from lagrange_cli.simulate.model.build import model_of
from tests.simulate.compiling import compiled_or_skip
from tests.simulate.switched_systems import G, OneContact, ball, on_sphere


def control(rtol: float = 1e-12) -> Control:
    return Control(np.full(4, rtol), np.full(4, rtol), 1e-3, 0.1)


def switching(rhs: OneContact, y0: list[float], until: float) -> ContactMotion:
    found = start_integrator(INTEGRATORS["DOP853"], rhs, 0.0, np.array(y0), until, control())
    assert isinstance(found, ContactMotion)
    return found


def gone(run: ContactMotion, times: np.ndarray, at_once: int | None = None) -> np.ndarray:
    """States at the times, asked for in blocks."""
    states = np.empty((len(times), 4))
    block = at_once or len(times)
    for first in range(0, len(times), block):
        part = slice(first, first + block)
        done = run.advance(times[part], states[part], most_steps=10**6, most_evaluations=math.inf)
        assert done.failure is None
        assert done.filled == len(times[part])
    return states


@pytest.mark.parametrize("at_once", [1, 3, 7, 50, None])
def test_samples_do_not_depend_on_how_they_are_asked_for(at_once: int | None):
    times = np.linspace(0, 2, 101)
    whole = gone(switching(ball(0.8), [0, 1, 1, 0], 2), times)
    parts = gone(switching(ball(0.8), [0, 1, 1, 0], 2), times, at_once)
    assert np.array_equal(whole, parts)


def test_a_sample_at_an_event_holds_the_state_after_it():
    run = switching(ball(0.5), [0, 1, 0, 0], 1)
    first = math.sqrt(2 / G)
    states = gone(run, np.array([0.0, 0.2]))
    at = run_to_first_event(ball(0.5))
    run = switching(ball(0.5), [0, 1, 0, 0], 1)
    states = gone(run, np.array([0.0, at, 1.0]))
    assert at == pytest.approx(first, abs=1e-12)
    assert states[1, 3] == pytest.approx(0.5 * G * first)


def run_to_first_event(rhs: OneContact) -> float:
    run = switching(rhs, [0, 1, 0, 0], 1)
    gone(run, np.array([0.0, 1.0]))
    return run.switches[0].t


def test_steps_and_evaluations_are_counted_over_all_pieces():
    run = switching(ball(0.8), [0, 1, 1, 0], 2)
    gone(run, np.linspace(0, 2, 5))
    assert len(run.switches) == 3
    assert run.steps >= 4
    assert run.evaluations >= 12 * run.steps


def test_limits_are_kept():
    run = switching(ball(0.8), [0, 1, 1, 0], 2)
    times, states = np.linspace(0, 2, 5), np.empty((5, 4))
    done = run.advance(times, states, most_steps=1, most_evaluations=math.inf)
    assert run.steps == 1
    assert done.filled < 5


def test_what_cannot_be_determined_ends_the_run():
    class Undecided(OneContact):
        def reset(self, t, y, closed, event, bounce):
            return (np.array(y) if event < 0 else None), closed

    sphere = on_sphere()
    rhs = Undecided(sphere.gap, sphere.normal, sphere.push, sphere.held)
    run = switching(rhs, [0.0, 2.0, 0, 0], 2)
    states = np.empty((2, 4))
    done = run.advance(np.array([0.0, 2.0]), states, most_steps=10**6, most_evaluations=math.inf)
    assert done.failure == UNDETERMINED
    assert run.stuck == Stuck(UNDETERMINED, (0,))
    assert done.filled == 1
    assert run.t == pytest.approx(math.sqrt(2 / G))


def test_a_contact_that_neither_holds_nor_gives_way_ends_the_run():
    class Stuck(OneContact):
        def reset(self, t, y, closed, event, bounce):
            return np.array(y), (False,)  # it lets the ball through

    floor = ball(0.0)
    rhs = Stuck(floor.gap, floor.normal, floor.push, floor.held)
    run = switching(rhs, [0, 1, 0, 0], 1)
    done = run.advance(
        np.array([0.0, 1.0]), np.empty((2, 4)), most_steps=10**6, most_evaluations=math.inf
    )
    assert done.failure == ENDLESS


def search(values, signs, noise=0.0, parts=((0.0, 1.0),)):
    """The first fall of g(t) within steps, and where it is."""
    events = TerminalEvents(lambda t, y: np.array([values(t)]), (signs,), (noise,))
    found = EventSearch(events)
    for a, b in parts:
        event = found.first(lambda t: np.array([t]), a, b)
        if event is not None:
            return event[0]
    return None


def test_a_fall_is_found_and_a_rise_is_not():
    assert search(lambda t: 0.3 - t, 1.0) == pytest.approx(0.3, abs=1e-14)
    assert search(lambda t: t - 0.3, -1.0) is None


def test_two_crossings_between_the_points_of_a_step_are_found():
    dip = search(lambda t: (t - 0.37) ** 2 - 1e-4, 1.0)
    assert dip == pytest.approx(0.36, abs=1e-12)


def test_a_function_without_a_value_within_a_step_falls_where_that_begins():
    assert search(lambda t: math.nan if 0.3 < t < 0.32 else 0.31 - t, 1.0) == pytest.approx(0.3)


@given(st.floats(1e-6, 0.9))
def test_what_rises_from_zero_falls_back_where_it_does(at: float):
    """A bounce as short as any part of the step is seen."""
    assert search(lambda t: t * (at - t), RISES) == pytest.approx(at, rel=1e-9)


GRAZES_BEFORE_A_KINK = """
name: thrown
parameters: {m: 1, g: 10, e: 1}
plane: xz
particles: {b: {mass: m, position: [x, y, z]}}
constraints: {f: {unilateral: z <= 1, restitution: e}}
potentials: {w: {gravity: g}, k: m*abs(x - 0.8)}
initial: {x: 0, z: 0, dot(x): 1, dot(z): 4.472135954}
"""


@pytest.mark.slow
def test_a_graze_is_known_after_a_switching_surface():
    model = model_of(loads(GRAZES_BEFORE_A_KINK).derive().equations)
    rhs, start = compiled_or_skip(model).rhs, np.array(model.initial)
    run = start_integrator(INTEGRATORS["DOP853"], rhs, 0.0, start, 1.0, control(1e-9))
    assert isinstance(run, ContactMotion)
    gone(run, np.array([1.0]))
    assert any(graze.t == pytest.approx(math.sqrt(0.2), abs=1e-6) for graze in run.grazes)


def test_noise_is_no_sign():
    """Below its noise nothing is made of a function that rises slowly from zero."""

    def slow(t: float) -> float:
        return 1e-9 * t**3 - 1e-17

    assert search(slow, RISES, noise=1e-12, parts=[(0, 1e-3), (1e-3, 0.1), (0.1, 2)]) is None
    assert search(lambda t: -(t**2), RISES, noise=1e-12) == pytest.approx(0, abs=0.3)


def switch(t: float, contact: int = 0, kind: str = "contact") -> ModeChange:
    moved = np.array([0.0, 1.0]) if kind == "contact" else np.zeros(2)
    return ModeChange(t, contact, kind, np.zeros(2), moved, (False, False))


def test_events_agree_contact_by_contact_in_any_order():
    runs = [
        [switch(1.0), switch(1.0 + 1e-12, 1), switch(2.0)],
        [switch(1.0, 1), switch(1.0 + 2e-12), switch(2.1)],
    ]
    found = event_agreement(runs, [3, 3], [0, 2])
    assert found.broken == math.inf
    assert sorted(found.errors) == pytest.approx([2e-12, 4e-12, 0.2], rel=1e-3)
    assert found.ratios(np.array([0.5, 1.5, 2.5]), 4.0) == pytest.approx([0, 1e-12, 0.05], rel=1e-3)
    assert found.exempt(np.array([0.9, 1.9, 2.3])).tolist() == [False, True, False]


def test_events_that_only_some_runs_have_break_the_agreement():
    found = event_agreement([[switch(1.0)], []], [3, 3], [0, 2])
    assert found.broken == 1.0
    assert found.ratios(np.array([0.5, 1.5]), 4.0).tolist() == [0, math.inf]
    # A run that has not come so far says nothing.
    assert event_agreement([[switch(1.0)], []], [3, 0.9], [0, 2]).broken == math.inf


def test_another_kind_of_event_breaks_the_agreement():
    found = event_agreement([[switch(1.0)], [switch(1.0, 0, "release")]], [3, 3], [0, 2])
    assert found.broken == 1.0


def test_an_event_near_the_end_may_lie_behind_it_for_others():
    found = event_agreement([[switch(9.75)], []], [10, 10], [0, 2], end=10.0, near=0.5)
    assert found.broken == math.inf
    assert (found.times.tolist(), found.errors.tolist()) == ([9.75], [0.25])
    assert event_agreement([[switch(9.25)], []], [10, 10], [0, 2], 10.0, 0.5).broken == 9.25


def test_changes_of_states_are_near_within_the_errors_of_their_times():
    """State 4 changes as in the companion, state 5 does so 0.25 later, state 6 near the end."""
    t = np.array([1.0, 1.0 + 2**-50, 1.125, 1.375, 1.625, 9.0, 9.75])
    runs = [((4, 1.0), (5, 1.125), (6, 9.875)), ((4, 1.0), (5, 1.375))]
    near = near_toggles(runs, [0, 1], 10.0, 0.5, t)
    assert {place: np.flatnonzero(flags).tolist() for place, flags in near.items()} == {
        4: [0, 1],
        5: [0, 1, 2, 3],
        6: [6],
    }


def test_a_first_rate_of_rounding_leaves_the_second_one():
    """Rounding is that of 1e6 and of 1e-6, the magnitudes of which the first rates are sums."""
    sizes = np.array([1e6, 1e6, 1e-6, 1e-6])
    first = ON_SURFACE * np.array([0.9e6, -1.1e6, 0.9e-6, -1.1e-6])
    rates = SurfaceRates(first, np.full(4, 3.0), sizes)
    assert [rates.leading(k, positional=True) for k in range(4)] == [3.0, first[1], 3.0, first[3]]
    assert [rates.leading(k, positional=False) for k in (0, 2)] == [0.0, 0.0]


def test_the_end_of_bounces():
    assert first_zeno_time([switch(1.0), switch(2.0, 0, "zeno"), switch(3.0, 0, "zeno")]) == 2.0
    assert first_zeno_time([switch(1.0)]) == math.inf


@pytest.mark.parametrize(
    ("matrix", "stable"),
    [
        # Positive minors suffice for two rows, however unlike they are, and not for three.
        ([[1, 100], [0, 1]], True),
        ([[1, 2], [1, 1]], False),
        ([[1, 2, 2], [2, 1, 2], [2, 2, 1]], False),
        # A rotation, and a symmetric matrix whose rows are scaled by 1, 1e6 and 1e-6.
        ([[1, -9, 0], [9, 1, 0], [0, 0, 1]], True),
        ([[2, 1, 1], [1e6, 2e6, 1e6], [1e-6, 1e-6, 2e-6]], True),
        ([[1, 0, 0], [0, 0, 0], [0, 0, 1]], False),
    ],
)
def test_matrices_that_a_diagonal_makes_positive_definite(matrix, stable):
    assert is_diagonally_stable(np.array(matrix, float)) is stable
