"""The order in which definitions are put into each other."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

__all__ = ["dependency_order"]


def dependency_order(given: Mapping[sp.Symbol, sp.Expr]) -> list[sp.Symbol]:
    """Symbols such that each comes after those its expression holds (chains may be long)."""
    done: dict[sp.Symbol, None] = {}
    for first in given:
        stack = [first]
        while stack:
            symbol = stack[-1]
            held = given[symbol].free_symbols & given.keys()
            ahead = [s for s in sorted(held, key=str) if s not in done]
            if symbol in done or not ahead:
                done[stack.pop()] = None
            else:
                stack.extend(ahead)
    return list(done)
