"""Polynomials at Chebyshev points: panels of time, integrals, derivatives, and series.

The nodes of degree N are the extrema of the Chebyshev polynomial T_N, from −1 to 1. A panel is a
part of the time; a function of the time is replaced in it by the polynomial through its values at
the nodes, whose last coefficients tell how far that is off (J. P. Boyd, *Solving Transcendental
Equations*, 2014, chapters 2 and 3; L. N. Trefethen, *Approximation Theory and Approximation
Practice*, 2013, chapters 3 and 18; L. N. Trefethen, *Spectral Methods in MATLAB*, 2000, chapters 6
and 12).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

#: Degree of the polynomials of panels: even, for integrals over every other node, and about that of
#: the integrators' own polynomials.
DEGREE = 16

#: Trailing coefficients whose largest stands for all that were left out: every other coefficient of
#: an even or odd function vanishes.
_LAST = 3

#: Bound of the coefficients that were left out, over that largest one: twice the sum of a series
#: that falls by a third from one to the next, since those of a kink fall more slowly. Not tuned.
_LEFT_OUT = 4.0

#: Numbers of rows.
Numbers: TypeAlias = NDArray[np.intp]

#: One flag a row.
Flags: TypeAlias = NDArray[np.bool_]


@cache
def nodes(degree: int) -> Array:
    """Return the nodes of a degree on [−1, 1], ascending, shape (degree + 1,)."""
    return -np.cos(np.pi * np.arange(degree + 1) / degree)


def nodes_between(edges: Array) -> Array:
    """Return the nodes of all panels between edges, shape (panels · DEGREE + 1,)."""
    inner = (1 + nodes(DEGREE)[:-1]) / 2
    return np.append((edges[:-1, None] + np.diff(edges)[:, None] * inner).ravel(), edges[-1])


# Integrals, and values between nodes.


@dataclass(frozen=True)
class Panels:
    """Panels of equal length between two times.

    Attributes
    ----------
    nodes
        Times in ascending order, shape (panels · :data:`DEGREE` + 1,); panels share their ends.
    count
        Number of panels.
    """

    nodes: Array
    count: int

    @property
    def span(self) -> float:
        return float(self.nodes[-1] - self.nodes[0])

    def integral(self, values: Array) -> tuple[float, float]:
        """Integrate a function with these values at the nodes by Clenshaw and Curtis.

        Returns
        -------
        The integral, and its difference from the integral with every other node, which is far
        above the error of the first.
        """
        rows = np.arange(self.count)[:, None] * DEGREE + np.arange(DEGREE + 1)
        half = self.span / self.count / 2
        fine = float(half * np.sum(values[rows] @ _weights(DEGREE)))
        coarse = float(half * np.sum(values[rows[:, ::2]] @ _weights(DEGREE // 2)))
        return fine, abs(fine - coarse)

    def weights(self) -> Array:
        """Return the weights of the nodes in integrals over the whole time."""
        total = np.zeros(len(self.nodes))
        for first in range(0, len(self.nodes) - 1, DEGREE):
            total[first : first + DEGREE + 1] += _weights(DEGREE)
        return total * self.span / self.count / 2


def panels(start: float, end: float, count: int) -> Panels:
    """Divide a time into panels of equal length."""
    return Panels(nodes_between(np.linspace(start, end, count + 1)), count)


@cache
def _weights(degree: int) -> Array:
    """Return the weights of Clenshaw and Curtis on [−1, 1]; ``degree`` is even."""
    angles = np.pi * np.arange(degree + 1) / degree
    orders = np.arange(1, degree // 2 + 1)
    parts = np.where(orders == degree // 2, 1.0, 2.0) / (4.0 * orders**2 - 1)
    weights = np.asarray(2.0 * (1 - np.cos(2 * np.outer(angles, orders)) @ parts) / degree)
    weights[[0, -1]] /= 2
    return weights


@cache
def _barycentric_weights() -> Array:
    signs = np.where(np.arange(DEGREE + 1) % 2, -1.0, 1.0)
    signs[[0, -1]] /= 2
    return signs


def barycentric(times: Array, values: Array, t: float) -> Array:
    """Interpolate between values at the nodes of one panel, shape (DEGREE + 1, …), at a time."""
    distances = t - times
    if np.any(distances == 0):
        return np.asarray(values[int(np.argmin(np.abs(distances)))])
    shares = _barycentric_weights() / distances
    return np.asarray(np.tensordot(shares / shares.sum(), values, 1))


# Derivatives at the nodes, for collocation.


@dataclass(frozen=True)
class Points:
    """Chebyshev points on [0, 1] in ascending order, and derivatives of polynomials there.

    Attributes
    ----------
    s
        The points, shape (degree + 1,).
    first, second
        Matrices that make first and second derivatives of values at the points.
    """

    s: Array
    first: Array
    second: Array


@cache
def points_of(degree: int) -> Points:
    """Return the points of a degree with their differentiation matrices."""
    x = nodes(degree)
    signs = np.where(np.arange(degree + 1) % 2, -1.0, 1.0)
    signs[[0, -1]] *= 2
    first = np.outer(signs, 1 / signs) / (x[:, None] - x + np.eye(degree + 1))
    first -= np.diag(first.sum(1))
    first *= 2
    return Points((1 + x) / 2, first, first @ first)


def coefficients_of(values: Array) -> Array:
    """Return the Chebyshev coefficients, of ascending degree, of columns of values at the nodes."""
    from scipy.fft import dct

    coefficients = np.asarray(dct(values[::-1], 1, axis=0)) / (len(values) - 1)
    coefficients[[0, -1]] /= 2
    return coefficients


# Series.


@dataclass(frozen=True)
class Series:
    """A function of the time as a polynomial in each panel.

    Attributes
    ----------
    edges
        Ends of the panels, shape (panels + 1,).
    coefficients
        Of Chebyshev polynomials, shape (panels, DEGREE + 1).
    left_out
        Estimated distance of the polynomial from the function, shape (panels,).
    """

    edges: Array
    coefficients: Array
    left_out: Array

    @classmethod
    def through(cls, edges: Array, values: Array) -> Series:
        """Make the polynomials through values at the nodes, shape (panels · DEGREE + 1,)."""
        coefficients = _coefficients(values, np.arange(len(edges) - 1))
        return cls(edges, coefficients, _left_out(coefficients))

    @cached_property
    def slope(self) -> Series:
        """The derivative by the time."""
        derived = _derived(self.coefficients) * (2 / np.diff(self.edges))[:, None]
        return Series(self.edges, derived, np.full(len(derived), np.nan))

    def panels_of(self, t: Array) -> Numbers:
        """Return the number of the panel of each time."""
        numbers = np.searchsorted(self.edges, t, side="right") - 1
        return np.clip(numbers, 0, len(self.edges) - 2)

    def at(self, t: Array) -> Array:
        """Evaluate the function at some times, shape (m,)."""
        return self.within(self.panels_of(t), t)

    def within(self, panels: Numbers, t: Array) -> Array:
        """Evaluate the polynomials of some panels, each at one time, shapes (m,)."""
        return _value(self.coefficients[panels], _place(self.edges, panels, t))

    def least(self) -> Array:
        """Return a lower bound of |f| in each panel, negative where f may vanish."""
        size = np.abs(self.coefficients)
        return np.asarray(2 * size[:, 0] - size.sum(axis=1) - self.left_out)


class Interpolated(NamedTuple):
    """A function at some times, its slopes, and how far the polynomials are off, shapes (m,)."""

    values: Array
    slopes: Array
    left_out: Array


def interpolated(edges: Array, values: Array, panels: Numbers, t: Array) -> Interpolated:
    """Interpolate between values at the nodes, each time in a panel, shapes (m,)."""
    coefficients, place = _coefficients(values, panels), _place(edges, panels, t)
    slopes = _value(_derived(coefficients), place) * 2 / (edges[panels + 1] - edges[panels])
    return Interpolated(_value(coefficients, place), slopes, _left_out(coefficients))


@cache
def _to_coefficients() -> Array:
    """Return the matrix that makes coefficients of values at the nodes of a panel."""
    vandermonde = np.polynomial.chebyshev.chebvander(nodes(DEGREE), DEGREE)
    return np.asarray(np.linalg.inv(vandermonde), float)


def _coefficients(values: Array, panels: Numbers) -> Array:
    """Return the coefficients of the polynomials of some panels, shape (m, DEGREE + 1)."""
    rows = panels[:, None] * DEGREE + np.arange(DEGREE + 1)
    return np.asarray(values[rows] @ _to_coefficients().T)


def _derived(coefficients: Array) -> Array:
    """Return the coefficients of the derivatives by the place in the panel."""
    return np.asarray(np.polynomial.chebyshev.chebder(coefficients, axis=1), float)


def _left_out(coefficients: Array) -> Array:
    """Estimate how far polynomials are off, by their last coefficients and by rounding."""
    last = np.abs(coefficients[:, -_LAST:]).max(axis=1)
    rounding = np.finfo(float).eps * np.abs(coefficients).sum(axis=1)
    return np.asarray(_LEFT_OUT * last + rounding)


def _place(edges: Array, panels: Numbers, t: Array) -> Array:
    """Return the place of each time in its panel, from −1 to 1."""
    left, right = edges[panels], edges[panels + 1]
    return np.asarray((2 * t - left - right) / (right - left))


def _value(c: Array, x: Array) -> Array:
    """Evaluate series, each at one place, by Clenshaw's recurrence; shapes (m, k) and (m,)."""
    last, before = np.zeros_like(x), np.zeros_like(x)
    for k in range(c.shape[1] - 1, 0, -1):
        last, before = c[:, k] + 2 * x * last - before, last
    return np.asarray(c[:, 0] + x * last - before)
