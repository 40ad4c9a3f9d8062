"""Where one of several event functions falls through zero within a step, on the interpolant.

The search of the compiled integrators in Python (kernels/events.c): signs are looked at where
a step is divided into parts, and where a function dips between equal signs its least value is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.integrators.events import PARTS, NativeEvents

__all__ = ["RISES", "Falling", "Search"]

#: A function whose least value is more than so many times what it changes by does not dip to zero.
SHALLOW = 4.0

#: The sign of a function that is zero at first, but for rounding, and then positive (events.h).
RISES = 2.0


@dataclass(frozen=True)
class Falling:
    """Functions g(t, y), of which a run ends where the first falls through zero.

    ``values`` gives all of them; ``signs`` are those that they have at first (or
    :data:`RISES`, and then what is made of it begins above its ``noise``); ``native`` are the
    same functions for compiled integrators.
    """

    values: Callable[[float, Array], Array]
    signs: tuple[float, ...]
    noise: tuple[float, ...]
    native: NativeEvents | None = None


class Search:
    """``signs`` are those of the functions on the way."""

    def __init__(self, falling: Falling) -> None:
        self._values, self._noise = falling.values, falling.noise
        self.signs = list(falling.signs)

    def first(
        self, state: Callable[[float], Array], start: float, end: float
    ) -> tuple[float, int] | None:
        """Time and number of the first function that falls through zero from start to end.

        Parameters
        ----------
        state
            The state at a time within the step.
        """
        times = np.linspace(start, end, PARTS + 1)
        values = np.array([self._values(t, state(t)) for t in times.tolist()])

        def along(k: int) -> Callable[[float], float]:
            return lambda t: float(self._values(t, state(t))[k])

        found = []
        for k, noise in enumerate(self._noise):
            t, self.signs[k] = _falls(along(k), times, values[:, k], self.signs[k], noise)
            if t is not None:
                found.append((t, k))
        return min(found, default=None)


def _falls(
    g: Callable[[float], float], times: Array, values: Array, sign: float, noise: float
) -> tuple[float | None, float]:
    """Where g falls through zero, and its last sign; ``sign`` is the one that it had before."""
    first = 0
    while sign == RISES and first + 1 < len(times):
        first += 1
        if values[first] > noise:
            sign = 1.0
        elif values[first] < -noise:
            return _falls_back(g, float(times[first - 1]), float(times[first])), -1.0
    for k in range(first, len(times)):
        now = float(np.sign(values[k]))
        if now < 0 < sign != RISES:
            return float(times[0]) if k == 0 else _zero(g, times[k - 1 : k + 1]), now
        if k > first and sign > 0 and now > 0:
            dip = _dip(g, times[k - 1 : k + 1], values[max(k - 2, 0) : k + 2])
            if dip is not None:
                return _zero(g, (float(times[k - 1]), dip)), now
        sign = sign if sign == RISES else now or sign
    return None, sign


def _falls_back(g: Callable[[float], float], start: float, end: float) -> float:
    """Where g, zero at the start and rising, falls through zero again."""
    while end - start > 2 * np.spacing(end):
        middle = start + (end - start) / 2
        if g(middle) > 0:
            return _zero(g, (middle, end))
        end = middle
    return start


def _zero(g: Callable[[float], float], between: Sequence[float] | Array) -> float:
    a, b = map(float, between)
    if g(a) <= 0:
        return a
    from scipy.optimize import brentq

    return float(brentq(g, a, b, xtol=2 * np.spacing(max(abs(a), abs(b))), rtol=4e-16 * 4))


def _dip(g: Callable[[float], float], part: Array, around: Array) -> float | None:
    """A time within the part where g is negative, though positive at its ends, if there is one."""
    inner = np.argmin(around)
    if len(around) < 3 or inner in (0, len(around) - 1):
        return None
    if around[inner] > SHALLOW * (around.max() - around[inner]):
        return None
    from scipy.optimize import minimize_scalar

    least = minimize_scalar(g, bounds=(float(part[0]), float(part[1])), method="bounded")
    return float(least.x) if least.fun < 0 else None
