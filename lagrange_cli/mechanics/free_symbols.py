"""Free symbols of expressions, found once for each part that expressions share."""

from __future__ import annotations

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
