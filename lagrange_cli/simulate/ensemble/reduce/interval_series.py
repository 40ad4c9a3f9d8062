"""Interval arithmetic with Taylor series, many at a time.

A series holds bounds of the coefficients of a function at one place, or over an interval of places:
then the last coefficient bounds the remainder of the polynomial of one degree less (R. E. Moore,
R. B. Kearfott and M. J. Cloud, *Introduction to Interval Analysis*, 2009, chapters 5 and 9). Bounds
are rounded outward. A coefficient that has no bound is infinite; so are all beyond the first of a
function where it has a kink, and the first where it has a pole.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

#: Roundings of a product or a sum, and of a function of the C library, over the last place.
_LAST_PLACES, _OF_FUNCTIONS = 2.0, 8.0

#: Whole powers that are multiplied out.
_MOST_MULTIPLIED = 64


def _bounds(low: Array, high: Array, last_places: float = _LAST_PLACES) -> Series:
    """Round bounds outward; those that are no numbers are infinite."""
    off = last_places * np.finfo(float).eps
    low = low - off * np.abs(low) - np.finfo(float).tiny
    high = high + off * np.abs(high) + np.finfo(float).tiny
    return Series(np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high))


@dataclass(frozen=True)
class Series:
    """Bounds of Taylor coefficients.

    Attributes
    ----------
    low, high
        Shape (coefficients, m), in ascending degree.
    """

    low: Array
    high: Array

    @classmethod
    def constant(cls, value: Array, like: Series) -> Series:
        """Return a series of a number, shape () or (m,), of as many coefficients as another."""
        rows = np.zeros_like(like.low)
        rows[0] = value
        return cls(rows, rows)

    def __len__(self) -> int:
        return len(self.low)

    def __neg__(self) -> Series:
        return Series(-self.high, -self.low)

    def __add__(self, second: Series) -> Series:
        return _bounds(self.low + second.low, self.high + second.high)

    def __sub__(self, second: Series) -> Series:
        return self + (-second)

    def __mul__(self, second: Series) -> Series:
        return _stacked([_convolved(self, second, k) for k in range(len(self))])

    def __truediv__(self, second: Series) -> Series:
        return self * reciprocal(second)

    def rows(self, first: int, last: int | None = None) -> Series:
        """Return some of the coefficients."""
        return Series(self.low[first:last], self.high[first:last])

    def only(self, which: NDArray[np.intp]) -> Series:
        """Return some of the series."""
        return Series(self.low[:, which], self.high[:, which])

    def where(self, chosen: Array, second: Series) -> Series:
        """Return these bounds where flags of shape (m,) are set, others elsewhere."""
        return Series(
            np.where(chosen, self.low, second.low), np.where(chosen, self.high, second.high)
        )

    def hull(self, second: Series) -> Series:
        """Return bounds of both."""
        return Series(np.minimum(self.low, second.low), np.maximum(self.high, second.high))

    def beyond(self, count: int) -> Series:
        """Return the same without bounds of the coefficients from a number on."""
        low, high = self.low.copy(), self.high.copy()
        low[count:], high[count:] = -np.inf, np.inf
        return Series(low, high)

    @property
    def size(self) -> Array:
        """Largest magnitudes, shape (coefficients, m)."""
        return np.maximum(np.abs(self.low), np.abs(self.high))


def _stacked(rows: list[Series]) -> Series:
    return Series(np.vstack([r.low for r in rows]), np.vstack([r.high for r in rows]))


def _convolved(a: Series, b: Series, k: int, weights: Array | None = None) -> Series:
    """Return Σ wⱼ aⱼ bₖ₋ⱼ over j = 0 … k, one row; the weights are not negative."""
    return _product_sum(a.rows(0, k + 1), Series(b.low[k::-1], b.high[k::-1]), weights)


def _product_sum(a: Series, b: Series, weights: Array | None = None) -> Series:
    """Return Σ wⱼ aⱼ bⱼ, one row."""
    products = a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high
    low = np.minimum(np.minimum(products[0], products[1]), np.minimum(products[2], products[3]))
    high = np.maximum(np.maximum(products[0], products[1]), np.maximum(products[2], products[3]))
    if weights is not None:
        low, high = low * weights[:, None], high * weights[:, None]
    if len(low) == 1:
        return _bounds(low, high)
    off = (len(low) + 2) * np.finfo(float).eps
    off = off * np.maximum(np.abs(low), np.abs(high)).sum(axis=0)
    return _bounds((low.sum(axis=0) - off)[None], (high.sum(axis=0) + off)[None])


def _rate_times(u: Series, h: Series, k: int) -> Series:
    """Return the coefficient of degree k of the integral of u′ h, from those of h below k."""
    weights = np.arange(1, k + 1) / k
    behind = Series(h.low[k - 1 :: -1], h.high[k - 1 :: -1])
    return _product_sum(u.rows(1, k + 1), behind, weights)


def square(u: Series) -> Series:
    """Return u², whose constant coefficient is not negative."""
    rows = u * u
    low, high = rows.low.copy(), rows.high.copy()
    low[0] = np.maximum(low[0], 0.0)
    crosses = (u.low[0] < 0) & (u.high[0] > 0)
    smallest = np.minimum(np.abs(u.low[0]), np.abs(u.high[0]))
    tight = _bounds(smallest[None] ** 2, smallest[None] ** 2).low[0]
    low[0] = np.where(crosses, 0.0, np.maximum(low[0], tight))
    return Series(low, high)


def reciprocal(u: Series) -> Series:
    """Return 1/u; nothing is known of it where u may be zero."""
    first = _bounds(1 / u.high[:1], 1 / u.low[:1])
    may_vanish = (u.low[0] <= 0) & (u.high[0] >= 0)
    # A side that only touches zero has one bound.
    low = np.where(may_vanish, np.where(u.low[0] == 0, 1 / u.high[0], -np.inf), first.low[0])
    high = np.where(may_vanish, np.where(u.high[0] == 0, 1 / u.low[0], np.inf), first.high[0])
    first = _bounds(low[None], high[None])
    terms = [first]
    for k in range(1, len(u)):
        known = _stacked(terms)
        behind = Series(known.low[::-1], known.high[::-1])
        terms.append(-(_product_sum(u.rows(1, k + 1), behind) * first))
    return _stacked(terms)


def _integrated(first: Series, u: Series, slope: Callable[[Series], Series]) -> Series:
    """Return y with y′ = u′·slope(y), from its constant coefficient."""
    terms = [first]
    for k in range(1, len(u)):
        terms.append(_rate_times(u, slope(_stacked(terms)), k))
    return _stacked(terms)


def _rising(u: Series, function: Callable[[Array], Array]) -> Series:
    """Return the range of a function that does not fall, one row."""
    return _bounds(function(u.low[:1]), function(u.high[:1]), _OF_FUNCTIONS)


def exponential(u: Series) -> Series:
    first = _rising(u, np.exp)
    first = Series(np.maximum(first.low, 0.0), first.high)
    return _integrated(first, u, lambda y: y)


def logarithm(u: Series) -> Series:
    inverse = reciprocal(u)
    first = _rising(Series(np.maximum(u.low, 0.0), u.high), np.log)
    return _integrated(first, u, lambda y: inverse.rows(0, len(y)))


def tangent(u: Series) -> Series:
    first = _rising(u, np.tan)
    turns = np.floor((u.high[0] + np.pi / 2) / np.pi) != np.floor((u.low[0] + np.pi / 2) / np.pi)
    apart = turns | (u.high[0] - u.low[0] >= np.pi)
    unknown = Series(np.full_like(first.low, -np.inf), np.full_like(first.low, np.inf))
    one = Series.constant(np.array(1.0), u)
    return _integrated(unknown.where(apart, first), u, lambda y: one.rows(0, len(y)) + square(y))


def hyperbolic_tangent(u: Series) -> Series:
    first = _rising(u, np.tanh)
    first = Series(np.maximum(first.low, -1.0), np.minimum(first.high, 1.0))
    one = Series.constant(np.array(1.0), u)
    return _integrated(first, u, lambda y: one.rows(0, len(y)) - square(y))


def _from_slope(u: Series, function: Callable[[Array], Array], slope: Series) -> Series:
    """Return a rising function of u, whose slope is known."""
    return _integrated(_rising(u, function), u, lambda y: slope.rows(0, len(y)))


def arc_tangent(u: Series) -> Series:
    return _from_slope(u, np.arctan, reciprocal(_one(u) + square(u)))


def arc_sine(u: Series) -> Series:
    slope = reciprocal(power(_one(u) - square(u), 0.5))
    return _from_slope(_clipped(u, -1.0, 1.0), np.arcsin, slope)


def arc_cosine(u: Series) -> Series:
    half = np.array(np.pi / 2)
    return Series.constant(half, u) - arc_sine(u)


def area_sine(u: Series) -> Series:
    return _from_slope(u, np.arcsinh, reciprocal(power(_one(u) + square(u), 0.5)))


def area_cosine(u: Series) -> Series:
    slope = reciprocal(power(square(u) - _one(u), 0.5))
    return _from_slope(_clipped(u, 1.0, np.inf), np.arccosh, slope)


def area_tangent(u: Series) -> Series:
    slope = reciprocal(_one(u) - square(u))
    return _from_slope(_clipped(u, -1.0, 1.0), np.arctanh, slope)


def _one(u: Series) -> Series:
    return Series.constant(np.array(1.0), u)


def _clipped(u: Series, least: float, most: float) -> Series:
    """Return the same with the constant coefficient between bounds of a domain."""
    low, high = u.low.copy(), u.high.copy()
    low[0], high[0] = np.clip(low[0], least, most), np.clip(high[0], least, most)
    return Series(low, high)


def power(u: Series, exponent: float) -> Series:
    """Return u to a constant exponent; u is not negative unless that is whole."""
    if exponent == int(exponent) and abs(exponent) <= _MOST_MULTIPLIED:
        whole = _whole_power(u, abs(int(exponent)))
        return reciprocal(whole) if exponent < 0 else whole
    base = _clipped(u, 0.0, np.inf)
    inverse = reciprocal(base)
    if exponent > 0:
        first = _rising(base, lambda x: np.power(x, exponent))
    else:
        ends = np.power(base.high[:1], exponent), np.power(base.low[:1], exponent)
        first = _bounds(*ends, _OF_FUNCTIONS)
    factor = Series.constant(np.array(exponent), u)

    def slope(y: Series) -> Series:
        count = len(y)
        return factor.rows(0, count) * (y * inverse.rows(0, count))

    return _integrated(first, u, slope)


def _whole_power(u: Series, exponent: int) -> Series:
    """Multiply by repeated squares; even powers are squares of others."""
    if exponent == 0:
        return _one(u)
    if exponent == 1:
        return u
    half = square(_whole_power(u, exponent // 2))
    return half * u if exponent % 2 else half


def _pair(u: Series, first: tuple[Series, Series], sign: float) -> tuple[Series, Series]:
    """Return s and c with s′ = u′ c and c′ = sign · u′ s."""
    sines, cosines = [first[0]], [first[1]]
    for k in range(1, len(u)):
        s, c = _stacked(sines), _stacked(cosines)
        sines.append(_rate_times(u, c, k))
        turned = _rate_times(u, s, k)
        cosines.append(turned if sign > 0 else -turned)
    return _stacked(sines), _stacked(cosines)


def _wave(low: Array, high: Array, shift: float) -> Series:
    """Return the range of cos(x − shift) between bounds, one row."""
    ends = np.cos(low - shift), np.cos(high - shift)
    places = (low - shift) / (2 * np.pi), (high - shift) / (2 * np.pi)
    slack = 4 * np.finfo(float).eps * (1 + np.maximum(np.abs(places[0]), np.abs(places[1])))
    top = np.floor(places[1] + slack) >= np.ceil(places[0] - slack)
    bottom = np.floor(places[1] + 0.5 + slack) >= np.ceil(places[0] + 0.5 - slack)
    # A large argument is not known to the last place of its sine.
    off = 4 * np.pi * slack
    least = np.where(bottom, -1.0, np.minimum(*ends) - off)
    most = np.where(top, 1.0, np.maximum(*ends) + off)
    known = np.isfinite(low) & np.isfinite(high)
    least, most = np.where(known, least, -1.0), np.where(known, most, 1.0)
    return Series(np.maximum(least, -1.0)[None], np.minimum(most, 1.0)[None])


def sine_and_cosine(u: Series) -> tuple[Series, Series]:
    first = _wave(u.low[0], u.high[0], math.pi / 2), _wave(u.low[0], u.high[0], 0.0)
    return _pair(u, first, -1.0)


def hyperbolic_pair(u: Series) -> tuple[Series, Series]:
    low, high = u.low[:1], u.high[:1]
    smallest = np.where((low < 0) & (high > 0), 0.0, np.minimum(np.abs(low), np.abs(high)))
    largest = np.maximum(np.abs(low), np.abs(high))
    cosh = _bounds(np.cosh(smallest), np.cosh(largest), _OF_FUNCTIONS)
    return _pair(u, (_rising(u, np.sinh), cosh), 1.0)


# Functions with kinks and jumps.


def magnitude(u: Series) -> Series:
    kinked = _kinked(u.hull(-u))
    low = kinked.low.copy()
    low[0] = np.maximum(low[0], 0.0)
    return u.where(u.low[0] >= 0, (-u).where(u.high[0] <= 0, Series(low, kinked.high)))


def _kinked(hull: Series) -> Series:
    """Return bounds beside a kink: of the values and the slopes alone."""
    return hull.beyond(2)


def sign(u: Series) -> Series:
    one = _one(u)
    either = Series(-one.low, one.high).beyond(1)
    return one.where(u.low[0] > 0, (-one).where(u.high[0] < 0, either))


def largest(u: Series, v: Series) -> Series:
    either = _kinked(u.hull(v))
    low = either.low.copy()
    low[0] = np.maximum(u.low[0], v.low[0])
    either = Series(low, either.high)
    return u.where(u.low[0] >= v.high[0], v.where(v.low[0] >= u.high[0], either))


def angle(y: Series, x: Series) -> Series:
    """Return atan2(y, x), which jumps at the negative x axis."""
    corners = [np.arctan2(a, b) for a in (y.low[:1], y.high[:1]) for b in (x.low[:1], x.high[:1])]
    first = _bounds(np.min(corners, axis=0), np.max(corners, axis=0), _OF_FUNCTIONS)
    may_jump = (x.low[0] <= 0) & (y.low[0] <= 0) & (y.high[0] >= 0)
    apart = Series(np.full_like(first.low, -4.0), np.full_like(first.low, 4.0))
    inverse = reciprocal(square(x) + square(y))
    shares = x * inverse, y * inverse
    terms = [apart.where(may_jump, first)]
    for k in range(1, len(y)):
        turned = _rate_times(y, shares[0].rows(0, k), k)
        terms.append(turned - _rate_times(x, shares[1].rows(0, k), k))
    whole = _stacked(terms)
    return whole.beyond(1).where(may_jump, whole)
