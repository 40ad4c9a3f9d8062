"""Estimated errors of the samples of a run, compared with the accuracy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.runs.problem import (
    InitialValueProblem,
    RunningLargest,
    RunningScales,
    largest_in_all,
    largest_so_far,
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
        n = len(problem.kinds)
        self._eps, self._n, self._seen = eps, n, 0
        self._scales = RunningScales(problem, start)
        self._worst, self._size = np.zeros(2 * n), np.zeros(n)
        self._estimate: ErrorEstimate | None = None

    def add(self, states: Array, errors: Array, beside: Array) -> None:
        """Take further samples.

        Parameters
        ----------
        states, errors
            Of the run, and what they are estimated to be off, shapes (m, 2n).
        beside
            What is estimated besides, over its scale, shape (m,).
        """
        # Where the last sample holds the accuracy, none before it matters.
        for largest in (largest_in_all, largest_so_far):
            each, scales, reached = self._relative(states, errors, largest)
            ratios = np.maximum(each.max(axis=1), beside[-len(each) :])
            if not self._seen and len(each) == len(states):
                ratios[0] = 0.0  # the start is given
            good = np.flatnonzero(ratios < self._eps)
            if len(good):
                break
        self._worst, self._size, moved = reached
        self._scales.advance(moved)
        newest = float(ratios[-1] / self._eps), each[-1], scales[-1].copy()
        self._seen += len(states)
        if len(good):
            at = int(good[-1])
            kept = self._seen - len(each) + at + 1, float(ratios[at]), scales[at]
        else:
            before = self.estimate
            kept = before.samples, before.estimate, before.scales
        self._estimate = ErrorEstimate(*kept, *newest)

    def _relative(
        self, states: Array, errors: Array, largest: RunningLargest
    ) -> tuple[Array, Array, tuple[Array, Array, Array]]:
        """Return errors over scales, and scales, at the rows of ``largest``, shapes (m, 2n), and
        the largest errors, coordinates and motion up to the last."""
        n = self._n
        errors = largest(self._worst, errors)
        sizes = largest(self._size, np.abs(states[:, :n]))
        worst = errors[-1].copy()
        errors[:, :n] = np.maximum(errors[:, :n], FLOOR_ULPS * ulps(sizes))
        scales, moved = self._scales.with_further(states, largest)
        return errors / scales, scales, (worst, sizes[-1], moved)

    @property
    def estimate(self) -> ErrorEstimate:
        assert self._estimate is not None
        return self._estimate


def error_estimate(
    problem: InitialValueProblem, eps: float, states: Array, errors: Array, beside: Array
) -> ErrorEstimate:
    """Estimate the error of all samples of a run at once."""
    estimate_so_far = RunningEstimate(problem, eps, states[0])
    estimate_so_far.add(states, errors, beside)
    return estimate_so_far.estimate
