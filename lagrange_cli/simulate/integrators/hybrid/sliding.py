"""Continuations of a motion on switching surfaces: pass, leave to a side, or slide.

A. F. Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988, §4: the rates on
both sides decide. If both lead back to the surface, the motion stays on it with the part of
both sides that keeps it there, as dry friction holds a body at rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.right_hand_side import (
    ON_SURFACE,
    StructuredRhs,
    Surfaces,
    SurfaceSides,
    structured,
    with_sides,
)

#: Surfaces met at one instant of which every combination of sides is looked at.
_MOST_AT_ONCE = 3

#: Nonlinearity of rates in the part between both sides of a surface, relative to them. Rounding
#: makes rates that are linear in it differ by less, products of two kinks by much more.
_LINEAR = 1e-6


@dataclass(frozen=True)
class Continuation:
    """One way in which the motion may go on.

    Attributes
    ----------
    sides
        The sides on which the motion stays.
    slope
        Rate of the state, shape (2n,).
    on
        Surfaces on which the state is.
    departs
        The motion leaves one of the surfaces at once.
    """

    sides: SurfaceSides
    slope: Array
    on: tuple[int, ...]
    departs: bool


def continuations(
    surfaces: Surfaces, t: float, y: Array, sides: SurfaceSides, met: Sequence[int]
) -> list[Continuation]:
    """Find the ways in which the motion may go on from the surfaces that it meets.

    Surfaces of positions that it meets with a speed are passed whatever acts. A surface that
    depends on the sides of others, as the bound of a controller on a step of its input, is where
    these sides put it. The list is empty if there are more surfaces at once than can be tried.
    """
    sides, on, undecided = _behind_passed(surfaces, t, y, sides, met)
    if not on:
        return [Continuation(sides, surfaces.side(sides)(t, y), on, departs=False)]
    if len(undecided) > _MOST_AT_ONCE:
        return []
    ways = []
    for choice in product((1.0, -1.0, 0.0), repeat=len(undecided)):
        chosen = dict(zip(undecided, choice, strict=True))
        reached = _reached(surfaces, t, y, sides, on, chosen)
        if reached is not None:
            rates = surfaces.rates(t, y, *reached)
            free = [k for k in undecided if chosen[k] != 0]
            leading = [rates.leading(k, surfaces.positional[k]) for k in free]
            departs = len(undecided) < len(on) or any(leading)
            if all(chosen[k] * rate >= 0 for k, rate in zip(free, leading, strict=True)):
                ways.append(Continuation(*reached, on, departs))
    return ways


def _behind_passed(
    surfaces: Surfaces, t: float, y: Array, sides: SurfaceSides, met: Sequence[int]
) -> tuple[SurfaceSides, tuple[int, ...], list[int]]:
    """Return sides behind surfaces that are passed, and the surfaces met and undecided there."""
    sides, on = surfaces.placed(t, y, sides, met)
    undecided: list[int] = []
    for _ in range(len(sides) + 1):
        behind, undecided = _passed(surfaces, t, y, sides, on)
        placed, on = surfaces.placed(t, y, behind, met)
        if placed == sides:
            break
        sides = placed
    return sides, on, undecided


def _reached(
    surfaces: Surfaces,
    t: float,
    y: Array,
    sides: SurfaceSides,
    on: Sequence[int],
    chosen: Mapping[int, float],
) -> tuple[SurfaceSides, Array] | None:
    """Return sides and slope of a choice, 0 to slide along a surface; None if it does not hold.

    A motion that slides along a surface is not followed where others lie differently on its sides:
    rates are not linear in the part between them.
    """
    slid = [k for k, side in chosen.items() if side == 0]
    placed = {
        with_sides(surfaces.placed(t, y, corner, on)[0], dict.fromkeys(slid, 0.0))
        for corner in corners(with_sides(sides, chosen), slid)
    }
    if len(placed) > 1:
        return None
    (tried,) = placed
    return _along(surfaces, t, y, tried, slid) if slid else _free(surfaces, t, y, tried)


def corners(sides: SurfaceSides, sliding: Sequence[int]) -> list[SurfaceSides]:
    """List the sides that surfaces along which the motion slides lie between."""
    choices = product((1.0, -1.0), repeat=len(sliding))
    return [with_sides(sides, dict(zip(sliding, choice, strict=True))) for choice in choices]


def _passed(
    surfaces: Surfaces, t: float, y: Array, sides: SurfaceSides, on: Sequence[int]
) -> tuple[SurfaceSides, list[int]]:
    """Return the sides behind surfaces of positions that are passed, and other surfaces."""
    across = with_sides(sides, dict.fromkeys(on, 1.0))
    rates = surfaces.rates(t, y, across, surfaces.side(across)(t, y))
    clear = np.abs(rates.first) > ON_SURFACE * rates.sizes
    passed = [k for k in on if surfaces.positional[k] and clear[k]]
    behind = with_sides(sides, {k: float(np.sign(rates.first[k])) for k in passed})
    return behind, [k for k in on if k not in passed]


def _free(
    surfaces: Surfaces, t: float, y: Array, sides: SurfaceSides
) -> tuple[SurfaceSides, Array] | None:
    slope = surfaces.side(sides)(t, y)
    return (sides, slope) if np.isfinite(slope).all() else None


def _along(
    surfaces: Surfaces, t: float, y: Array, sides: SurfaceSides, sliding: Sequence[int]
) -> tuple[SurfaceSides, Array] | None:
    """Return sides and slope along surfaces on which the motion slides; None if it does not."""
    parts, slope = SlidingRhs(surfaces, sides, sliding).parts(t, y)
    if not np.isfinite(slope).all() or not (np.abs(parts) < 1).all():
        return None
    placed = with_sides(sides, dict(zip(sliding, parts.tolist(), strict=True)))
    exact = surfaces.side(placed)(t, y)
    end = surfaces.side(with_sides(sides, dict.fromkeys(sliding, 1.0)))(t, y)
    size = (np.abs(exact) + np.abs(slope) + np.abs(end)).max()
    linear = bool((np.abs(exact - slope) <= _LINEAR * size).all())
    return (placed, slope) if linear else None


def unique_continuation(ways: Sequence[Continuation]) -> Continuation | None:
    """Choose the way that the motion takes; None if there is none, or more than one.

    Ways that differ in nothing but the name of a side are one.
    """
    if not ways:
        return None
    first = ways[0]
    same = all(np.array_equal(way.slope, first.slope) for way in ways)
    if same:
        return next((way for way in ways if not way.departs), first)
    return first if len(ways) == 1 else None


class SlidingRhs(StructuredRhs):
    """The right-hand side along surfaces that hold the motion, called like any.

    Their functions stay zero: the parts between both sides solve a linear system, whose entries
    are differences of rates.
    """

    def __init__(self, surfaces: Surfaces, sides: SurfaceSides, sliding: Sequence[int]) -> None:
        self._surfaces, self._sliding = surfaces, list(sliding)
        self._base = with_sides(sides, dict.fromkeys(sliding, 0.0))
        self._ends = [with_sides(self._base, {k: 1.0}) for k in sliding]
        self.project = structured(surfaces.side(self._base)).project

    def __call__(self, t: float, y: Array) -> Array:
        return self.parts(t, y)[1]

    def parts(self, t: float, y: Array) -> tuple[Array, Array]:
        """Solve for the parts between both sides, and the slope, shapes (surfaces,) and (2n,)."""
        slope, rates = self._at(t, y, self._base)
        ends = [self._at(t, y, sides) for sides in self._ends]
        matrix = np.array([r - rates for _, r in ends]).T
        try:
            parts = np.linalg.solve(matrix, -rates)
        except np.linalg.LinAlgError:
            return np.full(len(self._sliding), np.nan), np.full(len(y), np.nan)
        changes = np.array([end - slope for end, _ in ends])
        return parts, slope + parts @ changes

    def _at(self, t: float, y: Array, sides: SurfaceSides) -> tuple[Array, Array]:
        """Evaluate the slope on some sides, and the rates there of surfaces that are slid along."""
        slope = self._surfaces.side(sides)(t, y)
        rates = self._surfaces.rates(t, y, self._base, slope)
        positional = self._surfaces.positional
        slid_rates = [rates.second[k] if positional[k] else rates.first[k] for k in self._sliding]
        return slope, np.array(slid_rates)
