"""Event functions g(t, y) of a run, and the location of their zeros on a step's dense output.

The search is that of the compiled integrators (kernels/events.c): signs are compared at the
ends of parts of a step, and the least value of a function that dips between equal signs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array

#: Parts of a step in which signs are looked at (events.h).
EVENT_PARTS = 4

#: The sign of a function that is zero at first, but for rounding, and then positive (events.h).
RISES = 2.0


@dataclass(frozen=True)
class ZeroCrossing:
    """Zero, or least value, of an event function.

    Attributes
    ----------
    time
        Its time.
    index
        Number of the event function.
    state
        State then, shape (2n,).
    """

    time: float
    index: int
    state: Array


@dataclass(frozen=True)
class NativeEvents:
    """Event functions in C of the interface of a right-hand side.

    Attributes
    ----------
    function
        ``int g(t, y, u, p, work, out)`` of the :func:`.native.c_types.function_type` of the run's
        numbers, which writes one value for each event.
    parameters, work
        As of a :class:`.native.function.NativeRhs`.
    """

    function: Any
    parameters: Array
    work: Array


@dataclass(frozen=True)
class TerminalEvents:
    """Event functions g(t, y) that end a run: it stops where the first falls through zero.

    Attributes
    ----------
    values
        (t, y) → values of all functions, shape (events,).
    signs
        Signs at first. A function that rises from zero has :data:`RISES` and counts from where it
        exceeds its noise.
    noise
        Error of each function at first.
    native
        The same functions for compiled integrators; None if none are compiled.
    reach
        Least values below it are told too; by default none are.
    """

    values: Callable[[float, Array], Array]
    signs: tuple[float, ...]
    noise: tuple[float, ...]
    native: NativeEvents | None = None
    reach: tuple[float, ...] = ()


#: A function whose least value is more than so many times its changes does not dip to zero.
_SHALLOW = 4.0

#: Distance from an end of a step, beside a part of it, at which slopes of functions are seen.
_NEAR = 2.0**-12

#: Largest change over that distance at a least value, beside the change of a parabola.
_FLAT = 4.0

#: Part of an interval to which a least value is located: it is then known to rounding.
_SHARP = 1e-9


class EventSearch:
    """``signs`` are those of the functions on the way; ``dips`` where they came close to zero."""

    def __init__(self, events: TerminalEvents) -> None:
        self._values, self._noise = events.values, events.noise
        self._reach = events.reach or (0.0,) * len(events.signs)
        self.signs = list(events.signs)
        self.dips: list[ZeroCrossing] = []

    def first(
        self, state: Callable[[float], Array], start: float, end: float
    ) -> tuple[float, int] | None:
        """Find time and number of the first function that falls through zero; None if none does.

        Parameters
        ----------
        state
            The state at a time within the step.
        """
        times = np.linspace(start, end, EVENT_PARTS + 1)
        values = np.array([self._values(t, state(t)) for t in times.tolist()])
        near = _NEAR * (end - start) / EVENT_PARTS
        inside = [self._values(t, state(t)) for t in (start + near, end - near)]
        # Beyond the step values are not known: whether they fall into it stands for them.
        ends = [
            _falls_from(*three)
            for three in zip(values[[0, -1]], inside, values[[1, -2]], strict=True)
        ]
        values = np.concatenate([ends[:1], values, ends[1:]])
        times = np.concatenate([times[:1], times, times[-1:]])

        def along(k: int) -> Callable[[float], float]:
            return lambda t: float(self._values(t, state(t))[k])

        crossings, dips = [], []
        for k in range(len(self.signs)):
            function = _Function(along(k), times, values[:, k])
            t, dip, self.signs[k] = function.falls(self.signs[k], self._noise[k], self._reach[k])
            if t is not None:
                crossings.append((t, k))
            if dip is not None:
                dips.append((dip, k))
        first = min(crossings, default=None)
        last = np.inf if first is None else first[0]
        self.dips += [ZeroCrossing(t, k, state(t)) for t, k in sorted(dips) if t < last]
        return first


def _falls_from(at: Array, near: Array, farther: Array) -> Array:
    """Return infinity where functions fall from their value at the end of a step, or are as flat as
    at a least value; minus infinity where they rise."""
    with np.errstate(invalid="ignore"):
        falls = near - at <= _FLAT * _NEAR**2 * np.abs(farther - at)
    return np.where(falls, np.inf, -np.inf)


@dataclass(frozen=True)
class _Function:
    """One of the event functions along a step.

    The first and last values stand for those beyond the step: infinite, with the sign that says
    whether the function falls into the step.

    Attributes
    ----------
    g
        t → value of the function.
    times
        Times in the step, the first and the last twice, shape (k,).
    values
        Values at these times, shape (k,).
    """

    g: Callable[[float], float]
    times: Array
    values: Array

    def falls(
        self, sign: float, noise: float, reach: float
    ) -> tuple[float | None, float | None, float]:
        """Return the times of its zero crossing and of a least value below its reach, and its last
        sign; None if there is none. ``sign`` is the one that it had before."""
        times, values, first, last = self.times, self.values, 1, len(self.times) - 2
        dip = None
        while sign == RISES and first < last:
            first += 1
            if values[first] > noise:
                sign = 1.0
            elif values[first] < -noise:
                back = _falls_back(self.g, float(times[first - 1]), float(times[first]))
                return back, None, -1.0
        for k in range(first, last + 1):
            now = float(np.sign(values[k]))
            if now < 0 < sign != RISES:
                at = float(times[1]) if k == 1 else _zero(self.g, times[k - 1 : k + 1])
                return at, dip, now
            if k > first and sign == 1.0 and now > 0 and self._dips(k):
                at, least = _least(self.g, float(times[k - 1]), float(times[k]))
                if least < 0:
                    return _zero(self.g, (float(times[k - 1]), at)), dip, now
                dip = at if least < reach else dip
            sign = sign if sign == RISES or np.isnan(now) else now or sign
        return None, dip, sign

    def _dips(self, k: int) -> bool:
        """Tell whether it may have a least value in the part that ends at time number ``k``."""
        around = self.values[k - 2 : k], self.values[k - 1 : k + 1], self.values[k : k + 2]
        least = self.values[k - 1 : k + 1].min()
        if least > _SHALLOW * (self.values[k - 2 : k + 2].max() - least):
            return False
        (before, left), (_, right), (_, behind) = around
        return bool((left < before and left < right) or (right < left and right < behind))


def _falls_back(g: Callable[[float], float], start: float, end: float) -> float:
    """Locate the zero at which g, zero at the start and rising, falls again."""
    while end - start > 2 * np.spacing(end):
        middle = start + (end - start) / 2
        if g(middle) > 0:
            return _zero(g, (middle, end))
        end = middle
    return start


def _zero(g: Callable[[float], float], between: Sequence[float] | Array) -> float:
    """Locate where g stops being positive; where it has no value, as in overflow, it is not."""

    def positive(t: float) -> float:
        value = g(t)
        return -1.0 if np.isnan(value) else value

    a, b = map(float, between)
    if positive(a) <= 0:
        return a
    from scipy.optimize import brentq

    return float(brentq(positive, a, b, xtol=2 * np.spacing(max(abs(a), abs(b))), rtol=4e-16 * 4))


def _least(g: Callable[[float], float], a: float, b: float) -> tuple[float, float]:
    """Return the time between a and b at which g is least, and its value there."""
    from scipy.optimize import minimize_scalar

    # From a on: what times are measured from is no scale of the search.
    least = minimize_scalar(
        lambda since: g(a + since),
        bounds=(0.0, b - a),
        method="bounded",
        options={"xatol": _SHARP * (b - a)},
    )
    return a + float(least.x), float(least.fun)
