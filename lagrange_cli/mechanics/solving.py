"""Closed-form solutions of one equation for one unknown, all branches of them.

Only what can be written down with certainty is solved: linear and quadratic
equations, and equations in which the unknown stands once, under functions
with a known inverse. Nothing is searched for.
"""

from __future__ import annotations

import sympy as sp

from lagrange_cli.mechanics.terms import expand_terms

__all__ = ["linear_parts", "solutions"]

#: Terms that an equation may expand to while its powers of the unknown are read off.
_TERM_BUDGET = 500


def linear_parts(phi: sp.Expr, unknown: sp.Symbol) -> tuple[sp.Expr, sp.Expr] | None:
    """``(a, b)`` with φ = a·u + b, neither holding u; None if φ is not of that form."""
    powers = _powers_of(phi, unknown)
    if powers is None or not set(powers) <= {0, 1} or 1 not in powers:
        return None
    return powers[1], powers.get(0, sp.Integer(0))


def solutions(phi: sp.Expr, unknown: sp.Symbol) -> list[sp.Expr] | None:
    """Every branch u(other symbols) of φ = 0, periodic ones once.

    None where there is no closed form.
    """
    powers = _powers_of(phi, unknown)
    if powers is not None and set(powers) <= {0, 1, 2}:
        a, b, c = (powers.get(k, sp.Integer(0)) for k in (2, 1, 0))
        if a == 0:
            return [-c / b]
        if b == 0:
            root = sp.sqrt(-c / a)
            return [-root, root]
        root = sp.sqrt(b**2 - 4 * a * c)
        return [(-b - root) / (2 * a), (-b + root) / (2 * a)]
    return _inverted(phi, sp.Integer(0), unknown)


def _powers_of(phi: sp.Expr, unknown: sp.Symbol) -> dict[int, sp.Expr] | None:
    """Coefficients of φ as a polynomial in the unknown."""
    terms = expand_terms(phi, _TERM_BUDGET)
    if terms is None:
        return None
    powers: dict[int, list[sp.Expr]] = {}
    for term in terms:
        rest, dependent = term.as_independent(unknown, as_Add=False)
        base, exponent = dependent.as_base_exp()
        if dependent == 1:
            degree = 0
        elif base == unknown and exponent.is_Integer and exponent > 0:
            degree = int(exponent)
        else:
            return None
        powers.setdefault(degree, []).append(rest)
    found = {degree: sp.Add(*rests) for degree, rests in powers.items()}
    return {degree: e for degree, e in found.items() if e != 0} or {0: sp.Integer(0)}


def _inverted(left: sp.Expr, right: sp.Expr, unknown: sp.Symbol) -> list[sp.Expr] | None:
    """Solve ``left = right`` by undoing the operations around a single occurrence."""
    if left == unknown:
        return [right]
    if left.is_Add or left.is_Mul:
        rest, dependent = left.as_independent(unknown)
        if (dependent.is_Add or dependent.is_Mul) and dependent.func is left.func:
            return None
        right = right - rest if left.is_Add else right / rest
        return _inverted(dependent, right, unknown)
    branches = _undo(left, right, unknown)
    if branches is None:
        return None
    found = [_inverted(inner, value, unknown) for inner, value in branches]
    if any(f is None for f in found):
        return None
    return [s for f in found if f is not None for s in f]


def _undo(
    left: sp.Expr, right: sp.Expr, unknown: sp.Symbol
) -> list[tuple[sp.Expr, sp.Expr]] | None:
    """Equations ``inner = value`` that together are equivalent to ``f(inner) = right``."""
    if left.is_Pow:
        return _undo_power(left.base, left.exp, right, unknown)
    inner = left.args[0] if len(left.args) == 1 else None
    if inner is None:
        return None
    match left.func:
        case sp.sin:
            return [(inner, sp.asin(right)), (inner, sp.pi - sp.asin(right))]
        case sp.cos:
            return [(inner, sp.acos(right)), (inner, -sp.acos(right))]
        case sp.cosh:
            return [(inner, sp.acosh(right)), (inner, -sp.acosh(right))]
    single = {
        sp.tan: sp.atan,
        sp.sinh: sp.asinh,
        sp.tanh: sp.atanh,
        sp.exp: sp.log,
        sp.log: sp.exp,
        sp.asin: sp.sin,
        sp.acos: sp.cos,
        sp.atan: sp.tan,
        sp.asinh: sp.sinh,
        sp.acosh: sp.cosh,
        sp.atanh: sp.tanh,
    }
    inverse = single.get(left.func)
    return None if inverse is None else [(inner, inverse(right))]


def _undo_power(
    base: sp.Expr, exponent: sp.Expr, right: sp.Expr, unknown: sp.Symbol
) -> list[tuple[sp.Expr, sp.Expr]] | None:
    if unknown in exponent.free_symbols or not exponent.is_Rational:
        return None
    if exponent.q == 1 and exponent.p % 2 == 0:
        root = right ** (1 / exponent)
        return [(base, -root), (base, root)]
    if exponent.q == 2 or exponent == -1:
        return [(base, right ** (1 / exponent))]
    return None
