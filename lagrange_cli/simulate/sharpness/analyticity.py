"""Longest steps that pass over nothing sharp, shown by analyticity.

A method sees a force at a few times a step; a pulse between them it does not see. So no step is
longer than a part of the whole, unless it is shown that nothing sharp is near: that around the
motion, in discs of complex times, it is analytic and grows to no more than a few times what its
first derivatives say. Picard's iteration shows it: where slopes over discs of states
(:mod:`.disc_arithmetic`) lead nowhere out of these, the solution stays in them (Hairer, Nørsett,
Wanner, *Solving Ordinary Differential Equations I*, I.8). A force that is narrow on the real axis
is not analytic on such discs, or enormous: exp(-x²/w²) is exp(r²/w²) at x = ir.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Rhs, UnfitError
from lagrange_cli.simulate.integrators.expressions import Expressions, expressions
from lagrange_cli.simulate.integrators.external.heyoka_algebra import Algebra, Traced
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, HybridRhs
from lagrange_cli.simulate.integrators.piecewise import input_pieces
from lagrange_cli.simulate.runs.problem import InitialValueProblem, groups
from lagrange_cli.simulate.sharpness.disc_arithmetic import DISCS, Disc

#: Longest step, in radii of the discs along it; set by hand.
_STEP = 4.5

#: Longest step as a part of the span: runs that are compared must differ in their steps.
_MOST = 0.6

#: Of points nearer to each other than this part of the radius the first one is enough.
_APART = 0.25

#: Largest distance of two neighbouring points, in radii.
_BETWEEN = 1.25

#: Smallest radius that is tried, as a part of the longest step without discs.
_SMALLEST = 0.5

#: Factor by which a radius that is too large shrinks.
_SHRINK = 2**0.5

#: Operations of a right-hand side above which it would take too long to look.
_MOST_OPERATIONS = 500

#: Factor by which discs of states are made larger than needed.
_MARGIN = 1.1

#: Number of times that they are enlarged.
_ROUNDS = 12

#: Largest discs of states, as a multiple of the first ones or of the scales.
_LARGEST = 8.0

#: The least disc around a state, beside the largest of its kind, and of an angle.
_LEAST = 1e-3

#: How often discs are made tighter.
_TIGHTER = 4

#: How many times the radius of an event function's disc may shrink where that of the states is
#: halved: 8 is that of a cubic.
_TAME = 8.0

_Flags = NDArray[np.bool_]


def longest_step(problem: InitialValueProblem, reach: float) -> float:
    """The longest step where discs of this radius have been shown, 0 for none."""
    return max(problem.longest_step, min(_STEP * reach, _MOST * problem.span))


@dataclass(frozen=True)
class PathPoint:
    """State on a motion, and flags of the contacts that are closed there."""

    t: float
    y: Array
    closed: ContactMode = ()


class AnalyticDiscs:
    """Discs of complex times around points of a motion in which it is analytic and tame."""

    def __init__(self, problem: InitialValueProblem) -> None:
        self._problem, self._blind = problem, input_pieces(problem.rhs) is not None

    def first(self, place: PathPoint) -> float:
        """The radius of a disc of times in which the motion from there is analytic and tame: the
        largest that is shown by way of smaller ones, up to the span, 0 for none."""
        least, span = _SMALLEST * self._problem.longest_step, self._problem.span
        count = 1 + round(math.log(span / least, _SHRINK))
        radii = np.array([min(least * _SHRINK**k, span) for k in range(count)])
        clear = self._clear([place] * len(radii), radii, np.zeros_like(place.y))
        return 0.0 if not clear[0] else float(radii[: np.append(clear, False).argmin()][-1])

    def along(self, places: Sequence[PathPoint], most: float, scales: Array) -> float:
        """The radius for all of a motion between places, ``most`` or less; ``scales`` are its."""
        radius = most
        while radius >= _SMALLEST * self._problem.longest_step:
            near = list(self._near(places, radius))
            if self._clear(near, np.full(len(near), radius), scales).all():
                return radius
            radius /= _SHRINK
        return 0.0

    def _near(self, places: Sequence[PathPoint], radius: float) -> Iterator[PathPoint]:
        """Places on the motion of which each is near to the next one."""
        last = places[0]
        yield last
        for place in places[1:]:
            alike, way = place.closed == last.closed, place.t - last.t
            if alike and way < _APART * radius:
                continue
            parts = math.ceil(way / (_BETWEEN * radius)) if alike else 1
            yield from (self._between(last, place, k / parts) for k in range(1, parts))
            yield place
            last = place

    def _between(self, one: PathPoint, other: PathPoint, x: float) -> PathPoint:
        """A place at a part of the way from one to another, by Hermite's cubic."""
        side, h = self._side(one.closed), other.t - one.t
        starts, ends = h * side(one.t, one.y), h * side(other.t, other.y)
        line = other.y - one.y
        bent = (1 - x) * (starts - line) - x * (ends - line)
        return PathPoint(one.t + x * h, one.y + x * (line + (1 - x) * bent), one.closed)

    def _side(self, closed: ContactMode) -> Rhs:
        rhs = self._problem.rhs
        return rhs.side(closed) if isinstance(rhs, HybridRhs) else rhs

    def _clear(self, places: Sequence[PathPoint], radii: Array, scales: Array) -> _Flags:
        """Tell whether motions from places are shown to be tame, each within its radius."""
        found = np.zeros(len(places), dtype=bool)
        try:
            for closed in {place.closed for place in places}:
                if not self._blind:
                    mine = [k for k, place in enumerate(places) if place.closed == closed]
                    group = _Places(self._problem, [places[k] for k in mine], radii[mine], scales)
                    found[mine] = group.clear(self._side(closed), self._problem.rhs)
        except UnfitError:
            self._blind, found[:] = True, False
        return found


