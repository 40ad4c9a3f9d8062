"""Bounds of an expression along motions, over intervals of the time.

The state is a polynomial in each panel (:mod:`.dense_motion`). The expression over it has a Taylor
polynomial about the middle of an interval, with a remainder bounded by interval arithmetic, so that
nothing narrow hides between places. Errors of the state are counted by bounds of the derivatives of
the expression.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.reduce.expression_graph import Domain, Flags, Node, evaluated
from lagrange_cli.simulate.ensemble.reduce.interval_series import Series
from lagrange_cli.simulate.ensemble.reduce.motion_series import (
    Intervals,
    MotionSeries,
    in_middle,
    over_whole,
    remainder,
    rough_range,
)

#: Degree of the Taylor polynomials.
_DEGREE = 5

#: Rounding errors of a polynomial over the sizes of its terms.
_ROUNDING = 16 * float(np.finfo(float).eps)

#: Halvings of the bracket of a root: to the last place.
_HALVINGS = 56


@dataclass(frozen=True)
class Enclosures:
    """Bounds of an expression in intervals, shapes (m,), infinite where there are none.

    Attributes
    ----------
    low, high
        Over the interval.
    middle_low, middle_high
        In its middle.
    top
        Lower bound of the largest value in the interval.
    mean_low, mean_high
        Of the mean over it.
    root_low, root_high
        Of the only place, from −1 to 1, at which the expression rises above zero, where it rises
        everywhere in the interval; NaN elsewhere.
    spread, middle_spread
        Parts of these, over the interval and in its middle, that errors of the state cause.
    nowhere, partly
        The expression has no value in the interval, or none at some of its places.
    """

    low: Array
    high: Array
    middle_low: Array
    middle_high: Array
    top: Array
    mean_low: Array
    mean_high: Array
    root_low: Array
    root_high: Array
    spread: Array
    middle_spread: Array
    nowhere: Flags
    partly: Flags


@dataclass(frozen=True)
class Expression:
    """An output of a model along some motions.

    Attributes
    ----------
    along
        The motions.
    value, gradient
        Names of the output, and of its derivatives by the state.
    sign
        With which the output is multiplied.
    """

    along: MotionSeries
    value: str
    gradient: tuple[str, ...]
    sign: float = 1.0

    @property
    def graph(self) -> Node | float:
        """Return the graph of the output with its sign."""
        root = self.along.outputs.values[self.value]
        return root if self.sign > 0 else -root

    def bounds(self, intervals: Intervals) -> Enclosures:
        """Bound the expression over whole intervals alone, which is quick."""
        taylor = self.along.taylor(intervals)
        domain = Domain.whole(len(intervals))
        with np.errstate(all="ignore"):
            inputs = self.along.leaves(
                intervals, over_whole(taylor, 1), self.along.errors(intervals)
            )
            (value,) = evaluated([self.graph], inputs, domain)
        low, high = value.low[0], value.high[0]
        unknown = np.full(len(intervals), np.inf)
        ends = low, high, -unknown, unknown, low, low, high
        nan, zero = np.full(len(intervals), np.nan), np.zeros(len(intervals))
        return Enclosures(*ends, nan, nan, zero, zero, domain.nowhere, domain.partly)

    def enclosed(self, intervals: Intervals, above: Array | None = None) -> Enclosures:
        """Bound the expression by its Taylor polynomials.

        ``above``: numbers beside which bounds from above matter, shape (m,); None if only means do.
        """
        taylor, errors = self.along.taylor(intervals), self.along.errors(intervals)
        domain, at_middle = Domain.whole(len(intervals)), Domain.whole(len(intervals))
        with np.errstate(all="ignore"):
            inputs = self.along.leaves(intervals, over_whole(taylor, _DEGREE + 2))
            (over,) = evaluated([self.graph], inputs, domain)
            inputs = self.along.leaves(intervals, in_middle(taylor, _DEGREE + 1))
            (middle,) = evaluated([self.graph], inputs, at_middle)
            spread = self._spread(intervals, over_whole(taylor, 1), errors)
            in_place = self._spread(intervals, in_middle(taylor, 1), errors)
            low, high = over.low[0] - spread, over.high[0] + spread
            top, roots = low, np.full((2, len(intervals)), np.nan)
            if above is not None:
                rough = rough_range(middle, over)
                low, high = np.maximum(low, rough[0] - spread), np.minimum(high, rough[1] + spread)
                near = np.flatnonzero(high > above)
                some = middle.only(near), over.only(near)
                highest = _highest(*some)
                top = low.copy()
                top[near] = np.fmax(top[near], highest[0] - spread[near])
                high[near] = np.fmin(high[near], highest[1] + spread[near])
                roots[:, near] = _root(*some, spread[near], in_place[near])
            means = _mean(middle, over.rows(_DEGREE + 1))
            defined = ~at_middle.nowhere & ~at_middle.partly
            return Enclosures(
                low,
                high,
                np.where(defined, middle.low[0] - in_place, -np.inf),
                np.where(defined, middle.high[0] + in_place, np.inf),
                top,
                np.maximum(means[0], over.low[0]) - spread,
                np.minimum(means[1], over.high[0]) + spread,
                roots[0],
                roots[1],
                spread,
                in_place,
                domain.nowhere,
                domain.partly,
            )

    def _spread(self, intervals: Intervals, state: Series, errors: Array) -> Array:
        """Bound how far errors of the state move the expression."""
        inputs = self.along.leaves(intervals, state, errors)
        roots = [self.along.outputs.values[name] for name in self.gradient]
        slopes = evaluated(roots, inputs, Domain.whole(len(intervals)))
        sizes = np.array([slope.size[0] for slope in slopes])
        return np.asarray(np.where(errors > 0, sizes * errors, 0.0).sum(axis=0))


#: Places at which a polynomial is looked at, and the times that the largest is looked at closer.
_PLACES, _CLOSER = 17, 5


def _polynomial(series: Series) -> Array:
    """Return the coefficients in the middle of their bounds, shape (degrees, m)."""
    return np.asarray((series.low + series.high) / 2)


def _value(coefficients: Array, s: Array) -> Array:
    """Evaluate polynomials, shape (degrees, m), each at its places, shape (m, places)."""
    total = np.zeros(s.shape)
    for row in coefficients[::-1]:
        total = total * s + row[:, None]
    return total


def _highest(middle: Series, over: Series) -> tuple[Array, Array]:
    """Bound the largest value over an interval from both sides: by the largest values at some
    places, and by what the second derivative allows between."""
    coefficients = _polynomial(middle)
    degrees = np.arange(len(coefficients))
    bend = (np.abs(coefficients) * (degrees * (degrees - 1))[:, None]).sum(axis=0)
    rows, count = np.arange(coefficients.shape[1]), coefficients.shape[1]
    center, reach = np.zeros(count), 1.0
    bound = np.full(count, -np.inf)
    for _ in range(_CLOSER):
        s = np.clip(center[:, None] + reach * np.linspace(-1, 1, _PLACES), -1, 1)
        values = _value(coefficients, s)
        best, apart = values.argmax(axis=1), 2 * reach / (_PLACES - 1)
        allowance = bend * apart**2 / 8
        # Between the places beside the best it is looked at closer.
        highest = values[rows, best]
        for step in (-1, 0, 1):
            values[rows, np.clip(best + step, 0, _PLACES - 1)] = -np.inf
        bound = np.maximum(bound, values.max(axis=1) + allowance)
        center, reach = s[rows, best], apart
    off = ((middle.high - middle.low) / 2).sum(axis=0)
    least, most = remainder(over)
    return highest - off + least, np.maximum(bound, highest + allowance) + off + most


def _root(middle: Series, over: Series, spread: Array, in_place: Array) -> tuple[Array, Array]:
    """Bound the place at which a rising expression passes zero, as well as its errors in the middle
    allow; NaN where it does not rise, or shorter intervals tell more."""
    coefficients = _polynomial(middle)
    slope = over.low[1]
    off = ((middle.high - middle.low) / 2).sum(axis=0) + over.size[-1] + spread
    least = in_place + _ROUNDING * middle.size.sum(axis=0)
    left, right = np.full(len(slope), -1.0), np.ones(len(slope))
    for _ in range(_HALVINGS):
        place = (left + right) / 2
        above = _value(coefficients, place[:, None])[:, 0] > 0
        left, right = np.where(above, left, place), np.where(above, place, right)
    doubt = off / slope + 4 * np.finfo(float).eps
    known = (slope > coefficients[1] / 2) & (off <= 4 * least) & np.isfinite(doubt)
    known &= (slope > 0) & (right - doubt > -1) & (right + doubt < 1)
    return np.where(known, right - doubt, np.nan), np.where(known, right + doubt, np.nan)


def _mean(middle: Series, remainder: Series) -> tuple[Array, Array]:
    """Bound the mean over an interval of a polynomial and its remainder."""
    weights = 1 / np.arange(1, len(middle) + 1, 2)[:, None]
    low = (middle.low[::2] * weights).sum(axis=0)
    high = (middle.high[::2] * weights).sum(axis=0)
    count = len(middle)
    if count % 2:
        size = remainder.size[0] / (count + 1)
        return low - size, high + size
    return low + remainder.low[0] / (count + 1), high + remainder.high[0] / (count + 1)
