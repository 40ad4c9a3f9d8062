"""Bounds of an expression along motions, over intervals of the time.

The state is a polynomial in each panel (:mod:`.dense_motion`). The expression over it has a Taylor
polynomial about the middle of an interval, with a remainder bounded by interval arithmetic, so that
nothing narrow hides between places. Errors of the state are counted by bounds of the derivatives of
the expression.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import comb

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.reduce.dense_motion import WIDTH, Motions, Numbers, Panels
from lagrange_cli.simulate.ensemble.reduce.expression_graph import (
    Domain,
    Flags,
    Node,
    Outputs,
    evaluated,
)
from lagrange_cli.simulate.ensemble.reduce.interval_series import Series
from lagrange_cli.simulate.integrators.right_hand_side import InputPieces

#: Degree of the Taylor polynomials.
_DEGREE = 5

#: Rounding errors of a polynomial over the sizes of its terms.
_ROUNDING = 16 * float(np.finfo(float).eps)

#: Halvings of the bracket of a root: to the last place.
_HALVINGS = 56


@dataclass(frozen=True)
class Intervals:
    """Intervals of the time of some members.

    Attributes
    ----------
    member, panel
        Numbers, shape (m,).
    left, right
        Places in the panel, from −1 to 1, shape (m,).
    """

    member: Numbers
    panel: Numbers
    left: Array
    right: Array

    @classmethod
    def whole(cls, members: int, panels: int) -> Intervals:
        """Return all panels of all members."""
        member = np.repeat(np.arange(members), panels)
        panel = np.tile(np.arange(panels), members)
        return cls(member, panel, np.full(len(member), -1.0), np.ones(len(member)))

    def __len__(self) -> int:
        return len(self.member)

    def only(self, which: Flags) -> Intervals:
        return Intervals(self.member[which], self.panel[which], self.left[which], self.right[which])

    def divided(self, parts: int) -> Intervals:
        """Divide each into equal parts, in order."""
        steps = np.arange(parts + 1) / parts
        ends = self.left[:, None] + (self.right - self.left)[:, None] * steps
        ends[:, -1] = self.right
        member, panel = np.repeat(self.member, parts), np.repeat(self.panel, parts)
        return Intervals(member, panel, ends[:, :-1].ravel(), ends[:, 1:].ravel())


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
    outputs
        Graphs of the outputs of the model.
    value, gradient
        Names of the output, and of its derivatives by the state.
    motions, panels
        The motions.
    inputs
        Recorded inputs; None if there are none.
    sign
        With which the output is multiplied.
    """

    outputs: Outputs
    value: str
    gradient: tuple[str, ...]
    motions: Motions
    panels: Panels
    inputs: InputPieces | None = None
    sign: float = 1.0

    @property
    def _root(self) -> Node | float:
        root = self.outputs.values[self.value]
        return root if self.sign > 0 else -root

    def times(self, intervals: Intervals) -> tuple[Array, Array]:
        """Return the times of both ends."""
        begin, end = self.panels.edges[intervals.panel].T
        shares = (1 + intervals.left) / 2, (1 + intervals.right) / 2
        first, last = (begin + (end - begin) * share for share in shares)
        return first, np.where(intervals.right == 1, end, last)

    def bounds(self, intervals: Intervals) -> Enclosures:
        """Bound the expression over whole intervals alone, which is quick."""
        taylor = self._taylor(intervals)
        domain = _domain(intervals)
        with np.errstate(all="ignore"):
            inputs = self._inputs(intervals, _over(taylor, 1), self._errors(intervals))
            (value,) = evaluated([self._root], inputs, domain)
        low, high = value.low[0], value.high[0]
        unknown = np.full(len(intervals), np.inf)
        ends = low, high, -unknown, unknown, low, low, high
        nan, zero = np.full(len(intervals), np.nan), np.zeros(len(intervals))
        return Enclosures(*ends, nan, nan, zero, zero, domain.nowhere, domain.partly)

    def enclosed(self, intervals: Intervals, above: Array | None = None) -> Enclosures:
        """Bound the expression by its Taylor polynomials.

        ``above``: numbers beside which bounds from above matter, shape (m,); None if only means do.
        """
        taylor, errors = self._taylor(intervals), self._errors(intervals)
        domain, in_middle = _domain(intervals), _domain(intervals)
        with np.errstate(all="ignore"):
            inputs = self._inputs(intervals, _over(taylor, _DEGREE + 2), None)
            (over,) = evaluated([self._root], inputs, domain)
            inputs = self._inputs(intervals, _middle(taylor, _DEGREE + 1), None)
            (middle,) = evaluated([self._root], inputs, in_middle)
            spread = self._spread(intervals, _over(taylor, 1), errors)
            in_place = self._spread(intervals, _middle(taylor, 1), errors)
            low, high = over.low[0] - spread, over.high[0] + spread
            top, roots = low, np.full((2, len(intervals)), np.nan)
            if above is not None:
                rough = _rough_range(middle, over)
                low, high = np.maximum(low, rough[0] - spread), np.minimum(high, rough[1] + spread)
                near = np.flatnonzero(high > above)
                some = middle.only(near), over.only(near)
                highest = _highest(*some)
                top = low.copy()
                top[near] = np.fmax(top[near], highest[0] - spread[near])
                high[near] = np.fmin(high[near], highest[1] + spread[near])
                roots[:, near] = _root(*some, spread[near], in_place[near])
            means = _mean(middle, over.rows(_DEGREE + 1))
            defined = ~in_middle.nowhere & ~in_middle.partly
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
        inputs = self._inputs(intervals, state, errors)
        roots = [self.outputs.values[name] for name in self.gradient]
        slopes = evaluated(roots, inputs, _domain(intervals))
        sizes = np.array([slope.size[0] for slope in slopes])
        return np.asarray(np.where(errors > 0, sizes * errors, 0.0).sum(axis=0))

    def _errors(self, intervals: Intervals) -> Array:
        """Return the errors of the state, shape (2n, m)."""
        left_out = self.panels.left_out[:, intervals.member, intervals.panel]
        return np.asarray(self.motions.errors[intervals.member].T + left_out)

    def _taylor(self, intervals: Intervals) -> Array:
        """Return Taylor coefficients of the state about the middle, in units of half the interval,
        shape (WIDTH, 2n, m)."""
        whole = self.panels.coefficients[:, :, intervals.member, intervals.panel]
        middle = (intervals.left + intervals.right) / 2
        half = (intervals.right - intervals.left) / 2
        if (half == 1).all():
            return np.asarray(whole)
        shifted = whole.copy()
        for first in range(WIDTH - 1):
            for k in range(WIDTH - 2, first - 1, -1):
                shifted[k] += middle * shifted[k + 1]
        return np.asarray(shifted * (half ** np.arange(WIDTH)[:, None])[:, None, :])

    def _inputs(
        self, intervals: Intervals, state: Series, errors: Array | None
    ) -> Mapping[Node, Series]:
        """Return the series of all inputs; ``errors`` widen the state, shape (2n, m)."""
        count, known = len(state), self.outputs
        first, last = self.times(intervals)
        low, high = np.zeros((2, count, len(intervals)))
        if state.low is state.high:  # in the middle alone
            low[0] = high[0] = (first + last) / 2
        else:
            low[0], high[0] = first, last
        if count > 1:
            low[1] = high[1] = (last - first) / 2
        inputs_there = {known.t: Series(low, high)}
        for i, node in enumerate(known.state):
            low, high = state.low[:, i].copy(), state.high[:, i].copy()
            if errors is not None:
                low[0] -= errors[i]
                high[0] += errors[i]
            inputs_there[node] = Series(low, high)
        like = inputs_there[known.t]
        for i, node in enumerate(known.parameters):
            values = self.motions.parameters[intervals.member, i]
            inputs_there[node] = Series.constant(values, like)
        return inputs_there | self._recorded(first, last, like)

    def _recorded(self, first: Array, last: Array, like: Series) -> dict[Node, Series]:
        """Return the numbers of recorded inputs: those of all pieces in an interval."""
        pieces = self.inputs
        if pieces is None:
            return {}
        begin, end = (np.searchsorted(pieces.starts, t, side="right") - 1 for t in (first, last))
        begin = np.maximum(begin, 0)
        # reduceat takes pairs of a first row and the row behind the last one.
        ends = np.minimum(np.maximum(end, begin) + 1, len(pieces.starts))
        rows = np.vstack([pieces.rows, pieces.rows[-1:]])
        pairs = np.stack([begin, ends], 1).ravel()
        low = np.minimum.reduceat(rows, pairs)[::2]
        high = np.maximum.reduceat(rows, pairs)[::2]
        inputs_there = {}
        for i, node in enumerate(self.outputs.inputs):
            bounds = Series.constant(low[:, i], like), Series.constant(high[:, i], like)
            inputs_there[node] = bounds[0].hull(bounds[1])
        return inputs_there


