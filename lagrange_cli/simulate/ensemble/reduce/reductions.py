"""Numbers of motions from their samples, each with an estimate of its error.

Between samples a value is the polynomial through the twelve around it. Its distance from those
through ten and eight, an overestimate, is the estimated error of interpolation, to which the errors
that the accuracy of the samples allows are added.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

#: Samples that a polynomial goes through, and those that it is compared with.
_WIDTHS = (12, 10, 8)

#: Places between two samples at which an extremum is looked for first, and steps that refine it.
_PLACES, _REFINEMENTS = 9, 40

#: Halvings of the bracket of a root: to the last place.
_HALVINGS = 60

#: Units in the last place by which a polynomial may miss a sample, through the rounding of twelve
#: terms. Not tuned.
_LAST_PLACES = 8

#: Error of a root, as a part of the time between samples, from which on it is open: a line through
#: the root, by which the error is estimated, holds near it alone. Not tuned.
_OPEN = 1 / 16

#: Largest samples beside which the value between samples may be the largest of all.
_CANDIDATES = 4

_Numbers = NDArray[np.intp]


@dataclass(frozen=True)
class Sampled:
    """An expression along motions that reach the last sample.

    Attributes
    ----------
    times
        Times of the samples, shape (samples,).
    values
        Values of the expression, shape (members, samples).
    allowed
        Errors of these that the accuracy of the states allows, shape (members, samples); NaN where
        nothing is promised.
    """

    times: Array
    values: Array
    allowed: Array


#: Result of a reduction: numbers and estimates of their errors, each of shape (members,).
Reduced = tuple[Array, Array]


def _largest(sampled: Sampled) -> Reduced:
    """Return the largest values of all times, not of the samples alone."""
    values, members = sampled.values, np.arange(len(sampled.values))
    best, off = values.max(axis=1), np.zeros(len(values))
    at = values.argmax(axis=1)
    for places in _highest_peaks(values):
        top, doubt, _ = _peak(sampled, places)
        # Polynomials miss the samples that they go through by a few last places.
        higher = np.nan_to_num(top, nan=-np.inf) > best + _LAST_PLACES * np.spacing(np.abs(best))
        best, at = np.where(higher, top, best), np.where(higher, places, at)
        # Each peak that may be the highest contributes its whole error.
        off = np.maximum(off, np.where(top + doubt >= best, doubt, 0.0))
    return best, off + sampled.allowed[members, at]


def _least(sampled: Sampled) -> Reduced:
    best, off = _largest(Sampled(sampled.times, -sampled.values, sampled.allowed))
    return -best, off


def _mean(sampled: Sampled) -> Reduced:
    """Integrate the polynomials between samples."""
    span = sampled.times[-1] - sampled.times[0]
    mean, *coarser = (sampled.values @ _weights(sampled.times, width) / span for width in _WIDTHS)
    return mean, _doubt(mean, coarser) + sampled.allowed.mean(axis=1)


def _first(sampled: Sampled) -> Reduced:
    """Return the first times at which values are positive, NaN for never.

    The error is infinite where it is open whether values come above zero before.
    """
    values = sampled.values
    members, last = values.shape
    holds = values > 0
    ever = holds.any(axis=1)
    place = np.where(ever, holds.argmax(axis=1), last)
    first, off = np.full(members, np.nan), np.zeros(members)
    at_once = ever & (place == 0)
    first[at_once] = sampled.times[0]
    # A value that the accuracy does not tell from zero leaves open whether the condition held.
    off[at_once] = np.where(np.abs(values[at_once, 0]) <= sampled.allowed[at_once, 0], np.inf, 0.0)
    later = np.flatnonzero(ever & (place > 0))
    if len(later):
        chosen = _only(sampled, later)
        crossings = _crossing(chosen, place[later] - 1, chosen.times[place[later]])
        first[later], off[later] = crossings
    for member in range(members):
        _look_between(sampled, member, int(place[member]), first, off)
    off[np.isnan(sampled.allowed).any(axis=1)] = np.nan
    return first, off


def _look_between(sampled: Sampled, member: int, place: int, first: Array, off: Array) -> None:
    """Look before sample ``place`` for a passage above zero between two samples below it."""
    values = sampled.values[member]
    inner = np.arange(1, min(place, len(values) - 1))
    if len(inner) == 0:
        return
    before, here, after = values[inner - 1], values[inner], values[inner + 1]
    rise = _rise(before, here, after)
    allowed = np.nan_to_num(sampled.allowed[member, inner])
    near = inner[(here >= before) & (here >= after) & (here + 2 * rise + allowed >= 0)].tolist()
    if _may_rise(values[:3]):
        near.insert(0, 0)
    if place == len(values) and _may_rise(values[:-4:-1]):
        near.append(place - 1)
    for k in near:
        one = _only(sampled, np.array([member]))
        (top,), (doubt,), (at,) = _peak(one, np.array([k]))
        doubt += 0.0 if np.isnan(one.allowed[0, k]) else one.allowed[0, k]
        if top > doubt:
            low = k - 1 if at <= sampled.times[k] else k
            (first[member],), (off[member],) = _crossing(one, np.array([low]), np.array([at]))
            return
        if top >= -doubt:
            off[member] = np.inf
            return


def _may_rise(values: Array) -> bool:
    """Decide whether values may be above zero between the first two of three falling samples."""
    if len(values) < 3 or values[0] < values[1]:
        return False
    slope = (4 * values[1] - 3 * values[0] - values[2]) / 2
    bent = abs(values[0] - 2 * values[1] + values[2])
    return bool(values[0] * bent + 2 * slope**2 >= 0)


#: Kind of a reduction → function of motions that reach the end.
_REDUCTIONS: dict[str, Callable[[Sampled], Reduced]] = {
    "max": _largest,
    "min": _least,
    "mean": _mean,
    "first": _first,
}


def reduced(kind: str, times: Array, values: Array, allowed: Array) -> Reduced:
    """Reduce an expression along motions to numbers, with estimates of their errors.

    Parameters
    ----------
    kind
        One of :data:`.model.requested_outputs.KINDS`.
    times
        Times of the samples, shape (samples,).
    values
        Values of the expression, shape (members, samples); NaN after the end of what is known of a
        motion, which then has no number, unless a condition holds before.
    allowed
        As for :class:`Sampled`.
    """
    numbers, errors = np.full((2, len(values)), np.nan)
    ends = np.isfinite(values).cumprod(axis=1).sum(axis=1)
    known = np.flatnonzero(ends == len(times))
    if len(known):
        sampled = Sampled(times, values[known], allowed[known])
        numbers[known], errors[known] = _REDUCTIONS[kind](sampled)
    if kind == "first":
        for k in np.flatnonzero((ends < len(times)) & (ends > 1)).tolist():
            numbers[k], errors[k] = _first_known(times, values[k], allowed[k], int(ends[k]))
    return numbers, errors


def _first_known(times: Array, values: Array, allowed: Array, end: int) -> tuple[float, float]:
    """Return the first time of a motion that is known at its first samples alone."""
    sampled = Sampled(times[:end], values[None, :end], allowed[None, :end])
    (number,), (error,) = _first(sampled)
    # The condition may hold after the end of what is known.
    return float(number), float(np.inf if np.isnan(number) else error)


# Polynomials between samples.


def _only(sampled: Sampled, members: _Numbers) -> Sampled:
    return Sampled(sampled.times, sampled.values[members], sampled.allowed[members])


@dataclass(frozen=True)
class _Polynomials:
    """Polynomials, one a member, in times from a sample in units of a distance.

    Attributes
    ----------
    coefficients
        From the constant one up, shape (members, width).
    origin, unit
        Shape (members,).
    """

    coefficients: Array
    origin: Array
    unit: Array

    def __call__(self, t: Array) -> Array:
        """Evaluate each at its time, or times, shape (members,) or (members, k)."""
        wide = (slice(None), *([None] * (t.ndim - 1)))
        x = (t - self.origin[wide]) / self.unit[wide]
        total = np.zeros(x.shape)
        for coefficient in self.coefficients.T[::-1]:
            total = total * x + coefficient[wide]
        return total

    def rate(self) -> _Polynomials:
        """Return the derivatives by the time."""
        powers = np.arange(1, self.coefficients.shape[1])
        slopes = self.coefficients[:, 1:] * powers / self.unit[:, None]
        return _Polynomials(slopes, self.origin, self.unit)


def _doubt(value: Array, coarser: Sequence[Array]) -> Array:
    """Return the larger of two distances, since near an end or by chance one may be small."""
    return np.asarray(np.max([np.abs(value - coarse) for coarse in coarser], axis=0))


def _through(sampled: Sampled, places: _Numbers, width: int) -> _Polynomials:
    """Return the polynomials through ``width`` samples around one of each member."""
    times, count = sampled.times, len(sampled.times)
    width = min(width, count)
    first = np.clip(places - (width - 1) // 2, 0, count - width)
    window = first[:, None] + np.arange(width)
    origin = times[places]
    unit = (times[window[:, -1]] - times[window[:, 0]]) / 2
    x = (times[window] - origin[:, None]) / unit[:, None]
    powers = x[..., None] ** np.arange(width)
    values = np.take_along_axis(sampled.values, window, axis=1)
    coefficients = np.linalg.solve(powers, values[..., None])[..., 0]
    return _Polynomials(coefficients, origin, unit)


def _rise(before: Array, here: Array, after: Array) -> Array:
    """Return how far the vertex of a parabola through three samples is above the middle one."""
    bent = before - 2 * here + after
    with np.errstate(all="ignore"):
        return np.where(bent < 0, (after - before) ** 2 / (-8 * bent), 0.0)


def _highest_peaks(values: Array) -> list[_Numbers]:
    """Return samples of each member beside which the largest value may be: the highest ones by the
    parabolas through three."""
    count = values.shape[1]
    inner = np.arange(1, count - 1)
    before, here, after = values[:, :-2], values[:, 1:-1], values[:, 2:]
    rise = _rise(before, here, after)
    is_peak = (here >= before) & (here >= after)
    heights = np.where(is_peak, here + rise, -np.inf)
    best = np.argsort(-heights, axis=1)[:, :_CANDIDATES]
    peaks = [inner[best[:, k]] for k in range(best.shape[1])] if len(inner) else []
    # At the first and the last sample there are no three samples to compare.
    return [*peaks, *(np.full(len(values), k) for k in (0, count - 1))]


def _peak(sampled: Sampled, places: _Numbers) -> tuple[Array, Array, Array]:
    """Return the largest values beside some samples, the error of interpolation, and the times."""
    times, count = sampled.times, len(sampled.times)
    finer, *coarser = (_through(sampled, places, width) for width in _WIDTHS)
    low, high = times[np.maximum(places - 1, 0)], times[np.minimum(places + 1, count - 1)]
    fractions = np.linspace(0, 1, 2 * _PLACES + 1)
    tried = low[:, None] + (high - low)[:, None] * fractions
    best = finer(tried).argmax(axis=1)
    rows = np.arange(len(places))
    left = tried[rows, np.maximum(best - 1, 0)]
    right = tried[rows, np.minimum(best + 1, len(fractions) - 1)]
    slope = finer.rate()
    for _ in range(_REFINEMENTS):
        middle = (left + right) / 2
        rising = slope(middle) > 0
        left, right = np.where(rising, middle, left), np.where(rising, right, middle)
    at = (left + right) / 2
    top = finer(at)
    return top, _doubt(top, [polynomial(at) for polynomial in coarser]), at


def _crossing(sampled: Sampled, below: _Numbers, above: Array) -> Reduced:
    """Return the roots between a sample where values are not positive and a time where they are."""
    rows = np.arange(len(below))
    finer, *coarser = (_through(sampled, below, width) for width in _WIDTHS)
    left, right = sampled.times[below], above
    for _ in range(_HALVINGS):
        middle = (left + right) / 2
        positive = finer(middle) > 0
        left, right = np.where(positive, left, middle), np.where(positive, middle, right)
    here = finer(right)
    doubt = _doubt(here, [polynomial(right) for polynomial in coarser]) + np.abs(here)
    doubt += sampled.allowed[rows, below]
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = [np.abs(each.rate()(right)) for each in (finer, *coarser)]
        off = doubt / np.min(slopes, axis=0)
    apart = sampled.times[below + 1] - sampled.times[below]
    # With so large an error a line through the root does not estimate the distance.
    return right, np.where(off > _OPEN * apart, np.inf, off)


def _weights(times: Array, width: int) -> Array:
    """Return the weights of samples in the integral of polynomials through ``width`` of them."""
    count = len(times)
    width = min(width, count)
    weights = np.zeros(count)
    for k in range(count - 1):
        first = min(max(k - (width - 2) // 2, 0), count - width)
        window = slice(first, first + width)
        unit = times[k + 1] - times[k]
        x = (times[window] - times[k]) / unit
        moments = unit / np.arange(1, width + 1)
        weights[window] += np.linalg.solve((x[:, None] ** np.arange(width)).T, moments)
    return weights
