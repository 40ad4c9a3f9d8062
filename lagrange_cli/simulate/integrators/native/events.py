"""Zeros of event functions g(t, y) along a compiled run."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from lagrange_cli.simulate.integrators.base import EventStart
from lagrange_cli.simulate.integrators.event_functions import (
    EVENT_PARTS,
    NativeEvents,
    ZeroCrossing,
)
from lagrange_cli.simulate.integrators.native.c_structures import MOST_EVENTS, events_type
from lagrange_cli.simulate.integrators.native.c_types import NativeReal, address_of, place_of

#: Steps full of events that the buffer of one call holds.
_STEPS = 64


class EventBuffer:
    """The events that one call of a kernel locates, and ``crossings``, the list of all.

    ``signs`` are those that the functions had last; ``dips`` where they came close to zero.
    """

    def __init__(
        self, events: NativeEvents, dimension: int, real: NativeReal, inputs: int | None = None
    ) -> None:
        count, dtype, none = len(events.directions), real.dtype, np.zeros(len(events.directions))
        capacity = _STEPS * MOST_EVENTS * count
        self.crossings: list[ZeroCrossing] = []
        self.dips: list[ZeroCrossing] = []
        self._count, self._real = count, real
        self._times = np.empty(capacity, dtype)
        self._indices = np.empty(capacity, dtype=np.int64)
        self._states = np.empty((capacity, dimension), dtype)
        arrays: dict[str, Any] = {
            "p": real.array(events.parameters),
            "work": np.empty_like(events.work, dtype),
            "direction": np.array(events.directions, dtype=np.int64),
            "terminal": np.array(events.terminal, dtype=np.int64),
            "sign": real.array(np.array(events.signs or none)),
            "noise": real.array(np.array(events.noise or none)),
            "reach": real.array(np.array(events.reach or none)),
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
        self._c = events_type()(count=count, capacity=capacity, u=inputs)
        self._c.function = address_of(events.function)
        for name, array in arrays.items():
            setattr(self._c, name, place_of(array))

    def again(self, begun: EventStart) -> None:
        """Forget what was found, and begin with other signs, noise and reach."""
        self.crossings, self.dips = [], []
        for array, values in zip((self.signs, self._noise, self._reach), begun, strict=True):
            array[:] = self._real.array(np.array(values, dtype=float))

    @property
    def address(self) -> int:
        return ctypes.addressof(self._c)

    def read_inputs(self, address: int | None) -> None:
        """Let the event functions read their inputs at an address."""
        self._c.u = address

    def take(self) -> None:
        """Move what was found into the list."""
        for k in range(self._c.located):
            time = float(self._real.doubles(self._times[k : k + 1])[0])
            index = int(self._indices[k])
            kept, number = (
                (self.crossings, index) if index < self._count else (self.dips, index - self._count)
            )
            state = np.array(self._real.doubles(self._states[k]))
            kept.append(ZeroCrossing(time, number, state))
        self._c.located = 0
