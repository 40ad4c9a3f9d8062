"""Integrators in machine code: the C of :mod:`lagrange_cli.simulate.kernels` behind the protocol.

Each class has the name and the declared properties of the method that it
replaces where the right-hand side is a :class:`NativeRhs` with kernels. Calls
release the GIL, and every run has memory of its own.
"""

from __future__ import annotations

import ctypes
import math
from functools import cache
from typing import Any, ClassVar

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    NOT_FINITE,
    UNDERFLOW,
    UNMET,
    Advance,
    Control,
    EventStart,
    Integrator,
    SavedState,
    StepError,
)
from lagrange_cli.simulate.integrators.events import TerminalEvents, ZeroCrossing
from lagrange_cli.simulate.integrators.gauss import Gauss16
from lagrange_cli.simulate.integrators.native.buffers import (
    EventBuffer,
    LandmarkBuffer,
    ObservedBuffer,
)
from lagrange_cli.simulate.integrators.native.c_types import (
    DOUBLE,
    LONG,
    POINTER,
    KernelStatus,
    aligned_zeros,
    place_of,
    structure,
)
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.observed_motion import ROOM, ObservedMotion
from lagrange_cli.simulate.integrators.right_hand_side import Rhs
from lagrange_cli.simulate.integrators.scipy_methods import DOP853, RK4, Radau
from lagrange_cli.simulate.integrators.symplectic import (
    DIVERGES,
    Gauss4,
    Gauss6,
    Rattle,
    Verlet,
    require_shift,
)

_ROWS = ctypes.CFUNCTYPE(LONG)
_START = ctypes.CFUNCTYPE(ctypes.c_int, POINTER)
_INTERPOLATE = ctypes.CFUNCTYPE(ctypes.c_int, POINTER, POINTER, POINTER)
_ADVANCE = ctypes.CFUNCTYPE(ctypes.c_int, *(POINTER, POINTER, LONG, POINTER, POINTER, LONG, LONG))


#: Reasons of failure by the return value of a call (kernel.h).
_FAILURES: dict[int, str] = {
    KernelStatus.UNDERFLOW: UNDERFLOW,
    KernelStatus.NOT_FINITE: NOT_FINITE,
    KernelStatus.UNMET: UNMET,
    KernelStatus.DIVERGES: DIVERGES,
}

#: Steps or right-hand sides that no run makes.
_ENDLESS = 2**62


