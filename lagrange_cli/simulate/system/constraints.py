"""Constraints by interpreted functions: projection, events of contacts, states behind them.

The methods are those of emitted code (:mod:`lagrange_cli.emit.c.constraints`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.program.interpreter.interpreter import Runnable
from lagrange_cli.program.lowered.routines.numbers import Array as Numbers
from lagrange_cli.program.lowered.routines.projection import lead_positions, lead_velocities
from lagrange_cli.program.solvers.tolerances import (
    COMPLEMENTARITY_STEPS,
    IMPACT_TOLERANCES,
    RATE_TOLERANCE,
)
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.right_hand_side import Projection


def projection(
    functions: Mapping[str, Runnable], parameters: Sequence[float], kind: str = ""
) -> Projection | None:
    """Make the function that leads states back to closures; None without closures.

    A state that is too far away becomes NaN.

    Parameters
    ----------
    kind
        ``contact_`` for the projection onto closures and closed contacts; else empty.
    """
    if f"{kind}velocity_change" not in functions:
        return None
    names = [name for name in _CLOSURES if kind + name in functions]
    bound = {name: functions[kind + name].bound(parameters) for name in names}
    sizes = {name: functions[kind + name].size for name in names}

    def project(t: float, y: Array) -> Array:
        state = np.asarray(y, float).tolist()
        n, closures = sizes["velocity_change"], _ClosuresAt(t, bound)
        change = [0.0] * n
        led = all(map(math.isfinite, state))
        if led and "position_error" in sizes:
            m = sizes["position_error"] // 2
            arrays = [0.0] * (2 * m), [0.0] * m, change
            led = lead_positions(n, m, closures, state, *arrays)
        if led:
            m = sizes["velocity_error"] // 2
            led = lead_velocities(n, m, closures, state, [0.0] * (2 * m), change)
        return np.array(state) if led else np.full(len(state), np.nan)

    return project


#: Functions that a projection is made of, some of positions alone.
_CLOSURES = (
    *("position_error", "position_reach", "position_change"),
    *("velocity_error", "velocity_change"),
)


@dataclass(frozen=True)
class _ClosuresAt:
    """Functions of closures at a time, as routines call them."""

    t: float
    functions: Mapping[str, Callable[[Any, Any], Any]]

    def _stored(self, name: str, y: Numbers, results: Numbers) -> bool:
        values = self.functions[name](self.t, y).tolist()
        results[:] = values
        return all(map(math.isfinite, values))

    def position_error(self, y: Numbers, results: Numbers) -> bool:
        return self._stored("position_error", y, results)

    def position_reach(self, y: Numbers, results: Numbers) -> bool:
        return self._stored("position_reach", y, results)

    def position_change(self, y: Numbers, results: Numbers) -> bool:
        return self._stored("position_change", y, results)

    def velocity_error(self, y: Numbers, results: Numbers) -> bool:
        return self._stored("velocity_error", y, results)

    def velocity_change(self, y: Numbers, results: Numbers) -> bool:
        return self._stored("velocity_change", y, results)


#: A flag for each contact.
_Flags = NDArray[np.bool_]

#: Part of a time that is its rounding error, some units in the last place.
_TIME_ROUNDING = 2.0**-46


class _DeadlockError(ArithmeticError):
    """There is no motion behind an event; ``flags`` are of the contacts that leave none."""

    def __init__(self, flags: _Flags) -> None:
        self.flags = flags.astype(float)


def _require_finite(values: Any) -> Any:
    if not np.isfinite(values).all():
        raise ArithmeticError("not finite")
    return values


@dataclass(frozen=True)
class Impacts:
    """Functions of contacts at one state, with parameters and inputs.

    Attributes
    ----------
    functions
        Functions of the system by name.
    t, y
        Time and state.
    parameters
        Parameters; flags and targets of the contacts are at ``first`` and behind.
    inputs
        Values of inputs.
    first, count
        The first flag's place among the parameters, and the number of contacts.
    """

    functions: Mapping[str, Runnable]
    t: float
    y: Array
    parameters: Sequence[float]
    inputs: Sequence[float]
    first: int
    count: int

    @cached_property
    def n(self) -> int:
        """The number of coordinates."""
        return self.functions["impulse"].size

    def _values(self, name: str, flags: Any = None, targets: Any = None) -> Any:
        p = list(self.parameters)
        if flags is not None:
            p[self.first : self.first + 2 * self.count] = [*map(float, flags), *map(float, targets)]
        return self.functions[name](self.t, self.y, p, self.inputs)

    @property
    def _flags(self) -> Array:
        return np.array(self.parameters[self.first : self.first + self.count])

    def events(self) -> Array:
        """Evaluate what falls through zero at events: multipliers of closed contacts, else gaps."""
        flags, values = self._flags, self._values("gaps")[: self.count]
        if flags.any():
            closed, multipliers = flags > 0.0, self._values("contact_multipliers")
            values[closed] = multipliers[-self.count :][closed]
        return np.asarray(values)

    def reset(self, event: int, bounce: float) -> tuple[Array | None, Array]:
        """Find the state after an event, and which contacts are then closed (1, else 0).

        Parameters
        ----------
        event
            Number of the contact whose event it is; -1 at a start.
        bounce
            1, or 0 for an impact without restitution.

        Returns
        -------
        None in place of a state that there is not, with the contacts that leave no motion, if that
        is the reason.
        """
        try:
            with np.errstate(all="ignore"):
                return self._after(event, bounce)
        except _DeadlockError as deadlock:
            return None, deadlock.flags
        except (ArithmeticError, np.linalg.LinAlgError):
            return None, np.zeros(self.count)

    def _after(self, event: int, bounce: float) -> tuple[Array, Array]:
        u = self.count
        gap, near = _require_finite(self._values("gaps")).reshape(2, u)
        table = self._gap_table()
        gradient, rate = table[:2]
        v = self.y[self.n : 2 * self.n]
        speed, size = gradient @ v + rate, np.abs(gradient) @ np.abs(v) + np.abs(rate)
        # What closes within the rounding error of the time closes now.
        near = RATE_TOLERANCE * near - _TIME_ROUNDING * abs(self.t) * np.minimum(speed, 0.0)
        closed_before, happening = self._flags > 0.0, np.arange(u) == event
        closed = closed_before | happening | (gap <= near)
        d = self._responses(gradient, closed)
        stays = closed_before
        if (closed & ~closed_before & (speed < -RATE_TOLERANCE * size)).any():
            speed, size = self._hit(bounce, d, table, (speed, size), closed, closed_before)
            stays = np.zeros(u, dtype=bool)
        # One that was in contact and has its event is released, unless an impact came between.
        closed &= ~(stays & happening)
        closed &= stays | (speed <= RATE_TOLERANCE * size)
        return self.y, self._settled(d, closed)

    def _gap_table(self) -> tuple[Array, ...]:
        """Evaluate gradients of the gaps by rows, then rates, biases and restitutions."""
        u, n = self.count, self.n
        terms = _require_finite(self._values("gap_terms"))
        return terms[: u * n].reshape(u, n), *terms[u * n :].reshape(3, u)

    def _responses(self, gradient: Array, closed: _Flags) -> Array:
        """Find what a unit impulse of each closed contact adds to the rates of all, by columns."""
        d = np.zeros((self.count, self.count))
        for k in np.flatnonzero(closed):
            unit = (np.arange(self.count) == k).astype(float)
            change = self._values("impulse", unit, unit)
            # One that the closures alone hold back takes no impulse.
            if np.isfinite(change).all():
                d[:, k] = gradient @ change
        return d

    def _hit(
        self,
        bounce: float,
        d: Array,
        table: tuple[Array, ...],
        rates: tuple[Array, Array],
        closed: _Flags,
        closed_before: _Flags,
    ) -> tuple[Array, Array]:
        """Change the velocities by an impact; return rates of the gaps and their magnitudes."""
        gradient, rate, _, restitution = table
        between = (restitution >= 0.0) & (restitution <= 1.0 + RATE_TOLERANCE)
        if not between[closed].all():
            raise ArithmeticError("a restitution is not between 0 and 1")
        speed, size = np.where(closed_before, 0.0, rates[0]), rates[1]
        # The least rate after the impact, and that of active contacts.
        least = -bounce * restitution * np.minimum(speed, 0.0)
        flags = _pushing(d, speed - least, size, closed)
        v = self.y[self.n : 2 * self.n]
        # A second time for what rounding has left of the first.
        for _ in range(2):
            targets = least - gradient @ v - rate
            v += _require_finite(self._values("impulse", flags, targets))
        speed = gradient @ v + rate
        size = size + np.abs(gradient) @ np.abs(v) + np.abs(rate)
        off = np.where(flags, np.abs(speed - least), least - speed)
        if not (off <= IMPACT_TOLERANCES * RATE_TOLERANCE * size)[closed].all():
            raise ArithmeticError("an impact that is not resolved")
        return np.where(flags, least, speed), size

    def _settled(self, d: Array, closed: _Flags) -> Array:
        """Find the contacts among closed ones that have to push now (1, else 0)."""
        gradient, _, bias, _ = self._gap_table()
        a = _require_finite(self._values("rhs"))[self.n : 2 * self.n]
        w, size = gradient @ a + bias, np.abs(gradient) @ np.abs(a) + np.abs(bias)
        flags = _pushing(d, w, size, closed).astype(float)
        if flags.any():
            _require_finite(self._values("contact_multipliers", flags, np.zeros(self.count)))
        return flags


def _pushing(d: Array, w: Array, size: Array, closed: _Flags) -> _Flags:
    """Find which closed contacts push: w + d x ≥ 0 for pushes x ≥ 0, one of both zero for each.

    This is the dual method of Goldfarb and Idnani, *Math. Programming* 27 (1983) 1.
    """
    x, active = np.zeros(len(w)), np.zeros(len(w), dtype=bool)
    start, sizes = np.where(np.abs(w) > RATE_TOLERANCE * size, w, 0.0), size
    for _ in range(COMPLEMENTARITY_STEPS * (len(w) + 1)):
        w = start + d @ x
        size = sizes + np.abs(d) @ x
        w[active | (np.abs(w) <= RATE_TOLERANCE * size)] = 0.0
        violated = np.flatnonzero(closed & (w < 0.0))
        if not violated.size:
            return active
        _raise_push(int(violated[0]), d, w, x, active)
    raise _DeadlockError(np.zeros(len(w), dtype=bool))


def _raise_push(k: int, d: Array, w: Array, x: Array, active: _Flags) -> None:
    """Raise push k until w[k] is zero; active pushes that are used up end."""
    while True:
        pushing = np.flatnonzero(active)
        r = np.linalg.solve(d[np.ix_(pushing, pushing)], d[pushing, k])
        rise = d[k, k] - d[k, pushing] @ r
        full = -w[k] / rise if rise > RATE_TOLERANCE else np.inf
        ends = [(x[j] / ratio, j) for j, ratio in zip(pushing, r, strict=True) if ratio > 0.0]
        least, first = min(ends, default=(np.inf, -1))
        if min(full, least) == np.inf:
            flags = np.arange(len(w)) == k
            flags[pushing] = r < -RATE_TOLERANCE
            raise _DeadlockError(flags)
        x[pushing] = np.maximum(x[pushing] - min(full, least) * r, 0.0)
        x[k] += min(full, least)
        if full <= least:
            active[k] = True
            return
        w[k] = min(w[k] + least * rise, 0.0)
        x[first], active[first] = 0.0, False
