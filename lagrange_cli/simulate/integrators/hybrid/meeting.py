"""Continuations of a motion from the switching surfaces that it meets: pass, leave, or slide.

A. F. Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988, §4: the rates on
both sides decide. Surfaces that are met at one instant have 2ᵏ regions around the state, the
*corners*, and the motion goes on where the rates of a region, or of motion along surfaces
between some, agree with it. Along several surfaces that is certain where the matrix of the rates is
diagonally stable; else motions may spiral out of the intersection although every region leads back
to it (A. Yu. Pogromsky, W. P. M. H. Heemels, H. Nijmeijer, *Automatica* 39 (2003) 2139).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.hybrid.sliding import (
    LINEAR,
    Combination,
    is_diagonally_stable,
)
from lagrange_cli.simulate.integrators.right_hand_side import (
    ON_SURFACE,
    Surfaces,
    SurfaceSides,
    with_sides,
)

#: Surfaces met at one instant of which every combination of sides is looked at: 2187 of seven.
_MOST_AT_ONCE = 7

#: A surface that is met on some sides of others is not met on sides where its function is larger
#: than this part of the terms that it is the sum of: a function in it jumps between these sides.
_ELSEWHERE = 1e-9

#: Rates of two surfaces that are in the same proportion on all sides but for this part belong to
#: one surface that is written in two ways.
_PROPORTIONAL = 1e-9

#: Why it is not known how a motion goes on.
AMBIGUOUS = Phrase(
    "the motion from there is not unique: a kink or a jump of the forces pushes it away to both"
    " sides"
)
UNSETTLED = Phrase("what follows at a kink or a jump of the forces cannot be determined")
TOO_MANY_AT_ONCE = Phrase(
    "more kinks and jumps of the forces meet there than can be told apart, {most}",
    most=f"{_MOST_AT_ONCE}",
)
NOT_ONE_COMBINATION = Phrase(
    "the motion would slide along several jumps of the forces at once, and which combination of"
    " their sides holds it there is not determined"
)
MAY_SPIRAL = Phrase(
    "the motion would slide along several jumps of the forces at once, and it is not certain that"
    " it cannot leave them in a spiral"
)


@dataclass(frozen=True)
class Continuation:
    """One way in which the motion may go on.

    Attributes
    ----------
    sides
        The sides on which the motion stays; between them on surfaces along which it slides.
    slope
        Rate of the state, shape (2n,).
    on
        Surfaces on which the state is.
    departs
        The motion leaves one of the surfaces at once.
    corners
        Sides around the surfaces along which it slides; the sides alone where it does not.
    """

    sides: SurfaceSides
    slope: Array
    on: tuple[int, ...]
    departs: bool
    corners: tuple[SurfaceSides, ...]


def settled(
    surfaces: Surfaces, t: float, y: Array, corners: Sequence[SurfaceSides], met: Sequence[int]
) -> Continuation | str:
    """Find the one way in which a motion goes on from the surfaces that it meets, or say why not.

    Surfaces of positions that it meets with a speed are passed whatever acts. A surface that
    depends on the sides of others, as the bound of a controller on a step of its input, is where
    these sides put it. ``corners`` are the sides around the state before, ``met`` the surfaces
    that are met whatever rounding leaves of their functions.
    """
    place = _Place.at(surfaces, t, y, corners, met)
    sides, on, undecided = _behind_passed(place, corners[0])
    if not undecided:
        slope = surfaces.side(sides)(t, y)
        return Continuation(sides, slope, on, departs=False, corners=(sides,))
    while len(undecided) <= _MOST_AT_ONCE:
        around = _Around(place, sides, undecided)
        further = [k for k in sorted(around.met) if k not in on]
        if not further:
            return _chosen(around, on)
        undecided += further
        on = tuple(sorted({*on, *further}))
    return TOO_MANY_AT_ONCE


@dataclass(frozen=True)
class _Place:
    """A state on surfaces.

    Attributes
    ----------
    surfaces, t, y
        The surfaces, the time, and the state, shape (2n,).
    limits
        Largest magnitude of each function that is zero but for rounding, shape (S,).
    parts
        The same as a part of the terms that the function is the sum of, shape (S,).
    """

    surfaces: Surfaces
    t: float
    y: Array
    limits: Array
    parts: Array

    @classmethod
    def at(
        cls,
        surfaces: Surfaces,
        t: float,
        y: Array,
        corners: Sequence[SurfaceSides],
        met: Sequence[int],
    ) -> _Place:
        """Make the place of a state that meets surfaces: their functions there are rounding."""
        before = [np.abs(surfaces.values(t, y, sides)[0]) for sides in corners]
        limits, parts = np.zeros(len(corners[0])), np.full(len(corners[0]), ON_SURFACE)
        chosen = list(met)
        limits[chosen], parts[chosen] = 2 * np.min(before, axis=0)[chosen], _ELSEWHERE
        return cls(surfaces, t, y, limits, parts)

    def placed(
        self, sides: SurfaceSides, chosen: Mapping[int, float]
    ) -> tuple[SurfaceSides, tuple[int, ...]]:
        """Return sides, of surfaces on which the state is the ``chosen`` ones or those given; and
        the numbers of these surfaces. A surface may depend on the sides of those before it."""
        sides = with_sides(sides, chosen)
        on: tuple[int, ...] = ()
        for _ in range(len(sides) + 1):
            values, sizes = self.surfaces.values(self.t, self.y, sides)
            near = np.abs(values) <= np.maximum(self.limits, self.parts * sizes)
            on = tuple(np.flatnonzero(near).tolist())
            apart = np.flatnonzero(~near & (values != 0)).tolist()
            clear = {k: float(np.sign(values[k])) for k in apart}
            placed = with_sides(sides, {**chosen, **clear})
            if placed == sides:
                break
            sides = placed
        return sides, on


def _behind_passed(
    place: _Place, sides: SurfaceSides
) -> tuple[SurfaceSides, tuple[int, ...], list[int]]:
    """Return sides behind surfaces that are passed, and the surfaces met and undecided there."""
    sides, on = place.placed(sides, {})
    undecided: list[int] = []
    for _ in range(len(sides) + 1):
        behind, undecided = _passed(place, sides, on)
        placed, on = place.placed(behind, {})
        if placed == sides:
            break
        sides = placed
    return sides, on, undecided


def _passed(
    place: _Place, sides: SurfaceSides, on: Sequence[int]
) -> tuple[SurfaceSides, list[int]]:
    """Return the sides behind surfaces of positions that are passed, and other surfaces."""
    surfaces, t, y = place.surfaces, place.t, place.y
    across = with_sides(sides, dict.fromkeys(on, 1.0))
    rates = surfaces.rates(t, y, across, surfaces.side(across)(t, y))
    clear = np.abs(rates.first) > ON_SURFACE * rates.sizes
    passed = [k for k in on if surfaces.positional[k] and clear[k]]
    behind = with_sides(sides, {k: float(np.sign(rates.first[k])) for k in passed})
    return behind, [k for k in on if k not in passed]


@dataclass(frozen=True)
class _Corner:
    """The sides, the slope and the leading rates of the undecided surfaces in one region."""

    sides: SurfaceSides
    slope: Array
    rates: Array


class _Around:
    """The regions around a state on surfaces.

    Attributes
    ----------
    undecided
        Surfaces whose sides are to be found. Those that are others written in another way do not
        stand among them; they have the sides of these.
    met
        Surfaces on which the state is, in some region.
    """

    def __init__(self, place: _Place, sides: SurfaceSides, undecided: Sequence[int]) -> None:
        self._place, self._sides = place, sides
        self._all, self.met = tuple(undecided), set[int]()
        signs = [
            dict(zip(undecided, sign, strict=True))
            for sign in product((1.0, -1.0), repeat=len(undecided))
        ]
        corners = list(map(self._corner, signs))
        self._same = self._in_proportion(np.array([corner.rates for corner in corners]))
        self.undecided = tuple(k for k in undecided if self._same[k][0] == k)
        self._corners = {
            tuple(sign[k] for k in self.undecided): corner
            for sign, corner in zip(signs, corners, strict=True)
            if self._agrees(sign)
        }

    def _corner(self, sign: Mapping[int, float]) -> _Corner:
        """Evaluate a region: surfaces that are elsewhere on these sides are where they are."""
        sides, on = self._place.placed(self._sides, sign)
        self.met |= set(on)
        place = self._place
        slope = place.surfaces.side(sides)(place.t, place.y)
        rates = place.surfaces.rates(place.t, place.y, sides, slope)
        leading = [rates.leading(k, place.surfaces.positional[k]) for k in self._all]
        return _Corner(sides, slope, np.array(leading))

    def _in_proportion(self, rates: Array) -> dict[int, tuple[int, float]]:
        """Return of each surface the first one that it is in proportion to, with its sign."""
        same = {k: (k, 1.0) for k in self._all}
        for (i, first), (j, second) in combinations(enumerate(self._all), 2):
            if same[first][0] != first or same[second][0] != second:
                continue
            product_of_sizes = np.linalg.norm(rates[:, i]) * np.linalg.norm(rates[:, j])
            along = float(rates[:, i] @ rates[:, j])
            if product_of_sizes > 0 and abs(along) >= (1 - _PROPORTIONAL**2) * product_of_sizes:
                same[second] = first, float(np.sign(along))
        return same

    def _agrees(self, chosen: Mapping[int, float]) -> bool:
        """Tell whether surfaces that are one have sides that are one."""
        return all(chosen[k] == sign * chosen[first] for k, (first, sign) in self._same.items())

    def faces(self) -> Iterator[tuple[tuple[float, ...], dict[tuple[float, ...], _Corner]]]:
        """Yield choices of sides, 0 to slide along a surface, with the corners around each."""
        for choice in product((1.0, -1.0, 0.0), repeat=len(self.undecided)):
            yield (
                choice,
                {
                    sign: corner
                    for sign, corner in self._corners.items()
                    if all(c in (0.0, s) for c, s in zip(choice, sign, strict=True))
                },
            )

    def numbers(self, sliding: Sequence[int]) -> list[int]:
        """Return the places of some surfaces among those in the rates of a corner."""
        return [self._all.index(k) for k in sliding]


def _chosen(around: _Around, on: tuple[int, ...]) -> Continuation | str:
    """Return the way that the motion takes, or why there is none."""
    ways, doubts = list[Continuation](), list[str]()
    for choice, corners in around.faces():
        way = _way(around, on, choice, corners)
        if isinstance(way, Continuation):
            ways.append(way)
        elif way is not None:
            doubts.append(way)
    if doubts:
        return doubts[0]
    if not ways:
        return UNSETTLED
    first = ways[0]
    if all(np.array_equal(way.slope, first.slope) for way in ways):
        return next((way for way in ways if not way.departs), first)
    return first if len(ways) == 1 else AMBIGUOUS


def _way(
    around: _Around,
    on: tuple[int, ...],
    choice: Sequence[float],
    corners: Mapping[tuple[float, ...], _Corner],
) -> Continuation | str | None:
    """Return the way of a choice of sides; None if rates contradict it, or what is in doubt."""
    sliding = [i for i, side in enumerate(choice) if side == 0]
    signs = np.array(list(corners)).reshape(len(corners), -1)[:, sliding]
    slopes, rates = (
        np.array([getattr(c, name) for c in corners.values()]) for name in ("slope", "rates")
    )
    if not np.isfinite(slopes).all():
        return None
    numbers = around.numbers(around.undecided)
    slope, rate, parts = slopes[0], rates[0], np.empty(0)
    if sliding:
        slid = [numbers[i] for i in sliding]
        combined = Combination.of(signs, slopes, rates[:, slid])
        parts = combined.parts
        if not combined.is_one and _surround_zero(rates[:, slid]):
            return NOT_ONE_COMBINATION
        if not (np.abs(parts) < 1).all():
            return None
        slope = combined.slope
        rate = rates.mean(axis=0) + parts @ (signs.T @ rates) / len(signs)
    free = [i for i in range(len(choice)) if i not in sliding]
    if not all(choice[i] * rate[numbers[i]] >= 0 for i in free):
        return None
    if len(sliding) > 1:
        others = {_others(corner.sides, around) for corner in corners.values()}
        if not combined.is_one or len(others) > 1:
            return NOT_ONE_COMBINATION
        if not is_diagonally_stable(-combined.matrix):
            return MAY_SPIRAL
    sides = tuple(corner.sides for corner in corners.values())
    between = {around.undecided[i]: float(part) for i, part in zip(sliding, parts, strict=True)}
    departs = len(around.undecided) < len(on) or any(rate[numbers[i]] for i in free)
    return Continuation(with_sides(sides[0], between), slope, on, bool(departs), sides)


def _surround_zero(rates: Array) -> bool:
    """Tell whether a combination of the rates of corners, shape (corners, surfaces), is zero."""
    from scipy.optimize import nnls

    sizes = np.abs(rates).max(axis=0)
    scaled = rates / np.where(sizes > 0, sizes, 1.0)
    matrix = np.vstack([scaled.T, np.ones(len(rates))])
    goal = np.append(np.zeros(rates.shape[1]), 1.0)
    return bool(nnls(matrix, goal)[1] < LINEAR)


def _others(sides: SurfaceSides, around: _Around) -> SurfaceSides:
    """Return the sides of the surfaces that are decided."""
    return tuple(side for k, side in enumerate(sides) if k not in around.undecided)
