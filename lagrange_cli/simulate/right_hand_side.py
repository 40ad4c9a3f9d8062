"""Model → RightHandSide: functions of t and y alone, in machine code or interpreted."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from lagrange_cli.cache import Cache, open_cache
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.compiler import CompileError, find_compiler
from lagrange_cli.simulate.disturbance import off_by_one_ulp, rounding_factors
from lagrange_cli.simulate.integrators.base import Array, Rhs
from lagrange_cli.simulate.integrators.native import RHS, NativeRhs
from lagrange_cli.simulate.library import Source, load
from lagrange_cli.simulate.model import Model

__all__ = ["RightHandSide", "compiled", "interpreted", "right_hand_side"]

#: Values at many states: t (m,), y (m, 2n) → (m, k).
Table: TypeAlias = Callable[[Array, Array], Array]

_LONG, _POINTER = ctypes.c_long, ctypes.c_void_p

#: void system_table(f, rows, t, y, width, p, work, out, columns)
_TABLE = ctypes.CFUNCTYPE(
    None, _POINTER, _LONG, _POINTER, _POINTER, _LONG, _POINTER, _POINTER, _POINTER, _LONG
)

#: Options for the text of a system.
OPTIONS = ("-O2",)


@dataclass(frozen=True)
class RightHandSide:
    """Functions of t and y = [q, q̇], parameters bound.

    ``rhs`` gives [q̇, q̈], shape (2n,); ``disturbed`` two more of the same, with
    parameters and operations off by their rounding error. The tables evaluate
    many states at once: ``energy`` Σ q̇ ∂L/∂q̇ − L, one column; ``positions`` and
    ``velocities`` the scene's Cartesian names. NaN stands for what does not
    exist. ``implementation`` says in words what runs.
    """

    rhs: Rhs
    disturbed: tuple[Rhs, Rhs]
    energy: Table
    positions: Table
    velocities: Table
    implementation: str


def right_hand_side(model: Model, cache: Cache | None = None) -> RightHandSide:
    """The functions compiled where the machine has a C compiler, else interpreted."""
    try:
        return compiled(model, open_cache() if cache is None else cache)
    except CompileError as error:
        return interpreted(model, error.reason)


def _given(model: Model) -> list[float]:
    return [0.0 if p.value is None else p.value for p in model.parameters]


def _off(model: Model, pattern: int) -> list[float]:
    """Parameters off by their rounding error, then the factors of a pattern."""
    given = off_by_one_ulp(_given(model), pattern).tolist()
    return [*given, *rounding_factors(model.code.factors, pattern)]


# Machine code.


def compiled(model: Model, cache: Cache) -> RightHandSide:
    """The functions of a model in machine code.

    Raises
    ------
    CompileError
        There is no compiler, or it failed.
    """
    compiler = find_compiler()
    if compiler is None:
        raise CompileError("no C compiler was found")
    stepping = Source(kernels.files(), kernels.options(2 * len(model.coordinates)))
    texts = {"system.c": model.code.c, **kernels.headers()}
    system, stepper = load(compiler, [Source(texts, OPTIONS), stepping], cache)
    width = 2 * len(model.coordinates)

    def function(name: str, parameters: list[float]) -> NativeRhs:
        entry = RHS((f"system_{name}", system))
        lanes = getattr(system, f"system_{name}_lanes", None)
        work = np.empty(model.code.work)
        return NativeRhs(entry, np.array(parameters), work, stepper, lanes)

    def table(name: str, columns: int) -> Table:
        return _native_table(system, function(name, _given(model)), width, columns)

    return RightHandSide(
        rhs=function("rhs", _given(model)),
        disturbed=(function("disturbed", _off(model, 1)), function("disturbed", _off(model, 2))),
        energy=table("energy", 1),
        positions=table("positions", len(model.cartesian)),
        velocities=table("velocities", len(model.cartesian)),
        implementation="compiled C",
    )


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


def interpreted(model: Model, reason: str) -> RightHandSide:
    """The functions of a model run by Python; ``reason`` says why they are not compiled.

    What is executed is made of names and numbers that the program chose: no
    text of a scene is in it.
    """
    functions: dict[str, Any] = {}
    exec(compile(model.code.python, "<right-hand side>", "exec"), functions)

    def bound(name: str, parameters: list[float]) -> Callable[[float, Array], Any]:
        function = functions[name]
        return lambda t, y: function(t, y, parameters)

    def table(name: str, columns: int) -> Table:
        return _interpreted_table(bound(name, _given(model)), columns)

    return RightHandSide(
        rhs=bound("rhs", _given(model)),
        disturbed=(bound("disturbed", _off(model, 1)), bound("disturbed", _off(model, 2))),
        energy=table("energy", 1),
        positions=table("positions", len(model.cartesian)),
        velocities=table("velocities", len(model.cartesian)),
        implementation=f"interpreted Python: {reason}",
    )


def _interpreted_table(function: Callable[[float, Array], Any], columns: int) -> Table:
    def table(t: Array, y: Array) -> Array:
        rows = [function(float(s), state) for s, state in zip(t, y, strict=True)]
        return np.array(rows, dtype=float).reshape(len(t), columns)

    return table
