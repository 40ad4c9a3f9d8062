"""Panels of Chebyshev nodes along a motion, and the polynomials through what is known there.

A panel is a part of the time; a function of the time is replaced in it by the polynomial through
its values at the extrema of a Chebyshev polynomial, whose last coefficients tell how far that is
off (J. P. Boyd, *Solving Transcendental Equations*, 2014, chapters 2 and 3; L. N. Trefethen,
*Approximation Theory and Approximation Practice*, 2013, chapters 3 and 18).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

#: Degree of the polynomials: about that of the integrators' own.
DEGREE = 16

#: Last coefficients of which the largest stands for all that were left out: of an even or odd
#: function every other one vanishes.
_LAST = 3

#: What is left out, over that largest coefficient: a series that falls by a third each time, or a
#: kink, whose coefficients fall slowly. Set by hand.
_LEFT_OUT = 4.0

#: Numbers of rows.
Numbers: TypeAlias = NDArray[np.intp]

#: Which rows.
Flags: TypeAlias = NDArray[np.bool_]


@cache
def _nodes() -> Array:
    """Nodes on [−1, 1], ascending."""
    return -np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)


@cache
def _to_coefficients() -> Array:
    """The matrix that makes coefficients of values at the nodes."""
    return np.asarray(np.linalg.inv(np.polynomial.chebyshev.chebvander(_nodes(), DEGREE)), float)


def nodes_between(edges: Array) -> Array:
    """Return the nodes of all panels between edges, shape (panels · DEGREE + 1,)."""
    inner = (1 + _nodes()[:-1]) / 2
    return np.append((edges[:-1, None] + np.diff(edges)[:, None] * inner).ravel(), edges[-1])


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
        found = np.searchsorted(self.edges, t, side="right") - 1
        return np.clip(found, 0, len(self.edges) - 2)

    def at(self, t: Array) -> Array:
        """Evaluate the function at some times, shape (m,)."""
        return self.within(self.panels_of(t), t)

    def within(self, panels: Numbers, t: Array) -> Array:
        """Evaluate the polynomials of some panels, each at one time, shapes (m,)."""
        return _value(self.coefficients[panels], _place(self.edges, panels, t))

    def least(self) -> Array:
        """Return a bound from below of |f| in each panel, negative where it may vanish."""
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


def _coefficients(values: Array, panels: Numbers) -> Array:
    """Coefficients of the polynomials of some panels, shape (m, DEGREE + 1)."""
    rows = panels[:, None] * DEGREE + np.arange(DEGREE + 1)
    return np.asarray(values[rows] @ _to_coefficients().T)


def _derived(coefficients: Array) -> Array:
    """Coefficients of the derivatives by the place."""
    return np.asarray(np.polynomial.chebyshev.chebder(coefficients, axis=1), float)


def _left_out(coefficients: Array) -> Array:
    """Estimate how far polynomials are off, by their last coefficients and by rounding."""
    last = np.abs(coefficients[:, -_LAST:]).max(axis=1)
    rounding = np.finfo(float).eps * np.abs(coefficients).sum(axis=1)
    return np.asarray(_LEFT_OUT * last + rounding)


def _place(edges: Array, panels: Numbers, t: Array) -> Array:
    """Where times lie in their panels, from −1 to 1."""
    left, right = edges[panels], edges[panels + 1]
    return np.asarray((2 * t - left - right) / (right - left))


def _value(c: Array, x: Array) -> Array:
    """Evaluate series, each at one place, by Clenshaw's recurrence; shapes (m, k) and (m,)."""
    last, before = np.zeros_like(x), np.zeros_like(x)
    for k in range(c.shape[1] - 1, 0, -1):
        last, before = c[:, k] + 2 * x * last - before, last
    return np.asarray(c[:, 0] + x * last - before)
