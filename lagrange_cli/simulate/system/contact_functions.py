"""Functions of a system with contacts, in machine code or interpreted.

All of them read flags of closed contacts behind the scene's parameters (see
:mod:`lagrange_cli.program.systems.contact_systems`).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Protocol

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Rhs
from lagrange_cli.simulate.integrators.events import NativeEvents
from lagrange_cli.simulate.integrators.expressions import Tracer
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, POINTER, RHS, projection_type
from lagrange_cli.simulate.integrators.native.function import NativeInputs, NativeRhs
from lagrange_cli.simulate.integrators.piecewise import InputPieces, with_projection
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.rounding import SURFACE_NUMBERS
from lagrange_cli.simulate.system.tables import (
    StateFunction,
    Table,
    bound,
    interpreted_state_function,
    interpreted_table,
    native_state_function,
)
from lagrange_cli.simulate.system.tracing import tracer

#: int system_reset(t, y, u, p, event, bounce, work)
_RESET = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_double, *[POINTER] * 3, ctypes.c_long, ctypes.c_double, POINTER
)


#: Status of ``system_reset`` where there is no motion behind an event.
_DEADLOCK = 4


class ContactFunctions(Protocol):
    """Functions of a system with contacts for given ``parameters``, flags among them."""

    def side(self, name: str, parameters: Array) -> Rhs:
        """Return a right-hand side that projects onto the closed contacts."""

    def table(self, name: str, columns: int, parameters: Array) -> Table:
        """Return another function, at many states."""

    def row(self, name: str, columns: int, parameters: Array) -> StateFunction:
        """Return another function, at one state."""

    def events(self, parameters: Array) -> NativeEvents | None:
        """Return event functions for compiled integrators, None if none are compiled."""

    def reset(
        self, t: float, y: Array, parameters: Array, event: int, bounce: float
    ) -> tuple[Array | None, Array]:
        """State and flags behind an event; where there is none (None), flags of the contacts
        that leave no motion, if that is why."""


class NativeContacts:
    """Contact functions of a library of machine code; ``kernels`` finds those of integrators."""

    def __init__(
        self,
        model: Model,
        system: ctypes.CDLL,
        kernels: Callable[[str], ctypes.CDLL | None],
        pieces: InputPieces | None,
    ) -> None:
        self._model, self._system, self._kernels = model, system, kernels
        self._native_inputs = None if pieces is None else NativeInputs(pieces, DOUBLE)
        self._work = np.empty(model.code.work)
        self._reset = _RESET(("system_reset", system))
        # Memory in which states are handed over, made at the first call.
        self._state = self._parameters = np.empty(0)
        self._places: tuple[int, ...] = ()

    def _function(
        self, name: str, parameters: Array, projection: Any = None, trace: Tracer | None = None
    ) -> NativeRhs:
        entry = RHS((f"system_{name}", self._system))
        work = np.empty_like(self._work)
        return NativeRhs(
            entry,
            parameters,
            work,
            self._kernels,
            projection=projection,
            native_inputs=self._native_inputs,
            trace=trace,
        )

    def side(self, name: str, parameters: Array) -> Rhs:
        project = projection_type(DOUBLE)(("system_contact_project", self._system))
        return self._function(name, parameters, project, tracer(self._model.code.python, name))

    def table(self, name: str, columns: int, parameters: Array) -> Table:
        return partial(self._function(name, parameters).table, columns=columns)

    def row(self, name: str, columns: int, parameters: Array) -> StateFunction:
        width = 2 * len(self._model.coordinates)
        return native_state_function(self._function(name, parameters), width, columns)

    def events(self, parameters: Array) -> NativeEvents | None:
        function = RHS(("system_events", self._system))
        return NativeEvents(function, parameters, np.empty_like(self._work))

    def reset(
        self, t: float, y: Array, parameters: Array, event: int, bounce: float
    ) -> tuple[Array | None, Array]:
        if len(self._state) != len(y):
            self._state, self._parameters = np.empty(len(y)), np.empty(len(parameters))
            arrays = self._state, self._parameters, self._work
            self._places = tuple(array.ctypes.data for array in arrays)
        self._state[:], self._parameters[:] = y, parameters
        inputs = self._native_inputs
        u = None if inputs is None else inputs.address(inputs.pieces.at(t))
        state, numbers, work = self._places
        status = self._reset(t, state, u, numbers, event, bounce, work)
        flags = self._parameters[_flags(self._model)].copy()
        if status:
            return None, flags if status == _DEADLOCK else np.zeros_like(flags)
        return self._state.copy(), flags


class InterpretedContacts:
    """Contact functions of a module of Python."""

    def __init__(
        self, model: Model, functions: Mapping[str, Callable[..., Any]], pieces: InputPieces | None
    ) -> None:
        self._model, self._functions, self._pieces = model, functions, pieces

    def _bound(self, name: str, parameters: Array) -> Rhs:
        return bound(self._functions[name], parameters.tolist(), self._pieces)

    def side(self, name: str, parameters: Array) -> Rhs:
        numbers = parameters.tolist()
        project = bound(self._functions["contact_project"], numbers, None)
        trace = tracer(self._model.code.python, name)
        return with_projection(bound(self._functions[name], numbers, self._pieces, trace), project)

    def table(self, name: str, columns: int, parameters: Array) -> Table:
        return interpreted_table(self._bound(name, parameters), columns)

    def row(self, name: str, columns: int, parameters: Array) -> StateFunction:
        return interpreted_state_function(self._bound(name, parameters))

    def events(self, parameters: Array) -> NativeEvents | None:
        return None

    def reset(
        self, t: float, y: Array, parameters: Array, event: int, bounce: float
    ) -> tuple[Array | None, Array]:
        pieces = self._pieces
        inputs = [] if pieces is None else [lambda t, *_: pieces.values(t)]
        numbers = parameters.tolist()
        state, flags = self._functions["reset"](t, y, numbers, *inputs, event, bounce)
        return None if state is None else np.array(state), np.array(flags)


def _flags(model: Model) -> slice:
    """Find the flags of closed contacts among the parameters."""
    first = len(model.parameters) + SURFACE_NUMBERS * len(model.surfaces)
    return slice(first, first + len(model.contacts))
