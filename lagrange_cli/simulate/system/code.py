"""Functions of a model by name, for given parameters: in machine code, or run by Python.

What asks for functions, the right-hand sides with contacts and the switching surfaces among them,
is written once over :class:`ModelCode`; both kinds of code implement it.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import Any

import numpy as np

from lagrange_cli.program.interpreter.interpreter import Runnable
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.events import NativeEvents
from lagrange_cli.simulate.integrators.native.c_types import POINTER, RHS
from lagrange_cli.simulate.integrators.right_hand_side import InputPieces, StructuredRhs
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.constraints import Impacts, projection
from lagrange_cli.simulate.system.libraries import Libraries
from lagrange_cli.simulate.system.rounding import first_flag, parameter_values
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

#: Status of ``system_reset`` if no motion follows an event.
_DEADLOCK = 4


class ModelCode(ABC):
    """Functions of a model by name; inputs are those of one pattern of rounding errors.

    Functions read their ``parameters`` anew at each call of a table.
    """

    #: Number of coordinates of the model.
    coordinates: int

    @abstractmethod
    def side(self, name: str, parameters: Array) -> StructuredRhs:
        """Return a right-hand side; its states obey the closure equations."""

    @abstractmethod
    def contact_side(self, name: str, parameters: Array) -> StructuredRhs:
        """Return a right-hand side whose states obey the closed contacts too."""

    @abstractmethod
    def table(self, name: str, columns: int, parameters: Array) -> Table:
        """Return another function, at many states."""

    @abstractmethod
    def row(self, name: str, columns: int, parameters: Array) -> StateFunction:
        """Return another function, at one state."""

    @abstractmethod
    def events(self, name: str, parameters: Array) -> NativeEvents | None:
        """Return event functions for compiled integrators, None if none are compiled."""

    @abstractmethod
    def reset(
        self, t: float, y: Array, parameters: Array, event: int, bounce: float
    ) -> tuple[Array | None, Array]:
        """Return state and flags behind an event; None if no motion follows, with the flags of
        the contacts that leave none, if that is the reason."""


class NativeCode(ModelCode):
    """The functions of a library of machine code.

    ``guards``: numbers of :func:`.singular_guard.guard_signs`, for right-hand sides that end there.
    """

    def __init__(self, libraries: Libraries, pattern: int, guards: Array | None = None) -> None:
        self._libraries, self._pattern, self._guards = libraries, pattern, guards
        self.coordinates = len(libraries.model.coordinates)
        # Memory in which states are handed over, made at the first reset.
        self._state = self._parameters = self._work = np.empty(0)
        self._places: tuple[int, ...] = ()

    def side(self, name: str, parameters: Array) -> StructuredRhs:
        return self._libraries.function(name, self._pattern, parameters, self._guards)

    def contact_side(self, name: str, parameters: Array) -> StructuredRhs:
        return self._libraries.function(name, self._pattern, parameters, contacts=True)

    def table(self, name: str, columns: int, parameters: Array) -> Table:
        function = self._libraries.function(name, self._pattern, parameters)
        return partial(function.table, columns=columns)

    def row(self, name: str, columns: int, parameters: Array) -> StateFunction:
        width = self._libraries.model.layout.size
        function = self._libraries.function(name, self._pattern, parameters)
        return native_state_function(function, width, columns)

    def events(self, name: str, parameters: Array) -> NativeEvents | None:
        function = RHS((f"system_{name}", self._libraries.system))
        return NativeEvents(function, parameters, np.empty(self._libraries.model.code.work))

    @cached_property
    def _reset(self) -> Any:
        return _RESET(("system_reset", self._libraries.system))

    def reset(
        self, t: float, y: Array, parameters: Array, event: int, bounce: float
    ) -> tuple[Array | None, Array]:
        model = self._libraries.model
        if len(self._state) != len(y):
            self._state, self._parameters = np.empty(len(y)), np.empty(len(parameters))
            self._work = np.empty(model.code.work)
            arrays = self._state, self._parameters, self._work
            self._places = tuple(array.ctypes.data for array in arrays)
        self._state[:], self._parameters[:] = y, parameters
        inputs = self._libraries.inputs(self._pattern)
        u = None if inputs is None else inputs.address(inputs.pieces.at(t))
        state, numbers, work = self._places
        status = self._reset(t, state, u, numbers, event, bounce, work)
        first = first_flag(model)
        flags = self._parameters[first : first + len(model.contacts)].copy()
        if status:
            return None, flags if status == _DEADLOCK else np.zeros_like(flags)
        return self._state.copy(), flags


class InterpretedCode(ModelCode):
    """The functions of a model run by Python; ``guard`` ends right-hand sides somewhere."""

    def __init__(
        self,
        model: Model,
        functions: Mapping[str, Runnable],
        pieces: InputPieces | None,
        guard: Callable[[StructuredRhs], StructuredRhs] = lambda rhs: rhs,
    ) -> None:
        self._functions, self._pieces, self._guard = functions, pieces, guard
        self.coordinates = len(model.coordinates)
        self._model, self._known = model, len(parameter_values(model))

    def _constrained(self, name: str, parameters: Array, kind: str) -> StructuredRhs:
        """Bind a right-hand side with a projection, if there are closures."""
        numbers, functions = parameters.tolist(), self._functions
        # Without the factors of rounding.
        known = numbers[: self._known]
        change = None if kind else functions.get("shifted_change")

        def shift(t: float, q: Array, there: Array) -> Array:
            assert change is not None
            return np.asarray(change(t, np.concatenate([q, there]), known))

        return bound(
            functions[name],
            numbers,
            self._pieces,
            tracer(self._model.code.functions, name),
            projection(functions, known, kind),
            None if change is None else shift,
        )

    def side(self, name: str, parameters: Array) -> StructuredRhs:
        return self._guard(self._constrained(name, parameters, ""))

    def contact_side(self, name: str, parameters: Array) -> StructuredRhs:
        return self._constrained(name, parameters, "contact_")

    def table(self, name: str, columns: int, parameters: Array) -> Table:
        function = self._functions[name]

        def table(t: Array, y: Array) -> Array:
            now = bound(function, parameters.tolist(), self._pieces)
            return interpreted_table(now, columns)(t, y)

        return table

    def row(self, name: str, columns: int, parameters: Array) -> StateFunction:
        numbers = parameters.tolist()
        if name == "events":
            return lambda t, y: self._impacts(t, numbers).events(np.asarray(y, float))
        return interpreted_state_function(bound(self._functions[name], numbers, self._pieces))

    def events(self, name: str, parameters: Array) -> NativeEvents | None:
        return None

    def reset(
        self, t: float, y: Array, parameters: Array, event: int, bounce: float
    ) -> tuple[Array | None, Array]:
        return self._impacts(t, parameters.tolist()).reset(np.asarray(y, float), event, bounce)

    def _impacts(self, t: float, parameters: list[float]) -> Impacts:
        inputs = [] if self._pieces is None else self._pieces.values(t)
        first, count = first_flag(self._model), len(self._model.contacts)
        return Impacts(self._functions, t, parameters, inputs, first, count)
