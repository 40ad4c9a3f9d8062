"""Free symbols of expressions, found once for each part, and functions that stand in them."""

from __future__ import annotations

from collections.abc import Iterable

import sympy as sp

#: Expressions whose symbols are kept.
_KEPT = 2**18

#: ``id`` of an expression → the expression, which keeps its id from being given away, and its
#: symbols. By identity, since to compare with an equal expression of before takes longer.
_SYMBOLS: dict[int, tuple[sp.Basic, frozenset[sp.Symbol]]] = {}


def symbols_in(expr: sp.Basic) -> frozenset[sp.Symbol]:
    """Return the symbols of an expression; nothing here binds any, so that all are free."""
    known = _SYMBOLS.get(id(expr))
    if known is None:
        if len(_SYMBOLS) >= _KEPT:
            _SYMBOLS.clear()
        inside = (expr,) if expr.is_Symbol else ()
        symbols = frozenset[sp.Symbol](inside).union(*map(symbols_in, expr.args))
        known = _SYMBOLS[id(expr)] = expr, symbols
    return known[1]


def holds(expr: sp.Basic, *kinds: type[sp.Basic]) -> bool:
    """Say whether an operation of some kinds stands in an expression."""
    stack = [expr]
    while stack:
        top = stack.pop()
        if isinstance(top, kinds):
            return True
        stack += top.args
    return False


def symbols_of_all(expressions: Iterable[sp.Basic]) -> frozenset[sp.Symbol]:
    """Return the free symbols of all of some expressions, in one walk over their distinct parts."""
    present, seen, parts = set[sp.Symbol](), set[int](), list(expressions)
    while parts:
        part = parts.pop()
        if part.is_Symbol:
            present.add(part)
        for below in part.args:
            if id(below) not in seen:
                seen.add(id(below))
                parts.append(below)
    return frozenset(present)
