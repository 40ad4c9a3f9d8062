"""Pareto front of work and precision, and the run to recommend."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

_Run = TypeVar("_Run")

#: Runs whose seconds differ by less than this part are equally fast; set by hand.
_EQUALLY_FAST = 0.1


def pareto(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Tell for each point (error, cost) if it is on the front.

    It is if no other point is better in one of the two without being worse in the other. Equal
    points are on the front together; infinite ones are not on it.
    """
    order = sorted((p, k) for k, p in enumerate(points) if all(map(math.isfinite, p)))
    front = [False] * len(points)
    least, last = math.inf, None
    for point, k in order:
        if point[1] < least or point == last:
            front[k], least, last = True, point[1], point
    return front


def cost_ratio(error: float, cost: float, points: Iterable[tuple[float, float]]) -> float | None:
    """Cost relative to the cheapest point with error ≤ ``error``; None if there is none."""
    good = [c for e, c in points if e <= error]
    return None if not good else cost / min(good)


def cheapest(
    runs: Sequence[_Run], seconds: Callable[[_Run], float], evaluations: Callable[[_Run], int]
) -> _Run | None:
    """Return the run of least work among those that are as fast as the fastest but for chance."""
    if not runs:
        return None
    least = min(seconds(run) for run in runs)
    close = [run for run in runs if seconds(run) <= (1 + _EQUALLY_FAST) * least]
    return min(close, key=lambda run: (evaluations(run), seconds(run)))
