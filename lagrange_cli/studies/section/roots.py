"""Zeros of a function along a motion: all of them, and places where their number is open.

Between extrema a function is monotone, so that it has one zero or none between two of them. It is
not known which where it is as small as its error: there its number of zeros is open.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.studies.chebyshev import DEGREE, Flags, Series

#: Halvings of an interval until its ends are neighbouring doubles.
_HALVINGS = 60

#: Points of a panel between which the slope changes its sign once at most: it is a polynomial of
#: nearly that degree, and closer extrema show as a place where the number is open.
_LOOKS = 4 * DEGREE


@dataclass(frozen=True)
class Zeros:
    """Zeros of a function.

    Attributes
    ----------
    t
        Times of zeros, ascending, shape (m,).
    open
        Times of extrema so close to zero that they may be two zeros or none, shape (k,).
    """

    t: Array
    open: Array


def zeros_of(series: Series, errors: Array) -> Zeros:
    """Compute the zeros of a function.

    Parameters
    ----------
    errors
        Errors of the function in each panel, besides that of its series, shape (panels,). At its
        first edge it is exact but for rounding.
    """
    errors = errors + series.left_out
    inner = _extrema(series, series.least() <= errors)
    # At an edge the error is the larger one of its sides.
    sides = np.array([np.append(errors[:1], errors), np.append(errors, errors[-1:])])
    t = np.concatenate([series.edges, inner])
    most = np.concatenate([sides.max(axis=0), errors[series.panels_of(inner)]])
    extreme = np.concatenate([_turning(series), np.ones(len(inner), bool)])
    order = np.argsort(t, kind="stable")
    t, most, extreme = t[order], most[order], extreme[order]
    values = _defined(series, t)
    at_ends = [0, -1]
    rounding = _rounding(series)
    close = np.abs(values) <= most
    close[at_ends] = np.abs(values[at_ends]) <= np.maximum(rounding, [0.0, most[-1]])
    doubtful = close & extreme
    if close[0] and extreme.any():
        # A start at an extremum is a zero there, and the extremum beside it is the same place.
        first = int(np.argmax(extreme))
        doubtful[first] &= abs(values[first]) > rounding[0]
    ends = t[at_ends][close[at_ends]]
    between = _refined(series, *_brackets(t, values, ~close))
    return Zeros(np.sort(np.concatenate([between, ends])), t[doubtful])


def _defined(series: Series, t: Array) -> Array:
    """Evaluate a function at some times, at an edge from either side that has values."""
    values, panels = series.at(t), series.panels_of(t)
    before = np.flatnonzero(~np.isfinite(values) & (t == series.edges[panels]) & (panels > 0))
    values[before] = series.within(panels[before] - 1, t[before])
    return values


def _rounding(series: Series) -> Array:
    """Return the rounding errors of the function, of the time too, at both ends."""
    ends = series.edges[[0, -1]]
    sizes = np.abs(series.coefficients[[0, -1]]).sum(axis=1)
    return np.asarray(DEGREE * np.finfo(float).eps * (sizes + np.abs(ends * series.slope.at(ends))))


def _turning(series: Series) -> Flags:
    """Return at which edges the slope changes its sign."""
    panels = np.arange(len(series.edges) - 1)
    before = series.slope.within(panels, series.edges[1:])[:-1]
    behind = series.slope.within(panels, series.edges[:-1])[1:]
    inner = np.sign(before) != np.sign(behind)
    return np.concatenate([[False], inner, [False]])


def _brackets(t: Array, values: Array, known: Flags) -> tuple[Array, Array]:
    """Return the ends of intervals between known values of different signs."""
    t, signs = t[known], np.sign(values[known])
    # Nothing is known of zeros where there are no values.
    has_values = np.isfinite(signs)
    change = np.flatnonzero((signs[1:] != signs[:-1]) & has_values[1:] & has_values[:-1])
    return t[change], t[change + 1]


def _extrema(series: Series, near: Flags) -> Array:
    """Return the times of the extrema in some panels."""
    panels = np.flatnonzero(near)
    if not len(panels):
        return np.empty(0)
    looks = np.linspace(0, 1, _LOOKS + 1)
    left, right = series.edges[panels], series.edges[panels + 1]
    t = left[:, None] + (right - left)[:, None] * looks
    every = np.repeat(panels, _LOOKS + 1)
    slopes = series.slope.within(every, t.ravel()).reshape(t.shape)
    row, column = np.nonzero(np.sign(slopes[:, 1:]) != np.sign(slopes[:, :-1]))
    return _refined(series.slope, t[row, column], t[row, column + 1])


def _refined(series: Series, left: Array, right: Array) -> Array:
    """Halve intervals at whose ends a function has different signs, down to the last place."""
    sign = np.sign(series.at(left))
    for _ in range(_HALVINGS):
        middle = left + (right - left) / 2
        same = np.sign(series.at(middle)) == sign
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    return left + (right - left) / 2
