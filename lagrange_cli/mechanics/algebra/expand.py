"""Expansion of products and powers, within a budget of terms counted beforehand."""

from __future__ import annotations

import sympy as sp


def expand_terms(expr: sp.Expr, budget: int) -> list[sp.Expr] | None:
    """Multiply out products and integer powers of sums; return the terms.

    None if more than ``budget`` terms would result; they are counted beforehand.
    Arguments of functions and denominators are left alone.
    """
    if term_count(expr) > budget:
        return None
    return _expand(expr)


def term_count(expr: sp.Expr) -> int:
    """Count the terms that products and powers of sums would expand to."""
    if expr.is_Add:
        return sum(term_count(a) for a in expr.args)
    if expr.is_Mul:
        product = 1
        for a in expr.args:
            product *= term_count(a)
        return product
    if expr.is_Pow and expr.exp.is_Integer and expr.exp.is_positive:
        return int(term_count(expr.base) ** min(int(expr.exp), 64))
    return 1


def _expand(expr: sp.Expr) -> list[sp.Expr]:
    if expr.is_Add:
        return [t for a in expr.args for t in _expand(a)]
    if expr.is_Mul:
        factors = [_expand(a) for a in expr.args]
        is_one_term = all(terms == [a] for terms, a in zip(factors, expr.args, strict=True))
        return [expr] if is_one_term else _product(factors)
    if expr.is_Pow and expr.exp.is_Integer and expr.exp.is_positive and term_count(expr.base) > 1:
        return _product([_expand(expr.base)] * int(expr.exp))
    return [expr]


def _product(factors: list[list[sp.Expr]]) -> list[sp.Expr]:
    terms = factors[0]
    for factor in factors[1:]:
        terms = [sp.Mul(a, b) for a in terms for b in factor]
    return terms