class _Compiled:
    """The part of an integrator that calls its kernel; mixed into the method it replaces."""

    kernel: ClassVar[str]
    interpolates: ClassVar[bool]
    repeats: ClassVar[bool] = True

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        assert isinstance(rhs, NativeRhs)
        assert rhs.kernels is not None
        self._library = rhs.kernels(self.kernel)
        self._native, self._control = rhs, control
        self._landmarks: LandmarkBuffer | None = None
        self._events: EventBuffer | None = None
        self._seen: ObservedBuffer | None = None
        self._stretches: tuple[Array, Array] | None = None
        self._stretches_at = 0, 0, 0
        self._fresh = b""
        self.end_event: int | None = None
        n = len(y0)
        rows = self._rows(n)
        memory = aligned_zeros(n * (rows + 3) + len(rhs.work), rhs.real.dtype)
        self._every = memory
        self._memory = memory[: n * rows].reshape(rows, n)
        self._tolerances = memory[n * rows : n * (rows + 2)].reshape(2, n)
        self._scratch = memory[n * (rows + 2) : n * (rows + 3)].reshape(1, n)
        self._memory[0] = rhs.real.array(y0)
        self._run = run = structure("run", rhs.real)()
        address, row = place_of(memory), memory.itemsize * n
        run.rhs, run.lanes, run.project = rhs.address, rhs.lanes_address, rhs.projection_address
        run.p = rhs.parameters_address
        run.shift = rhs.shift_address
        self._begin_inputs(rhs, t0)
        run.memory, run.n, run.t_end = address, n, rhs.real.number(t_end)
        run.rtol, run.atol = address + row * rows, address + row * (rows + 1)
        run.work = address + row * (rows + 3)
        run.t = run.t_old = run.t_new = rhs.real.number(t0)
        run.h = rhs.real.number(self._first_step(t_end - t0))
        self.t_end = t_end
        if rhs.series is not None:
            run.series, run.series_rows = rhs.series
        if rhs.landmarks is not None:
            self._landmarks = LandmarkBuffer(rhs.landmarks, n, rhs.real)
            run.landmarks = self._landmarks.address
        self._advance = self._function("advance", _ADVANCE)
        self._stand()

    def _stand(self) -> None:
        """Begin at the state that the memory has."""
        self._read()

    def _begin_inputs(self, rhs: NativeRhs, t0: float) -> None:
        """Let inputs begin with the piece that holds at the start."""
        inputs, run = rhs.native_inputs, self._run
        if inputs is None:
            return
        run.starts, run.inputs = inputs.starts.ctypes.data, inputs.rows.ctypes.data
        run.pieces, run.width = inputs.rows.shape
        run.piece = inputs.pieces.first(t0)
        run.u = inputs.address(run.piece)

    def _rows(self, n: int) -> int:
        """Return the number of rows of memory, each of n numbers."""
        return _row_count(self._library, self.kernel)

    def _first_step(self, span: float) -> float:
        return min(self._control.first_step, span)

    def _function(self, name: str, prototype: Any) -> Any:
        return _kernel(self._library, f"lagrange_{self.kernel}_{name}", prototype)

    def _read(self) -> None:
        """Copy kernel counters and state into attributes."""
        run = self._run
        self.t = float(run.t)
        high, low = self._native.real.doubles(self._memory[:2])
        self.y: Array = high + low
        self.steps: int = run.steps
        self.rejections: int = run.rejections
        self.evaluations: int = run.evaluations
        if self._landmarks is not None:
            self.remade = self._landmarks.remade
        if self._events is not None:
            self._events.take()

    def observe(self, motion: ObservedMotion) -> None:
        assert self._native.real is DOUBLE
        self._seen = ObservedBuffer(motion)
        self._run.observed = self._seen.address

    def loosen_by(self, control: Control) -> None:
        assert control.loosening is not None
        real, loosening = self._native.real, control.loosening
        self._stretches = since, rows = real.array(loosening.since), real.array(loosening.rows)
        self._stretches_at = place_of(since), place_of(rows), len(since)

    def stop_at(self, events: TerminalEvents) -> None:
        if not self.interpolates:
            raise ValueError(f"steps of {self.kernel} have no interpolant to find events on")
        self._events = EventBuffer(events, self._memory.shape[1], self._native.real)
        self._events.read_inputs(self._run.u)
        self._run.events = self._events.address
        self._fresh = bytes(self._run)

    def state(self) -> SavedState:
        values = {
            "run": np.frombuffer(bytes(self._run), np.uint8),
            "memory": self._every.copy(),
            "end_event": self.end_event,
        }
        if self._landmarks is not None:
            values["peaks"] = self._landmarks.peaks.copy()
        return values if self._events is None else {**values, "signs": self._events.signs.copy()}

    def restore(self, state: SavedState) -> None:
        run = self._run
        pointers = {name: getattr(run, name) for name, kind in run._fields_ if kind is POINTER}
        ctypes.memmove(ctypes.byref(run), state["run"].tobytes(), ctypes.sizeof(run))
        for name, address in pointers.items():
            setattr(run, name, address)
        if self._native.native_inputs is not None:
            run.u = self._native.native_inputs.address(run.piece)
        self._every[:] = state["memory"]
        if self._landmarks is not None:
            self._landmarks.peaks[:] = state["peaks"]
        if self._events is not None:
            self._events.signs[:] = state["signs"]
            self._events.read_inputs(run.u)
        self._read()
        self.end_event = state["end_event"]

    @property
    def dips(self) -> list[ZeroCrossing]:
        return [] if self._events is None else self._events.dips

    def step(self, limit: float) -> None:
        times = np.array([np.inf if self.interpolates else limit])
        done = self.advance(times, self._scratch, most_steps=1, most_evaluations=np.inf)
        if done.failure is not None:
            raise StepError(done.failure)

    def advance(
        self, times: Array, states: Array, *, most_steps: int, most_evaluations: float
    ) -> Advance:
        real = self._native.real
        times = real.array(times)
        fits = states.flags.c_contiguous and states.dtype == real.dtype
        out = states if fits else np.empty(states.shape, real.dtype)
        filled, run = LONG(), self._run
        run.max_step = real.number(self._control.max_step)
        self._tolerances[0] = real.array(self._control.rtol)
        self._tolerances[1] = real.array(self._control.atol)
        run.since, run.looser, run.stretches = self._stretches_at
        if self._seen is not None:
            self._seen.give()
            most_steps = min(most_steps, ROOM)
        status = self._advance(
            ctypes.byref(run),
            place_of(times),
            len(times),
            place_of(out),
            ctypes.byref(filled),
            min(most_steps, _ENDLESS),
            math.ceil(min(most_evaluations, _ENDLESS)),
        )
        if out is not states:
            states[: filled.value] = real.doubles(out[: filled.value])
        if self._seen is not None:
            self._seen.take()
        self._read()
        if self._events is not None and self._events.end is not None:
            self.end_event = self._events.end
        return Advance(filled.value, _FAILURES.get(status))


