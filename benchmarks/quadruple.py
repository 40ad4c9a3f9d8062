"""Motion of a system in numbers of 113 binary digits: the emitted equations in C's __float128.

Nothing is shared with what ``simulate`` does but the equations: the arithmetic has twice its
digits, the method is another one (``quadruple.c``), and so is the search for events here.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from lagrange_cli.cache import open_cache
from lagrange_cli.emit.c.target import Real
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.simulate.model.build import programs_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.native.sources import library_source
from lagrange_cli.simulate.system.inputs import RecordedInputs, read_recorded_inputs
from lagrange_cli.toolchain.compiler import find_compiler
from lagrange_cli.toolchain.shared_library import CSource, load_libraries

Array = NDArray[np.float64]

#: The type as the emission of C has it.
QUADRUPLE = Real("__float128", "q", "q", Fraction(1, 2**113), 4931, "", "")

#: Parts of the time between two samples at whose ends events are looked for.
PARTS = 4

#: A number that an event makes zero is zero below this part of the largest it had.
ZERO = 1e-24

#: Events between two samples beyond which there is no end of them.
ENDLESS = 1000

#: Why a run ends that has used up its right-hand sides.
TOO_MANY = "it takes too many right-hand sides"

_POINTER, _LONG, _DOUBLE = ctypes.c_void_p, ctypes.c_long, ctypes.c_double

#: Functions of quadruple.c: what they return, what they take.
_INTERFACE: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "begin": (_POINTER, (_LONG, _LONG, _LONG, _LONG)),
    "end": (None, (_POINTER,)),
    "obey": (None, (_POINTER, _POINTER, _POINTER)),
    "parameters": (None, (_POINTER, _LONG, _POINTER, _POINTER)),
    "inputs": (None, (_POINTER, _LONG, _POINTER)),
    "stand": (ctypes.c_int, (_POINTER, _DOUBLE, *[_POINTER] * 3, _DOUBLE)),
    "until": (ctypes.c_int, (_POINTER, _DOUBLE, _LONG)),
    "shift": (ctypes.c_int, (_POINTER, _DOUBLE, _LONG)),
    "distance": (_DOUBLE, (_POINTER, _DOUBLE)),
    "mark": (None, (_POINTER,)),
    "back": (None, (_POINTER,)),
    "state": (None, (_POINTER, _POINTER, _POINTER)),
    "value": (ctypes.c_int, (_POINTER, _POINTER, _LONG, _POINTER)),
    "reset": (ctypes.c_int, (_POINTER, _POINTER, _LONG, _LONG, _POINTER)),
    "evaluations": (_LONG, (_POINTER,)),
}


class EndedError(Exception):
    """The motion cannot be followed further."""


@dataclass(frozen=True)
class Happening:
    """An event of a contact: its time as two doubles, the contact, and what happens to it."""

    high: float
    low: float
    name: str


class Library:
    """The machine code of a system; motions with any parameters and initial state begin in it."""

    def __init__(self, equations: Equations, model: Model) -> None:
        self.model = model
        self.drive: RecordedInputs | None = read_recorded_inputs(model.recordings)
        system = "#include <quadmath.h>\n" + library_source(programs_of(equations), QUADRUPLE)
        own = Path(__file__).with_name("quadruple.c").read_text(encoding="ascii")
        options = ("-std=gnu99", "-O2", "-Wl,--no-as-needed", "-lquadmath")
        source = CSource({"system.c": system, "quadruple.c": own}, options)
        (self._library,) = load_libraries(find_compiler(), [source], open_cache())
        for name, (result, arguments) in _INTERFACE.items():
            function = getattr(self._library, f"quadruple_{name}")
            function.restype, function.argtypes = result, arguments

    def call(self, name: str, *arguments: Any) -> Any:
        """A function of quadruple.c."""
        return getattr(self._library, f"quadruple_{name}")(*arguments)

    def address(self, name: str) -> int | None:
        """Where a function of the system is, None where there is none."""
        try:
            return ctypes.cast(self._library[f"system_{name}"], _POINTER).value
        except AttributeError:
            return None


def _lacking(values: Sequence[float], exact: Sequence[Fraction | None]) -> list[float]:
    """What doubles lack of the numbers that the scene writes; 0 where only these are known."""
    pairs = zip(values, exact, strict=True)
    return [0.0 if known is None else float(known - Fraction(value)) for value, known in pairs]


class Motion:
    """One motion on its way: its state, the closed contacts, and what happened so far."""

    def __init__(
        self, library: Library, model: Model, scales: Array, tolerance: float, most: int
    ) -> None:
        self._library, self._model, self._most = library, model, most
        self._width = 2 * len(model.coordinates)
        contacts = len(model.contacts)
        values, low = model.numbers, _lacking(model.numbers, model.exact_numbers)
        self._parameters = np.array([*values, *[0.0] * (2 * contacts)])
        self._low_parameters = np.array([*low, *[0.0] * (2 * contacts)])
        self._flags = slice(len(values), len(values) + contacts)
        self._largest = np.zeros(contacts)
        self.happened: list[Happening] = []
        row = 0 if library.drive is None else library.drive.pieces.rows.shape[1]
        work = 2 * model.code.work
        self._motion = library.call("begin", self._width, len(self._parameters), row, work)
        if not self._motion:
            raise MemoryError
        self._scales = np.ascontiguousarray(tolerance * scales)

    def __del__(self) -> None:
        if getattr(self, "_motion", None):
            self._library.call("end", self._motion)

    @property
    def evaluations(self) -> int:
        return int(self._library.call("evaluations", self._motion))

    def through(self, times: Array) -> Iterator[tuple[Array, Array]]:
        """The states at the times, from the first on: doubles, and what they lack.

        Raises
        ------
        EndedError
            It goes no further.
        """
        initial = np.array(self._model.initial)
        low = np.array(_lacking(self._model.initial or (), self._model.exact_initial))
        self._give(self._parameters)
        self._obey()
        drive = self._library.drive
        starts = np.empty(0) if drive is None else drive.pieces.starts
        self._read(float(times[0]))
        first_step = float(times[1] - times[0]) / 64
        arrays = initial.ctypes.data, low.ctypes.data, self._scales.ctypes.data
        status = self._library.call("stand", self._motion, float(times[0]), *arrays, first_step)
        self._require(status)
        if self._model.contacts:
            self._reset(-1)
        yield self._state()
        for t in times[1:].tolist():
            inner = starts[(starts > self._now()) & (starts < t)]
            for stop in (*inner.tolist(), t):
                self._go(stop)
                self._read(stop)
            yield self._state()

    def _go(self, t: float) -> None:
        if not self._model.contacts:
            self._require(self._library.call("until", self._motion, t, self._most))
            return
        first = self._now()
        for part in range(1, PARTS + 1):
            self._go_with_contacts(t if part == PARTS else first + (t - first) * part / PARTS)

    def _require(self, status: int) -> None:
        if status:
            reasons = {2: "the constraints cannot be met", 3: TOO_MANY}
            raise EndedError(reasons.get(status, "no step is short enough"))

    def _state(self) -> tuple[Array, Array]:
        high, low = np.empty((2, self._width + 1))
        self._library.call("state", self._motion, high.ctypes.data, low.ctypes.data)
        return high[1:], low[1:]

    def _time(self) -> tuple[float, float]:
        high, low = np.empty((2, self._width + 1))
        self._library.call("state", self._motion, high.ctypes.data, low.ctypes.data)
        return float(high[0]), float(low[0])

    def _now(self) -> float:
        return self._time()[0]

    def _give(self, parameters: Array) -> None:
        data = parameters.ctypes.data, self._low_parameters.ctypes.data
        self._library.call("parameters", self._motion, len(parameters), *data)

    def _read(self, t: float) -> None:
        """Take the inputs that hold from a time on."""
        if self._library.drive is not None:
            pieces = self._library.drive.pieces
            row = np.ascontiguousarray(pieces.rows[pieces.at(t)])
            self._library.call("inputs", self._motion, len(row), row.ctypes.data)

    # Contacts.

    def _obey(self) -> None:
        """Take the right-hand side and the projection for what is closed."""
        closed = bool(self._parameters[self._flags].any())
        names = ("contact_rhs", "contact_project") if closed else ("rhs", "project")
        self._library.call("obey", self._motion, *map(self._library.address, names))

    def _values(self) -> Array:
        """The multiplier of each closed contact, the gap of each open one."""
        values = np.empty(len(self._model.contacts))
        address = self._library.address("events")
        self._require(
            self._library.call("value", self._motion, address, len(values), values.ctypes.data)
        )
        self._largest = np.maximum(self._largest, np.abs(values))
        return values

    def _go_with_contacts(self, t: float) -> None:
        for _ in range(ENDLESS):
            rising = np.abs(self._values()) <= ZERO * self._largest
            event = self._fallen(t, rising)
            if event is None:
                return
            self._happen(event)
        raise EndedError("contacts close and open without end")

    def _fallen(self, t: float, rising: NDArray[np.bool_]) -> int | None:
        """Go on to a time or to the first event before, whose contact is told."""
        self._library.call("mark", self._motion)
        length = float(self._library.call("distance", self._motion, t))
        found = [
            (self._zero(k, length, bool(rising[k])), k)
            for k in np.flatnonzero(self._at(length) < 0).tolist()
        ]
        if not found:
            self._library.call("back", self._motion)
            self._require(self._library.call("until", self._motion, t, self._most))
            return None
        first, event = min(found)
        self._at(first)
        self._polish(event, length)
        return event

    def _at(self, length: float) -> Array:
        """The numbers that events make zero, so far behind the mark."""
        self._library.call("back", self._motion)
        self._require(self._library.call("shift", self._motion, length, self._most))
        return self._values()

    def _zero(self, k: int, length: float, rising: bool) -> float:
        """How far behind the mark number k, negative at a distance, falls through zero."""
        start, end = 0.0, length
        while rising and start == 0.0:
            if end < 1e-12 * length:
                raise EndedError("a contact that opens closes at once")
            if self._at(end / 2)[k] > 0:
                start = end / 2
            else:
                end /= 2

        def number(at: float) -> float:
            return float(self._at(at)[k])

        if not rising and number(0.0) <= 0:
            return 0.0
        return float(brentq(number, start, end, xtol=1e-300, rtol=1e-15))

    def _polish(self, k: int, length: float) -> None:
        """Secant steps from where the motion stands, each smaller than the one before."""
        step, before = 1e-9 * length, float(self._values()[k])
        for _ in range(4):
            self._require(self._library.call("shift", self._motion, step, self._most))
            now = float(self._values()[k])
            if now == before or now == 0.0:
                return
            step, before = -now * step / (now - before), now

    def _happen(self, event: int) -> None:
        closed = bool(self._parameters[self._flags][event])
        kind = "release" if closed else "contact"
        name = f"{kind}:{self._model.contacts[event]}"
        self.happened.append(Happening(*self._time(), name))
        self._reset(event)

    def _reset(self, event: int) -> None:
        parameters = self._parameters
        count, data = len(parameters), parameters.ctypes.data
        address = self._library.address("reset")
        status = self._library.call("reset", self._motion, address, event, count, data)
        if status:
            raise EndedError("what the contacts do next cannot be determined")
        self._obey()
