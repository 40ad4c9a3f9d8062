"""Pseudo-arclength continuation of a branch from one of its points.

Steps go along the tangent and are corrected in the hyperplane across it (H. B. Keller,
Applications of Bifurcation Theory, 1977; W. Govaerts, Numerical Methods for Bifurcations of
Dynamical Equilibria, 2000, ch. 2). A step counts if corrections contract, the tangent turns by
little, and the step back arrives where it began; else it is made again at half its length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.analysis.branches.curve import CurvePoint, Space
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import EndKind
    from lagrange_cli.analysis.values import Matrix

# Step control: shorter steps and smaller angles cost time, longer ones may change to another
# branch that passes near. The values are cautious, not tuned; each step is checked by its way back.

#: Longest step along the parameter as a part of its range, and along the others in their scales.
_ALONG, _ACROSS = 0.02, 0.1
#: First and shortest step.
_FIRST, _SHORTEST = 5e-3, 1e-9
#: Cosines of the largest angle between neighbouring tangents, and of one that lets steps grow.
_LARGEST_TURN, _SMALL_TURN = np.cos(0.2), np.cos(0.06)
#: Growth of steps.
_GROWTH = 1.5
#: Steps that leap over a branch point, at which corrections are not determined.
_LEAPS = (0.08, 0.04, 0.02, 0.01, 5e-3, 2e-3, 1e-3)
#: Length of a step below which a leap is tried.
_STUCK = 1e-5
#: Difference of a step there and back, in scaled unknowns.
_BACK = 1e-7
#: Scaled size of unknowns that leave every bound.
_FAR = 1e3
#: Points of a branch in one direction.
MOST_POINTS = 2000


@dataclass(frozen=True)
class Way:
    """Points of a branch in one direction, the first being where it began, and how it ends."""

    points: tuple[CurvePoint, ...]
    end: EndKind


def follow(space: Space, start: CurvePoint, most: int = MOST_POINTS) -> Way:
    """Follow a branch from a point in the direction of its tangent, for ``most`` points."""
    points, step = [start], _FIRST
    while len(points) < most:
        here = points[-1]
        announce(f"following a branch at {here.y[-1]:.6g}")
        step = min(step, _longest(space, here))
        after = _stepped(space, here, step)
        if after is None:
            step /= 2
            after = _leapt(space, here) if step < _STUCK else None
            if after is None:
                if step < _SHORTEST:
                    return Way(tuple(points), _stuck(space, points))
                continue
            step = _FIRST
        if not space.low <= after.y[-1] <= space.high:
            last = _at_range(space, here, after)
            if last is None:
                step /= 2
                if step < _SHORTEST:
                    return Way(tuple(points), "stuck")
                continue
            # A branch may begin where the range ends.
            arrived = np.array_equal(last.y, here.y)
            return Way(tuple(points) if arrived else (*points, last), "range")
        if closed := _closed(space, points, after):
            return Way((*points, closed), "closed")
        points.append(after)
        if float(np.abs(after.y / space.scale)[:-1].max(initial=0.0)) > _FAR:
            return Way(tuple(points), "far")
        if here.tangent @ after.tangent > _SMALL_TURN:
            step *= _GROWTH
    return Way(tuple(points), "budget")


def _longest(space: Space, here: CurvePoint) -> float:
    """Bound a step by what it changes of the parameter and of the others."""
    size = float(np.abs(here.y / space.scale)[:-1].max(initial=0.0))
    along = abs(here.slope) + 1e-3
    return min(_ALONG / along, _ACROSS * max(1.0, size))


def _stepped(space: Space, here: CurvePoint, step: float) -> CurvePoint | None:
    """Make one step; None if it may have left the branch."""
    guess = here.y + step * here.tangent * space.scale
    y = space.corrected(guess, here.tangent)
    if y is None or not space.allows(y):
        return None
    after = space.point(y, here.tangent)
    if after is None or after.tangent @ here.tangent < _LARGEST_TURN:
        return None
    return after if _comes_back(space, here, after) else None


def _comes_back(space: Space, here: CurvePoint, after: CurvePoint) -> bool:
    """Say whether the step back along the new tangent arrives where the step began."""
    length = float(after.tangent @ ((after.y - here.y) / space.scale))
    guess = after.y - length * after.tangent * space.scale
    y = space.approached(guess, after.tangent)
    if y is None:
        return False
    gap = np.abs((y - here.y) / space.scale).max()
    return bool(gap <= _BACK * max(1.0, float(np.abs(y / space.scale).max())))


def _leapt(space: Space, here: CurvePoint) -> CurvePoint | None:
    """Leap over a branch point, to where corrections are determined again."""
    for length in _LEAPS:
        after = _stepped(space, here, length)
        if after is not None:
            return after
    return None


def _at_range(space: Space, here: CurvePoint, after: CurvePoint) -> CurvePoint | None:
    """Find the point between two others at which the branch meets the end of the range."""
    bound = space.low if after.y[-1] < space.low else space.high
    width = after.y[-1] - here.y[-1]
    part = (bound - here.y[-1]) / width
    y = space.landed(here.y + part * (after.y - here.y), bound)
    if y is None or not space.allows(y):
        return None
    y[-1] = bound
    last = space.point(y, here.tangent)
    if last is None or last.tangent @ here.tangent < _LARGEST_TURN:
        return None
    far = (
        np.abs((y - here.y) / space.scale).max()
        > 2 * np.abs((after.y - here.y) / space.scale).max()
    )
    return None if far else last


def _closed(space: Space, points: list[CurvePoint], after: CurvePoint) -> CurvePoint | None:
    """Return the first point again, perhaps turns away, if the branch has come back to it."""
    if len(points) < 4:
        return None
    start, here = points[0], points[-1]
    before = space.difference(here.y, start.y)
    beyond = space.difference(after.y, start.y)
    step = float(np.abs((after.y - here.y) / space.scale).max())
    passes = start.tangent @ before < 0 <= start.tangent @ beyond
    if not passes or float(np.abs(beyond).max()) > 2 * step or start.tangent @ after.tangent < 0.5:
        return None
    there = after.y - beyond * space.scale
    part = -(start.tangent @ before) / (start.tangent @ (beyond - before))
    y = space.corrected(here.y + part * (after.y - here.y), start.tangent)
    if y is None or float(np.abs((y - there) / space.scale).max()) > _BACK:
        return None
    return CurvePoint(there, start.tangent, start.turn)


def _stuck(space: Space, points: list[CurvePoint]) -> EndKind:
    """Say why a branch cannot be followed: singular where nothing is finite beyond, or stuck."""
    here = points[-1]
    beyond: Matrix = here.y + 10 * _STUCK * here.tangent * space.scale
    if space.linearized(beyond) is None or not space.allows(beyond):
        return "singular"
    return "stuck"
