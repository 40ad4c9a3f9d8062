"""Machine code of a model: its functions and the integrators for it, compiled and loaded."""

from __future__ import annotations

import copy
import ctypes
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from lagrange_cli.cache import Cache
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.expressions import Tracer
from lagrange_cli.simulate.integrators.native.c_types import (
    DOUBLE,
    NativeReal,
    function_type,
    projection_type,
)
from lagrange_cli.simulate.integrators.native.function import NativeInputs, NativeRhs
from lagrange_cli.simulate.integrators.native.landmarks import NativeLandmarks
from lagrange_cli.simulate.integrators.piecewise import InputPieces
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.inputs import RecordedInputs
from lagrange_cli.simulate.system.parameters import parameter_values
from lagrange_cli.simulate.system.stepping import stepping_source
from lagrange_cli.simulate.system.tracing import tracer
from lagrange_cli.simulate.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.simulate.toolchain.shared_library import CSource, load_libraries

#: int64_t lagrange_digits(void)
_DIGITS = ctypes.CFUNCTYPE(ctypes.c_int64)

#: Options for the text of a system.
OPTIONS = ("-O2",)


def pieces_of(recorded: RecordedInputs | None, pattern: int) -> InputPieces | None:
    """Pieces of inputs, off by their rounding error in a pattern other than 0."""
    if recorded is None:
        return None
    return recorded.perturbed(pattern) if pattern else recorded.pieces


def _reading(trace: Tracer, count: int) -> Tracer:
    """Restrict a trace to the first ``count`` parameters."""
    return lambda known, t, y, p, u: trace(known, t, y, p[:count], u)


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
        code, stepping = model.code, stepping_source(len(model.coordinates))
        options = stepping.options
        if real is not DOUBLE:
            system = kernels.extended_precision({"system.c": code.c})
            stepping = CSource(kernels.extended_precision(stepping.files), options)
        else:
            system = {"system.c": code.c + code.lanes, **kernels.kernel_headers()}
        sources = [CSource(system, OPTIONS), stepping]
        self.system, self.stepper = load_libraries(find_compiler(), sources, cache, deadline)
        self._compile: Callable[[str], list[ctypes.CDLL]] = lambda group: load_libraries(
            find_compiler(), [CSource(kernels.kernel_files(group), options)], cache, deadline
        )
        self._further: dict[str, ctypes.CDLL | None] = {}
        self.model, self._real, self.recorded_inputs = model, real, recorded
        self._functions = sources[0].functions

    def of(self, model: Model) -> Libraries:
        """Return the same libraries for a model of other numbers."""
        libraries = copy.copy(self)
        libraries.model = model
        return libraries

    def function(
        self,
        name: str,
        pattern: int = 0,
        parameters: Array | None = None,
        guards: Array | None = None,
    ) -> NativeRhs:
        """Return a function of the system; numbers are off by their rounding in a pattern not 0.

        ``parameters``: those that it reads, if not the model's; ``guards``: numbers of
        :func:`.singular_guard.guard_signs`, for the guarded form of a right-hand side.
        """
        if parameters is None:
            parameters = parameter_values(self.model, pattern, self._real)
        guarded, trace = "", tracer(self.model.code.python, name)
        if guards is not None:
            guarded, trace = "guarded_", _reading(trace, len(parameters))
            parameters = np.concatenate([parameters, guards])
        pieces = pieces_of(self.recorded_inputs, pattern)
        entry = function_type(self._real)((f"system_{guarded}{name}", self.system))
        lanes = f"system_{guarded}{name}_lanes"
        at_once = self.system[lanes] if lanes in self._functions else None
        work = np.empty(self.model.code.work)
        projection = self._projection if self.model.multipliers else None
        return NativeRhs(
            entry,
            parameters,
            work,
            self.holding,
            at_once,
            self._real,
            projection,
            None if pieces is None else NativeInputs(pieces, self._real),
            trace,
            self._shift,
        )

    def holding(self, kernel: str) -> ctypes.CDLL | None:
        """Return the library of a kernel, None if it cannot be compiled or is for doubles."""
        if kernel in kernels.GROUPS["stepping"]:
            return self.stepper
        if self._real is not DOUBLE:
            return None
        group = next(name for name, members in kernels.GROUPS.items() if kernel in members)
        if group not in self._further:
            self._further[group] = None
            with suppress(CompileError):
                self._further[group] = self._compile(group)[0]
        return self._further[group]

    @property
    def _projection(self) -> Any:
        return projection_type(self._real)(("system_project", self.system))

    @property
    def _shift(self) -> Any:
        known = "system_shifted_change" in self._functions
        entry = ("system_shifted_change", self.system)
        return function_type(self._real)(entry) if known else None

    def sides(self, guards: Array | None = None) -> tuple[NativeRhs, tuple[NativeRhs, NativeRhs]]:
        """Return the right-hand side and the two perturbed ones; guarded with some ``guards``."""
        one, two = (self.function("disturbed", pattern, guards=guards) for pattern in (1, 2))
        return self.function("rhs", guards=guards), (one, two)

    @property
    def landmarks(self) -> NativeLandmarks | None:
        """The exponents of sharp functions, None if there are none."""
        if not self.model.landmarks:
            return None
        entry = function_type(self._real)(("system_landmarks", self.system))
        work = np.empty(self.model.code.work)
        return NativeLandmarks(entry, parameter_values(self.model), work, self.model.landmarks)

    @property
    def digits(self) -> int:
        """Binary digits of the numbers that the compiler made of the type."""
        return int(_DIGITS(("lagrange_digits", self.stepper))())
