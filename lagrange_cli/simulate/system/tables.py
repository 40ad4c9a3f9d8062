"""Functions of a system at many states at once, and with their parameters bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from lagrange_cli.program.interpreter.interpreter import Runnable
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.right_hand_side import (
    Expressions,
    InputPieces,
    PiecewiseRhs,
    Projection,
    Shift,
    StructuredRhs,
    Tracer,
)

#: Values at many states: t (m,), y (m, 2n) → (m, k).
Table: TypeAlias = Callable[[Array, Array], Array]

#: Values at one state.
StateFunction: TypeAlias = Callable[[float, Array], Array]

#: The same at many, with parameters that differ from state to state: those of all, (m, l).
ParameterTable: TypeAlias = Callable[[Array, Array, Array], Array]


def no_columns(t: Array, y: Array) -> Array:
    """Return a table without columns."""
    return np.empty((len(t), 0))


def native_state_function(function: NativeRhs, width: int, columns: int) -> StateFunction:
    """Evaluate a function of a library at one state of ``width`` numbers; NaN if it fails."""
    state, out = np.empty(width), np.empty(columns)
    places = state.ctypes.data, out.ctypes.data
    arguments = function.parameters_address, function.work.ctypes.data

    def row(t: float, y: Array) -> Array:
        state[:] = y
        if function.function(t, places[0], function.inputs(t), *arguments, places[1]):
            return np.full(columns, np.nan)
        return out.copy()

    return row


def interpreted_state_function(function: Callable[[float, Array], Any]) -> StateFunction:
    """Evaluate a function run by Python at one state."""
    return lambda t, y: np.asarray(function(t, y), dtype=float)


def native_parameter_table(function: NativeRhs, columns: int) -> ParameterTable:
    """Evaluate a function of a library at many states, with the parameters of each."""

    def rows(t: Array, y: Array, known: Array) -> Array:
        values = np.empty((len(t), columns))
        for k, parameters in enumerate(known):
            function.parameters[:] = parameters
            values[k : k + 1] = function.table(t[k : k + 1], y[k : k + 1], columns)
        return values

    return rows


def interpreted_table(function: Callable[[float, Array], Any], columns: int) -> Table:
    """Evaluate a function run by Python at many states."""

    def table(t: Array, y: Array) -> Array:
        rows = [function(float(s), state) for s, state in zip(t, y, strict=True)]
        return np.array(rows, dtype=float).reshape(len(t), columns)

    return table


@dataclass(frozen=True)
class _BoundRhs(StructuredRhs):
    """A function run by Python, called as one of t and y.

    Attributes
    ----------
    function
        The function of t, y, parameters and inputs.
    parameters
        Values of its parameters.
    inputs
        Values of its inputs; None without inputs.
    trace
        Runs it over objects; None if that is not wanted.
    driven
        Functions of time whose values follow those of its inputs.
    project, shift
        As those of any :class:`.right_hand_side.StructuredRhs`.
    """

    function: Runnable
    parameters: list[float]
    inputs: Array | None
    trace: Tracer | None
    driven: tuple[Callable[[float], float], ...]
    project: Projection | None
    shift: Shift | None

    @cached_property
    def _of_state(self) -> Callable[[float, Array], Any]:
        function, parameters, driven = self.function, self.parameters, self.driven
        values = [] if self.inputs is None else self.inputs.tolist()
        if not driven:
            return function.bound(parameters, values)
        return lambda t, y: function(t, y, parameters, [*values, *(u(t) for u in driven)])

    def __call__(self, t: float, y: Array) -> Any:
        return self._of_state(t, y)

    @property
    def expressions(self) -> Expressions | None:
        if self.trace is None:
            return None
        inputs = np.empty(0) if self.inputs is None else self.inputs
        return Expressions(self.trace, np.array(self.parameters), inputs)


def bound(
    function: Runnable,
    parameters: list[float],
    pieces: InputPieces | None,
    trace: Tracer | None = None,
    project: Projection | None = None,
    shift: Shift | None = None,
) -> StructuredRhs:
    """Bind parameters and inputs of a function run by Python; it is then one of t and y.

    Parameters
    ----------
    trace
        The same function over objects.
    project, shift
        As those of any :class:`.right_hand_side.StructuredRhs`.
    """
    if pieces is None:
        return _BoundRhs(function, parameters, None, trace, (), project, shift)
    driven = pieces.functions
    # No object that stands for all times goes through a user's function.
    trace = None if driven else trace

    def within(row: Array) -> StructuredRhs:
        return _BoundRhs(function, parameters, row, trace, driven, project, shift)

    return PiecewiseRhs(pieces, within, project)
