"""The length of an expression in print, by which short forms are compared."""

from __future__ import annotations

from functools import lru_cache

import sympy as sp

#: Most expressions whose length is kept, for parts that several forms of a sum share.
_KEPT = 2**13


@lru_cache(maxsize=_KEPT)
def printed_length(expr: sp.Expr) -> int:
    """Count letters, numbers, functions, exponents and signs between terms.

    A factor ±1 and brackets count nothing, so that a collected coefficient is shorter than
    two terms: ``(k + k2) x`` has 4 signs, ``k x + k2 x`` has 5.
    """
    if expr.is_Add:
        return sum(map(printed_length, expr.args)) + len(expr.args) - 1
    if expr.is_Mul:
        return sum(printed_length(a) for a in expr.args if a not in (1, -1))
    if expr.is_Pow and not isinstance(expr, sp.exp):
        exponent = abs(expr.exp) if expr.exp.is_number else expr.exp
        return printed_length(expr.base) + (0 if exponent == 1 else printed_length(exponent))
    return 1 + sum(map(printed_length, expr.args))


def sum_size(expr: sp.Expr) -> tuple[int, int]:
    """Count the terms of all sums in an energy, then those of the outermost.

    Roots, denominators and arguments are not looked into.
    """
    return _terms(expr), len(sp.Add.make_args(expr))


def _terms(expr: sp.Expr) -> int:
    if expr.is_Add:
        return len(expr.args) + sum(map(_terms, expr.args))
    if expr.is_Mul:
        return sum(map(_terms, expr.args))
    if expr.is_Pow and expr.exp.is_Integer and expr.exp.is_positive:
        return _terms(expr.base)
    return 0