@cache
def _kernel(library: ctypes.CDLL, name: str, prototype: Any) -> Any:
    return prototype((name, library))


@cache
def _row_count(library: ctypes.CDLL, kernel: str) -> int:
    return int(_kernel(library, f"lagrange_{kernel}_rows", _ROWS)())


class _Interpolating(_Compiled):
    """A kernel with an interpolant, and a slope at the start."""

    def _stand(self) -> None:
        self._begin = self._function("start", _START)
        self._nowhere = bool(self._begin(ctypes.byref(self._run)))
        self._read()

    def advance(
        self, times: Array, states: Array, *, most_steps: int, most_evaluations: float
    ) -> Advance:
        if self._nowhere:
            return Advance(0, Phrase("the right-hand side does not exist at the start"))
        return super().advance(
            times, states, most_steps=most_steps, most_evaluations=most_evaluations
        )

    def again(self, t0: float, y0: Array, first_step: float, event_start: EventStart) -> bool:
        if self._events is None or self._landmarks is not None:
            return False
        run = self._run
        ctypes.memmove(ctypes.byref(run), self._fresh, ctypes.sizeof(run))
        real = self._native.real
        self._every[:] = np.zeros(1, real.dtype)
        self._memory[0] = real.array(y0)
        run.t = run.t_old = run.t_new = real.number(t0)
        run.h, run.evaluations = real.number(min(first_step, self.t_end - t0)), 0
        self._begin_inputs(self._native, t0)
        self._events.again(event_start)
        self._events.read_inputs(run.u)
        self.end_event = None
        self._nowhere = bool(self._begin(ctypes.byref(run)))
        self._read()
        return True

    def interpolate(self, times: Array) -> Array:
        call, real = self._function("interpolate", _INTERPOLATE), self._native.real
        at = real.array(np.asarray(times, dtype=float))
        states = np.empty((len(at), self._memory.shape[1]), real.dtype)
        for k in range(len(at)):
            if call(ctypes.byref(self._run), at[k:].ctypes.data, states[k:].ctypes.data):
                states[k] = real.array(np.full(states.shape[1], np.nan))
        return real.doubles(states)


class CompiledDOP853(_Interpolating, DOP853):
    """:class:`DOP853` in C: the same coefficients, error estimate and step control.

    Slopes are not evaluated within a step from rest, nor for an interpolant that is a cubic.
    """

    kernel = "dop853"

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        super().__init__(rhs, t0, y0, t_end, control)
        self._run.mode = control.autonomous


class CompiledGauss16(_Interpolating, Gauss16):
    """:class:`Gauss16` in C: the eight stages of an iteration are evaluated side by side."""

    kernel = "gauss"


class CompiledTaylor(_Interpolating, Integrator):
    """Taylor series of one order by emitted recurrences, for numbers wider than doubles.

    A step counts the evaluations of its order.
    """

    kernel = "series"
    name = "taylor"
    title = "Taylor series of order 28"
    order = 28

    def _rows(self, n: int) -> int:
        assert self._native.series is not None
        _, rows = self._native.series
        return super()._rows(n) + math.ceil(rows * (self.order + 1) / n)


class CompiledRadau(_Interpolating, Radau):
    """:class:`Radau` in C, with an interpolant of the method's own order."""

    kernel = "radau"

    def _rows(self, n: int) -> int:
        # The Jacobian, and factors of a real and a complex matrix.
        return super()._rows(n) + 4 * n


class _FixedStep(_Compiled):
    """A kernel that makes steps of ``control.step``."""

    name: ClassVar[str]

    def _first_step(self, span: float) -> float:
        if self._control.step is None:
            raise ValueError(f"{self.name} needs control.step")
        return self._control.step


class CompiledRK4(_FixedStep, RK4):
    """:class:`RK4` in C."""

    kernel = "rk4"


class CompiledVerlet(_FixedStep, Verlet):
    """:class:`Verlet` in C."""

    kernel = "verlet"


class CompiledRattle(_FixedStep, Rattle):
    """:class:`Rattle` in C."""

    kernel = "rattle"

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        require_shift(rhs)
        super().__init__(rhs, t0, y0, t_end, control)


class CompiledGauss4(_FixedStep, Gauss4):
    """:class:`Gauss4` in C."""

    kernel = "gauss4"


class CompiledGauss6(_FixedStep, Gauss6):
    """:class:`Gauss6` in C."""

    kernel = "gauss6"


#: The class in machine code of each method that has one.
COMPILED = {
    method.name: method
    for method in (
        CompiledDOP853,
        CompiledGauss16,
        CompiledRadau,
        CompiledRK4,
        CompiledVerlet,
        CompiledRattle,
        CompiledGauss4,
        CompiledGauss6,
    )
}
