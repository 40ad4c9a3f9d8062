"""Which coordinates are angles."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

__all__ = ["is_angle"]


def is_angle(q: sp.Symbol, positions: Sequence[sp.Expr]) -> bool:
    """Whether ``q`` enters the positions, and only through 2π-periodic functions.

    That is shown where every occurrence stands under sin, cos or tan in an
    argument ``k·q + rest`` with an integer k.
    """
    holding = [r for r in positions if q in r.free_symbols]
    return bool(holding) and all(_periodic(r, q) for r in holding)


def _periodic(expr: sp.Expr, q: sp.Symbol) -> bool:
    stack = [expr]
    while stack:
        top = stack.pop()
        if q not in top.free_symbols:
            continue
        if top == q:
            return False
        if top.func in (sp.sin, sp.cos, sp.tan):
            slope = top.args[0].diff(q)
            if slope.is_Integer:
                continue
        stack.extend(top.args)
    return True
