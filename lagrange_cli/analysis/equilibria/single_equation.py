"""Real roots of one equation in one unknown, in closed form, with conditions for their existence.

Solved are u^n = c and equations of first and second degree, also in u², in cos u, in sin u or in
tan u/2, and what :mod:`~lagrange_cli.mechanics.elimination.solve_equation` inverts. All roots are
found, those of angles within one turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from lagrange_cli.analysis.values import Existence
from lagrange_cli.mechanics.algebra.polynomials import cancelled, factored_form
from lagrange_cli.mechanics.elimination.solve_equation import solutions

_COS, _SIN = sp.Dummy("c", real=True), sp.Dummy("s", real=True)
_HALF_TURN = sp.pi


@dataclass(frozen=True)
class Root:
    """A root, and the conditions under which it is real."""

    value: sp.Expr
    conditions: tuple[Existence, ...] = ()


def factors_of(equation: sp.Expr, unknowns: frozenset[sp.Symbol]) -> list[sp.Expr]:
    """List the factors of the numerator that contain unknowns; others are assumed nonzero."""
    numerator = sp.fraction(cancelled(equation))[0]
    factors = [f.as_base_exp() for f in sp.Mul.make_args(factored_form(numerator))]
    bases = [base for base, exponent in factors if exponent.is_positive is not False]
    return list(dict.fromkeys(b for b in bases if b.free_symbols & unknowns))


def real_roots(equation: sp.Expr, unknown: sp.Symbol, *, is_angle: bool) -> list[Root] | None:
    """Solve ``equation = 0``: all real roots, of an angle within a turn; None if it cannot be.

    Parameters
    ----------
    equation
        Over one unknown, which it holds, and parameters.
    is_angle
        True if the unknown's values a turn apart mean the same.
    """
    roots: list[Root] = []
    for factor in factors_of(equation, frozenset((unknown,))):
        more = _roots_of_factor(factor, unknown, is_angle)
        if more is None:
            return None
        roots += more
    return roots


def _roots_of_factor(factor: sp.Expr, unknown: sp.Symbol, is_angle: bool) -> list[Root] | None:
    if is_angle:
        return _angles(factor, unknown)
    if factor.is_polynomial(unknown):
        return _polynomial(factor, unknown)
    if factor.has(sp.sin, sp.cos, sp.tan):
        return None  # as many roots as there are turns
    values = solutions(factor, unknown)
    return None if values is None else [Root(value) for value in values]


def _angles(factor: sp.Expr, unknown: sp.Symbol) -> list[Root] | None:
    """Solve an equation in cos u and sin u."""
    flat = sp.expand_trig(factor.replace(sp.tan, lambda x: sp.sin(x) / sp.cos(x)))
    flat = flat.xreplace({sp.cos(unknown): _COS, sp.sin(unknown): _SIN})
    if unknown in flat.free_symbols:
        return None
    roots: list[Root] = []
    for part in factors_of(flat, frozenset((_COS, _SIN))):
        more = _on_circle(part, unknown)
        if more is None:
            return None
        roots += more
    return roots


def _on_circle(part: sp.Expr, unknown: sp.Symbol) -> list[Root] | None:
    """Solve a polynomial equation between cos u and sin u."""
    if not part.is_polynomial(_COS, _SIN):
        return None
    linear = sp.Poly(part, _COS, _SIN)
    if linear.total_degree() == 1 and part.has(_COS) and part.has(_SIN):
        return _of_first_degree(linear)
    for function, eliminated in ((_COS, _SIN), (_SIN, _COS)):
        powers = sp.Poly(part, eliminated)
        if all(degree % 2 == 0 for (degree,) in powers.monoms()):
            single = sum(c * (1 - function**2) ** (d // 2) for (d,), c in powers.terms())
            return _by_inverse(sp.expand(single), function)
    return None


def _by_inverse(equation: sp.Expr, function: sp.Symbol) -> list[Root] | None:
    """Return the angles at which cos u or sin u is a root of a polynomial."""
    roots: list[Root] = []
    for factor in factors_of(equation, frozenset((function,))):
        levels = _polynomial(factor, function)
        if levels is None:
            return None
        for level in levels:
            within = (*level.conditions, *_at_most_one(level.value))
            if function is _COS:
                angle = sp.acos(level.value)
                angles = [angle] if level.value in (1, -1) else [angle, -angle]
            else:
                angle = sp.asin(level.value)
                angles = [angle] if level.value in (1, -1) else [angle, _HALF_TURN - angle]
            roots += [Root(angle, within) for angle in angles]
    return roots


def _of_first_degree(linear: sp.Poly) -> list[Root]:
    """Solve a sin u + b cos u + d = 0 by t = tan u/2."""
    b, a, d = (linear.coeff_monomial(m) for m in (_COS, _SIN, 1))
    if d == 0:
        angle = sp.atan(-b / a)
        return [Root(angle), Root(angle + _HALF_TURN)]
    if sp.expand(d - b) == 0:
        return [Root(_HALF_TURN), Root(-2 * sp.atan(b / a))]
    square = sp.expand(a**2 + b**2 - d**2)
    exists = _not_negative(square, Existence(d**2, a**2 + b**2))
    root = sp.sqrt(square)
    return [Root(2 * sp.atan((-a + sign * root) / (d - b)), exists) for sign in (1, -1)]


def _polynomial(factor: sp.Expr, unknown: sp.Symbol) -> list[Root] | None:
    """Solve an equation of first or second degree, of second degree in u², or u^n = c."""
    powers = {d: c for (d,), c in sp.Poly(factor, unknown).terms()}
    if set(powers) <= {0, 1}:
        return [Root(cancelled(-powers.get(0, sp.S.Zero) / powers[1]))]
    if set(powers) <= {0, 1, 2}:
        return _quadratic(*(powers.get(d, sp.S.Zero) for d in (2, 1, 0)))
    if set(powers) <= {0, 2, 4}:
        squares = _quadratic(*(powers.get(d, sp.S.Zero) for d in (4, 2, 0)))
        return [
            Root(sign * sp.sqrt(s.value), (*s.conditions, *_not_negative(s.value)))
            for s in squares
            for sign in (1, -1)
        ]
    if len(powers) == 2 and 0 in powers:
        return _roots_of(cancelled(-powers[0] / powers[max(powers)]), max(powers))
    return None


def _roots_of(value: sp.Expr, degree: int) -> list[Root]:
    """Solve u^n = value: for odd n one root of the value's sign, else two or none."""
    exponent = sp.Rational(1, degree)
    exists = _not_negative(value)
    if degree % 2 == 0:
        return [Root(sign * value**exponent, exists) for sign in (1, -1)]
    roots = [] if value.is_nonpositive else [Root(value**exponent, exists)]
    opposite = cancelled(-value)
    if not value.is_nonnegative:
        roots.append(Root(-(opposite**exponent), _not_negative(opposite)))
    return roots


