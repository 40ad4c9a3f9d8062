"""Sums of one velocity and what drives it, ``φ̇ + ω``, over which energies and forces are short.

They are those that the scene wrote, and the rates of sums that it wrote: ``φ + ω t``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.free_symbols import symbols_in

#: Terms of the longest sum that is written over others, and sums that are tried, each a pass over
#: the terms. Scenes that a person writes have fewer; neither is tuned.
_MOST_TERMS = 20
_MOST_SUMS = 10


class RateSum(NamedTuple):
    """A velocity, and its sum with what drives it."""

    velocity: sp.Symbol
    whole: sp.Expr


def rate_sums(
    sums: Iterable[sp.Expr], rates: Mapping[sp.Symbol, sp.Symbol], t: sp.Symbol
) -> tuple[RateSum, ...]:
    """Find the sums of one velocity and what holds no coordinate, among sums and their rates.

    ``rates``: coordinate → velocity.
    """
    moving = frozenset(rates) | frozenset(rates.values())
    gathered: dict[RateSum, None] = {}
    for whole in sums:
        present = symbols_in(whole) & moving
        (symbol,) = present if len(present) == 1 else (None,)
        if symbol is None or symbol not in whole.args:
            continue
        driving = whole - symbol
        if symbol not in rates:
            gathered[RateSum(symbol, whole)] = None
        elif driving.has(t):
            gathered[RateSum(rates[symbol], rates[symbol] + sp.diff(driving, t))] = None
    return tuple(gathered)[:_MOST_SUMS]


def over_rate_sums(
    terms: Sequence[sp.Expr], sums: Iterable[RateSum]
) -> tuple[list[sp.Expr], dict[sp.Symbol, RateSum]]:
    """Write terms over each sum in place of its velocity, where that is shorter in print.

    Returns
    -------
    tuple
        The terms, and the sums that their new symbols stand for.
    """
    shown, stand_ins = list(terms), dict[sp.Symbol, RateSum]()
    for rate in sums if len(shown) <= _MOST_TERMS else ():
        if not any(rate.velocity in symbols_in(term) for term in shown):
            continue
        symbol = sp.Dummy(rate.velocity.name, real=True)
        shift = {rate.velocity: symbol + rate.velocity - rate.whole}
        expanded = expand_terms(sp.Add(*shown).xreplace(shift), _MOST_TERMS)
        collected = None if expanded is None else collected_terms(expanded)
        if collected is not None and _length(collected, {symbol: rate.whole}) < _length(shown, {}):
            shown, stand_ins[symbol] = collected, rate
    return shown, stand_ins


def _length(terms: Sequence[sp.Expr], meanings: Mapping[sp.Symbol, sp.Expr]) -> int:
    return sum(printed_length(t.xreplace(meanings)) for t in terms) + len(terms)
