"""Numbers of parts into which the time between samples is divided."""

from __future__ import annotations

from typing import NamedTuple

from lagrange_cli.simulate.request import Request

#: Largest number of parts in all.
FINEST = 2**17


class SampleGrid(NamedTuple):
    """Times between samples that are asked for, and steps of fixed size in each (0: adaptive)."""

    intervals: int
    steps: int

    def finer(self, every: int, wanted: int) -> int:
        """Return a multiple of ``every`` that makes as many parts as wanted, if steps are free."""
        return every if self.steps else every * -(-self.every(wanted) // every)

    def every(self, wanted: int) -> int:
        """Return the parts of each interval that make so many in all, or as many as possible."""
        parts = max(1, -(-min(wanted, FINEST) // self.intervals))
        if not self.steps:
            return parts
        most = min(parts, self.steps)
        possible = (k for k in range(most, self.steps + 1) if self.steps % k == 0)
        return next(possible)


def grid_of(request: Request) -> SampleGrid:
    """Return the grid of the times that are asked for."""
    steps = (
        0 if request.step is None else round((request.times[1] - request.times[0]) / request.step)
    )
    return SampleGrid(len(request.times) - 1, steps)
