"""Expressions put in place of symbols, where what recurs is evaluated once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import sympy as sp

from lagrange_cli.mechanics.algebra.plain_sums import negative, plain_sum


class Substitution:
    """Replaces symbols as ``xreplace`` does.

    Parameters
    ----------
    places
        Symbol → the expression in its place.
    """

    def __init__(self, places: Mapping[sp.Basic, sp.Expr]) -> None:
        self._places = places
        #: An operation and the ``id`` of its operands → these, which keeps them, and its value.
        self._known: dict[tuple[Any, ...], tuple[Sequence[sp.Basic], sp.Expr]] = {}

    def place(self, symbol: sp.Symbol) -> sp.Expr | None:
        """Give the expression in place of a symbol; None if it stays."""
        return self._places.get(symbol)

    def put_into(self, expr: sp.Expr) -> sp.Expr:
        """Replace the symbols in an expression; parts without any stay as they are."""
        if not expr.args:
            return self._places.get(expr, expr)
        parts = [self.put_into(a) for a in expr.args]
        if all(new is old for new, old in zip(parts, expr.args, strict=True)):
            return expr
        return self.evaluated(expr.func, parts)

    def evaluated(self, kind: Callable[..., sp.Expr], parts: Sequence[sp.Expr]) -> sp.Expr:
        """Evaluate an operation, once for operands that are the same objects."""
        key = kind, *map(id, parts)
        if key not in self._known:
            self._known[key] = parts, _made(kind, parts)
        return self._known[key][1]


def _made(kind: Callable[..., sp.Expr], parts: Sequence[sp.Expr]) -> sp.Expr:
    if kind is sp.Add:
        return plain_sum(parts)
    if kind is sp.Mul and len(parts) == 2 and parts[0] is sp.S.NegativeOne:
        return negative(parts[1]) if parts[1].is_Add else sp.Mul(*parts)
    return kind(*parts)
