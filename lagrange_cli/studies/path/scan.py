"""Paths of one degree of freedom up to an energy: where a motion ends, over how it begins.

With one coordinate the end of a motion is a function of its initial velocity alone, whose
derivative is the Jacobi field. Motions are shot until cubics through values and derivatives
foretell those between them; the roots of the distance from an end are brackets of sign changes, and
extremes that nearly touch zero.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.motions import Motions

#: Velocities that are looked at, over scale times the largest rate of change of forces.
_REACH = 4.0

#: Motions that are shot first, and at most.
_FIRST, _MOST = 65, 3000

#: Accuracy of motions, and distance from the foretold end, over the scale, that is resolved.
_ROUGH, _RESOLVED = 1e-6, 0.03

#: Least width of an interval, over the reach: one so narrow counts as not resolved.
_LEAST_WIDTH = 1e-10

#: Halvings of a bracket, after which Newton's method goes on.
_HALVINGS = 12


@dataclass(frozen=True)
class Ending:
    """The end of a motion: its initial velocity, its position, and the derivative of the latter."""

    v: float
    q: float
    slope: float


@dataclass(frozen=True)
class Scan:
    """The ends of motions with initial velocities from −reach to reach.

    Attributes
    ----------
    reach
        The largest initial velocity.
    energy
        Σ q̇ ∂L/∂q̇ − L with it.
    count
        Number of motions.
    is_resolved
        True if the ends between neighbouring motions are foretold by cubics.
    intervals
        Neighbouring motions.
    """

    reach: float
    energy: float
    count: int
    is_resolved: bool
    intervals: tuple[tuple[Ending, Ending], ...]


def scan(motions: Motions, first: End, last: End, scale: float) -> Scan | None:
    """Shoot motions of one degree of freedom until the ends are a known function of the start.

    None with more coordinates, or where no motion comes to the end.
    """
    if motions.size != 1:
        return None
    reach = _reach(motions, first, last, scale)
    shooter = _Shooter(motions, first, last, scale, reach)
    endings = [shooter.ending(v) for v in np.linspace(-reach, reach, _FIRST).tolist()]
    known = [e for e in endings if e is not None]
    resolved = len(known) == len(endings)
    intervals: list[tuple[Ending, Ending]] = []
    waiting = list(itertools.pairwise(known))[::-1]
    while waiting:
        a, b = waiting.pop()
        middle = None if shooter.count >= _MOST else shooter.ending((a.v + b.v) / 2)
        foretold = (a.q + b.q) / 2 + (b.v - a.v) * (a.slope - b.slope) / 8
        if middle is None or b.v - a.v < _LEAST_WIDTH * reach:
            resolved = False
            intervals.append((a, b))
        elif abs(middle.q - foretold) <= _RESOLVED * scale:
            intervals += [(a, middle), (middle, b)]
        else:
            waiting += [(middle, b), (a, middle)]
    if not intervals:
        return None
    edge = np.array([[reach]])
    at = motions.action_values(np.array([first.t]), first.q[None], edge)
    energy = float(at.momenta[0, 0] * reach - at.lagrangian[0])
    return Scan(reach, energy, shooter.count, resolved, tuple(intervals))


def scanned(motions: Motions, first: End, last: End, whole: Scan, scale: float) -> Iterator[Array]:
    """Yield initial velocities near which a motion comes to an end, in ascending order."""
    shooter, goal = _Shooter(motions, first, last, scale, whole.reach), float(last.q[0])
    for a, b in whole.intervals:
        if (a.q - goal) * (b.q - goal) <= 0:
            yield np.array([_bisected(shooter, a, b, goal)])
        elif a.slope * b.slope < 0:
            # The extreme of the cubic; one that nearly touches may be two roots, or one double.
            part = a.slope / (a.slope - b.slope)
            extreme = shooter.ending(a.v + part * (b.v - a.v))
            if extreme is None or (extreme.q - goal) * (a.q - goal) > (_RESOLVED * scale) ** 2:
                continue
            yield np.array([_bisected(shooter, a, extreme, goal)])
            yield np.array([_bisected(shooter, extreme, b, goal)])


def _reach(motions: Motions, first: End, last: End, scale: float) -> float:
    """Return a velocity well above that of oscillations of the size of the ends."""
    span = last.t - first.t
    q = np.array([first.q, (first.q + last.q) / 2, last.q])
    t = first.t + span * np.array([0, 0.5, 1])
    stiffness, _ = motions.slopes(t, q, np.zeros_like(q))
    rate = math.sqrt(float(np.max(np.abs(np.nan_to_num(stiffness)))))
    mean = abs(float(last.q[0] - first.q[0])) / span
    return _REACH * max(scale * rate, mean, scale / span)


@dataclass
class _Shooter:
    motions: Motions
    first: End
    last: End
    scale: float
    reach: float
    count: int = 0

    def ending(self, v: float) -> Ending | None:
        """Shoot one motion; None if it does not come to the time of the end."""
        self.count += 1
        times = np.array([self.first.t, self.last.t])
        shot = self.motions.shot(times, self.first.q, np.array([v]), _ROUGH)
        if shot is None:
            return None
        return Ending(v, float(shot.q[-1, 0]), float(shot.fields[-1, 0, 0]))


def _bisected(shooter: _Shooter, a: Ending, b: Ending, goal: float) -> float:
    """Halve a bracket a few times; without a sign change its better end is returned."""
    if (a.q - goal) * (b.q - goal) > 0:
        return min(a, b, key=lambda e: abs(e.q - goal)).v
    for _ in range(_HALVINGS):
        middle = shooter.ending((a.v + b.v) / 2)
        if middle is None:
            break
        if (a.q - goal) * (middle.q - goal) <= 0:
            b = middle
        else:
            a = middle
    slope = (b.q - a.q) / (b.v - a.v) if b.v > a.v else 0.0
    return a.v + (goal - a.q) / slope if slope else a.v
