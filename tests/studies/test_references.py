"""Fronts, errors over scales, references: against closed forms, and refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.errors import AccuracyError
from lagrange_cli.simulate import INTEGRATORS
from lagrange_cli.simulate.integrators.hybrid.contact_system import ModeChange
from lagrange_cli.simulate.runs.problem import InitialValueProblem, running_scales
from lagrange_cli.studies.reference import Motion, errors, reference
from lagrange_cli.studies.tradeoff.measure import trade
from lagrange_cli.studies.tradeoff.result import cheapest, cost_ratio, pareto
from tests.campaign import slice_of
from tests.studies.trade_systems import (
    BALL,
    DOUBLE,
    RUNAWAY,
    model,
    problem_and_coarse_run,
)
from tests.systems.shipped import SYSTEMS

# Fronts

number = st.sampled_from([0.0, 1e-12, 0.5, 1.0, 2.0, 3.0, math.inf])
pair = st.tuples(number, number)


@given(st.lists(pair, max_size=12))
def test_the_front_is_what_no_other_point_beats(points):
    def beats(a, b):
        return a != b and a[0] <= b[0] and a[1] <= b[1]

    expected = [
        all(map(math.isfinite, p)) and not any(beats(other, p) for other in points) for p in points
    ]
    assert pareto(points) == expected


@given(st.lists(st.tuples(st.floats(), st.floats()), max_size=8))
def test_the_front_of_anything_has_finite_points_only(points):
    front = [p for p, on in zip(points, pareto(points), strict=True) if on]
    assert all(math.isfinite(x) for p in front for x in p)
    assert bool(front) == any(all(map(math.isfinite, p)) for p in points)


@given(number, st.floats(0.1, 10), st.lists(st.tuples(number, st.floats(0.1, 10)), max_size=8))
def test_behind_is_a_factor_over_the_cheapest_that_is_as_good(error, cost, points):
    good = [c for e, c in points if e <= error]
    found = cost_ratio(error, cost, points)
    assert (found is None) == (not good)
    if found is not None:
        assert found * min(good) == pytest.approx(cost)


def test_of_runs_that_are_as_fast_the_one_of_least_work_is_the_cheapest():
    runs = [(1.0, 500), (1.05, 100), (1.5, 10)]
    assert cheapest(runs, lambda r: r[0], lambda r: r[1]) == (1.05, 100)
    assert cheapest([], lambda r: r[0], lambda r: r[1]) is None


# Errors


def plain(times, kinds=("length",)):
    return InitialValueProblem(lambda t, y: y, np.zeros(2 * len(kinds)), np.array(times), kinds)


def test_errors_are_the_largest_so_far_over_the_scales():
    problem = plain([0.0, 1.0, 2.0, 4.0])
    one = Motion(np.zeros((4, 2)), (), 4.0)
    other = Motion(np.array([[0, 0], [0.2, 0], [0, 6], [0.1, 0]]), (), 4.0)
    found = errors(problem, np.array([0.5, 10.0]), one, other)
    assert found.tolist() == [0, 0.4, 0.6, 0.6]


def test_what_is_not_finite_is_an_infinite_error():
    problem = plain([0.0, 1.0])
    other = Motion(np.array([[0, 0], [np.nan, 0]]), (), 1.0)
    found = errors(problem, np.ones(2), Motion(np.zeros((2, 2)), (), 1.0), other)
    assert found[1] == np.inf


def jump(t, contact=0, kind="contact"):
    return ModeChange(t, contact, kind, np.array([0.0, -1.0]), np.array([0.0, 1.0]), (False,))


def test_velocities_beside_a_jump_do_not_count_but_its_time_does():
    problem = plain([0.0, 1.0, 2.0])
    before, after = np.array([[0, -1], [0, -1], [0, 1.0]]), np.array([[0, -1], [0, 1], [0, 1.0]])
    one, other = Motion(before, (jump(1.01),), 2.0), Motion(after, (jump(0.99),), 2.0)
    found = errors(problem, np.ones(2), one, other)
    # The event is 0.02 off in a span of 2; the sample at 1 lies between both.
    assert found[-1] == pytest.approx(0.02 / 2)
    missed = Motion(after, (), 2.0)
    assert errors(problem, np.ones(2), one, missed)[-1] == np.inf
    elsewhere = Motion(after, (jump(0.99, contact=1),), 2.0)
    assert errors(problem, np.ones(2), one, elsewhere)[-1] == np.inf


# References


def test_a_reference_is_within_its_error_of_the_closed_form(oscillator):
    _, _, problem, coarse = problem_and_coarse_run(oscillator)
    with np.errstate(all="ignore"):
        known = reference(problem, coarse, 30.0)
    t = problem.times
    off = np.abs(known.motion.states - np.column_stack([np.cos(t), -np.sin(t)])) / known.scales
    assert off.max() <= known.error + 2 * np.finfo(float).eps
    assert known.error < 1e-12
    assert known.scales == pytest.approx([2, 1], rel=1e-2)
    assert problem.until == 6


@pytest.mark.slow
def test_a_reference_in_long_doubles_is_checked_by_another_method(traded):
    if "long doubles" not in traded.reference.method:
        pytest.skip("no wider arithmetic here")
    assert traded.reference.checked in INTEGRATORS
    assert traded.reference.checked != "DOP853"
    assert traded.reference.difference < 1e-11


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_garbage")
def test_without_a_compiler_two_methods_are_compared(oscillator, monkeypatch):
    monkeypatch.setenv("CC", "/nowhere/cc")
    found = trade(oscillator, methods=["DOP853"], repeat=1, until=2.0, budget=10.0)
    assert "interpreted" in found.implementation
    assert found.reference.method == "Gauss16 against DOP853"
    assert found.reference.checked is None
    assert found.reference.error < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize(
    "until", slice_of([0.198, 0.213, 0.555, 0.585], 0, lambda until: until < 0.3)
)
def test_roundings_that_two_methods_share_count_as_error_of_a_reference_in_doubles(until):
    # A heavy pull: where the right-hand side rounds, both methods round nearly alike.
    text = (SYSTEMS / "pendulums" / "spherical_pendulum.yaml").read_text(encoding="utf-8")
    fast = model(text.replace("g: {value: 9.81,", "g: {value: 9.81e6,"))
    _, _, problem, coarse = problem_and_coarse_run(fast, until=until)
    with np.errstate(all="ignore"):
        wide = reference(problem, coarse, 60.0)
        known = reference(replace(problem, wider=lambda: None), coarse, 60.0)
    if "long doubles" not in wide.method:
        pytest.skip("no wider arithmetic here")
    off = errors(problem, known.scales, known.motion, wide.motion)[-1]
    assert known.method == "Gauss16 against DOP853"
    # Chance may bring roundings together, not by much.
    assert wide.error < off <= 2 * known.error


def refusal(*args, **kwargs):
    with pytest.raises(AccuracyError) as caught:
        trade(*args, **kwargs)
    (problem,) = caught.value.problems
    assert caught.value.exit_code == 1
    return problem.message, problem.hint


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_garbage")
def test_chaos_is_refused_with_an_end_that_has_a_reference():
    of = model(DOUBLE)
    message, hint = refusal(of, repeat=1)
    assert "chaotic" in message
    until = float(hint.removeprefix("--until "))
    assert 5 < until < 60
    found = trade(of, methods=["Gauss16"], repeat=1, until=until)
    assert found.reference.error < 1e-4
    assert found.until == until


def test_a_singularity_is_refused_with_an_end_before_it():
    # x = 1/(1 - t) solves it.
    message, hint = refusal(model(RUNAWAY), repeat=1)
    assert "cannot be continued past t = 1" in message
    assert 0.5 < float(hint.removeprefix("--until ")) < 1


@pytest.mark.slow
def test_bounces_without_end_are_refused_with_an_end_before_them():
    # They end at sqrt(2 h/g) (1 + e)/(1 - e) = 3.
    message, hint = refusal(model(BALL), until=4.0, repeat=1)
    assert "infinitely many by t = 3" in message
    assert 2 < float(hint.removeprefix("--until ")) < 3


def test_no_time_for_a_reference_is_a_refusal(oscillator):
    message, hint = refusal(oscillator, budget=1e-12)
    assert "budget" in message
    assert hint == "--budget 60"


def test_scales_of_a_reference_are_those_of_the_promise(oscillator):
    _, _, problem, coarse = problem_and_coarse_run(oscillator)
    with np.errstate(all="ignore"):
        known = reference(problem, coarse, 30.0)
    assert known.scales.tolist() == running_scales(problem, known.motion.states)[-1].tolist()
