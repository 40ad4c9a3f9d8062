"""Machine code of a model: its functions and the integrators for it, compiled and loaded."""

from __future__ import annotations

import copy
import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

from lagrange_cli.cache import Cache
from lagrange_cli.errors import StoppedError
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.buffers import NativeLandmarks
from lagrange_cli.simulate.integrators.native.c_types import (
    DOUBLE,
    ByReference,
    NativeReal,
    address_of,
    function_type,
    projection_type,
)
from lagrange_cli.simulate.integrators.native.function import NativeInputs, NativeRhs
from lagrange_cli.simulate.integrators.right_hand_side import InputPieces, Tracer
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.inputs import RecordedInputs
from lagrange_cli.simulate.system.library_sources import OPTIONS, stepping_source, system_source
from lagrange_cli.simulate.system.rounding import parameter_values
from lagrange_cli.simulate.system.tracing import tracer
from lagrange_cli.stages import is_to_end
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.toolchain.shared_library import CSource, load_libraries

#: int64_t lagrange_digits(void)
_DIGITS = ctypes.CFUNCTYPE(ctypes.c_int64)

#: Types of the functions of a system, by what is called in place of those that ctypes cannot.
_PROTOTYPES = {"": function_type, "_projection": projection_type}

#: int system_NAME_taylor_rows(void)
_ROWS = ctypes.CFUNCTYPE(ctypes.c_int)


def pieces_of(recorded: RecordedInputs | None, pattern: int) -> InputPieces | None:
    """Return the pieces of inputs, off by their rounding error in a pattern other than 0."""
    if recorded is None:
        return None
    return recorded.perturbed(pattern) if pattern else recorded.pieces


def _reading(trace: Tracer, count: int) -> Tracer:
    """Restrict a trace to the first ``count`` parameters."""
    return lambda known, t, y, p, u: trace(known, t, y, p[:count], u)


def _sources(model: Model, real: NativeReal) -> list[CSource]:
    """Return the C of a system, and of its integrators."""
    code, stepping = model.code, stepping_source(model.layout.size)
    if real is DOUBLE:
        return [system_source(code), stepping]
    wide, integrators = kernels.wide_files(code.c, code.taylor)
    of_type = kernels.options_of(real)
    return [
        CSource(wide, (*OPTIONS, *of_type)),
        CSource(integrators, (*stepping.options, *of_type)),
    ]