def _domain(intervals: Intervals) -> Domain:
    return Domain(np.zeros(len(intervals), bool), np.zeros(len(intervals), bool))


def _middle(taylor: Array, count: int) -> Series:
    """Return the series in the middle of intervals, shape (count, 2n, m)."""
    rows = taylor[:count]
    return Series(rows, rows)


def _over(taylor: Array, count: int) -> Series:
    """Return the series over whole intervals: their coefficients about any place in them."""
    sizes = np.abs(taylor)
    off = np.zeros((count, *taylor.shape[1:]))
    for k in range(count):
        for i in range(k + 1, len(taylor)):
            off[k] += comb(i, k) * sizes[i]
    return Series(taylor[:count] - off, taylor[:count] + off)


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


def _remainder(over: Series) -> tuple[Array, Array]:
    """Bound the last term over an interval."""
    least, most = over.low[-1], over.high[-1]
    if len(over) % 2:
        return np.minimum(least, 0), np.maximum(most, 0)
    size = np.maximum(np.abs(least), np.abs(most))
    return -size, size


def _rough_range(middle: Series, over: Series) -> tuple[Array, Array]:
    """Bound a polynomial and its remainder over an interval, term by term."""
    off = middle.size[1:].sum(axis=0)
    least, most = _remainder(over)
    return middle.low[0] - off + least, middle.high[0] + off + most


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
    least, most = _remainder(over)
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
