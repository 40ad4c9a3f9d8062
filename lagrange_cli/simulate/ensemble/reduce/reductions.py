"""Numbers of motions, bounded from both sides.

Intervals of the time are divided until bounds of the expression (:mod:`.enclosures`) tell the
number, so that neither a narrow peak nor a pole is missed: branch and bound for extrema and first
times, adaptive quadrature with remainders for means. What is left open is part of the error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.reduce.dense_motion import Numbers
from lagrange_cli.simulate.ensemble.reduce.enclosures import Enclosures, Expression
from lagrange_cli.simulate.ensemble.reduce.expression_graph import Flags
from lagrange_cli.simulate.ensemble.reduce.motion_series import Intervals
from lagrange_cli.simulate.ensemble.reduce.poles import rises_beyond_bounds

#: Parts into which an interval is divided, and divisions of a panel, to its last places.
_PARTS, _DIVISIONS = 4, 24

#: Intervals of a member that are divided at a time; more of them are taken as they are.
_MOST_INTERVALS = 2048

#: Those of so many intervals that are divided further if the largest value is sought.
_MOST_PROMISING = 64

#: Part of the error of the state beside which bounds are close enough, and part of a number itself.
_CLOSE, _LAST_PLACES = 0.1, 1e-13

#: Result of a reduction: numbers and bounds of their errors, each of shape (members,).
Reduced = tuple[Array, Array]


def _crowded(intervals: Intervals, members: int) -> Flags:
    """Flag the intervals of members that have too many of them."""
    counts = np.bincount(intervals.member, minlength=members)
    return np.asarray(counts[intervals.member] > _MOST_INTERVALS)


def _behind(intervals: Intervals, members: int, high: Array) -> Flags:
    """Flag the intervals of crowded members but those with the largest bounds."""
    ends = _crowded(intervals, members)
    for member in np.unique(intervals.member[ends]):
        places = np.flatnonzero(intervals.member == member)
        order = np.argsort(-high[places], kind="stable")
        ends[places[order[:_MOST_PROMISING]]] = False
    return ends


def _largest(expression: Expression) -> Reduced:
    """Return the largest values."""
    members = len(expression.along.motions)
    best, upper = np.full((2, members), -np.inf)
    undefined = np.zeros(members, bool)
    intervals = Intervals.whole(members, len(expression.along.panels.edges))
    rough = expression.bounds(intervals)
    undefined[intervals.member[rough.nowhere]] = True
    intervals = _promising(expression, intervals, rough, best)
    for division in range(_DIVISIONS + 1):
        if not len(intervals):
            break
        member = intervals.member
        known = expression.enclosed(intervals, best[member])
        undefined[member[known.nowhere]] = True
        np.maximum.at(best, member, np.fmax(known.middle_low, known.top))
        last = (division == _DIVISIONS) | _behind(intervals, members, known.high)
        off = np.where(np.isfinite(best), np.abs(best) * _LAST_PLACES, 0.0)[member]
        close = known.high - best[member] <= 2 * (1 + _CLOSE) * known.spread + off
        # Errors of the state count where they are largest: not far more than in the middle.
        close &= np.isfinite(known.spread) & (known.spread <= 2 * known.middle_spread + off)
        ends = last | (close & ~known.partly)
        ends &= ~known.nowhere
        np.maximum.at(upper, member[ends], known.high[ends])
        goes_on = ~ends & ~known.nowhere & (known.high > best[member])
        intervals = intervals.only(goes_on).divided(_PARTS)
    number, error = _middle(best, upper)
    unbounded = np.isinf(upper)
    number[unbounded], error[unbounded] = best[unbounded], np.inf
    if unbounded.any():
        number[rises_beyond_bounds(expression.along, expression.graph, unbounded)] = np.inf
    return np.where(undefined, np.nan, number), np.where(undefined, np.inf, error)


def _promising(
    expression: Expression, intervals: Intervals, rough: Enclosures, best: Array
) -> Intervals:
    """Return the panels that may hold the largest value of a member."""
    np.maximum.at(best, intervals.member[~rough.partly], rough.low[~rough.partly])
    return intervals.only(~rough.nowhere & (rough.high >= best[intervals.member]))


def _middle(low: Array, high: Array) -> Reduced:
    """Return the numbers between bounds, and how far they may be off."""
    with np.errstate(invalid="ignore"):
        number, error = (low + high) / 2, (high - low) / 2
    return number, error + 2 * np.spacing(np.abs(number))


def _least(expression: Expression) -> Reduced:
    number, error = _largest(replace(expression, sign=-expression.sign))
    return -number, error


@np.errstate(invalid="ignore")
def _mean(expression: Expression) -> Reduced:
    """Integrate Taylor polynomials over intervals."""
    members = len(expression.along.motions)
    low, high = np.zeros((2, members))
    undefined = np.zeros(members, bool)
    begin, end = expression.along.motions.span
    size, spread = np.zeros((2, members))
    intervals = Intervals.whole(members, len(expression.along.panels.edges))
    for division in range(_DIVISIONS + 1):
        if not len(intervals):
            break
        known, member = expression.enclosed(intervals), intervals.member
        undefined[member[known.nowhere]] = True
        first, last = expression.along.times(intervals)
        share = (last - first) / (end - begin)
        middle, width = _middle(known.mean_low, known.mean_high)
        finite = np.isfinite(middle) & np.isfinite(width)
        middle, width = (np.where(finite, x, np.inf) for x in (middle, width))
        np.maximum.at(size, member[finite], np.abs(middle * share)[finite])
        in_place = np.where(np.isfinite(known.middle_spread), known.middle_spread, 0.0)
        if division == 0:
            np.add.at(spread, member, np.where(finite, in_place * share, 0.0))
        close = width - in_place <= _CLOSE * np.maximum(in_place, spread[member])
        close |= width * share <= _LAST_PLACES * size[member]
        close &= finite
        ends = close & ~known.partly
        ends |= (division == _DIVISIONS) | _crowded(intervals, members)
        ends |= known.nowhere
        np.add.at(low, member[ends], known.mean_low[ends] * share[ends])
        np.add.at(high, member[ends], known.mean_high[ends] * share[ends])
        intervals = intervals.only(~ends).divided(_PARTS)
    number, error = _middle(low, high)
    unknown = undefined | ~np.isfinite(error)
    return np.where(unknown, np.nan, number), np.where(unknown, np.inf, error)


def _first(expression: Expression) -> Reduced:
    """Return the first times at which values are positive, NaN for never.

    The error is infinite where it is open whether values come above zero before.
    """
    members = len(expression.along.motions)
    certain, possible = np.full(members, np.inf), np.full(members, np.inf)
    open_time = np.zeros(members)
    left_open: list[tuple[Numbers, Array, Array]] = []
    intervals = Intervals.whole(members, len(expression.along.panels.edges))
    rough = expression.bounds(intervals)
    intervals = intervals.only(~rough.nowhere & (rough.high > 0))
    for division in range(_DIVISIONS + 1):
        if not len(intervals):
            break
        member = intervals.member
        known = expression.enclosed(intervals, np.zeros(len(intervals)))
        first, last = expression.along.times(intervals)
        whole = (known.low > 0) & ~known.partly
        np.minimum.at(certain, member[whole], first[whole])
        inside = known.middle_low > 0
        np.minimum.at(certain, member[inside], ((first + last) / 2)[inside])
        # Where the expression rises, its root is known at once, as well as it can be.
        rises = np.isfinite(known.root_low) & ~known.partly
        low, high = (
            first + (last - first) * (1 + root) / 2 for root in (known.root_low, known.root_high)
        )
        np.minimum.at(certain, member[rises], high[rises])
        may = (known.high > 0) & ~known.nowhere & ~whole & (first < certain[member])
        rises &= may
        left_open.append((member[rises], low[rises], high[rises]))
        # Errors of the state leave the sign open: shorter intervals do not tell it.
        width = known.high - known.low
        close = np.isfinite(width) & (width <= 4 * known.middle_spread)
        close &= (known.middle_low <= 0) & (known.middle_high >= 0)
        ends = may & ~rises & (close | (division == _DIVISIONS) | _crowded(intervals, members))
        may &= ~rises
        left_open.append((member[ends], first[ends], last[ends]))
        intervals = intervals.only(may & ~ends).divided(_PARTS)
    for member, first, last in left_open:
        before = first < certain[member]
        np.minimum.at(possible, member[before], first[before])
        np.add.at(open_time, member[before], (np.minimum(last, certain[member]) - first)[before])
    return _first_times(expression, certain, possible, open_time)


def _first_times(
    expression: Expression, certain: Array, possible: Array, open_time: Array
) -> Reduced:
    """Return numbers and errors from the first times at which a condition may hold and does."""
    possible = np.minimum(possible, certain)
    last_place = np.spacing(np.abs(expression.along.motions.span).max())
    with np.errstate(invalid="ignore"):
        gap = certain - possible
        # Open intervals that do not reach the first certain time are another passage.
        together = gap <= open_time * (1 + 1e-6) + 8 * last_place
    error = np.where(together, gap / 2 + last_place, np.inf)
    number = np.where(together, (certain + possible) / 2, certain)
    never = np.isinf(certain)
    number[never], error[never] = np.nan, np.where(np.isinf(possible[never]), 0.0, np.inf)
    return number, error


#: Kind of a reduction → function of an expression along motions that reach the end.
REDUCTIONS: dict[str, Callable[[Expression], Reduced]] = {
    "max": _largest,
    "min": _least,
    "mean": _mean,
    "first": _first,
}
