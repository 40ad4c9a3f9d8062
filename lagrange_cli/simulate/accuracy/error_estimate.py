"""Estimated errors of the samples of a run, compared with the accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.runs.problem import (
    InitialValueProblem,
    motion,
    scales_from,
    ulps,
)

#: Units in the last place below which nothing is promised.
FLOOR_ULPS = 4.0


@dataclass(frozen=True)
class ErrorEstimate:
    """Samples of a run that hold an accuracy, with the estimate of their error.

    Attributes
    ----------
    samples
        Number of samples, from the first, that hold the accuracy.
    estimate
        Estimated error over its scale at the last of them.
    scales
        Scales of the state there, shape (2n,).
    excess
        Estimated error of the last sample over its scale, relative to the accuracy.
    errors
        Errors of the state at the last sample that all runs reached, over ``last``, shape
        (2n,).
    last
        Scales at that sample, shape (2n,).
    """

    samples: int
    estimate: float
    scales: Array
    excess: float
    errors: Array
    last: Array


class RunningEstimate:
    """Looks at the samples of a run in parts, in order; ``start`` is the first of them."""

    def __init__(self, problem: InitialValueProblem, eps: float, start: Array) -> None:
        self._problem, self._eps, self._n, self._seen = problem, eps, len(problem.kinds), 0
        self._size = problem.layout.size
        self._start = start[: self._n]
        #: Largest errors, motions and speeds, and sizes of coordinates so far.
        self._largest = np.zeros(2 * self._size + self._n)
        self._estimate: ErrorEstimate | None = None

    def add(self, states: Array, errors: Array, event_errors: Array) -> None:
        """Take further samples.

        Parameters
        ----------
        states, errors
            Of the run, and what they are estimated to be off, shapes (m, 2n).
        event_errors
            Errors of the times of events, as parts of the span, shape (m,).
        """
        sizes = np.abs(states[:, : self._n])
        rows = np.concatenate([errors, motion(self._start, states), sizes], axis=1)
        np.maximum.accumulate(rows, axis=0, out=rows)
        self._take(np.maximum(rows, self._largest), len(states), event_errors)

    def add_by_last(self, samples: int, compare: Callable[[Array], None]) -> bool:
        """Take so many further samples if the last one holds the accuracy: none before it matters.

        ``compare`` brings the largest errors, motions and speeds, and sizes of coordinates up to
        date, shape (2·2n + n,). False where the last sample does not hold; then nothing is taken.
        """
        largest = self._largest.copy()
        compare(largest)
        return self._take(largest[None], samples, np.zeros(1))

    def _take(self, rows: Array, samples: int, event_errors: Array) -> bool:
        """Take samples by what is largest up to each, or up to the last if that one holds."""
        n, size, largest = self._n, self._size, rows[-1].copy()
        errors, moved, sizes = np.split(rows, [size, 2 * size], axis=1)
        errors[:, :n] = np.maximum(errors[:, :n], FLOOR_ULPS * ulps(sizes))
        scales = scales_from(self._problem, moved)
        each = errors / scales
        ratios = np.maximum(each.max(axis=1), event_errors)
        if not self._seen and len(rows) == samples:
            ratios[0] = 0.0  # the start is given
        good = np.flatnonzero(ratios < self._eps)
        if len(rows) < samples and not len(good):
            return False
        self._largest, before = largest, self._seen + samples - len(rows)
        self._seen += samples
        newest = float(ratios[-1] / self._eps), each[-1], scales[-1].copy()
        if len(good):
            at = int(good[-1])
            last_holding = before + at + 1, float(ratios[at]), scales[at]
        else:
            earlier = self.estimate
            last_holding = earlier.samples, earlier.estimate, earlier.scales
        self._estimate = ErrorEstimate(*last_holding, *newest)
        return True

    @property
    def estimate(self) -> ErrorEstimate:
        assert self._estimate is not None
        return self._estimate


def error_estimate(
    problem: InitialValueProblem, eps: float, states: Array, errors: Array, event_errors: Array
) -> ErrorEstimate:
    """Estimate the error of all samples of a run at once."""
    estimate_so_far = RunningEstimate(problem, eps, states[0])
    estimate_so_far.add(states, errors, event_errors)
    return estimate_so_far.estimate
