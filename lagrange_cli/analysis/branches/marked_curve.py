"""A branch as points with marks: marks are put on it, and it is cut where nothing is proven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.analysis.branches.curve import CurvePoint, Space
from lagrange_cli.analysis.branches.singular_points import Located
from lagrange_cli.analysis.values import Matrix

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import EndKind, MarkKind

#: Distance, in scaled unknowns, of points that are one.
SAME = 1e-7
#: Length, in scaled unknowns, of parts of branches beside a singular point that are left out.
_SHORT = 1e-4
#: Rounding of doubles, a few times.
_ROUNDING = 1e-15


@dataclass
class Mark:
    """A marked point; ``frequency`` is that of flutter."""

    kind: MarkKind
    at: Located
    frequency: float | None = None

    @property
    def y(self) -> Matrix:
        """The point in doubles."""
        return np.array([float(x) for x in self.at.y])


@dataclass
class Traced:
    """A branch: its points, and its marks as pairs of an index of a point and a mark."""

    points: list[CurvePoint]
    ends: tuple[EndKind, EndKind]
    marks: list[tuple[int, Mark]] = field(default_factory=list)

    @property
    def is_closed(self) -> bool:
        return self.ends[1] == "closed"


@dataclass(frozen=True)
class Cut:
    """The points next to a place where a branch ends on both sides, and the reason."""

    points: tuple[CurvePoint, CurvePoint]
    end: EndKind


def cut_apart(space: Space, branch: Traced, cuts: Sequence[tuple[int, Cut]]) -> list[Traced]:
    """Return the parts of a branch between cuts, but for those that are too short to be seen.

    ``cuts``: numbers of the points before them, in their order.
    """
    if not cuts:
        return [branch]
    parts: list[Traced] = []
    start, begins = 0, branch.ends[0]
    points, marks = [branch.points[0]], [(0, m) for n, m in branch.marks if not n]
    for k, cut in [*cuts, (len(branch.points) - 1, None)]:
        shift = len(points) - start - 1
        points = [*points, *branch.points[start + 1 : k + 1]]
        marks += [(n + shift, m) for n, m in branch.marks if start < n <= k]
        if cut is None:
            parts.append(Traced(points, (begins, branch.ends[1]), marks))
            break
        parts.append(Traced([*points, cut.points[0]], (begins, cut.end), marks))
        start, begins, points, marks = k, cut.end, [cut.points[1]], []
    if branch.is_closed:
        head, last = parts.pop(0), parts.pop()
        shift = len(last.points) - 1
        moved = [(n + shift, m) for n, m in head.marks if n]
        whole = [*last.points, *head.points[1:]]
        parts.append(Traced(whole, (last.ends[0], head.ends[1]), [*last.marks, *moved]))
    return [part for part in parts if _length(space, part.points) > _SHORT]


def within_range(space: Space, branch: Traced, low: float, high: float) -> list[Traced]:
    """Return the parts of a branch whose parameter is in a range; they end where that ends."""
    _divide_at_ends(space, branch, low, high)
    inside = [low <= p.y[-1] <= high for p in branch.points]
    if all(inside):
        return [branch]
    if branch.is_closed:
        _begin_at(branch, inside.index(False))
        inside = [low <= p.y[-1] <= high for p in branch.points]
    parts: list[Traced] = []
    last = len(inside) - 1
    for is_inside, run in groupby(range(last + 1), inside.__getitem__):
        numbers = list(run)
        first, end = numbers[0], numbers[-1]
        if not is_inside or first == end:
            continue
        ends = (
            branch.ends[0] if first == 0 else "range",
            branch.ends[1] if end == last else "range",
        )
        marks = [(n - first, m) for n, m in branch.marks if first <= n <= end]
        parts.append(Traced(branch.points[first : end + 1], ends, marks))
    return parts


def _divide_at_ends(space: Space, branch: Traced, low: float, high: float) -> None:
    """Put points on a branch where its parameter passes an end of a range.

    A mark whose value is an end, as far as that is known, is taken to be there.
    """
    for k, mark in branch.marks:
        room = mark.at.error * (space.high - space.low) + _ROUNDING * abs(branch.points[k].y[-1])
        for end in (low, high):
            if abs(branch.points[k].y[-1] - end) <= room:
                branch.points[k].y[-1] = end
    for k in range(len(branch.points) - 2, -1, -1):
        here, after = branch.points[k], branch.points[k + 1]
        for end in (low, high):
            start, width = here.y[-1] - end, after.y[-1] - here.y[-1]
            if start * (after.y[-1] - end) < 0:
                y = space.landed(here.y - start / width * (after.y - here.y), end)
                if y is not None:
                    y[-1] = end
                    branch.points.insert(k + 1, CurvePoint(y, here.tangent, here.turn))
                    branch.marks = [(n + (n > k), m) for n, m in branch.marks]
                    break


def _begin_at(branch: Traced, first: int) -> None:
    """Let a closed branch begin at another of its points."""
    last = len(branch.points) - 1
    branch.points[:] = [*branch.points[first:], *branch.points[1 : first + 1]]
    branch.marks = sorted(
        {((n - first) % last, id(m)): ((n - first) % last, m) for n, m in branch.marks}.values(),
        key=lambda pair: pair[0],
    )


def _length(space: Space, points: Sequence[CurvePoint]) -> float:
    pairs = pairwise(points)
    return sum(float(np.linalg.norm(space.difference(b.y, a.y))) for a, b in pairs)


def insert(space: Space, branch: Traced, k: int, mark: Mark) -> None:
    """Put a mark's point behind the k-th one of a branch, or take a neighbour if it is there."""
    for near in (k, k + 1):
        if np.abs(space.difference(branch.points[near].y, mark.y)).max() < SAME:
            branch.marks.append((near, mark))
            return
    here, after = branch.points[k], branch.points[k + 1]
    y = here.y + space.difference(mark.y, here.y) * space.scale
    tangent = here.tangent + after.tangent
    branch.points.insert(k + 1, CurvePoint(y, tangent / np.linalg.norm(tangent), 0.0))
    branch.marks = [(n + (n > k), m) for n, m in branch.marks]
    branch.marks.append((k + 1, mark))
