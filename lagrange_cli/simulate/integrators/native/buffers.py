"""Memory that kernels and Python share along a compiled run: events, exponents, observed motion."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import EventStart
from lagrange_cli.simulate.integrators.events import (
    EVENT_PARTS,
    TerminalEvents,
    ZeroCrossing,
)
from lagrange_cli.simulate.integrators.native.c_types import (
    LANDMARK_ROWS,
    MOST_EVENTS,
    NativeReal,
    address_of,
    place_of,
    structure,
)
from lagrange_cli.simulate.integrators.observed_motion import (
    BRIEF,
    ROOM,
    SETTLING,
    WINDOW,
    ObservedMotion,
)

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
        """Forget the located events, and begin with other signs, noise and reach."""
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
        """Note the located events."""
        for k in range(self._c.located):
            index = int(self._indices[k])
            if index < self._count:
                self.end = index
            else:
                time = float(self._real.doubles(self._times[k : k + 1])[0])
                state = np.array(self._real.doubles(self._states[k]))
                self.dips.append(ZeroCrossing(time, index - self._count, state))
        self._c.located = 0


@dataclass(frozen=True)
class NativeLandmarks:
    """A C function that gives the exponents of ``count`` sharp functions.

    Attributes
    ----------
    function, parameters, work
        As of :class:`.integrators.events.NativeEvents`.
    """

    function: Any
    parameters: Array
    work: Array
    count: int


class LandmarkBuffer:
    """Memory of a kernel for exponents; ``peaks``, shape (2, count), is kept between steps."""

    def __init__(self, landmarks: NativeLandmarks, dimension: int, real: NativeReal) -> None:
        count, dtype = landmarks.count, real.dtype
        self.peaks = np.zeros((2, count), dtype)
        arrays = {
            "p": real.array(landmarks.parameters),
            "work": np.empty_like(landmarks.work, dtype),
            "level": self.peaks[0],
            "active": self.peaks[1],
            "values": np.empty((LANDMARK_ROWS, count), dtype),
            "state": np.empty(dimension, dtype),
        }
        self._kept_alive = landmarks, arrays
        self._c = structure("landmarks")(count=count)
        self._c.function = address_of(landmarks.function)
        for name, array in arrays.items():
            setattr(self._c, name, place_of(array))

    @property
    def remade(self) -> int:
        """Number of steps that were made again."""
        return int(self._c.remade)

    @property
    def address(self) -> int:
        return ctypes.addressof(self._c)


#: Numbers that the kernel changes.
_CHANGED = ("longest", "since", "passed", "ended")


class ObservedBuffer:
    """Memory of a kernel that observes a motion in the arrays of an :class:`ObservedMotion`."""

    def __init__(self, motion: ObservedMotion) -> None:
        self._motion = motion
        self._steps, n = np.empty((2, ROOM)), len(motion.way)
        arrays = {
            **{name: getattr(motion, name) for name in ("origin", "angle", "kind", "moved")},
            **{name: getattr(motion, name) for name in ("scales", "way", "closest")},
            "ends": self._steps[0],
            "lengths": self._steps[1],
            "size": np.empty(n),
            "state": np.empty(len(motion.moved)),
        }
        self._kept_alive = arrays
        self._c = structure("observed")(brief=BRIEF, settling=SETTLING, window=WINDOW)
        self._c.coordinates = n
        for name, array in arrays.items():
            setattr(self._c, name, place_of(array))
        for name in ("tolerance", "least", "span", "nearest", "slowest"):
            setattr(self._c, name, getattr(motion, name))

    def give(self) -> None:
        """Copy the state of the motion, which other runs may have observed, to the kernel."""
        for name in _CHANGED:
            setattr(self._c, name, getattr(self._motion, name))

    def take(self) -> None:
        """Copy the observations of the kernel to the motion."""
        self._motion.extend(*self._steps[:, : self._c.recorded].tolist())
        self._c.recorded = 0
        for name in _CHANGED:
            setattr(self._motion, name, getattr(self._c, name))

    @property
    def address(self) -> int:
        return ctypes.addressof(self._c)
