"""Speed against accuracy of one scene as a value, with its tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from lagrange_cli.drawn import Drawn, Reported
from lagrange_cli.studies.reference import Reference
from lagrange_cli.studies.tradeoff.runs import ACCURACIES, WorkPrecisionPoint


@dataclass(frozen=True)
class Recommendation:
    """The run to take for an accuracy."""

    accuracy: float
    point: WorkPrecisionPoint


@dataclass(frozen=True)
class CostRatios:
    """Costs of a run of ``auto`` relative to the cheapest runs; None if there is none as good.

    Attributes
    ----------
    point
        The run of ``auto``.
    seconds, evaluations
        Relative to the cheapest run that is as accurate as this one turned out.
    seconds_needed, evaluations_needed
        Relative to the cheapest run with the accuracy that was asked for.
    """

    point: WorkPrecisionPoint
    seconds: float | None = None
    evaluations: float | None = None
    seconds_needed: float | None = None
    evaluations_needed: float | None = None


@dataclass(frozen=True, repr=False)
class Trade(Drawn, Reported):
    """Speed against accuracy of one scene.

    Attributes
    ----------
    name
        Name of the scene.
    until
        Time of the last sample.
    samples
        Number of samples.
    formulation
        Minimal or multiplier form.
    implementation
        The code that ran, in words.
    stiff
        True if the coarse run found the system stiff.
    reference
        The solution that errors are measured from.
    points
        Runs of methods.
    automatic
        Runs of ``auto``.
    left_out
        Method that cannot run here, or is too slow → the reason.
    repeat
        Largest number of times that a run was timed.
    budget
        Seconds after which a run was given up.
    """

    name: str
    until: float
    samples: int
    formulation: str
    implementation: str
    stiff: bool
    reference: Reference
    points: tuple[WorkPrecisionPoint, ...]
    automatic: tuple[CostRatios, ...]
    left_out: dict[str, str]
    repeat: int
    budget: float

    @property
    def recommended(self) -> tuple[Recommendation, ...]:
        """The fastest run for each accuracy that one reaches, the reference's error added."""
        recommendations = []
        for accuracy in ACCURACIES:
            most = accuracy - self.reference.error
            good = [p for p in self.points if p.distance <= most]
            best = cheapest(good, lambda p: p.median, lambda p: p.evaluations)
            if best is not None:
                recommendations.append(Recommendation(accuracy, best))
        return tuple(recommendations)

    def __repr__(self) -> str:
        counts = f"{len(self.points)} runs, {len(self.recommended)} recommended"
        return f"<Trade of {self.name}: {counts}>"


# The front, and the run to recommend.


_Run = TypeVar("_Run")

#: Runs whose seconds differ by less than this part are equally fast: timings of one run are spread
#: as far. Not tuned.
_EQUALLY_FAST = 0.1


def pareto(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Return for each point (error, cost) if it is on the front.

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
    """Return the cost over that of the cheapest point with error ≤ ``error``, or None."""
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
