"""Errors estimated in parts, in order, are those estimated sample by sample."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from lagrange_cli.simulate.accuracy.error_estimate import FLOOR_ULPS, RunningEstimate
from lagrange_cli.simulate.runs.problem import InitialValueProblem, running_scales, ulps
from tests.simulate.native_systems import native


def a_problem(draw, samples):
    n = int(draw.integers(1, 4))
    unsampled = None if draw.random() < 0.5 else draw.random(2 * n) * draw.integers(0, 2, 2 * n)
    return InitialValueProblem(
        lambda t, y: y,
        draw.normal(size=2 * n),
        np.linspace(0, 1, max(samples, 2)),
        tuple(draw.choice(["angle", "length"], n)),
        unsampled=unsampled,
    )


def a_run(draw, samples, columns):
    """States, errors of a state and what is estimated besides, of all sizes; some not known."""
    states = draw.normal(size=(samples, columns)) * 10.0 ** draw.integers(-3, 3)
    errors = np.abs(draw.normal(size=(samples, columns)))
    errors *= 10.0 ** draw.integers(-12, -2, size=(samples, 1))
    beside = np.abs(draw.normal(size=samples)) * 10.0 ** draw.integers(-12, -4)
    if draw.random() < 0.2:
        states[draw.integers(samples) :] = 0.0
    if draw.random() < 0.2:
        errors[draw.integers(samples), 0] = np.nan
    return states, errors, beside


def sample_by_sample(problem, eps, states, errors, beside):
    """Samples that hold the accuracy, the estimate at the last, and that of the very last."""
    n = len(problem.kinds)
    worst = np.maximum.accumulate(errors, axis=0)
    sizes = np.maximum.accumulate(np.abs(states[:, :n]), axis=0)
    worst[:, :n] = np.maximum(worst[:, :n], FLOOR_ULPS * ulps(sizes))
    ratios = np.maximum((worst / running_scales(problem, states)).max(axis=1), beside)
    ratios[0] = 0.0
    last = int(np.flatnonzero(ratios < eps)[-1])
    return last + 1, ratios[last], ratios[-1] / eps


@pytest.mark.parametrize("seed", range(10))
def test_parts_of_a_run_give_what_all_samples_give(seed):
    draw = np.random.default_rng(seed)
    for _ in range(30):
        samples = int(draw.integers(1, 40))
        problem = a_problem(draw, samples)
        run = a_run(draw, samples, len(problem.y0))
        eps = 10.0 ** draw.integers(-10, -3)
        cuts = sorted({0, samples, *draw.integers(0, samples + 1, 3).tolist()})
        estimate = RunningEstimate(problem, eps, run[0][0])
        with np.errstate(all="ignore"):
            for first, end in pairwise(cuts):
                estimate.add(*(part[first:end] for part in run))
            wanted = sample_by_sample(problem, eps, *run)
        found = estimate.estimate
        got = found.samples, found.estimate, found.excess
        np.testing.assert_array_equal(got, wanted)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("unknown", [False, True])
def test_machine_code_compares_runs_as_arrays_do(unknown):
    draw, compare = np.random.default_rng(7), native("pendulum").compare
    runs = draw.normal(size=(3, 25, 6))
    if unknown:
        runs[1, 9, 2] = np.nan
    weights, start, before = np.array([2.0, 3.0]), runs[0, 0], draw.random(15)
    largest = before.copy()
    compare(list(runs), weights, start, largest)
    run, one, two = runs
    moved = np.abs(run - np.concatenate([start[:3], np.zeros(3)]))
    errors = weights[0] * np.abs(one - run) + weights[1] * np.abs(two - run)
    rows = np.concatenate([errors, moved, np.abs(run[:, :3])], axis=1)
    np.testing.assert_array_equal(largest, np.maximum(rows.max(axis=0), before))
    assert np.isnan(largest).sum() == unknown


@pytest.mark.parametrize("samples", [1, 12])
def test_samples_are_taken_by_the_last_one_only_if_that_holds(samples):
    draw = np.random.default_rng(samples)
    problem = a_problem(draw, samples)
    states, n = draw.normal(size=(samples, len(problem.y0))), len(problem.kinds)
    for error, holds in ((1e-9, True), (1e-3, samples == 1)):
        errors = np.full(states.shape, error)
        moved = np.abs(states - np.concatenate([states[0, :n], np.zeros(n)]))
        rows = np.concatenate([errors, moved, np.abs(states[:, :n])], axis=1)
        by_last, whole = (RunningEstimate(problem, 1e-6, states[0]) for _ in range(2))
        taken = by_last.add_by_last(
            samples, lambda largest, rows=rows: np.copyto(largest, rows.max(axis=0))
        )
        assert taken == holds
        if holds:
            whole.add(states, errors, np.zeros(samples))
            assert by_last.estimate.samples == whole.estimate.samples == samples
            assert by_last.estimate.excess == whole.estimate.excess
