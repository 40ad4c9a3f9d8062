"""Sums as SymPy builds them, their terms put in order by keys.

SymPy compares terms pair by pair, and makes new ones of their coefficients and the rest: of sums of
hundreds of terms that takes longer than all else that is done with them. A term here stays the
object that it is, unless there is another one like it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeAlias

import sympy as sp

from lagrange_cli.mechanics.algebra.argument_order import sympy_order

_ZERO, _ONE, _MINUS_ONE = sp.S.Zero, sp.S.One, sp.S.NegativeOne

#: A term without its coefficient: its factors, or the only one.
_Rest: TypeAlias = sp.Basic | tuple[sp.Basic, ...]


def plain_sum(terms: Iterable[sp.Expr]) -> sp.Expr:
    """Add expressions of the scene language."""
    given = list(terms)
    number, kept = _ZERO, dict[_Rest, list[sp.Expr]]()
    for term in _flat(given):
        if term.is_Rational:
            number += term
            continue
        parts = _coefficient_and_rest(term)
        if parts is None:
            return sp.Add(*given)
        count, rest = parts
        new = [count, term]
        like = kept.setdefault(rest, new)
        if like is not new:
            like[0] += count
            like[1] = _scaled(like[0], rest)
    ordered = sorted([t for _, t in kept.values() if t is not _ZERO], key=sympy_order)
    if number is not _ZERO:
        ordered.insert(0, number)
    return sp.Add._from_args(ordered, True)


def _flat(terms: Sequence[sp.Expr]) -> Iterable[sp.Expr]:
    for term in terms:
        if term.is_Add:
            yield from _flat(term.args)
        else:
            yield term


def _coefficient_and_rest(term: sp.Expr) -> tuple[sp.Rational, _Rest] | None:
    """Take a term apart; None if SymPy may have more to do with it."""
    if term.is_Mul:
        factors = term.args
        if not factors[0].is_Number:
            return _ONE, factors
        if len(factors) > 2:
            is_plain = factors[0].is_Rational and not factors[1].is_Number
            return (factors[0], factors[1:]) if is_plain else None
        count, rest = factors
        if not count.is_Rational or rest.is_Mul or rest.is_Number:
            return None
        return (count, rest) if _is_plain(rest) or rest.is_Add else None
    return (_ONE, term) if _is_plain(term) else None


def _is_plain(factor: sp.Expr) -> bool:
    """Tell whether it is a symbol, a power of what holds symbols, or a function but exp."""
    if factor.is_Pow:
        return not factor.base.is_number
    return bool(factor.is_Symbol or (factor.is_Function and factor.func is not sp.exp))


def _scaled(count: sp.Rational, rest: _Rest) -> sp.Expr:
    """Put a term together again."""
    if count is _ZERO:
        return _ZERO
    factors = rest if isinstance(rest, tuple) else (rest,)
    return sp.Mul._from_args(factors if count is _ONE else (count, *factors), True)


def negative(expr: sp.Expr) -> sp.Expr:
    """Change the sign of an expression, term by term of a sum."""
    return plain_sum(map(_opposite, expr.args)) if expr.is_Add else -expr


def _opposite(term: sp.Expr) -> sp.Expr:
    if term.is_Symbol:
        return sp.Mul._from_args((_MINUS_ONE, term), True)
    factors = term.args
    if not term.is_Mul or factors[1].is_Number:
        return _MINUS_ONE * term
    number, further = (factors[0], factors[1:]) if factors[0].is_Number else (_ONE, factors)
    return sp.Mul._from_args(further if number is _MINUS_ONE else (-number, *further), True)