class _Places:
    """Places with the same contacts closed, and a radius for each: t (m,), y (m, 2n)."""

    def __init__(
        self, problem: InitialValueProblem, places: Sequence[PathPoint], radii: Array, scales: Array
    ) -> None:
        self._problem, self._closed, self._scales = problem, places[0].closed, scales
        self._t = np.array([place.t for place in places])
        self._y = np.array([place.y for place in places])
        self._radii = radii

    def clear(self, side: Rhs, rhs: Rhs) -> _Flags:
        """Tell whether motions by the slopes of a ``side`` of all are shown to be tame."""
        traced = expressions(side)
        if traced is None:
            raise UnfitError("its equations are not to be had as expressions")
        slopes = np.array([side(t, y) for t, y in zip(self._t.tolist(), self._y, strict=True)])
        states = self._first(np.abs(slopes))
        most = np.maximum(_LARGEST * self._of_kind(states), self._scales)
        lost = ~np.isfinite(slopes).all(axis=1)
        for _ in range(_ROUNDS):
            needed = self._needed(traced, states)
            lost |= ~(needed <= most).all(axis=1)
            inside = np.asarray((needed <= states).all(axis=1))
            if (lost | inside).all():
                break
            states = np.where(inside[:, None], states, np.fmax(states, _MARGIN * needed))
        clear = inside & ~lost
        if isinstance(rhs, HybridRhs) and clear.any():
            clear &= self._falls_tamely(rhs, self._tightened(traced, states))
        return np.asarray(clear)

    def _tightened(self, of: Expressions, states: Array) -> Array:
        """Discs of states that enclose the motions alone: Picard's iteration leads from any that it
        does not leave to smaller ones. In those that are larger than need be, a gap may change
        by more than what is sharp in it."""
        for _ in range(_TIGHTER):
            states = np.fmin(states, self._needed(of, states))
        return states

    def _needed(self, of: Expressions, states: Array) -> Array:
        """Bound the motion by slopes over discs of states within the radii."""
        discs = self._over(of, self._radii, states)
        largest = np.stack([disc.largest for disc in discs], axis=1)
        return np.asarray(self._radii[:, None] * largest)

    def _first(self, slopes: Array) -> Array:
        """Bound the first motion of states, with a part of that of others of their kind."""
        n, radii = slopes.shape[1] // 2, self._radii[:, None]
        velocities = radii * slopes[:, n:]
        states = _MARGIN * np.concatenate(
            [radii * (slopes[:, :n] + velocities), velocities], axis=1
        )
        least = _LEAST * np.maximum(self._of_kind(states), self._scales)
        least[:, :n] = np.where(
            self._problem.angles, np.maximum(least[:, :n], _LEAST), least[:, :n]
        )
        least[:, n:] = np.maximum(least[:, n:], least[:, :n] / radii)
        return np.maximum(states, np.where(least > 0, least, _LEAST))

    def _of_kind(self, states: Array) -> Array:
        """The largest of each kind, of positions and of velocities."""
        n, largest = len(self._problem.kinds), np.empty_like(states)
        for alike in groups(self._problem.kinds):
            for first in (0, n):
                numbers = [first + k for k in alike]
                largest[:, numbers] = states[:, numbers].max(axis=1, keepdims=True)
        return largest

    def _falls_tamely(self, rhs: HybridRhs, states: Array) -> _Flags:
        """Tell whether what falls through zero at events changes no faster than a cubic."""
        gaps, multipliers = rhs.traced(self._closed)
        count, tame = len(self._closed), np.ones(len(states), dtype=bool)
        opened = [k for k in range(count) if not self._closed[k]]
        shut = [k - count for k in range(count) if self._closed[k]]
        for function, numbers in ((gaps, opened), (multipliers, shut)):
            if numbers:
                whole = self._over(function, self._radii, states, numbers)
                half = self._over(function, self._radii / 2, states / 2, numbers)
                for a, b in zip(whole, half, strict=True):
                    tame &= np.isfinite(a.radius) & (a.radius <= _TAME * b.radius)
        return tame

    def _over(
        self, of: Expressions, radii: Array, states: Array, few: Sequence[int] | None = None
    ) -> list[Disc]:
        """A function over discs around times and states: all that it gives, or some of it."""
        algebra = Algebra(DISCS, _MOST_OPERATIONS)
        y = [Traced(Disc(*of), algebra) for of in zip(self._y.T, states.T, strict=True)]
        with np.errstate(all="ignore"):
            found = of.trace(
                algebra.functions,
                Traced(Disc(self._t, radii), algebra),
                y,
                [Traced(x, algebra) for x in of.parameters.tolist()],
                [Traced(x, algebra) for x in of.inputs.tolist()],
            )
            wanted = range(len(found)) if few is None else few
            discs = [algebra.plain(found[k]) for k in wanted]
            return [_as_many(disc, len(radii)) for disc in discs]


def _as_many(disc: Disc, count: int) -> Disc:
    """So many discs, where one stands for all as well."""
    return Disc(np.broadcast_to(disc.middle, count), np.broadcast_to(disc.radius, count))
