"""Closed-form solutions of one equation for one unknown, all branches of them.

The equations are linear or quadratic, or hold the unknown once, under functions with a known
inverse; there is no search. An
inverse may bring in a branch that does not solve the equation (√z = −1): the
caller checks it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.polynomials import expand_terms, factored_form, term_count

#: Value of an expression at the reference configuration; None if it is unknown.
_Value = Callable[[sp.Expr], "mpf | None"]

_ZERO = sp.Integer(0)

#: Inverses of functions that have one.
_INVERSES: dict[Any, Callable[[sp.Expr], sp.Expr]] = {
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

#: Terms that an equation may expand to while its powers of the unknown are read off. A longer
#: equation counts as one without closed form. Not tuned.
_TERM_BUDGET = 500


def linear_parts(phi: sp.Expr, unknown: sp.Symbol) -> tuple[sp.Expr, sp.Expr] | None:
    """Split φ = a·u + b into ``(a, b)``, neither holding u; None if φ is not of that form."""
    powers = _powers_of(phi, unknown)
    if powers is None or not set(powers) <= {0, 1} or 1 not in powers:
        return None
    return powers[1], powers.get(0, sp.Integer(0))


def linear_solution(pivot: sp.Expr, remainder: sp.Expr) -> sp.Expr:
    """Solve pivot·u + remainder = 0, without quotients of quotients.

    u/cos α = a/cos α + b gives a + b cos α.
    """
    if sp.fraction(pivot)[1] == 1:
        return -remainder / pivot
    return sp.Add(*(-term / pivot for term in sp.Add.make_args(remainder)))


def solves_everywhere(pivot: sp.Expr, remainder: sp.Expr, constants: frozenset[sp.Symbol]) -> bool:
    """Say whether u = −remainder/pivot solves pivot·u + remainder = 0 in all states.

    The pivot of x·sin(ω t) = y·cos(ω t) vanishes at some times.
    """
    if remainder != 0 and remainder.free_symbols <= constants:
        return True  # where the pivot vanishes the equation does not hold
    factors = [f for f in sp.Mul.make_args(pivot) if not f.free_symbols <= constants]
    return all(f.is_nonzero for f in factors)


def solutions(
    phi: sp.Expr, unknown: sp.Symbol, at: _Value = lambda _: None, *, several: bool = True
) -> list[sp.Expr] | None:
    """Solve φ = 0: every branch u(other symbols); None if there is no closed form.

    Of branches that recur with a period, the one nearest to the reference
    configuration is returned.

    Parameters
    ----------
    at
        Value of an expression at the reference configuration, None if that is
        not known.
    several
        If False, an equation of more than one branch gives None.
    """
    powers = _powers_of(phi, unknown)
    if powers is not None and set(powers) <= {0, 1, 2}:
        a, b, c = (powers.get(k, sp.Integer(0)) for k in (2, 1, 0))
        if a == 0:
            return [linear_solution(b, c)]
        if not several:
            return None
        if b == 0:
            root = _root(-c / a)
            return [-root, root]
        half = b / 2
        root = _root(half**2 - a * c)
        return [(-half - root) / a, (-half + root) / a]
    branches = _inverted(phi, sp.Integer(0), unknown, at)
    return branches if several or (branches is not None and len(branches) == 1) else None


def _root(expr: sp.Expr) -> sp.Expr:
    """Take a square root of either sign that stays smooth as a squared factor passes zero.

    With x = l sin θ on a circle, z = l cos θ follows the particle around it, whereas
    the positive root l |cos θ| would reflect it at the diameter.
    """
    expanded = sp.Add(*(expand_terms(expr, _TERM_BUDGET) or [expr]))
    candidates = []
    for form in (expanded, _without_squares(expanded, sp.sin), _without_squares(expanded, sp.cos)):
        if (
            len(sp.Add.make_args(form)) <= _FACTOR_TERMS
            and len(form.free_symbols) <= _FACTOR_SYMBOLS
        ):
            candidates.append(_squares(factored_form(form)))
    smooth = [pair for pair in candidates if not pair[1].has(sp.sin, sp.cos)]
    outside, inside = next(iter(smooth or candidates), (sp.Integer(1), expanded))
    return sp.sqrt(expanded) if outside == 1 else outside * sp.sqrt(sp.expand(inside))


def _without_squares(expr: sp.Expr, function: Any) -> sp.Expr:
    """Write even powers of sines in cosines, or the reverse."""
    partner = sp.cos if function is sp.sin else sp.sin
    powers = [p for p in expr.atoms(sp.Pow) if p.base.func is function and p.exp.is_Integer]
    rules = {p: (1 - partner(p.base.args[0]) ** 2) ** (p.exp / 2) for p in powers if p.exp.is_even}
    return sp.expand(expr.xreplace(rules))


def _squares(product: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Split product = a²·b into ``(a, b)``, as much in ``a`` as stands in even powers."""
    outside, inside = sp.Integer(1), sp.Integer(1)
    for factor in sp.Mul.make_args(product):
        base, exponent = factor.as_base_exp()
        halves = int(exponent / 2) if exponent.is_Integer else 0
        outside *= base**halves
        inside *= base ** (exponent - 2 * halves)
    return outside, inside