class Libraries:
    """A model's functions and the integrators for it, loaded for one type of numbers.

    Raises
    ------
    CompileError
        There is no compiler, or it failed, or had not ended at the deadline.
    """

    def __init__(
        self,
        model: Model,
        recorded: RecordedInputs | None,
        cache: Cache,
        real: NativeReal,
        deadline: float,
    ) -> None:
        sources = _sources(model, real)
        options = sources[-1].options
        compiler = find_compiler()
        by = f" by {compiler.name}" if compiler.packaged else ""
        #: Says in words what was compiled; a compiler of the machine needs no name.
        self.implementation = f"compiled C{by}"
        self.system, self.stepper = load_libraries(compiler, sources, cache, deadline)
        self._compile: Callable[[str], list[ctypes.CDLL]] = lambda group: load_libraries(
            find_compiler(), [CSource(kernels.kernel_files(group), options)], cache, deadline
        )
        self._further: dict[str, ctypes.CDLL | None] = {}
        self.model, self._real, self.recorded_inputs = model, real, recorded
        self._functions = sources[0].functions
        self._inputs: dict[int, NativeInputs | None] = {}

    def with_numbers(self, model: Model, recorded: RecordedInputs | None) -> Libraries:
        """Return the same libraries for a model of other numbers and inputs."""
        libraries = copy.copy(self)
        libraries.model, libraries.recorded_inputs, libraries._inputs = model, recorded, {}
        return libraries

    def function(
        self,
        name: str,
        pattern: int = 0,
        parameters: Array | None = None,
        guards: Array | None = None,
        *,
        contacts: bool = False,
    ) -> NativeRhs:
        """Return a function of the system; numbers are off by their rounding in a pattern not 0.

        Parameters
        ----------
        parameters
            The numbers that it reads, if not the model's.
        guards
            Numbers of :func:`.singular_guard.guard_signs`, for the guarded form of a right-hand
            side.
        contacts
            States are projected onto closed contacts too, and evaluated one by one.
        """
        if parameters is None:
            parameters = parameter_values(self.model, pattern, self._real)
        guarded, trace = "", tracer(self.model.code.functions, name)
        if guards is not None:
            guarded, trace = "guarded_", _reading(trace, len(parameters))
            parameters = np.concatenate([self._real.array(part) for part in (parameters, guards)])
        entry = self._entry(f"{guarded}{name}")
        lanes = f"system_{guarded}{name}_lanes"
        at_once = self.system[lanes] if lanes in self._functions and not contacts else None
        work = np.empty(self.model.code.work)
        constrained = self.model.multipliers and not contacts
        projection = self._projection("project") if constrained else None
        rhs = NativeRhs(
            entry,
            parameters,
            work,
            self.holding,
            at_once,
            self._real,
            self._projection("contact_project") if contacts else projection,
            self.inputs(pattern),
            trace,
            None if contacts else self._shift,
        )
        if f"system_{guarded}{name}_taylor" in self._functions:
            rhs.series = self._series(name)
        return rhs

    def inputs(self, pattern: int) -> NativeInputs | None:
        """Return the inputs, off by their rounding in a pattern not 0; None without inputs."""
        if pattern not in self._inputs:
            pieces = pieces_of(self.recorded_inputs, pattern)
            self._inputs[pattern] = None if pieces is None else NativeInputs(pieces, self._real)
        return self._inputs[pattern]

    def _series(self, name: str) -> tuple[int, int]:
        """Return the address of the Taylor recurrences of a function, and their rows."""
        address = address_of(self.system[f"system_{name}_taylor"])
        return address, int(_ROWS((f"system_{name}_taylor_rows", self.system))())

    def holding(self, kernel: str) -> ctypes.CDLL | None:
        """Return the library of a kernel, None if it cannot be compiled or is for doubles.

        Raises
        ------
        StoppedError
            The compiler ended since somebody has asked for an end: no run begins in Python, whose
            state a run in machine code could not go on from.
        """
        if kernel in kernels.GROUPS["stepping"] or kernel in kernels.GROUPS["series"]:
            return self.stepper
        if self._real is not DOUBLE:
            return None
        group = next(name for name, members in kernels.GROUPS.items() if kernel in members)
        if group not in self._further:
            try:
                self._further[group] = self._compile(group)[0]
            except CompileError:
                if is_to_end():
                    raise StoppedError from None
                self._further[group] = None
        return self._further[group]

    def _entry(self, name: str, kind: str = "") -> Any:
        """Return a C function of the system; ``kind``: ``_projection`` if it is one."""
        place = (f"system_{name}", self.system)
        if self._real.by_value:
            return _PROTOTYPES[kind](self._real)(place)
        return ByReference(place, (f"lagrange_call{kind}", self.stepper), self._real)

    def _projection(self, name: str) -> Any:
        return self._entry(name, "_projection")

    @property
    def _shift(self) -> Any:
        known = "system_shifted_change" in self._functions
        return self._entry("shifted_change") if known else None

    def sides(self, guards: Array | None = None) -> tuple[NativeRhs, tuple[NativeRhs, NativeRhs]]:
        """Return the right-hand side and the two perturbed ones; guarded with some ``guards``."""
        one, two = (self.function("disturbed", pattern, guards=guards) for pattern in (1, 2))
        return self.function("rhs", guards=guards), (one, two)

    @property
    def landmarks(self) -> NativeLandmarks | None:
        """The exponents of sharp functions, None if there are none."""
        if not self.model.landmarks:
            return None
        parameters = parameter_values(self.model, 0, self._real)
        work, count = np.empty(self.model.code.work), self.model.landmarks
        return NativeLandmarks(self._entry("landmarks"), parameters, work, count)

    @property
    def digits(self) -> int:
        """Binary digits of the numbers that the compiler made of the type."""
        return int(_DIGITS(("lagrange_digits", self.stepper))())
