"""Free symbols of expressions, found once for each part, and functions that stand in them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import sympy as sp

#: Expressions whose symbols are kept.
_KEPT = 2**18


@lru_cache(maxsize=_KEPT)
def symbols_in(expr: sp.Basic) -> frozenset[sp.Symbol]:
    """Return the free symbols of an expression, as ``free_symbols`` does each time anew."""
    if expr.is_Symbol:
        return frozenset((expr,))
    return frozenset[sp.Symbol]().union(*map(symbols_in, expr.args))


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