@lru_cache(maxsize=4096)
def _powers_of(phi: sp.Expr, unknown: sp.Symbol) -> Mapping[int, sp.Expr] | None:
    """Give the coefficients of φ as a polynomial in the unknown; None if it is none."""
    terms = expand_terms(phi, _TERM_BUDGET)
    if terms is None:
        return None
    powers: dict[int, list[sp.Expr]] = {}
    for term in terms:
        cofactor, dependent = term.as_independent(unknown, as_Add=False)
        base, exponent = dependent.as_base_exp()
        if dependent == 1:
            degree = 0
        elif base == unknown and exponent.is_Integer and exponent > 0:
            degree = int(exponent)
        else:
            return None
        powers.setdefault(degree, []).append(cofactor)
    coefficients = {degree: sp.Add(*rests) for degree, rests in powers.items()}
    return {degree: e for degree, e in coefficients.items() if e != 0} or {0: sp.Integer(0)}


def _inverted(
    left: sp.Expr, right: sp.Expr, unknown: sp.Symbol, at: _Value
) -> list[sp.Expr] | None:
    """Solve ``left = right`` by inverting the operations around a single occurrence."""
    if left == unknown:
        return [right]
    if left.is_Add or left.is_Mul:
        constant, dependent = left.as_independent(unknown)
        if (dependent.is_Add or dependent.is_Mul) and dependent.func is left.func:
            return None
        right = right - constant if left.is_Add else right / constant
        return _inverted(dependent, right, unknown, at)
    branches = _undo(left, right, unknown)
    if branches is None:
        return None
    values: list[sp.Expr] = []
    for inner, value, period in branches:
        solved = _inverted(inner, _nearest_period(inner, value, period, at), unknown, at)
        if solved is None:
            return None
        values.extend(solved)
    return values


def _nearest_period(inner: sp.Expr, value: sp.Expr, period: sp.Expr, at: _Value) -> sp.Expr:
    """Move a value by whole periods towards ``inner`` at the reference configuration."""
    if period == 0:
        return value
    here, there = at(inner), at(value)
    if here is None or there is None:
        return value
    return value + period * int(mpmath.nint((here - there) / mpf(period.evalf(mpmath.mp.dps))))


def _undo(
    left: sp.Expr, right: sp.Expr, unknown: sp.Symbol
) -> list[tuple[sp.Expr, sp.Expr, sp.Expr]] | None:
    """Invert f: ``inner = value + k·period`` together solve ``f(inner) = right``."""
    if left.is_Pow:
        return _undo_power(left.base, left.exp, right, unknown)
    if len(left.args) != 1:
        return None
    inner, turn = left.args[0], 2 * sp.pi
    match left.func:
        case sp.sin:
            return [(inner, sp.asin(right), turn), (inner, sp.pi - sp.asin(right), turn)]
        case sp.cos:
            return [(inner, sp.acos(right), turn), (inner, -sp.acos(right), turn)]
        case sp.tan:
            return [(inner, sp.atan(right), sp.pi)]
        case sp.cosh:
            return [(inner, sp.acosh(right), _ZERO), (inner, -sp.acosh(right), _ZERO)]
    inverse = _INVERSES.get(left.func)
    return None if inverse is None else [(inner, inverse(right), _ZERO)]


def _undo_power(
    base: sp.Expr, exponent: sp.Expr, right: sp.Expr, unknown: sp.Symbol
) -> list[tuple[sp.Expr, sp.Expr, sp.Expr]] | None:
    if unknown in exponent.free_symbols or not exponent.is_Rational:
        return None
    if exponent.q == 1 and exponent.p % 2 == 0:
        root = _root(right) if exponent == 2 else right ** (1 / exponent)
        return [(base, -root, _ZERO), (base, root, _ZERO)]
    if exponent.q == 2 or exponent == -1:
        return [(base, right ** (1 / exponent), _ZERO)]
    return None


# Budgets of an equation that is tried for factors, so that trials stay quick; a longer equation
# is not factored. None is tuned.

#: Its terms.
_FACTOR_TERMS = 8
#: Its symbols.
_FACTOR_SYMBOLS = 5
#: Its terms once multiplied out.
_FACTOR_PRODUCTS = 200
#: Its highest power.
_FACTOR_POWER = 32

#: Stand-ins for the symbols, so that equations of one shape are factored once.

_PLACES = sp.symbols(f"s:{_FACTOR_SYMBOLS}", real=True)


@lru_cache(maxsize=256)
def _has_factors(form: sp.Expr) -> bool:
    """Say whether a polynomial in the stand-ins is a product or a power."""
    return not factored_form(form).is_Add


def _is_small(phi: sp.Expr) -> bool:
    """Say whether an equation may be multiplied out, by a count beforehand."""
    powers = (p.exp for p in phi.atoms(sp.Pow) if p.exp.is_Integer)
    return all(e <= _FACTOR_POWER for e in powers) and term_count(phi) <= _FACTOR_PRODUCTS


def factor_branches(phi: sp.Expr, constants: frozenset[sp.Symbol]) -> list[sp.Expr]:
    """List the factors of a short polynomial φ that can vanish; φ itself if it has none."""
    symbols = sorted(phi.free_symbols, key=str)
    short = len(sp.Add.make_args(phi)) <= _FACTOR_TERMS and len(symbols) <= _FACTOR_SYMBOLS
    if not short or not _is_small(phi) or not phi.is_polynomial(*symbols):
        return [phi]
    if not _has_factors(phi.xreplace(dict(zip(symbols, _PLACES, strict=False)))):
        return [phi]
    factors = [f.as_base_exp()[0] for f in sp.Mul.make_args(factored_form(phi))]
    return [f for f in factors if not (f.free_symbols <= constants or f.is_nonzero)] or [phi]
