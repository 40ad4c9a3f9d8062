"""Constraints by interpreted functions: projection, events of contacts, states behind them.

The methods are the routines of emitted code (:mod:`lagrange_cli.program.lowered.routines`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lagrange_cli.program.interpreter.interpreter import Runnable
from lagrange_cli.program.lowered.routines.impacts import (
    INSTANT,
    falling,
    reset_arrays,
    reset_contacts,
)
from lagrange_cli.program.lowered.routines.numbers import Array as Numbers
from lagrange_cli.program.lowered.routines.projection import lead_positions, lead_velocities
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


@dataclass(frozen=True)
class Impacts:
    """Functions of contacts at a time, with parameters and inputs, as routines call them.

    Attributes
    ----------
    functions
        Functions of the system by name.
    t
        The time.
    parameters
        Parameters; flags and targets of the contacts are at ``first`` and behind.
    inputs
        Values of inputs.
    first, count
        The first flag's place among the parameters, and the number of contacts.
    """

    functions: Mapping[str, Runnable]
    t: float
    parameters: Sequence[float]
    inputs: Sequence[float]
    first: int
    count: int

    def events(self, y: Array) -> Array:
        """Evaluate what falls through zero at events: multipliers of closed contacts, else gaps."""
        c, m = self.count, self.functions["contact_multipliers"].size
        state, out = y.tolist(), [math.nan] * c
        if not falling(c, m - c, self, state, self._mode, out, [0.0] * (2 * c), [0.0] * m):
            return np.full(c, np.nan)
        return np.array(out)

    def reset(self, y: Array, event: int, bounce: float) -> tuple[Array | None, Array]:
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
        n, m = self.functions["impulse"].size, self.functions["contact_multipliers"].size
        c, state, mode = self.count, y.tolist(), self._mode
        arrays = ([0.0] * size for size in reset_arrays(n, len(y), c, m).values())
        number, late = event if event >= 0 else c, INSTANT * abs(self.t)
        status = reset_contacts(n, c, self, number, bounce, late, state, mode, *arrays)
        return (None if status else np.array(state)), np.array(mode[:c])

    @property
    def _mode(self) -> list[float]:
        return [*self.parameters[self.first : self.first + self.count], *[0.0] * self.count]

    def _stored(self, name: str, y: Numbers, results: Numbers, mode: Sequence[float] = ()) -> bool:
        p = list(self.parameters)
        p[self.first : self.first + len(mode)] = mode
        values = self.functions[name](self.t, y, p, self.inputs).tolist()
        results[:] = values
        return all(map(math.isfinite, values))

    def gaps(self, y: Numbers, results: Numbers) -> bool:
        return self._stored("gaps", y, results)

    def gap_terms(self, y: Numbers, results: Numbers) -> bool:
        return self._stored("gap_terms", y, results)

    def flight_rhs(self, y: Numbers, results: Numbers) -> bool:
        return self._stored("rhs", y, results)

    def impulse(self, y: Numbers, mode: Numbers, results: Numbers) -> bool:
        return self._stored("impulse", y, results, mode)

    def contact_multipliers(self, y: Numbers, mode: Numbers, results: Numbers) -> bool:
        return self._stored("contact_multipliers", y, results, mode)
