"""Stability of the parts of branches, and the points at which it is lost without a fold."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from mpmath import mpf

from lagrange_cli.analysis.branches.curve import CurvePoint, Space
from lagrange_cli.analysis.branches.marked_curve import Mark, Traced, insert
from lagrange_cli.analysis.branches.poles import (
    MOST_STATES,
    Counts,
    CrossingSearch,
    counted,
    equilibrium,
)
from lagrange_cli.analysis.branches.singular_points import Located, proven_point_at
from lagrange_cli.analysis.branches.values import MarkedPoint, Stretch
from lagrange_cli.analysis.linear.linearize import linear_system
from lagrange_cli.analysis.linear.stability import stability
from lagrange_cli.analysis.values import Stability
from lagrange_cli.errors import InputError
from lagrange_cli.phrases import Phrase

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.parameter import Varied
    from lagrange_cli.analysis.branches.values import MarkKind
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.analysis.values import Equilibrium, Matrix, Mpf

_DIFFERENT = Phrase("points of the stretch differ")

#: Halvings of an interval in which the number of unstable poles changes.
_HALVINGS = 14
#: Parts of a stretch at which stability is decided.
_PLACES = (0.37, 0.71)
#: Distance from the ends of a stretch, over the first or last step, at which poles are counted.
_BESIDE = 1e-3
#: Rounding of a double.
_ROUNDING = 2.0**-53

_Counted: TypeAlias = "tuple[Matrix, Counts | None]"
"""A point with the numbers of its poles."""


@dataclass(frozen=True)
class Judge:
    """Decides stability along branches.

    Attributes
    ----------
    system
        The equations of equilibrium.
    varied
        The parameter, and what follows it.
    space
        The same equations as functions of it.
    """

    system: RestSystem
    varied: Varied
    space: Space

    def system_at(self, value: Mpf) -> RestSystem:
        """Return the system at a value of the parameter."""
        return self.system.with_parameters(self.varied.values(value, self.system.known))

    def equilibrium(self, y: Matrix) -> Equilibrium:
        """Return a point as an equilibrium."""
        return equilibrium(self.system, self.space, Located(tuple(map(mpf, y.tolist())), 0.0))

    def stability(self, at: Located) -> Stability:
        """Decide the stability of one equilibrium."""
        try:
            system = self.system_at(at.y[-1])
            place = equilibrium(system, self.space, at)
            return stability(system, place, linear_system(system, place))
        except InputError as error:
            return Stability("undecided", error.problems[0].message)

    # Marks without a fold.

    def stretches(self, branch: Traced) -> tuple[Stretch, ...]:
        """Split a branch at its marks and at crossings of poles, and judge the parts.

        Points within the error of a mark may lie on either side of it: they belong to no part.
        """
        unresolved = self._mark_poles(branch)
        _turn_to_mark(branch)
        last = len(branch.points) - 1
        runs = {0: (0, 0), last: (last, last)}
        for k, mark in branch.marks:
            before, behind = self._run_within(branch.points, k, mark)
            known_before, known_behind = runs.get(k, (k, k))
            runs[k] = min(before, known_before), max(behind, known_behind)
        parts = []
        for k, after in pairwise(sorted(runs)):
            behind, before = runs[k][1], runs[after][0]
            parts.append((behind + (behind > k), before - (before < after)))
        return tuple(
            Stretch(first, end, self._over(branch.points[first : end + 1], unresolved))
            for first, end in parts
            if end > first
        )

    def _run_within(self, points: list[CurvePoint], k: int, mark: Mark) -> tuple[int, int]:
        """Return the first and last of the points in a row that lie within the error of a mark."""
        first = last = k
        while first > 0 and self._is_within(points[first - 1], mark):
            first -= 1
        while last + 1 < len(points) and self._is_within(points[last + 1], mark):
            last += 1
        return first, last

    def _is_within(self, point: CurvePoint, mark: Mark) -> bool:
        room = mark.at.radius * np.maximum(1.0, np.abs(mark.y))
        room[-1] = self._error(mark)
        gaps = self.space.difference(point.y, mark.y) * self.space.scale
        return bool((np.abs(gaps) <= room).all())

    def _mark_poles(self, branch: Traced) -> list[CurvePoint]:
        """Mark the points between marks at which poles cross the imaginary axis.

        Returns the points behind which their numbers change, and no crossing is found.
        """
        unresolved: list[CurvePoint] = []
        marked = {k for k, _ in branch.marks}
        counts = counted(self.space, [p.y for p in branch.points])
        crossings: list[tuple[int, Mark]] = []
        for k in range(len(branch.points) - 1):
            ends = [branch.points[k].y, branch.points[k + 1].y]
            end_counts = list(counts[k : k + 2])
            for side in (0, 1):
                if k + side in marked:
                    ends[side] = self._beside(ends[side], ends[1 - side])
                    end_counts[side] = counted(self.space, [ends[side]])[0]
            changes = self._changes((ends[0], end_counts[0]), (ends[1], end_counts[1]))
            crossings += [(k, mark) for mark in changes if mark is not None]
            unresolved += [branch.points[k]] if None in changes else []
        for k, mark in reversed(crossings):
            insert(self.space, branch, k, mark)
        branch.marks.sort(key=lambda pair: pair[0])
        return unresolved

    def _beside(self, marked: Matrix, neighbour: Matrix) -> Matrix:
        """Return a point beside a marked one."""
        return self._part(marked, neighbour, _BESIDE)

    def _part(self, start: Matrix, end: Matrix, part: float) -> Matrix:
        """Return the point of the branch between two neighbours at a part of their chord."""
        chord = (end - start) / self.space.scale
        guess = start + part * (end - start)
        y = self.space.corrected(guess, chord / np.linalg.norm(chord))
        return guess if y is None else y

    def _changes(self, start: _Counted, end: _Counted) -> list[Mark | None]:
        """Locate changes of the numbers of poles between two points; None for one not found."""
        marks: list[Mark | None] = []
        for first, last in self._intervals(start, end, _HALVINGS):
            assert first[1] is not None
            assert last[1] is not None
            is_flutter = first[1].negative == last[1].negative
            # Eigenvalues of K vanish in pairs where there is neither a fold nor a branch point.
            if (first[1].negative - last[1].negative) % 2:
                marks.append(None)
                continue
            marks.append(self._crossing(start[0], end[0], first[0], last[0], is_flutter=is_flutter))
        return marks

    def _intervals(
        self, start: _Counted, end: _Counted, halvings: int
    ) -> list[tuple[_Counted, _Counted]]:
        """Bisect to the intervals in which numbers of poles change."""
        if start[1] is None or end[1] is None or start[1] == end[1]:
            return []
        if not halvings:
            return [(start, end)]
        y = self._part(start[0], end[0], 0.5)
        middle = (y, counted(self.space, [y])[0])
        if middle[1] is None:
            return []
        before = self._intervals(start, middle, halvings - 1)
        return before + self._intervals(middle, end, halvings - 1)

    def _crossing(
        self, start: Matrix, end: Matrix, low: Matrix, high: Matrix, *, is_flutter: bool
    ) -> Mark | None:
        """Find a crossing in digits, in an interval or, if poles move slowly, around it."""
        if 2 * len(self.system.equations.system.coordinates) > MOST_STATES:
            return self._in_doubles(low, high, "flutter" if is_flutter else "divergence")
        search = CrossingSearch(self.space, self.system_at)
        for more in (1.0, 1e3, np.inf):
            wide = [start, end] if np.isinf(more) else self._widened(start, end, low, high, more)
            crossing = search.flutter(*wide) if is_flutter else search.divergence(*wide)
            if crossing is not None:
                return Mark(
                    "flutter" if is_flutter else "divergence", crossing.at, crossing.frequency
                )
        return None

    def _widened(
        self, start: Matrix, end: Matrix, low: Matrix, high: Matrix, more: float
    ) -> list[Matrix]:
        """Move the ends of an interval apart, but not beyond two points."""
        chord = (end - start) / self.space.scale
        length = float(chord @ chord)
        places = [float(((y - start) / self.space.scale) @ chord) / length for y in (low, high)]
        width = more * (places[1] - places[0])
        parts = max(0.0, places[0] - width), min(1.0, places[1] + width)
        return [self._part(start, end, part) for part in parts]

    def _in_doubles(self, low: Matrix, high: Matrix, kind: MarkKind) -> Mark:
        """Mark the middle of an interval, with its width as the error."""
        width = abs(high[-1] - low[-1]) / self.space.scale[-1]
        middle = (low + high) / 2
        return Mark(kind, Located(tuple(map(mpf, middle.tolist())), float(width)))

    # Verdicts.

    def _over(self, points: list[CurvePoint], unresolved: list[CurvePoint]) -> Stability:
        """Decide the stability of a stretch at two points of it; undecided if they differ."""
        if any(p is q for p in points[:-1] for q in unresolved):
            return Stability("undecided", _DIFFERENT)
        verdicts = [self._at(points, part) for part in _PLACES]
        known = [v for v in verdicts if v.verdict != "undecided"] or verdicts
        if len({v.verdict for v in known}) > 1:
            return Stability("undecided", _DIFFERENT)
        return known[0]

    def _at(self, points: list[CurvePoint], part: float) -> Stability:
        place = part * (len(points) - 1)
        k = min(int(place), len(points) - 2)
        start, end = points[k].y, points[k + 1].y
        chord = (end - start) / self.space.scale
        if not chord.any():
            return Stability("undecided", _DIFFERENT)
        share = min(max(place - k, 0.1), 0.9)
        guess = start + share * (end - start)
        at = proven_point_at(self.space, guess, chord / np.linalg.norm(chord))
        if at is None:
            return Stability("undecided", Phrase("the equilibrium could not be found in digits"))
        return self.stability(at)

    def marked(self, mark: Mark) -> MarkedPoint:
        """Return a mark as a value, with its error."""
        value = float(mark.at.y[-1])
        place = equilibrium(self.system, self.space, mark.at)
        position = tuple(float(x) for x in place.position or ())
        return MarkedPoint(mark.kind, value, self._error(mark), position, mark.frequency)

    def _error(self, mark: Mark) -> float:
        """Return the error of a mark's parameter, with the rounding of its double."""
        width = self.space.high - self.space.low
        return mark.at.error * width + _ROUNDING * abs(float(mark.at.y[-1]))


def _turn_to_mark(branch: Traced) -> None:
    """Let a closed branch begin at its first mark, if it has one."""
    if not branch.is_closed or not branch.marks or branch.marks[0][0] == 0:
        return
    first, last = branch.marks[0][0], len(branch.points) - 1
    branch.points[:] = [*branch.points[first:], *branch.points[1 : first + 1]]
    marks = [((k - first) % last, mark) for k, mark in branch.marks]
    branch.marks[:] = [*marks, (last, marks[0][1])]
