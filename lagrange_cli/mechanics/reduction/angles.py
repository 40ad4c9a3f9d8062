"""Coordinates that enter positions only through 2π-periodic functions."""

from __future__ import annotations

from collections.abc import Iterable

import sympy as sp


def periodic_symbols(positions: Iterable[sp.Expr]) -> set[sp.Symbol]:
    """Symbols that enter the positions, and only through 2π-periodic functions.

    That is shown where every occurrence stands under sin, cos or tan in an
    argument ``k·q + rest`` with an integer k.
    """
    present: set[sp.Symbol] = set()
    aperiodic: set[sp.Symbol] = set()
    seen: set[sp.Expr] = set()
    stack = list(positions)
    while stack:
        top = stack.pop()
        if top in seen:
            continue
        seen.add(top)
        if top.is_Symbol:
            present.add(top)
            aperiodic.add(top)
        elif top.func in (sp.sin, sp.cos, sp.tan):
            inside = top.args[0].free_symbols
            present |= inside
            aperiodic |= {s for s in inside if not _integer_slope(top.args[0], s)}
        else:
            stack.extend(top.args)
    return present - aperiodic


def _integer_slope(argument: sp.Expr, q: sp.Symbol) -> bool:
    return bool(argument == q or argument.diff(q).is_Integer)
