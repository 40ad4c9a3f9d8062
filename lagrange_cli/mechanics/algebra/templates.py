"""Expressions written again with other symbols that SymPy sorts in the same way.

Elements of an indexed family differ in the names of their symbols. If the new names stand in the
order of the old ones, all arguments of sums and products keep their places: nothing is sorted, and
nothing that SymPy evaluates comes out otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import sympy as sp

from lagrange_cli.mechanics.free_symbols import symbols_in


class _Step(NamedTuple):
    """An operation of a template.

    Attributes
    ----------
    build
        Makes its value of those of its operands.
    operands
        Their numbers among the values: symbols and constants, then earlier steps.
    symbol
        Number of the one symbol that it holds; None if it holds several.
    known
        Values by that symbol: elements of a family share these.
    """

    build: Callable[..., sp.Expr]
    operands: Sequence[int]
    symbol: int | None
    known: dict[sp.Symbol, sp.Expr]


class Template:
    """An expression whose symbols are exchanged for others of one order and one kind.

    Parameters
    ----------
    expr
        The expression.
    symbols
        All symbols of it, and perhaps others, in the order of their names.
    """

    def __init__(self, expr: sp.Expr, symbols: Sequence[sp.Symbol]) -> None:
        parts = _parts(expr, symbols)
        self._constants = [part for part in parts if not symbols_in(part)]
        moving = [part for part in parts if symbols_in(part)]
        places = {part: k for k, part in enumerate([*symbols, *self._constants, *moving])}
        self._steps = [_step(part, places) for part in moving]
        self._whole = places[expr]

    def over(self, symbols: Sequence[sp.Symbol]) -> sp.Expr:
        """Write the expression with other symbols, one in place of each of the template's."""
        values = [*symbols, *self._constants]
        for build, operands, symbol, known in self._steps:
            if symbol is None:
                values.append(build(*[values[k] for k in operands]))
                continue
            name = symbols[symbol]
            if name not in known:
                known[name] = build(*[values[k] for k in operands])
            values.append(known[name])
        whole: sp.Expr = values[self._whole]
        return whole


def _parts(expr: sp.Expr, symbols: Sequence[sp.Symbol]) -> list[sp.Basic]:
    """List the parts of an expression but symbols, each once and operands first."""
    listed: dict[sp.Basic, bool] = dict.fromkeys(symbols, False)
    stack: list[tuple[sp.Basic, bool]] = [(expr, False)]
    while stack:
        top, ready = stack.pop()
        if top in listed:
            continue
        if ready or not symbols_in(top):
            listed[top] = True
        else:
            stack.append((top, True))
            stack.extend((a, False) for a in reversed(top.args))
    return [part for part, wanted in listed.items() if wanted]


def _step(expr: sp.Basic, places: Mapping[sp.Basic, int]) -> _Step:
    present = symbols_in(expr)
    symbol = places[next(iter(present))] if len(present) == 1 else None
    return _Step(_builder(expr), [places[a] for a in expr.args], symbol, {})


def _builder(expr: sp.Basic) -> Callable[..., sp.Expr]:
    """Give the function that makes an expression of this kind of its parts, as they stand."""
    kind = expr.func
    if expr.is_Add or expr.is_Mul:
        commutes = expr.is_commutative
        return lambda *parts: kind._from_args(parts, commutes)
    if expr.is_Pow:
        return lambda *parts: sp.Pow(*parts, evaluate=False)
    return kind
