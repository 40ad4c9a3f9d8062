"""Motion along switching surfaces: Filippov's combination of what the equations are around them.

A. F. Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988, §4: where both
sides of a surface lead back to it, the motion stays on it with the part of both sides that
keeps it there, as dry friction holds a body at rest. One surface combines its two sides, whatever
else differs between them. Several surfaces hold a motion together where the slopes of the regions
around them, the *corners*, are affine in the sides: then Filippov's combination is one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.right_hand_side import (
    StructuredRhs,
    Surfaces,
    SurfaceSides,
    structured,
)

#: Deviation of slopes from an affine function of the sides, relative to them. Rounding makes it
#: less, products of two kinks much more.
LINEAR = 1e-6

#: Condition of the scaled matrix of rates above which its rows are taken to depend on each other:
#: rounding is by far smaller, and so is the condition of any that belongs to separate surfaces.
_CONDITIONED = 1e8

#: Newton steps by which a state is moved onto the surfaces that hold it: it is there but for the
#: error of one step of the method.
_STEPS_ONTO = 2

#: Part of the terms that a surface's function is the sum of, by which a state may be off it.
_ROUNDING = 4 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class Combination:
    """Filippov's combination of corners, whose slopes are affine in the sides.

    Attributes
    ----------
    parts
        Parts between both sides at which the rates are zero, shape (surfaces,); not numbers if
        there are none.
    slope
        The slope there, shape (2n,).
    directions
        Derivatives of the slope by the sides, shape (surfaces, 2n).
    matrix
        Derivatives of the rates by the sides, a row a rate, shape (surfaces, surfaces).
    margin
        Negative where the slopes are not affine in the sides but for rounding.
    """

    parts: Array
    slope: Array
    directions: Array
    matrix: Array
    margin: float

    @property
    def is_one(self) -> bool:
        """Tell whether one combination alone has rates of zero; of one surface it has."""
        if len(self.matrix) == 1:
            return True
        sizes = np.abs(self.matrix).max(axis=1, initial=0.0)
        scaled = self.matrix / np.where(sizes > 0, sizes, 1.0)[:, None]
        return self.margin >= 0 and bool(np.linalg.cond(scaled) < _CONDITIONED)

    @classmethod
    def of_two(cls, upper: Array, lower: Array, rate: float, lower_rate: float) -> Combination:
        """Combine both sides of one surface, with their slopes and its rates there."""
        direction, derivative = (upper - lower) / 2, (rate - lower_rate) / 2
        if derivative:
            part = -(rate + lower_rate) / 2 / derivative
        else:  # no side leads away where both rates are zero, as friction that fades with the speed
            part = 0.0 if rate == 0 else float("nan")
        slope = _combined_slope((upper + lower) / 2, np.array([part]), direction[None])
        return cls(np.array([part]), slope, direction[None], np.array([[derivative]]), 0.0)

    @classmethod
    def of(cls, signs: Array, slopes: Array, rates: Array) -> Combination:
        """Combine corners of ``signs`` with their slopes and rates, all of shape (corners, …)."""
        count = len(signs)
        if count == 2:
            upper, lower = slopes if signs[0, 0] > 0 else slopes[::-1]
            rate, lower_rate = rates[:, 0].tolist() if signs[0, 0] > 0 else rates[::-1, 0].tolist()
            return cls.of_two(upper, lower, rate, lower_rate)
        directions, matrix = signs.T @ slopes / count, (signs.T @ rates / count).T
        middle = slopes.mean(axis=0)
        try:
            parts = np.linalg.solve(matrix, -rates.mean(axis=0))
        except np.linalg.LinAlgError:
            parts = np.full(signs.shape[1], np.nan)
        deviation = np.abs(slopes - middle - signs @ directions).max()
        margin = float(LINEAR * np.abs(slopes).max() - deviation)
        slope = _combined_slope(middle, parts, directions)
        return cls(parts, slope, directions, matrix, margin)


def _combined_slope(middle: Array, parts: Array, directions: Array) -> Array:
    """Sum a slope and its changes; what cancels but for rounding is zero, since steps of a body at
    rest would have no scale but that rounding."""
    slope = middle + parts @ directions
    sizes = np.abs(middle) + np.abs(parts) @ np.abs(directions)
    slope[np.abs(slope) <= _ROUNDING * sizes] = 0.0
    return np.asarray(slope)


def is_diagonally_stable(matrix: Array) -> bool:
    """Tell whether D A + Aᵀ D is shown to be positive definite for a positive diagonal D.

    Of two rows that is so where all principal minors are positive (Berman and Plemmons,
    *Nonnegative Matrices in the Mathematical Sciences*, 1979). Of more rows a few scalings are
    tried: that which makes the matrix symmetric, as where friction acts on rates, and that of the
    diagonal.
    """
    diagonal = np.diagonal(matrix)
    if not (diagonal > 0).all():
        return False
    if len(matrix) <= 2:
        return bool(np.linalg.det(matrix) > 0)
    symmetric = np.ones(len(matrix))
    for k in range(1, len(matrix)):
        for j in range(k):
            if matrix[j, k] * matrix[k, j] > 0:
                symmetric[k] = symmetric[j] * matrix[j, k] / matrix[k, j]
                break
    for scaling in (np.ones(len(matrix)), symmetric, 1 / diagonal):
        scaled = scaling[:, None] * matrix
        if (scaling > 0).all() and np.linalg.eigvalsh(scaled + scaled.T).min() > 0:
            return True
    return False


class SlidingRhs(StructuredRhs):
    """The right-hand side along surfaces that hold the motion, called like any.

    ``corners`` are the sides around them. Their functions stay zero: the parts between both sides
    solve a linear system, whose entries are differences of rates. States are moved onto the
    surfaces along the slopes' differences, which are where the jumping forces push.
    """

    def __init__(
        self, surfaces: Surfaces, sliding: Sequence[int], corners: Sequence[SurfaceSides]
    ) -> None:
        self._surfaces, self._sliding, self._corners = surfaces, list(sliding), tuple(corners)
        self._signs = np.array([[sides[k] for k in sliding] for sides in corners])
        self._onto = structured(surfaces.side(self._corners[0])).project
        self._positional = surfaces.positional
        self._last: tuple[float, Array, Combination] | None = None
        self.project = self.onto_surfaces

    def __call__(self, t: float, y: Array) -> Array:
        return self.parts(t, y)[1]

    def parts(self, t: float, y: Array) -> tuple[Array, Array]:
        """Solve for the parts between both sides, and the slope, shapes (surfaces,) and (2n,)."""
        combined = self._combined(t, y)
        return combined.parts, combined.slope

    @property
    def ends_count(self) -> int:
        """The number of :meth:`ends`."""
        return 2 * len(self._sliding) + (len(self._sliding) > 1)

    def ends(self, t: float, y: Array) -> list[float]:
        """Evaluate what is positive while the motion is held: distances of each part from both
        ends, and that slopes are affine in the sides of several surfaces."""
        combined = self._combined(t, y)
        ends = [end for part in combined.parts.tolist() for end in (1 - part, 1 + part)]
        return ends if len(self._sliding) == 1 else [*ends, combined.margin]

    def _combined(self, t: float, y: Array) -> Combination:
        """Combine the corners at a state; events and states ask for the last one again."""
        if self._last is None or self._last[0] != t or not np.array_equal(self._last[1], y):
            slopes = [self._surfaces.side(sides)(t, y) for sides in self._corners]
            rates = [
                self._surfaces.rates(t, y, sides, slope)
                for sides, slope in zip(self._corners, slopes, strict=True)
            ]
            leading = [
                [float((r.second if self._positional[k] else r.first)[k]) for k in self._sliding]
                for r in rates
            ]
            combined = Combination.of(self._signs, np.array(slopes), np.array(leading))
            self._last = t, np.array(y), combined
        return self._last[2]

    def onto_surfaces(self, t: float, y: Array) -> Array:
        """Move a state onto the surfaces, and onto the constraints."""
        moved = y if self._onto is None else self._onto(t, y)
        for _ in range(_STEPS_ONTO):
            values, sizes = self._surfaces.values(t, moved, self._corners[0])
            off = [
                0.0 if self._positional[k] or abs(values[k]) <= _ROUNDING * sizes[k] else values[k]
                for k in self._sliding
            ]
            if not any(off):
                break
            combined = self._combined(t, moved)
            try:
                change = np.linalg.solve(combined.matrix, np.array(off)) @ combined.directions
            except np.linalg.LinAlgError:
                break
            moved = moved - change
            moved = moved if self._onto is None else self._onto(t, moved)
        return moved
