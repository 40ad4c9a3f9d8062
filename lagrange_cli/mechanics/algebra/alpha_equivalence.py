"""Equality of expressions up to the names of their symbols (alpha equivalence).

Elements of an indexed family differ in symbols only. A result for one holds for every other
with symbols exchanged, so that the work is done once a family. Symbols are matched in the
order of the coordinates.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import sympy as sp

from lagrange_cli.mechanics.algebra.arithmetic import power, sympy_order
from lagrange_cli.mechanics.system import Coordinate

_Result = TypeVar("_Result")


@dataclass(frozen=True)
class ShapeInstance(Generic[_Result]):
    """The result for the first expression of a shape, and the symbols to exchange for this one.

    Attributes
    ----------
    names
        Symbol of the first expression → symbol of this one.
    numbers
        Coordinates that this expression holds, ascending; the first one's have the same order.
    """

    result: _Result
    names: Mapping[sp.Symbol, sp.Symbol]
    numbers: Sequence[int]

    def renamed(self, expr: sp.Expr) -> sp.Expr:
        """Exchange the symbols in a part of the result."""
        return rename_symbols(expr, self.names) if self.names else expr


class ShapeClasses(Generic[_Result]):
    """Results for expressions, computed once for all that differ in coordinates only."""

    def __init__(
        self, coordinates: Sequence[Coordinate], work_out: Callable[[sp.Expr], _Result]
    ) -> None:
        self._symbols = [(c.q, c.v, c.a) for c in coordinates]
        self._number = {s: j for j, symbols in enumerate(self._symbols) for s in symbols}
        self._work_out = work_out
        self._known: dict[Hashable, tuple[list[int], _Result]] = {}
        self.width = len(coordinates)

    def instance(self, expr: sp.Expr) -> ShapeInstance[_Result]:
        """Return the result for an expression, in terms of the first expression of its shape."""
        numbers = sorted({self._number[s] for s in expr.free_symbols if s in self._number})
        # A result that is simplified for a positive symbol does not hold for another one.
        places = {
            s: (k, d, s.is_positive)
            for k, j in enumerate(numbers)
            for d, s in enumerate(self._symbols[j])
        }
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
    """Compute a key that two expressions share exactly if they agree up to symbols with places."""
    if not expr.args:
        place: Hashable = places.get(expr, expr)
        return place
    parts = [shape(a, places) for a in expr.args]
    if expr.is_Add or expr.is_Mul:  # the order of whose arguments is that of their names
        return expr.func, frozenset(Counter(parts).items())
    return (expr.func, *parts)


def rename_symbols(expr: sp.Expr, names: Mapping[sp.Symbol, sp.Symbol]) -> sp.Expr:
    """Exchange symbols for others of the same kind, leaving the expression as it is written.

    ``xreplace`` would evaluate products that were left unevaluated, such as 2·(x − y).
    """
    if not expr.args:
        return names.get(expr, expr)
    parts = [rename_symbols(a, names) for a in expr.args]
    if all(new is old for new, old in zip(parts, expr.args, strict=True)):
        return expr
    if expr.is_Pow:
        return power(*parts)
    if not (expr.is_Add or expr.is_Mul):
        return expr.func(*parts)
    if any(new.func is not old.func for new, old in zip(parts, expr.args, strict=True)):
        return expr.func(*parts)  # sin(x − y) may have become −sin(y − x)
    leading = [p for p in parts if p.is_Number]
    parts = leading + sorted((p for p in parts if not p.is_Number), key=sympy_order)
    return expr.func._from_args(parts, expr.is_commutative)
