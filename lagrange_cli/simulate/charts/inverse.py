"""Coordinates of a chart at one position, by Newton's method."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

#: A function of a chart: t, [q, v] → numbers.
Function = Callable[[float, Array], Array]

#: Most steps of Newton's method.
_NEWTON = 30

#: Its last step, relative to the size of the coordinates.
_SMALLEST = 1e-13

#: One that changes no rates, relative to the same.
_ROUNDING = 4 * float(np.finfo(float).eps)

#: Misfit of a position, beside its size, that no coordinates of the chart account for.
_MISFIT = 1e-6

#: Largest step of a coordinate.
LONGEST_STEP = 1.0

#: A direction that moves the positions by less than this part of what others do moves nothing.
_NOTHING = 1e-9

#: Least distance from singular configurations of a chart, as a multiple of the uncertainty of
#: positions.
_CLEAR = 10.0


@dataclass
class ChartPoint:
    """Coordinates of one position.

    Attributes
    ----------
    t
        Time.
    r, w
        Position and velocity, shape (k,).
    q, v
        Coordinates of the chart and their rates, shape (n,).
    jacobian, volume
        ∂r/∂q, shape (k, n), and the volume that its columns span.
    clear
        The chart is regular here, by more than the uncertainty of the position.
    amplification
        As in :class:`.continuation.ContinuedCoordinates`, shape (n,); infinite if q is not known.
    """

    t: float
    r: Array
    w: Array
    q: Array
    v: Array
    jacobian: Array
    volume: float
    clear: bool
    amplification: Array


@dataclass
class _Tangent:
    """Derivatives of the positions, with ∂r/∂q = left·diag(sizes)·right if it is finite.

    Attributes
    ----------
    jacobian, drift
        ∂r/∂q, shape (k, n), and ∂r/∂t, shape (k,).
    left, sizes, right
        Shapes (k, m), (m,) and (m, n) with m = min(k, n).
    """

    jacobian: Array
    drift: Array
    left: Array = field(default_factory=lambda: np.empty((0, 0)))
    sizes: Array = field(default_factory=lambda: np.empty(0))
    right: Array = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def finite(self) -> bool:
        return len(self.sizes) > 0

    def least(self, moved: Array) -> Array:
        """Return the smallest x for which ∂r/∂q·x is closest to ``moved``, NaN if there is none."""
        if not self.finite:
            return np.full(self.jacobian.shape[1], np.nan)
        counts = self.sizes > _NOTHING * self.sizes[0]
        return np.asarray(np.where(counts, (moved @ self.left) / self.sizes, 0.0) @ self.right)


class ChartInverse:
    """Positions → coordinates of a chart.

    Parameters
    ----------
    positions, velocities
        As in :func:`.continuation.continue_coordinates`.
    errors
        Uncertainty of the positions, shape (k,).
    """

    def __init__(self, positions: Function, velocities: Function, errors: Array) -> None:
        self._positions, self._velocities, self._errors = positions, velocities, errors

    def point(self, t: float, guess: Array, r: Array, w: Array) -> ChartPoint:
        """Find the coordinates, and their rates, of a position r and a velocity w near a guess."""
        q, n = guess.copy(), len(guess)
        for _ in range(_NEWTON):
            tangent = self._tangent(t, q)
            step = tangent.least(r - self._positions(t, np.concatenate([q, np.zeros(n)])))
            if not np.isfinite(step).all():
                break
            q = q + np.minimum(np.maximum(step, -LONGEST_STEP), LONGEST_STEP)
            if (np.abs(step) <= _SMALLEST * (1 + np.abs(q))).all():
                break
        if not (np.abs(step) <= _ROUNDING * (1 + np.abs(q))).all():
            tangent = self._tangent(t, q)
        v, jacobian = tangent.least(w - tangent.drift), tangent.jacobian
        size = np.abs(r).max(initial=1e-300)
        miss = np.abs(r - self._positions(t, np.concatenate([q, np.zeros(n)]))).max()
        there = bool(miss <= _MISFIT * size)
        if not tangent.finite:
            return ChartPoint(t, r, w, q, v, jacobian, np.nan, False, np.full(n, np.inf))
        volume = math.prod(tangent.sizes.tolist())
        clear = bool(tangent.sizes[-1] > _NOTHING * tangent.sizes[0])
        inverse = (tangent.right.T / tangent.sizes) @ tangent.left.T
        spread = np.abs(inverse) @ self._errors if clear else np.full(n, np.inf)
        amplification = spread if clear and there else np.full(n, np.inf)
        away = clear and bool((_CLEAR * spread < 1).all())
        return ChartPoint(t, r, w, q, v, jacobian, volume, away, amplification)

    def _tangent(self, t: float, q: Array) -> _Tangent:
        jacobian, drift = self.jacobian(t, q)
        if not np.isfinite(jacobian).all():
            return _Tangent(jacobian, drift)
        return _Tangent(jacobian, drift, *np.linalg.svd(jacobian, full_matrices=False))

    def jacobian(self, t: float, q: Array) -> tuple[Array, Array]:
        """Evaluate ∂r/∂q, shape (k, n), and ∂r/∂t, shape (k,)."""
        n = len(q)
        drift = np.asarray(self._velocities(t, np.concatenate([q, np.zeros(n)])))
        columns = []
        for j in range(n):
            unit = np.zeros(n)
            unit[j] = 1.0
            columns.append(self._velocities(t, np.concatenate([q, unit])) - drift)
        return np.array(columns).T, drift


def moving_nothing(point: ChartPoint) -> NDArray[np.bool_]:
    """Flag the coordinates of the direction that moves positions least, shape (n,)."""
    if not np.isfinite(point.jacobian).all():
        return np.ones(len(point.q), dtype=bool)
    least = np.linalg.svd(point.jacobian)[2][-1]
    return np.asarray(np.abs(least) > _NOTHING)


def alikeness(one: ChartPoint, two: ChartPoint) -> float:
    """Return the cosine between the planes that columns of ∂r/∂q span, −1 if one is turned over.

    It is turned over on the other side of a configuration at which columns become dependent.
    """
    volumes = one.volume * two.volume
    return float(np.linalg.det(one.jacobian.T @ two.jacobian) / volumes) if volumes > 0 else 0.0
