"""Event functions g(t, y) along a compiled run."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from lagrange_cli.simulate.integrators.base import EventStart
from lagrange_cli.simulate.integrators.event_functions import (
    EVENT_PARTS,
    TerminalEvents,
    ZeroCrossing,
)
from lagrange_cli.simulate.integrators.native.c_structures import MOST_EVENTS, structure
from lagrange_cli.simulate.integrators.native.c_types import NativeReal, address_of, place_of

#: Steps full of events that the buffer of one call holds.
_STEPS = 64


class EventBuffer:
    """The events that calls of a kernel locate: one that ends the run, and ``dips`` before it.

    Attributes
    ----------
    signs
        Those that the functions had last.
    dips
        Where they came close to zero.
    end
        Number of the function that fell through zero; None before.
    """

    def __init__(self, events: TerminalEvents, dimension: int, real: NativeReal) -> None:
        assert events.native is not None
        count, dtype = len(events.signs), real.dtype
        capacity = _STEPS * MOST_EVENTS * count
        self.dips: list[ZeroCrossing] = []
        self.end: int | None = None
        self._count, self._real = count, real
        self._times = np.empty(capacity, dtype)
        self._indices = np.empty(capacity, dtype=np.int64)
        self._states = np.empty((capacity, dimension), dtype)
        arrays: dict[str, Any] = {
            "p": real.array(events.native.parameters),
            "work": np.empty_like(events.native.work, dtype),
            "sign": real.array(np.array(events.signs)),
            "noise": real.array(np.array(events.noise)),
            "reach": real.array(np.array(events.reach or np.zeros(count))),
            "before": np.zeros(count, dtype),
            "values": np.empty((EVENT_PARTS + 4, count), dtype),
            "state": np.empty(dimension, dtype),
            "times": self._times,
            "indices": self._indices,
            "states": self._states,
        }
        self.signs = arrays["sign"]
        self._noise, self._reach = arrays["noise"], arrays["reach"]
        self._kept_alive = events, arrays
        self._c = structure("events")(count=count, capacity=capacity)
        self._c.function = address_of(events.native.function)
        for name, array in arrays.items():
            setattr(self._c, name, place_of(array))

    def again(self, begun: EventStart) -> None:
        """Forget what was found, and begin with other signs, noise and reach."""
        self.dips, self.end = [], None
        for array, values in zip((self.signs, self._noise, self._reach), begun, strict=True):
            array[:] = self._real.array(np.array(values, dtype=float))

    @property
    def address(self) -> int:
        return ctypes.addressof(self._c)

    def read_inputs(self, address: int | None) -> None:
        """Let the event functions read their inputs at an address."""
        self._c.u = address

    def take(self) -> None:
        """Note what was found."""
        for k in range(self._c.located):
            index = int(self._indices[k])
            if index < self._count:
                self.end = index
            else:
                time = float(self._real.doubles(self._times[k : k + 1])[0])
                state = np.array(self._real.doubles(self._states[k]))
                self.dips.append(ZeroCrossing(time, index - self._count, state))
        self._c.located = 0
