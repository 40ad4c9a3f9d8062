"""Expressions that differ in the names of symbols only: the members of an indexed family.

What is worked out for one member holds for every other with its symbols exchanged, so
that the work is done once a family. Symbols are matched in the order of the coordinates.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cmp_to_key
from typing import Generic, TypeVar

import sympy as sp

from lagrange_cli.mechanics.equations import Coordinate

__all__ = ["ShapeClasses", "ShapeInstance", "rename_symbols", "shape"]

_Result = TypeVar("_Result")

#: The order of the arguments of sums and products.
_SYMPY_ORDER = cmp_to_key(sp.Basic.compare)


@dataclass(frozen=True)
class ShapeInstance(Generic[_Result]):
    """What was worked out for the first of a family, and what to exchange for this one.

    ``numbers`` of the coordinates that the expression holds, ascending; those of the first
    have the same order.
    """

    result: _Result
    names: Mapping[sp.Symbol, sp.Symbol]
    numbers: Sequence[int]

    def renamed(self, expr: sp.Expr) -> sp.Expr:
        """A part of the result for this member."""
        return rename_symbols(expr, self.names) if self.names else expr


class ShapeClasses(Generic[_Result]):
    """Results for expressions, worked out once for all that differ in coordinates only."""

    def __init__(
        self, coordinates: Sequence[Coordinate], work_out: Callable[[sp.Expr], _Result]
    ) -> None:
        self._symbols = [(c.q, c.v, c.a) for c in coordinates]
        self._number = {s: j for j, symbols in enumerate(self._symbols) for s in symbols}
        self._work_out = work_out
        self._known: dict[Hashable, tuple[list[int], _Result]] = {}
        self.width = len(coordinates)

    def of(self, expr: sp.Expr) -> ShapeInstance[_Result]:
        """The result for an expression, in terms of the first of its family."""
        numbers = sorted({self._number[s] for s in expr.free_symbols if s in self._number})
        places = {s: (k, d) for k, j in enumerate(numbers) for d, s in enumerate(self._symbols[j])}
        key = shape(expr, places)
        if key not in self._known:
            self._known[key] = numbers, self._work_out(expr)
            return ShapeInstance(self._known[key][1], {}, numbers)
        first, result = self._known[key]
        names = {
            old: new
            for a, b in zip(first, numbers, strict=True)
            for old, new in zip(self._symbols[a], self._symbols[b], strict=True)
        }
        return ShapeInstance(result, names, numbers)


def shape(expr: sp.Basic, places: Mapping[sp.Symbol, Hashable]) -> Hashable:
    """What is equal for two expressions exactly if they are the same up to symbols with places."""
    if not expr.args:
        place: Hashable = places.get(expr, expr)
        return place
    parts = [shape(a, places) for a in expr.args]
    if expr.is_Add or expr.is_Mul:  # the order of whose arguments is that of their names
        return expr.func, frozenset(Counter(parts).items())
    return (expr.func, *parts)


def rename_symbols(expr: sp.Expr, names: Mapping[sp.Symbol, sp.Symbol]) -> sp.Expr:
    """The expression with symbols exchanged for others of the same kind, as it is written.

    ``xreplace`` would evaluate what was left unevaluated, such as 2·(x − y).
    """
    if not expr.args:
        return names.get(expr, expr)
    parts = [rename_symbols(a, names) for a in expr.args]
    if all(new is old for new, old in zip(parts, expr.args, strict=True)):
        return expr
    if not (expr.is_Add or expr.is_Mul):
        return expr.func(*parts)
    if any(new.func is not old.func for new, old in zip(parts, expr.args, strict=True)):
        return expr.func(*parts)  # sin(x − y) may have become −sin(y − x)
    leading = [p for p in parts if p.is_Number]
    parts = leading + sorted((p for p in parts if not p.is_Number), key=_SYMPY_ORDER)
    return expr.func._from_args(parts, expr.is_commutative)
