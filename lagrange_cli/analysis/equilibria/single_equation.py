"""Real roots of one equation in one unknown, in closed form, with conditions for their existence.

Solved are u^n = c and equations of first and second degree, also in u², in cos u, in sin u or in
tan u/2, and what :mod:`~lagrange_cli.mechanics.elimination.solve_equation` inverts. All roots are
found, those of angles within one turn, where no factor vanishes that was divided by.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from lagrange_cli.analysis.values import Existence
from lagrange_cli.mechanics.algebra.identities import by_single_angles
from lagrange_cli.mechanics.algebra.polynomials import cancelled, expand_terms, factored_form
from lagrange_cli.mechanics.elimination.solve_equation import solutions

_COS, _SIN = sp.Dummy("c", real=True), sp.Dummy("s", real=True)
_HALF_TURN = sp.pi

#: Terms that an equation is multiplied out to while the factors of an unknown are read off.
_TERMS = 500


@dataclass(frozen=True)
class Root:
    """A root, and the conditions under which it is real."""

    value: sp.Expr
    conditions: tuple[Existence, ...] = ()


@dataclass(frozen=True)
class RootSet:
    """All roots of an equation.

    Attributes
    ----------
    roots
        The roots.
    divisors
        Expressions in parameters that were divided by: where one vanishes roots may differ.
    """

    roots: tuple[Root, ...] = ()
    divisors: tuple[sp.Expr, ...] = ()

    def __add__(self, more: RootSet) -> RootSet:
        return RootSet(self.roots + more.roots, self.divisors + more.divisors)


def factors_of(equation: sp.Expr, unknowns: frozenset[sp.Symbol]) -> list[sp.Expr]:
    """List the factors of the numerator that contain unknowns."""
    return [f for f in _vanishing(equation) if f.free_symbols & unknowns]


def constant_factors(equation: sp.Expr, unknowns: frozenset[sp.Symbol]) -> list[sp.Expr]:
    """List the factors of the numerator in parameters alone."""
    return [f for f in _vanishing(equation) if f.free_symbols and not f.free_symbols & unknowns]


def _vanishing(equation: sp.Expr) -> list[sp.Expr]:
    numerator = sp.fraction(cancelled(equation))[0]
    factors = [f.as_base_exp() for f in sp.Mul.make_args(factored_form(numerator))]
    bases = [base for base, exponent in factors if exponent.is_positive is not False]
    return list(dict.fromkeys(bases))


def real_roots(equation: sp.Expr, unknown: sp.Symbol, *, is_angle: bool) -> RootSet | None:
    """Solve ``equation = 0``: all real roots, of an angle within a turn; None if it cannot be.

    Parameters
    ----------
    equation
        Over one unknown, which it holds, and parameters.
    is_angle
        True if the unknown's values a turn apart mean the same.
    """
    return _of_factors(
        equation, (unknown,), lambda factor: _roots_of_factor(factor, unknown, is_angle)
    )


def _of_factors(
    equation: sp.Expr,
    unknowns: tuple[sp.Symbol, ...],
    solve: Callable[[sp.Expr], RootSet | None],
) -> RootSet | None:
    """Solve each factor; None if one cannot be."""
    wanted = frozenset(unknowns)
    roots = RootSet((), tuple(constant_factors(equation, wanted)))
    for factor in factors_of(equation, wanted):
        more = solve(factor)
        if more is None:
            return None
        roots += more
    return roots


def _roots_of_factor(factor: sp.Expr, unknown: sp.Symbol, is_angle: bool) -> RootSet | None:
    if is_angle:
        return _angles(factor, unknown)
    if factor.is_polynomial(unknown):
        return _polynomial(factor, unknown)
    if factor.has(sp.sin, sp.cos, sp.tan):
        return None  # as many roots as there are turns
    values, divisors = solutions(factor, unknown), _coefficients(factor, unknown)
    if values is None or divisors is None:
        return None
    return RootSet(tuple(map(Root, values)), divisors)


def _coefficients(factor: sp.Expr, unknown: sp.Symbol) -> tuple[sp.Expr, ...] | None:
    """Collect what multiplies each function of the unknown; None beyond the budget."""
    terms = expand_terms(factor, _TERMS)
    if terms is None:
        return None
    sums: dict[sp.Expr, list[sp.Expr]] = {}
    for term in terms:
        cofactor, dependent = term.as_independent(unknown, as_Add=False)
        sums.setdefault(dependent, []).append(cofactor)
    return tuple(sp.Add(*parts) for dependent, parts in sums.items() if dependent != 1)


def _angles(factor: sp.Expr, unknown: sp.Symbol) -> RootSet | None:
    """Solve an equation in cos u and sin u."""
    flat = by_single_angles(factor).xreplace({sp.cos(unknown): _COS, sp.sin(unknown): _SIN})
    if unknown in flat.free_symbols:
        return None
    return _of_factors(flat, (_COS, _SIN), lambda part: _on_circle(part, unknown))


def _on_circle(part: sp.Expr, unknown: sp.Symbol) -> RootSet | None:
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


def _by_inverse(equation: sp.Expr, function: sp.Symbol) -> RootSet | None:
    """Return the angles at which cos u or sin u is a root of a polynomial."""
    levels = _of_factors(equation, (function,), lambda factor: _polynomial(factor, function))
    if levels is None:
        return None
    roots: list[Root] = []
    for level in levels.roots:
        within = (*level.conditions, *_at_most_one(level.value))
        if function is _COS:
            angle = sp.acos(level.value)
            angles = [angle] if level.value in (1, -1) else [angle, -angle]
        else:
            angle = sp.asin(level.value)
            angles = [angle] if level.value in (1, -1) else [angle, _HALF_TURN - angle]
        roots += [Root(angle, within) for angle in angles]
    return RootSet(tuple(roots), levels.divisors)


def _of_first_degree(linear: sp.Poly) -> RootSet:
    """Solve a sin u + b cos u + d = 0 by t = tan u/2."""
    b, a, d = (linear.coeff_monomial(m) for m in (_COS, _SIN, 1))
    if d == 0:
        angle = sp.atan(factored_form(cancelled(-b / a)))
        return RootSet((Root(angle), Root(angle + _HALF_TURN)), (a,))
    if sp.expand(d - b) == 0:
        return RootSet((Root(_HALF_TURN), Root(-2 * sp.atan(b / a))), (a,))
    square = sp.expand(a**2 + b**2 - d**2)
    exists = _not_negative(square, Existence(d**2, a**2 + b**2))
    root = sp.sqrt(square)
    roots = (Root(2 * sp.atan((-a + sign * root) / (d - b)), exists) for sign in (1, -1))
    return RootSet(tuple(roots), (d - b,))


def _polynomial(factor: sp.Expr, unknown: sp.Symbol) -> RootSet | None:
    """Solve an equation of first or second degree, of second degree in u², or u^n = c.

    None for one in which the unknown cancels, as it may beyond the budget of polynomials.
    """
    powers = {d: c for (d,), c in sp.Poly(factor, unknown).terms()}
    if max(powers) == 0:
        return None
    divisors = (powers[max(powers)],)
    if set(powers) <= {0, 1}:
        return RootSet((Root(cancelled(-powers.get(0, sp.S.Zero) / powers[1])),), divisors)
    if set(powers) <= {0, 1, 2}:
        a, b, c = (powers.get(d, sp.S.Zero) for d in (2, 1, 0))
        return RootSet(tuple(_quadratic(a, b, c)), divisors)
    if set(powers) <= {0, 2, 4}:
        squares = _quadratic(*(powers.get(d, sp.S.Zero) for d in (4, 2, 0)))
        roots = (
            Root(sign * sp.sqrt(s.value), (*s.conditions, *_not_negative(s.value)))
            for s in squares
            for sign in (1, -1)
        )
        return RootSet(tuple(roots), divisors)
    if len(powers) == 2 and 0 in powers:
        value = cancelled(-powers[0] / powers[max(powers)])
        return RootSet(tuple(_roots_of(value, max(powers))), divisors)
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
