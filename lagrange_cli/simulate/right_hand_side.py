"""Model → RightHandSide: functions of t and y alone, in machine code or interpreted."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from lagrange_cli.cache import Cache, open_cache
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.compiler import CompileError, find_compiler
from lagrange_cli.simulate.disturbance import off_by_one_ulp, rounding_factors
from lagrange_cli.simulate.integrators.base import Array, ConstrainedRhs, Rhs
from lagrange_cli.simulate.integrators.native import (
    DOUBLE,
    EXTENDED,
    NativeReal,
    NativeRhs,
    function_type,
    projection_type,
)
from lagrange_cli.simulate.library import Source, load
from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.watch import StoppedError

__all__ = [
    "RightHandSide",
    "Wider",
    "compiled",
    "functions_of",
    "interpreted",
    "right_hand_side",
]

#: Values at many states: t (m,), y (m, 2n) → (m, k).
Table: TypeAlias = Callable[[Array, Array], Array]

_LONG, _POINTER = ctypes.c_long, ctypes.c_void_p

#: int64_t lagrange_digits(void)
_DIGITS = ctypes.CFUNCTYPE(ctypes.c_int64)

#: void system_table(f, rows, t, y, width, p, work, out, columns)
_TABLE = ctypes.CFUNCTYPE(
    None, _POINTER, _LONG, _POINTER, _POINTER, _LONG, _POINTER, _POINTER, _POINTER, _LONG
)

#: Options for the text of a system.
OPTIONS = ("-O2",)

#: Part of a budget after which the compiler is given up, so that the rest is for Python.
COMPILING = 0.5


@dataclass(frozen=True)
class Wider:
    """The right-hand sides of a system in numbers wider than doubles.

    ``epsilon``: the distance from 1 to the next of these numbers.
    """

    rhs: Rhs
    disturbed: tuple[Rhs, Rhs]
    epsilon: float


@dataclass(frozen=True)
class RightHandSide:
    """Functions of t and y = [q, q̇], parameters bound.

    ``rhs`` gives [q̇, q̈], shape (2n,); ``disturbed`` two more of the same, with
    parameters and operations off by their rounding error. The tables evaluate
    many states at once: ``energy`` Σ q̇ ∂L/∂q̇ − L, one column; ``positions`` and
    ``velocities`` the scene's Cartesian names; ``multipliers`` and ``constraints``
    (φ, then φ̇ and ψ) those of the closure equations, ``outputs`` what the scene
    asks for besides, no columns where there are none. NaN stands for what does not
    exist. ``implementation`` says in words what runs. ``wider`` makes the same
    right-hand sides in wider arithmetic, or None where there is none. Right-hand
    sides of systems with closure equations have a projection, see
    :func:`.base.projection`.
    """

    rhs: Rhs
    disturbed: tuple[Rhs, Rhs]
    energy: Table
    positions: Table
    velocities: Table
    multipliers: Table
    constraints: Table
    outputs: Table
    implementation: str
    wider: Callable[[], Wider | None] = lambda: None


def right_hand_side(
    model: Model, cache: Cache | None = None, budget: float | None = None
) -> RightHandSide:
    """The functions compiled where the machine has a C compiler, else interpreted.

    ``budget``: seconds for all that is done with them, from now on.
    """
    seconds = math.inf if budget is None else budget
    try:
        return compiled(model, open_cache() if cache is None else cache, seconds)
    except CompileError as error:
        return interpreted(model, error.reason)


def _given(model: Model) -> Array:
    return np.array([0.0 if p.value is None else p.value for p in model.parameters])


def _off(model: Model, pattern: int, real: NativeReal = DOUBLE) -> Array:
    """Parameters off by their rounding error, then the factors of a pattern."""
    given = off_by_one_ulp(_given(model), pattern)
    return np.concatenate([given, rounding_factors(model.code.factors, pattern, real)])


def _no_columns(t: Array, y: Array) -> Array:
    return np.empty((len(t), 0))


# Machine code.


class _Libraries:
    """A model's functions and the integrators for it, loaded for one type of numbers.

    Raises
    ------
    CompileError
        There is no compiler, or it failed, or had not ended at the deadline.
    """

    def __init__(self, model: Model, cache: Cache, real: NativeReal, deadline: float) -> None:
        code, options = model.code, kernels.options(2 * len(model.coordinates))
        system, stepping = {"system.c": code.c}, kernels.files()
        if real is not DOUBLE:
            system, stepping = kernels.extended(system), kernels.extended(stepping)
        else:
            system = {"system.c": code.c + code.lanes, **kernels.headers()}
        sources = [Source(system, OPTIONS), Source(stepping, options)]
        self.system, self.stepper = load(find_compiler(), sources, cache, deadline)
        self._model, self._real = model, real
        self._functions = sources[0].functions

    def function(self, name: str, parameters: Array) -> NativeRhs:
        entry = function_type(self._real)((f"system_{name}", self.system))
        lanes = f"system_{name}_lanes"
        at_once = self.system[lanes] if lanes in self._functions else None
        work = np.empty(self._model.code.work)
        projection = self._projection if self._model.multipliers else None
        return NativeRhs(entry, parameters, work, self.stepper, at_once, self._real, projection)

    @property
    def _projection(self) -> Any:
        return projection_type(self._real)(("system_project", self.system))

    def sides(self) -> tuple[NativeRhs, tuple[NativeRhs, NativeRhs]]:
        """The right-hand side, and the two disturbed ones."""
        rhs = self.function("rhs", _given(self._model))
        off = [self.function("disturbed", _off(self._model, k, self._real)) for k in (1, 2)]
        return rhs, (off[0], off[1])

    @property
    def digits(self) -> int:
        """Binary digits of the numbers that the compiler made of the type."""
        return int(_DIGITS(("lagrange_digits", self.stepper))())


def compiled(model: Model, cache: Cache, budget: float = math.inf) -> RightHandSide:
    """The functions of a model in machine code.

    Raises
    ------
    CompileError
        There is no compiler, or it failed, or took half of the ``budget``, in seconds.
    """
    started = time.perf_counter()
    libraries = _Libraries(model, cache, DOUBLE, started + COMPILING * budget)
    width = 2 * len(model.coordinates)

    def table(name: str, columns: int) -> Table:
        if columns == 0:
            return _no_columns
        function = libraries.function(name, _given(model))
        return _native_table(libraries.system, function, width, columns)

    rhs, disturbed = libraries.sides()
    return RightHandSide(
        rhs=rhs,
        disturbed=disturbed,
        energy=table("energy", 1),
        positions=table("positions", len(model.cartesian)),
        velocities=table("velocities", len(model.cartesian)),
        multipliers=table("multipliers", len(model.multipliers)),
        constraints=table("constraints", model.residuals),
        outputs=table("outputs", len(model.outputs)),
        implementation="compiled C",
        wider=lambda: _wider(model, cache, started + budget),
    )


def _wider(model: Model, cache: Cache, deadline: float) -> Wider | None:
    """Right-hand sides in long doubles, where they have more digits here and in C.

    Raises
    ------
    StoppedError
        They were not ready at the deadline.
    """
    if EXTENDED.epsilon >= DOUBLE.epsilon:
        return None
    try:
        libraries = _Libraries(model, cache, EXTENDED, deadline)
    except CompileError:
        if time.perf_counter() >= deadline:
            raise StoppedError from None
        return None
    if 2.0 ** (1 - libraries.digits) != EXTENDED.epsilon:
        return None
    return Wider(*libraries.sides(), EXTENDED.epsilon)


def _native_table(library: ctypes.CDLL, function: NativeRhs, width: int, columns: int) -> Table:
    """A function of the library at many states; ``width`` numbers a state."""
    call = _TABLE(("system_table", library))

    def table(t: Array, y: Array) -> Array:
        t, y = np.ascontiguousarray(t, dtype=float), np.ascontiguousarray(y, dtype=float)
        out = np.empty((len(t), columns))
        call(
            function.address,
            len(t),
            t.ctypes.data,
            y.ctypes.data,
            width,
            function.parameters.ctypes.data,
            function.work.ctypes.data,
            out.ctypes.data,
            columns,
        )
        return out

    return table


# Interpreted.


def functions_of(code: str) -> dict[str, Any]:
    """The functions of a model's code in Python, by name.

    What is executed is made of names and numbers that the program chose: no
    text of a scene is in it.
    """
    functions: dict[str, Any] = {}
    exec(compile(code, "<model>", "exec"), functions)
    return functions


def interpreted(model: Model, reason: str) -> RightHandSide:
    """The functions of a model run by Python; ``reason`` says why they are not compiled."""
    functions = functions_of(model.code.python)

    def bound(name: str, parameters: Array) -> Callable[[float, Array], Any]:
        function, given = functions[name], parameters.tolist()
        return lambda t, y: function(t, y, given)

    def table(name: str, columns: int) -> Table:
        return _interpreted_table(bound(name, _given(model)), columns) if columns else _no_columns

    def side(name: str, parameters: Array) -> Rhs:
        rhs = bound(name, parameters)
        if not model.multipliers:
            return rhs
        return ConstrainedRhs(rhs, bound("project", parameters[: len(model.parameters)]))

    return RightHandSide(
        rhs=side("rhs", _given(model)),
        disturbed=(side("disturbed", _off(model, 1)), side("disturbed", _off(model, 2))),
        energy=table("energy", 1),
        positions=table("positions", len(model.cartesian)),
        velocities=table("velocities", len(model.cartesian)),
        multipliers=table("multipliers", len(model.multipliers)),
        constraints=table("constraints", model.residuals),
        outputs=table("outputs", len(model.outputs)),
        implementation=f"interpreted Python: {reason}",
    )


def _interpreted_table(function: Callable[[float, Array], Any], columns: int) -> Table:
    def table(t: Array, y: Array) -> Array:
        rows = [function(float(s), state) for s, state in zip(t, y, strict=True)]
        return np.array(rows, dtype=float).reshape(len(t), columns)

    return table
