"""All branches that are reached from some equilibria, with folds and points where branches meet.

A branch is followed both ways from an equilibrium that lies on none yet. Where it meets another
one, that one is followed from there. Each marked point is located in digits.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from mpmath import mpf

from lagrange_cli.analysis.branches.continuation import Way, follow
from lagrange_cli.analysis.branches.curve import CurvePoint, Space
from lagrange_cli.analysis.branches.marked_curve import SAME, Cut, Mark, Traced, cut_apart, insert
from lagrange_cli.analysis.branches.refining import refined
from lagrange_cli.analysis.branches.singular_points import Crossing, Located, crossing_at, fold_at
from lagrange_cli.analysis.values import Matrix

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import EndKind, MarkKind

# Thresholds in scaled unknowns, between the rounding of corrected points and the distances of
# different branches; budgets that bound the time. They are not tuned.

#: Branches that are followed.
MOST_BRANCHES = 32
#: Smallest singular value of J, over the largest, at which a branch is followed.
_REGULAR = 1e-8
#: Distance of a point from a chord, over the chord, of a point that may lie on the branch.
_BESIDE = 0.1
#: Chords that are tried.
_CHORDS = 6
#: Steps along a new branch after which it is compared with others.
_COMPARED = 6
#: First step along a branch from a branch point, and one that shows how the parameter changes.
_OFF, _PROBE = 1e-3, 2e-2
#: Part of a tangent along the parameter that is none.
_STEEP = 1e-6
#: Change of the parameter over its range that is none.
_STILL = 1e-13
#: Cosine of the angle between a branch and its own tangent at a branch point.
_OWN = 0.9
#: Length of an interval, in scaled unknowns, at which bisection ends, and parts at which it divides
#: one, the second where the first is a pole. Beside a pole points in doubles are soon off.
_RESOLVED, _PARTS = 1e-9, (0.5, 0.41)
#: Growth of the logarithm of det J towards a pole.
_GROWN = 5.0
#: Part of a tangent along the parameter whose sign is not known, one at which bisection ends, and
#: rounding of doubles.
_LEVEL, _FLAT, _ROUNDING = 1e-9, 1e-7, 1e-15


_Changed: TypeAlias = Callable[[CurvePoint], bool]
"""Says whether a point is beyond a change of sign."""


@dataclass
class Tracing:
    """Branches that are known so far.

    ``skipped``: number of degenerate equilibria; ``left``: number of equilibria, and of directions
    from branch points, for which the budget was spent.
    """

    space: Space
    branches: list[Traced] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    skipped: int = 0
    left: int = 0
    _waiting: deque[tuple[Mark, Matrix]] = field(default_factory=deque)
    _crossings: dict[tuple[int, int], Crossing | None] = field(default_factory=dict)

    def start_at(self, y: Matrix) -> None:
        """Follow the branch of an equilibrium, and all that meet it, unless it is known."""
        if self.has(y):
            return
        if len(self.branches) >= MOST_BRANCHES:
            self.left += 1
            return
        start = self._regular(y)
        if start is None:
            self.skipped += 1
            return
        self._both_ways(start)
        while self._waiting and len(self.branches) < MOST_BRANCHES:
            self._emanate(*self._waiting.popleft())
        self.left += len(self._waiting)
        self._waiting.clear()

    def _regular(self, y: Matrix) -> CurvePoint | None:
        known = self.space.linearized(y)
        if known is None:
            return None
        sizes = np.linalg.svd(known[1], compute_uv=False)
        if not sizes[-1] > _REGULAR * sizes[0]:
            return None
        along = np.zeros_like(y)
        along[-1] = 1.0
        start = self.space.point(y, along)
        if start is None or abs(start.slope) > _STEEP:
            return start
        # At a fold the sign of the slope, which shows it, is not known.
        for side in (_OFF, -_OFF):
            guess = y + side * start.tangent * self.space.scale
            neighbour = self.space.corrected(guess, start.tangent)
            if neighbour is not None and self.space.low <= neighbour[-1] <= self.space.high:
                return self.space.point(neighbour, start.tangent)
        return start

    def _both_ways(self, start: CurvePoint) -> None:
        forth = follow(self.space, start)
        if forth.end == "closed":
            self._add(Traced(list(forth.points), ("closed", "closed")))
            return
        back = follow(self.space, _reversed(start))
        self._add(_joined(back, forth))

    def _add(self, branch: Traced) -> None:
        if len(branch.points) < 2:
            self.skipped += 1
            return
        self._refine(branch)
        cuts = [
            (k, cut)
            for k in range(len(branch.points) - 1)
            if (cut := self._cut(branch.points[k], branch.points[k + 1])) is not None
        ]
        parts = cut_apart(self.space, branch, cuts)
        self.skipped += not parts
        for part in parts:
            self.branches.append(part)
            marks = self._marks_of(part)
            for k, mark in reversed(marks):
                insert(self.space, part, k, mark)
            part.marks.sort(key=lambda pair: pair[0])
        self._crossings.clear()  # of these points alone

    def _refine(self, branch: Traced) -> None:
        """Add points between those of a branch, separately between its marks."""
        cuts = [0, *(k for k, _ in branch.marks), len(branch.points) - 1]
        parts = [branch.points[a : b + 1] for a, b in pairwise(cuts) if b > a]
        points, places = [branch.points[0]], {0: 0}
        for (_, end), part in zip([p for p in pairwise(cuts) if p[1] > p[0]], parts, strict=True):
            points += refined(self.space, part)[1:]
            places[end] = len(points) - 1
        branch.points[:] = points
        branch.marks[:] = [(places[k], mark) for k, mark in branch.marks]

    # Marks.

    def _marks_of(self, branch: Traced) -> list[tuple[int, Mark]]:
        """Locate the folds and branch points of a branch, each with the point before it."""
        points = branch.points
        crossings = [
            (k, mark)
            for k, (here, after) in enumerate(pairwise(points))
            if (mark := self._crossing(here, after)) is not None
        ]
        marks = list(crossings)
        sloping = [k for k, point in enumerate(points) if abs(point.slope) > _LEVEL]
        for i, j in pairwise(sloping):
            # A pitchfork explains that the parameter turns back.
            passed = [m for k, m in crossings if i <= k < j]
            passed += [m for k, m in branch.marks if i < k < j]
            if points[i].slope * points[j].slope < 0 and all(
                mark.kind == "transcritical" for mark in passed
            ):
                fold = self._fold(points[i], points[j])
                behind = self._place(points[i : j + 1], fold.y)
                marks.append((i + (behind or 0), fold))
        return sorted(marks, key=lambda m: (m[0], self._way(points[m[0]], m[1])))

    def _way(self, origin: CurvePoint, mark: Mark) -> float:
        return float(origin.tangent @ self._gap(mark.y, origin.y))

    def _gap(self, y: Matrix, origin: Matrix) -> Matrix:
        return self.space.difference(y, origin)

    def _crossing(self, here: CurvePoint, after: CurvePoint) -> Mark | None:
        """Locate the branch point between two points with a proof; None if there is none."""
        crossing = self._proven_crossing(here, after)
        if crossing is None:
            return None
        mark = self._known(Mark(self._kind(crossing), crossing.at))
        if crossing.tangents:
            tangent = min(crossing.tangents, key=lambda t: abs(float(t @ here.tangent)))
            self._waiting.append((mark, tangent))
        return mark

    def _proven_crossing(self, here: CurvePoint, after: CurvePoint) -> Crossing | None:
        if here.turn * after.turn >= 0:
            return None
        ends = id(here), id(after)
        if ends not in self._crossings:
            crossing = crossing_at(self.space, _middle(self.space, here, after))
            near = crossing and self._is_inside(crossing.at, here, after)
            self._crossings[ends] = crossing if near else None
        return self._crossings[ends]

    def _cut(self, here: CurvePoint, after: CurvePoint) -> Cut | None:
        """Say where a branch ends between two points at which det J has different signs.

        It does where no branch point is proven: det J passes infinity, or is not known to pass
        zero at one point.
        """
        if here.turn * after.turn >= 0 or self._proven_crossing(here, after) is not None:
            return None
        near = self._bisected(here, after, lambda p: p.turn * here.turn < 0)
        far = max(map(self._determinant, (here, after)))
        is_pole = min(map(self._determinant, near)) > far + _GROWN
        return Cut(near, "pole" if is_pole else "stuck")

    def _determinant(self, point: CurvePoint) -> float:
        """Return the logarithm of the size of det [J; tangent]."""
        known = self.space.linearized(point.y)
        return -np.inf if known is None else float(_bordered(known[1], point.tangent)[1])

    def _known(self, mark: Mark) -> Mark:
        """Return the mark already located at this point, else this one."""
        for earlier in self.marks:
            if np.abs(self._gap(mark.y, earlier.y)).max() < SAME:
                return earlier
        self.marks.append(mark)
        return mark

    def _kind(self, crossing: Crossing) -> MarkKind:
        """Name a branch point by how the parameter changes on both branches."""
        steep = [t for t in crossing.tangents if t[-1] == 0.0]
        if len(crossing.tangents) < 2 or len(steep) == 2:
            return "branch point"
        if not steep:
            return "transcritical"
        y = _doubles(crossing.at)
        probe = self.space.corrected(y + _PROBE * steep[0] * self.space.scale, steep[0])
        moved = probe is None or abs(probe[-1] - y[-1]) > _STILL * self.space.scale[-1]
        return "pitchfork" if moved else "branch point"

    def _fold(self, here: CurvePoint, after: CurvePoint) -> Mark:
        weight = here.slope / (here.slope - after.slope)
        guess = here.y + weight * (after.y - here.y)
        tangent = (1 - weight) * here.tangent + weight * after.tangent
        at = fold_at(self.space, guess, tangent)
        if at is None or not self._is_inside(at, here, after):
            at = self._turning(here, after)
        return self._known(Mark("fold", at))

    def _turning(self, here: CurvePoint, after: CurvePoint) -> Located:
        """Return a point near which the parameter turns back.

        Its error is what the parameter changes by at most along an interval at whose ends the sign
        of the slope is known.
        """

        def changed(point: CurvePoint) -> bool:
            return point.slope * here.slope < 0

        wide = self._bisected(here, after, changed, _FLAT)
        near = self._bisected(*wide, changed)
        middle = (near[0].y + near[1].y) / 2
        gap = float(np.linalg.norm(self._gap(wide[1].y, wide[0].y)))
        error = 2 * gap * max(abs(point.slope) for point in wide)
        sizes = self.space.scale / np.maximum(1.0, np.abs(middle))
        radius = gap * float(sizes[:-1].max())
        return Located(tuple(map(mpf, middle.tolist())), max(error, _ROUNDING), radius)

    def _is_inside(self, at: Located, here: CurvePoint, after: CurvePoint) -> bool:
        length = np.abs(self._gap(after.y, here.y)).max()
        gaps = (np.abs(self._gap(_doubles(at), p.y)).max() for p in (here, after))
        return bool(max(gaps) < 1.5 * length)

    def _bisected(
        self, here: CurvePoint, after: CurvePoint, changed: _Changed, least_slope: float = 0.0
    ) -> tuple[CurvePoint, CurvePoint]:
        """Bisect an interval to the change of a sign, as far as points can be corrected.

        It ends where the parameter's part of the tangent is below ``least_slope``.
        """
        while float(np.abs(self._gap(after.y, here.y)).max()) > _RESOLVED:
            tried = (self._at(here, after, part) for part in _PARTS)
            point = next((p for p in tried if p is not None), None)
            if point is None or abs(point.slope) <= least_slope:
                break
            here, after = (here, point) if changed(point) else (point, after)
        return here, after

    def _at(self, here: CurvePoint, after: CurvePoint, part: float) -> CurvePoint | None:
        guess = here.y + part * (after.y - here.y)
        y = self.space.corrected(guess, here.tangent)
        return None if y is None else self.space.point(y, here.tangent)

    # Other branches.

    def _emanate(self, mark: Mark, tangent: Matrix) -> None:
        """Follow a branch from a branch point, both ways, unless it is known."""
        ways: list[Way] = []
        for sign in (1.0, -1.0):
            start = self._off(mark, sign * tangent)
            if start is None or self.has(follow(self.space, start, most=_COMPARED).points[-1].y):
                continue
            way = follow(self.space, start)
            if way.end == "closed":
                self._add(Traced(list(way.points), ("closed", "closed")))
                return
            ways.append(Way((CurvePoint(mark.y, sign * tangent, 0.0), *way.points), way.end))
        if len(ways) == 2:
            branch = _joined(ways[1], ways[0])
            branch.marks.append((len(ways[1].points) - 1, mark))
            self._add(branch)
        elif ways:
            ends: tuple[EndKind, EndKind] = ("branch point", ways[0].end)
            self._add(Traced(list(ways[0].points), ends, [(0, mark)]))

    def _off(self, mark: Mark, tangent: Matrix) -> CurvePoint | None:
        """Find a point of the branch beside a branch point."""
        for length in (_OFF, 10 * _OFF, _OFF / 10):
            y = self.space.corrected(mark.y + length * tangent * self.space.scale, tangent)
            if y is None or not self.space.allows(y):
                continue
            if not self.space.low <= y[-1] <= self.space.high:
                return None
            point = self.space.point(y, tangent)
            if point is not None and point.tangent @ tangent > _OWN:
                return point
        return None

    def finish(self) -> None:
        """Put marks on all branches that they lie on.

        The sign of det J does not show where an even number of eigenvalues vanishes at once.
        """
        for branch in self.branches:
            present = {id(mark) for _, mark in branch.marks}
            for mark in self.marks:
                place = None if id(mark) in present else self._place(branch.points, mark.y)
                if place is not None:
                    insert(self.space, branch, place, mark)
            branch.marks.sort(key=lambda pair: pair[0])

    def at(self, branch: Traced, value: float) -> list[Matrix]:
        """Find the points of a branch at a value of the parameter."""
        points = []
        for here, after in pairwise(branch.points):
            start, width = here.y[-1], after.y[-1] - here.y[-1]
            if width and 0 <= (value - start) / width <= 1:
                part = (value - start) / width
                y = self.space.landed(here.y + part * (after.y - here.y), value)
                points += [] if y is None else [y]
        return points

    def has(self, y: Matrix) -> bool:
        """Say whether a point lies on a branch that is known."""
        return any(self._place(branch.points, y) is not None for branch in self.branches)

    def _place(self, points: Sequence[CurvePoint], y: Matrix) -> int | None:
        """Return the number of the point behind which another one lies; None if it does not."""
        table = np.array([p.y for p in points])
        gaps = np.array([self._gap(row, y) for row in table])
        distances = np.linalg.norm(gaps, axis=1)
        nearest: list[int] = np.argsort(distances)[:_CHORDS].tolist()
        for k in nearest:
            for first, second in ((k - 1, k), (k, k + 1)):
                if first < 0 or second >= len(points):
                    continue
                if self._is_between(points[first], points[second], gaps[first], y):
                    return first
        return None

    def _is_between(self, first: CurvePoint, second: CurvePoint, gap: Matrix, y: Matrix) -> bool:
        """Say whether a point lies on the curve between two neighbours.

        ``gap``: scaled difference of the first one and the point.
        """
        chord = (second.y - first.y) / self.space.scale
        length = float(np.linalg.norm(chord))
        if length == 0.0:
            return float(np.abs(gap).max()) < SAME
        part = -(gap @ chord) / length**2
        if not -0.5 <= part <= 1.5:
            return False
        offset = gap + part * chord
        if float(np.linalg.norm(offset)) > _BESIDE * length + SAME:
            return False
        there = self.space.corrected(first.y + part * (second.y - first.y), chord / length)
        if there is None:
            return float(np.linalg.norm(offset)) < SAME
        return float(np.abs(self._gap(there, y)).max()) < SAME


def _middle(space: Space, here: CurvePoint, after: CurvePoint) -> Matrix:
    return np.asarray((here.y + after.y) / 2)


def _doubles(at: Located) -> Matrix:
    return np.array([float(x) for x in at.y])


def _reversed(point: CurvePoint) -> CurvePoint:
    return CurvePoint(point.y, -point.tangent, -point.turn)


def _joined(back: Way, forth: Way) -> Traced:
    """Join two ways from one point to a branch that begins where the first one ends."""
    points = [*map(_reversed, reversed(back.points[1:])), *forth.points]
    return Traced(points, (back.end, forth.end))


def _bordered(slopes: Matrix, tangent: Matrix) -> tuple[float, float]:
    """Return the sign of det [J; tangent] and the logarithm of its size."""
    sign, size = np.linalg.slogdet(np.vstack([slopes, tangent]))
    return float(sign), float(size)
