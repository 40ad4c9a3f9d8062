"""Runs of several members with their estimates, and those that are decided."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

_Integers: TypeAlias = NDArray[np.int64]
Indices: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True)
class BatchedRuns:
    """Runs of some members in lanes of vectors.

    Attributes
    ----------
    numbers
        Numbers of the members, shape (m,).
    states
        States at the samples, shape (m, samples, 2n).
    scales
        Scales of the states, shape (m, 2n).
    estimate
        Estimated errors, relative to scales, shape (m,); infinite before a companion.
    steps, evaluations
        Steps and right-hand sides of the runs; a coefficient of the slope counts as one.
    all_evaluations
        Right-hand sides of the runs and their companions.
    companions
        States of the companions if an accuracy is promised, each shaped as ``states``.
    """

    numbers: Indices
    states: Array
    scales: Array
    estimate: Array
    steps: _Integers
    evaluations: _Integers
    all_evaluations: _Integers
    companions: tuple[Array, ...] = ()

    def only(self, which: Indices) -> BatchedRuns:
        """Return some of them; all of them are not copied."""
        return self if len(which) == len(self.numbers) else self._some(which)

    def decided(self, eps: float) -> BatchedRuns:
        """Return the runs whose estimate is below an accuracy, without companions."""
        return replace(self, companions=()).only(np.flatnonzero(self.estimate < eps))

    def undecided(self, eps: float) -> BatchedRuns:
        """Return the runs whose estimate is finite, but not below an accuracy."""
        return self.only(np.flatnonzero((self.estimate >= eps) & np.isfinite(self.estimate)))

    def in_turn(self, count: int) -> Iterator[BatchedRuns]:
        """Yield ``count`` of them at a time, not copied."""
        for first in range(0, len(self.numbers), count):
            yield self._some(slice(first, first + count))

    def _some(self, which: Indices | slice) -> BatchedRuns:
        return BatchedRuns(
            self.numbers[which],
            self.states[which],
            self.scales[which],
            self.estimate[which],
            self.steps[which],
            self.evaluations[which],
            self.all_evaluations[which],
            tuple(companion[which] for companion in self.companions),
        )
