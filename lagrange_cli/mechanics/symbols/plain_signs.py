"""Expressions that are real, or not negative, at a glance.

SymPy infers the same by asking for many more properties of every part, which takes a hundred times
as long for the root of a sum of squares.
"""

from __future__ import annotations

import sympy as sp


def is_plainly_real(expr: sp.Expr) -> bool:
    """Tell whether sums, products and powers of real numbers plainly make a real number."""
    if not expr.args:
        return bool(expr.is_real)
    if expr.is_Add or expr.is_Mul:
        return all(map(is_plainly_real, expr.args))
    if not expr.is_Pow or not expr.exp.is_Rational or expr.exp < 0:
        return False
    return is_plainly_real(expr.base) if expr.exp.is_Integer else is_plainly_nonnegative(expr.base)


def is_plainly_nonnegative(expr: sp.Expr) -> bool:
    """Tell whether a sum or product is one of even powers and of what is not negative."""
    if not expr.args:
        return bool(expr.is_nonnegative)
    if expr.is_Add or expr.is_Mul:
        return all(map(is_plainly_nonnegative, expr.args))
    if not expr.is_Pow or not expr.exp.is_Rational or expr.exp < 0:
        return False
    if expr.exp.is_Integer and expr.exp % 2 == 0:
        return is_plainly_real(expr.base)
    return is_plainly_nonnegative(expr.base)
