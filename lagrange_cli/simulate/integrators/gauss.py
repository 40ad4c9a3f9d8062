"""Collocation at eight Gauss points, its equations solved by iteration.

Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, II.7. The
ends of the steps are of order 16; between them the collocation polynomial is
of order 9, and its error is what steers the steps. The eight stages of an
iteration do not depend on each other: machine code evaluates them side by side
(Antoñana, Makazaga, Murua, *Numer. Algorithms* 76 (2017) 861), which makes it
the fastest method here for smooth motion. The sum over steps is compensated as
in :mod:`.scipy_methods`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    UNDERFLOW,
    Control,
    Integrator,
    StepError,
    two_sum,
)
from lagrange_cli.simulate.integrators.right_hand_side import Rhs

_STAGES = 8
_MOST_ITERATIONS = 16

#: The error that iterations may leave beside the tolerance: it adds up over steps.
_LEFT = 1e-3

#: Rounding errors of the slopes, in units, where iterations stop to converge.
_STALLED = 2048.0

#: The error beside the estimate, which is the last coefficient of the slope.
_CAUTION = 0.01

#: Most growth of a step.
_GROW = 2.0


@dataclass(frozen=True)
class _Tableau:
    """Coefficients of the method with eight stages.

    At Gauss points the coefficient of P_k in a polynomial of degree 7 is exactly (2k + 1) Σ_j b_j
    P_k(x_j) f_j.

    Attributes
    ----------
    nodes, weights
        On [0, 1], shape (8,).
    a, aa
        Matrix of the stages, and its square, shape (8, 8).
    expansion
        Matrix from slopes at the nodes to Legendre coefficients, shape (8, 8).
    """

    nodes: Array
    weights: Array
    a: Array
    aa: Array
    expansion: Array


@cache
def _tableau() -> _Tableau:
    x, w = np.polynomial.legendre.leggauss(_STAGES)
    expansion = ((2 * np.arange(_STAGES) + 1) * _legendre(x)[:, :-1]).T * (w / 2)
    a = _integrals(x) @ expansion
    return _Tableau((1 + x) / 2, w / 2, a, a @ a, expansion)


def _legendre(x: Array) -> Array:
    """Evaluate P_0 … P_8 at each x, shape (len(x), 9)."""
    return np.asarray(np.polynomial.legendre.legvander(x, _STAGES))


def _integrals(x: Array) -> Array:
    """Integrate P_0 … P_7 over half the distance from −1 to each x, shape (len(x), 8)."""
    values = _legendre(x)
    k = np.arange(1, _STAGES)
    higher = (values[:, 2:] - values[:, :-2]) / (2 * (2 * k + 1))
    return np.column_stack([(1 + x) / 2, higher])


class Gauss16(Integrator):
    """Gauss–Legendre collocation of order 16 by fixed-point iteration.

    If the first half of y' is the second half of y, as in mechanics, the
    stages of the first half follow from the slopes of the second by A² in place
    of A, which halves the iterations.
    """

    name = "Gauss16"
    title = "Gauss–Legendre collocation with eight stages, by iteration"
    order = 16
    state_attributes = (
        *("_start", "_low", "_base", "_rest", "_t_old", "_next", "_shape"),
        *("_rate", "_first"),
    )

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        self._rhs, self._control = self._counted(rhs), control
        self.t, self.y, self.t_end = t0, np.array(y0, dtype=float), t_end
        self._start, self._low = self.y, np.zeros_like(self.y)
        self._t_old, self._next = t0, min(control.first_step, t_end - t0)
        n, self._tableau = len(self.y), _tableau()
        self._first = 0 if n % 2 else n // 2
        self._rate = 0.1
        # Legendre coefficients of the slope over the last step; a constant before the first.
        self._shape = np.zeros((_STAGES, n))
        self._shape[0] = self._rhs(t0, self.y)

    def step(self, limit: float) -> None:
        t, control = self.t, self._control
        smallest = 10 * (math.nextafter(t, math.inf) - t)
        h = max(min(self._next, control.max_step), smallest)
        start, start_low = two_sum(self._start, self._low)
        scale = 1 / (control.atol + control.rtol * np.abs(start))
        while h >= smallest:
            t_new = min(t + h, limit)
            h = t_new - t
            error, slopes, stages = self._solve(h, start, start_low, scale)
            if error <= 1 and self._first and not self._second_order(slopes, stages):
                self._first = 0
            elif error <= 1:
                self._accept(t_new, h, start, start_low, slopes)
                self._next = h * _factor(error)
                return
            else:
                h *= max(_factor(error), 0.2) if error > 1 else 0.5
        raise StepError(UNDERFLOW)

    def _solve(
        self, h: float, start: Array, start_low: Array, scale: Array
    ) -> tuple[float, Array, Array]:
        """Solve the equations of a step; return its error beside the tolerance, slopes and stages.

        The error is NaN where the iteration does not converge.
        """
        first, started = self._first, self.t > self._t_old
        nodes = self._tableau.nodes.tolist()
        weight = scale[first:]
        if first:
            weight = np.maximum(weight, h * scale[:first])
        slopes = self._predicted(h) if started else np.tile(self._shape[0], (_STAGES, 1))
        stages = self._stages(h, start, start_low, slopes)
        noise = _noise(stages[:, first:] * weight)
        before, rate = math.inf, self._expected_rate(h)
        for k in range(_MOST_ITERATIONS):
            old = stages
            slopes = np.array(
                [self._rhs(self.t + h * c, y) for c, y in zip(nodes, old, strict=True)]
            )
            if not np.isfinite(slopes).all():
                break
            error = _estimate(h, slopes[:, first:], weight, noise)
            if k == 0 and started and error > 1:
                return error, slopes, old
            stages = self._stages(h, start, start_low, slopes)
            change = _mean((stages - old)[:, first:] * weight)
            noise = _noise(stages[:, first:] * weight)
            rate = change / before if k else rate
            stalled = k > 1 and rate > 0.5 and change < _STALLED * noise
            if change * rate < _LEFT * (1 - rate) or change < noise or stalled:
                self._rate = min(max(rate, 1e-3), 0.5)
                return error, slopes, old
            if not rate < 0.9:
                break
            before = change
        return math.nan, slopes, stages

    def _expected_rate(self, h: float) -> float:
        """Predict how errors shrink in an iteration: as in the last step, and slower if longer."""
        ratio = h / (self.t - self._t_old) if self.t > self._t_old else 1.0
        return min(self._rate * max(ratio, 1.0) ** 2, 0.5)

    def _predicted(self, h: float) -> Array:
        """Continue the slope over the last step over a step of ``h``."""
        ratio = h / (self.t - self._t_old)
        return _legendre(1 + 2 * ratio * self._tableau.nodes)[:, :-1] @ self._shape

    def _stages(self, h: float, start: Array, start_low: Array, slopes: Array) -> Array:
        first = self._first
        following = start[first:] + (start_low[first:] + h * (self._tableau.a @ slopes[:, first:]))
        if not first:
            return np.asarray(following)
        moved = h * (start[first:] + start_low[first:]) * self._tableau.nodes[:, None]
        moved += h * h * (self._tableau.aa @ slopes[:, first:])
        return np.hstack([start[:first] + (start_low[:first] + moved), following])

    def _second_order(self, slopes: Array, stages: Array) -> bool:
        half = self._first
        return bool((slopes[:, :half] == stages[:, half:]).all())

    def _accept(
        self, t_new: float, h: float, start: Array, start_low: Array, slopes: Array
    ) -> None:
        if self._first:
            velocities = self._stages(h, start, start_low, slopes)[:, self._first :]
            slopes = np.hstack([velocities, slopes[:, self._first :]])
        low = start_low + h * (self._tableau.weights @ slopes)
        y = start + low
        projected = self._arrived(t_new, y)
        if projected is not y:
            low = low + (projected - y)
        self._shape = self._tableau.expansion @ slopes
        self._base, self._rest = start, start_low
        self._start, self._low = start, low
        self._t_old, self.t, self.y = self.t, t_new, projected

    def interpolate(self, times: Array) -> Array:
        h = self.t - self._t_old
        x = 2 * ((np.asarray(times) - self._t_old) / h) - 1
        return np.asarray(self._base + (self._rest + h * (_integrals(x) @ self._shape)))


def _estimate(h: float, slopes: Array, weight: Array, noise: float) -> float:
    """Estimate the error by how the expansion in Legendre polynomials ends.

    It is relative to the tolerance, or to the rounding of the stages if that is larger.
    """
    before, last = (_tableau().expansion[-2:] @ slopes) * weight * h
    last, before = _mean(last), _mean(before)
    return _CAUTION * last * (last / before if last < before else 1.0) / max(1.0, noise)


def _noise(stages: Array) -> float:
    """Estimate the rounding error of stages."""
    return 2.0**-51 * _mean(stages)


def _mean(values: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def _factor(error: float) -> float:
    """Return the factor by which a step may change: the interpolant is of order 9."""
    return min(0.9 * error ** (-1 / 9), _GROW) if error > 0 else _GROW
