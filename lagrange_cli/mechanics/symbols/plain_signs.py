"""Expressions that are real, or not negative, at a glance.

SymPy infers the same by asking for many more properties of every part, which takes a hundred times
as long for the root of a sum of squares.
"""

from __future__ import annotations

import sympy as sp


def is_plainly_real(expr: sp.Expr, *, nonnegative: bool = False) -> bool:
    """Tell whether sums, products and powers of real numbers plainly make a real number.

    ``nonnegative``: one that is not negative either, a sum or product of even powers and of what
    is not negative.
    """
    if not expr.args:
        return bool(expr.is_nonnegative if nonnegative else expr.is_real)
    if expr.is_Add or expr.is_Mul:
        return all(is_plainly_real(part, nonnegative=nonnegative) for part in expr.args)
    if not expr.is_Pow or not expr.exp.is_Rational or expr.exp < 0:
        return False
    whole = expr.exp.is_Integer and (not nonnegative or expr.exp % 2 == 0)
    return is_plainly_real(expr.base, nonnegative=not whole)
