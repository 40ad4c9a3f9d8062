"""Squares of two-term sums, as a person writes them."""

from __future__ import annotations

import sympy as sp


def binomial_square(expr: sp.Expr) -> sp.Expr:
    """Write ``R² + 2 R a cos θ + a² cos² θ`` as ``(R + a cos θ)²``; leave others."""
    if len(expr.args) != 3:
        return expr
    for k, mixed in enumerate(expr.args):
        first, second = (_root(term) for j, term in enumerate(expr.args) if j != k)
        if first is None or second is None:
            continue
        product = 2 * first * second
        if mixed in (product, -product):
            return (first + second if mixed == product else first - second) ** 2
    return expr


def _root(term: sp.Expr) -> sp.Expr | None:
    """Take the square root of a product of even powers; None of others."""
    powers = [f.as_base_exp() for f in sp.Mul.make_args(term)]
    if any(b.is_number or not (e.is_Integer and e % 2 == 0) for b, e in powers):
        return None
    return sp.Mul(*(b ** (e / 2) for b, e in powers))


def normalize_square_signs(product: sp.Expr) -> sp.Expr:
    """Write ``(a − R)²`` as ``(R − a)²``, so that an even power has one form."""
    turned = [f for f in sp.Mul.make_args(product) if _is_turned(f)]
    return product.xreplace({f: (-f.base) ** f.exp for f in turned}) if turned else product


def _is_turned(factor: sp.Expr) -> bool:
    if not (factor.is_Pow and factor.base.is_Add and factor.exp.is_Integer):
        return False
    return bool(factor.exp % 2 == 0 and factor.base.could_extract_minus_sign())
