"""Expressions of heyoka that behave like the numbers of a right-hand side."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from lagrange_cli.simulate.integrators.base import UnfitError

#: Operations of a right-hand side after which it is given up: elimination makes many of few.
MOST_HEYOKA_OPERATIONS = 20_000

#: Functions by their names in :mod:`math`, where heyoka calls them the same.
_SAME = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh",
         "atanh", "exp", "log", "sqrt", "atan2")  # fmt: skip

#: Functions without a Taylor series somewhere.
_ROUGH = ("abs", "fabs", "sign", "copysign", "min", "max")


class Algebra:
    """The functions of heyoka, over :class:`Traced`, and how many ``operations`` were made."""

    def __init__(self, package: Any) -> None:
        self.expression, self.zero = package.expression, package.expression(0.0)
        self.operations = 0
        self.functions: dict[str, Callable[..., Any]] = {
            name: self._function(getattr(package, name)) for name in _SAME
        }
        self.functions |= {name: self._rough(name) for name in _ROUGH}
        self.functions |= {"pow": pow, "solve": solve}

    def _function(self, function: Callable[..., Any]) -> Callable[..., Traced]:
        return lambda *arguments: self.made(function, *map(self.plain, arguments))

    def _rough(self, name: str) -> Callable[..., Any]:
        return lambda *_: Traced(_Rough(name), self)

    def value(self, operand: Any) -> Any:
        """Return what an operand stands for, a number as an expression of the package."""
        return operand.value if isinstance(operand, Traced) else self.expression(float(operand))

    def plain(self, operand: Any) -> Any:
        """Return the same, if it has a Taylor series.

        Raises
        ------
        UnfitError
            It has no derivatives somewhere.
        """
        value = self.value(operand)
        if isinstance(value, _Rough):
            raise UnfitError(f"a force in it is not smooth ({value.function})")
        return value

    def made(self, function: Callable[..., Any], *values: Any) -> Traced:
        """Apply a function or an operator, and count it.

        Raises
        ------
        UnfitError
            There are too many.
        """
        self.operations += 1
        if self.operations > MOST_HEYOKA_OPERATIONS:
            raise UnfitError(f"it takes more than {MOST_HEYOKA_OPERATIONS:,} operations")
        return Traced(function(*values), self)


class _Rough:
    """A value of a function that is not smooth, and all that is made of it.

    It may be compared: tests of pivots have magnitudes in them.
    """

    def __init__(self, function: str) -> None:
        self.function = function

    def _self(self, *_: Any) -> _Rough:
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _self
    __truediv__ = __rtruediv__ = __pow__ = __rpow__ = __neg__ = _self


_Operator: TypeAlias = Callable[["Traced", Any], "Traced"]


def _operators(function: Callable[..., Any]) -> tuple[_Operator, _Operator]:
    """Return the operator with the other operand behind it, and that with it in front."""
    return (
        lambda one, operand: one.algebra.made(function, one.value, one.algebra.value(operand)),
        lambda one, operand: one.algebra.made(function, one.algebra.value(operand), one.value),
    )


class Traced:
    """A number or an expression of heyoka, which folds numbers, sums with 0, products with 1."""

    __slots__ = ("algebra", "value")

    def __init__(self, value: Any, algebra: Algebra) -> None:
        self.value, self.algebra = value, algebra

    @property
    def vanishes(self) -> bool:
        """The value is the number 0."""
        return bool(self.value == self.algebra.zero)

    __add__, __radd__ = _operators(operator.add)
    __sub__, __rsub__ = _operators(operator.sub)
    __mul__, __rmul__ = _operators(operator.mul)
    __truediv__, __rtruediv__ = _operators(operator.truediv)
    __pow__, __rpow__ = _operators(operator.pow)

    def __neg__(self) -> Traced:
        return self.algebra.made(operator.neg, self.value)

    def __gt__(self, operand: Any) -> bool:
        """Pivots of regular states are large enough: elsewhere values are not finite."""
        return True

    def __lt__(self, operand: Any) -> bool:
        raise UnfitError("its equations differ from state to state")


def solve(a: Any, b: Any, n: int) -> Any:
    """Solve a x = b by elimination in the given order; the second part of x has its sign turned.

    The first n rows are those of a mass matrix. Unless it is diagonal it may be singular by
    itself, at some states or at all: what follows from the others is added to it, their
    squares, which change no solution.
    """
    solution = _eliminated(a.copy(), b.copy()) if _is_diagonal(a[:n, :n]) else None
    if solution is None:
        g, f = a[n:, :n], b[n:]
        weight = sum(a[i, i] for i in range(n)) / sum(x * x for x in g.ravel())
        fuller, more = a.copy(), b.copy()
        fuller[:n, :n] = fuller[:n, :n] + (g.T @ g) * weight
        more[:n] = more[:n] + (g.T @ f) * weight
        solution = _eliminated(fuller, more)
    if solution is None:
        raise UnfitError("its equations have no solution without a choice of pivots")
    solution[n:] = -solution[n:]
    return solution


def _eliminated(a: Any, b: Any) -> Any:
    """Solve in place; None if a pivot vanishes."""
    s = len(b)
    for j in range(s):
        if _vanishes(a[j, j]):
            return None
        for i in range(j + 1, s):
            if _vanishes(a[i, j]):
                continue
            ratio = a[i, j] / a[j, j]
            for k in range(j, s):
                if not _vanishes(a[j, k]):
                    a[i, k] = a[i, k] - ratio * a[j, k]
            b[i] = b[i] - ratio * b[j]
    for j in reversed(range(s)):
        b[j] = (b[j] - sum(a[j, k] * b[k] for k in range(j + 1, s))) / a[j, j]
    return np.asarray(b)


def _is_diagonal(matrix: Any) -> bool:
    return all(_vanishes(x) for (i, j), x in np.ndenumerate(matrix) if i != j)


def _vanishes(entry: Any) -> bool:
    return entry.vanishes if isinstance(entry, Traced) else entry == 0.0
