"""Kinds of numbers that functions are run over."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.interpreter import solvers
from lagrange_cli.program.lowered.functions import Solve


class UnsupportedError(Exception):
    """A function needs more than an arithmetic has."""


@dataclass(frozen=True)
class Arithmetic:
    """Numbers, or objects in their place, and what is done with them besides + − * /.

    Attributes
    ----------
    number
        Returns the number nearest to a fraction.
    epsilon
        Rounding error of the numbers.
    functions
        Functions of programs by name.
    solve
        Solves equations: a :class:`Solve`, the numbers of a matrix by rows and of a right-hand side
        → those of the solution.
    state
        Lists the numbers of a state.
    errors
        Exceptions of operations without a result, after which a function has NaN for results;
        empty if they are for the caller.
    of_doubles
        Results are arrays of doubles, which must be finite, and large families run through NumPy.
    """

    number: Callable[[Fraction], Any]
    epsilon: Any
    functions: Mapping[str, Callable[..., Any]]
    solve: Callable[[Solve, Sequence[Any], Sequence[Any]], Sequence[Any]]
    state: Callable[[Any], list[Any]] = list
    errors: tuple[type[Exception], ...] = ()
    of_doubles: bool = False


def _sign(x: float) -> float:
    """Return 1, 0 or -1 with the sign of x, NaN for NaN."""
    return float(x > 0.0) - float(x < 0.0) if x == x else math.nan


def _smaller(a: float, b: float) -> float:
    """Return the smaller of two numbers, NaN if one is."""
    return a if a < b or a != a else b


def _larger(a: float, b: float) -> float:
    """Return the larger of two numbers, NaN if one is."""
    return a if a > b or a != a else b


#: Functions that :mod:`math` has not, or not as Python has them.
_OTHERWISE: dict[str, Callable[..., Any]] = {
    "abs": abs,
    "sign": _sign,
    "min": _smaller,
    "max": _larger,
}


def _doubles(y: Any) -> list[float]:
    numbers: list[float] = np.asarray(y, float).tolist()
    return numbers


#: Doubles of Python, one state at a time.
DOUBLES = Arithmetic(
    number=float,
    epsilon=2.0**-53,
    functions={name: _OTHERWISE.get(name) or getattr(math, name) for name in PROGRAM_FUNCTIONS},
    solve=solvers.solution,
    state=_doubles,
    errors=(ArithmeticError, ValueError, np.linalg.LinAlgError),
    of_doubles=True,
)


def digits(context: Any) -> Arithmetic:
    """Return the arithmetic of a context of mpmath, with as many digits as it has at a call."""
    # Imported here: most runs need no digits.
    from lagrange_cli.mechanics.numerics.bounded_functions import BOUNDED_FUNCTIONS

    functions = {
        name: getattr(context, "fabs" if name == "abs" else name)
        for name in PROGRAM_FUNCTIONS
        if name not in ("min", "max", *BOUNDED_FUNCTIONS)
    }

    def solve(step: Solve, matrix: Sequence[Any], right: Sequence[Any]) -> Sequence[Any]:
        n = len(right)
        if step.routine not in ("definite", "pivoted", "saddle"):
            raise UnsupportedError(step.routine)
        rows = [list(matrix[i * n : (i + 1) * n]) for i in range(n)]
        solved = list(context.lu_solve(context.matrix(rows), context.matrix(list(right))))
        if step.routine == "saddle":
            # [x, l] of M x = f + Gᵀ l.
            solved[step.sizes[0] :] = [-x for x in solved[step.sizes[0] :]]
        return solved

    return Arithmetic(
        number=lambda value: context.mpf(value.numerator) / value.denominator,
        epsilon=context.mpf(2) ** -53,
        functions={**functions, **BOUNDED_FUNCTIONS, "min": _smaller, "max": _larger},
        solve=solve,
    )


def objects(functions: Mapping[str, Callable[..., Any]]) -> Arithmetic:
    """Return the arithmetic of objects that remember what is done with them.

    Parameters
    ----------
    functions
        Functions of programs by name, and ``solve`` of a matrix, a right-hand side and the number
        of rows that are the mass matrix's, if there is one.
    """
    eliminate = functions.get("solve")

    def solve(step: Solve, matrix: Sequence[Any], right: Sequence[Any]) -> Sequence[Any]:
        if step.routine != "saddle" or eliminate is None:
            raise UnsupportedError(step.routine)
        n = len(right)
        whole, vector = np.empty(n * n, dtype=object), np.empty(n, dtype=object)
        whole[:], vector[:] = matrix, right
        return list(eliminate(whole.reshape(n, n), vector, step.sizes[0]))

    return Arithmetic(number=float, epsilon=2.0**-53, functions=functions, solve=solve)
