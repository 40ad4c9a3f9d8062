"""A branch as points with marks: marks are put on it, and it is cut where nothing is proven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
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