def _quadratic(a: sp.Expr, b: sp.Expr, c: sp.Expr) -> list[Root]:
    if b == 0:
        exists = _not_negative(cancelled(-c / a))
    else:
        exists = _not_negative(sp.expand(b**2 - 4 * a * c), Existence(4 * a * c, b**2))
    place = sp.Dummy("u", real=True)
    roots = solutions(a * place**2 + b * place + c, place) or []
    return [Root(root, exists) for root in reversed(roots)]


def _not_negative(value: sp.Expr, said: Existence | None = None) -> tuple[Existence, ...]:
    """Return the condition value ≥ 0, unless it always holds."""
    if value.is_nonnegative:
        return ()
    return (said or Existence(sp.S.Zero, value),)


def _at_most_one(level: sp.Expr) -> tuple[Existence, ...]:
    """Return the condition |level| ≤ 1, without denominators, unless it always holds."""
    if level.is_number:
        return () if abs(level) <= 1 else (Existence(abs(level), sp.S.One),)
    above, below = sp.fraction(level)
    return (Existence(_size(above), _size(below)),)


def _size(value: sp.Expr) -> sp.Expr:
    """Write |value|, without bars where the sign is known."""
    return sp.Mul(*(sp.Abs(f) for f in sp.Mul.make_args(value)))
