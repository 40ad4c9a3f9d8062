"""Places on a surface at which an expression vanishes, solved for a coordinate or its cosine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp
from mpmath import mpc, mpf

from lagrange_cli.analysis.contacts.relations import Flat, Surface, reduced
from lagrange_cli.analysis.equilibria.single_equation import real_roots
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.proofs.zero_test import vanish

#: Digits of the numbers that decide, and the margin by which a bound is exceeded for certain.
_DIGITS, _MARGIN = 40, mpf(10) ** -20

#: Operations of a numerator that is searched for factors, and of a root that is worth reading.
_MOST_OPERATIONS, _LONGEST = 400, 60


@dataclass(frozen=True)
class Zero:
    """A place: ``left`` = ``right``.

    Attributes
    ----------
    left
        A coordinate, a function of an angle, or an expression that could not be solved.
    right
        The value; 0 if it could not be solved.
    number
        The value in numbers; None if it has none.
    angle
        The same for the sine or cosine of an output of the scene, if one is the angle.
    """

    left: sp.Expr
    right: sp.Expr
    number: float | None = None
    angle: tuple[sp.Expr, sp.Expr] | None = None


def zeros(
    numerator: sp.Expr, coordinates: Sequence[sp.Symbol], known: Mapping[sp.Symbol, sp.Expr]
) -> list[Zero]:
    """List the places at which an expression in lowest terms vanishes.

    Factors that are positive or negative throughout for the ``known`` values of the parameters are
    left out, and so are values that no cosine has.
    """
    flat = Flat.of([numerator])
    polynomial = flat.flat(numerator)
    moving = [*coordinates, *flat.moving(coordinates)]
    factors = [polynomial]
    if sp.count_ops(polynomial) <= _MOST_OPERATIONS:
        factors = [factor for factor, _ in sp.factor_list(polynomial)[1]]
    places: list[Zero] = []
    for factor in factors:
        present = [s for s in moving if s in factor.free_symbols]
        if not present and not _is_nonzero(flat.full(factor), known):
            places.append(Zero(flat.full(factor), sp.S.Zero))
        elif present and not _has_one_sign(factor, present, flat, known):
            places += _solved(factor, present, flat, known)
    return places


def _is_nonzero(factor: sp.Expr, known: Mapping[sp.Symbol, sp.Expr]) -> bool:
    value = _number(factor, known)
    return bool(factor.is_nonzero) or (value is not None and abs(value) > _MARGIN)


def _has_one_sign(
    factor: sp.Expr,
    present: Sequence[sp.Symbol],
    flat: Flat,
    known: Mapping[sp.Symbol, sp.Expr],
) -> bool:
    """Tell if even powers with coefficients of one sign, one of them alone, make up a factor."""
    if not factor.is_polynomial(*present):
        return False
    terms = sp.Poly(factor, *present).terms()
    if any(degree % 2 for powers, _ in terms for degree in powers):
        return False
    if not any(not any(powers) for powers, _ in terms):
        return False
    signs = {_sign(flat.full(coefficient), known) for _, coefficient in terms}
    return len(signs) == 1 and signs != {0}


def _sign(value: sp.Expr, known: Mapping[sp.Symbol, sp.Expr]) -> int:
    """Sign of a constant; 0 if it is not known."""
    if value.is_positive or value.is_negative:
        return 1 if value.is_positive else -1
    number = _number(value, known)
    if number is None or abs(number.imag) > 0 or abs(number.real) <= _MARGIN:
        return 0
    return 1 if number.real > 0 else -1


def _solved(
    factor: sp.Expr,
    present: Sequence[sp.Symbol],
    flat: Flat,
    known: Mapping[sp.Symbol, sp.Expr],
) -> Iterator[Zero]:
    """Yield the roots of a factor in one unknown; the factor if it cannot be solved."""
    leading = sp.LC(factor, *present) if factor.is_polynomial(*present) else factor
    sign = -1 if leading.could_extract_minus_sign() else 1
    unsolved = Zero(flat.full(_by_powers(sign * factor, present)), sp.S.Zero)
    symbols = factor.free_symbols
    angles = [a for s in present for a in [flat.functions.get(s)] if a is not None]
    shared = any(a.free_symbols & symbols for a in angles)
    if len(present) != 1 or shared or not factor.is_polynomial(present[0]):
        yield unsolved
        return
    (unknown,) = present
    place = sp.Dummy("u", real=True)
    roots = real_roots(factor.xreplace({unknown: place}), place, is_angle=False)
    if (
        roots is None
        or any(sp.count_ops(r.value) > _LONGEST for r in roots.roots)
        or not all(_is_nonzero(flat.full(divisor), known) for divisor in roots.divisors)
    ):
        yield unsolved
        return
    left = flat.functions.get(unknown, unknown)
    for root in roots.roots:
        if not vanish(factor.xreplace({unknown: root.value})):
            yield unsolved
            return
    for root in roots.roots:
        right = shortened(flat.full(root.value))
        number = _number(right, known)
        if number is not None and _is_outside(number, bounded=left != unknown):
            continue
        yield Zero(left, right, None if number is None else float(number.real))


def collected(fraction: sp.Expr, coordinates: Sequence[sp.Symbol]) -> sp.Expr:
    """Collect the powers of the unknowns in the numerator, where that prints shorter."""
    above, below = sp.fraction(sp.together(fraction))
    flat = Flat.of([above])
    polynomial = flat.flat(above)
    if sp.count_ops(polynomial) > _MOST_OPERATIONS:
        return shortened(fraction)
    number, factors = sp.factor_list(polynomial)
    moving = [*coordinates, *flat.moving(coordinates)]
    for factor, degree in factors:
        present = [s for s in moving if s in factor.free_symbols]
        sign = -1 if number.could_extract_minus_sign() and present and degree % 2 else 1
        number = (sign * number) * _by_powers(sign * factor, present) ** degree
    return min(shortened(fraction), flat.full(number) / shortened(below), key=printed_length)


def _by_powers(factor: sp.Expr, present: Sequence[sp.Symbol]) -> sp.Expr:
    """Collect the powers of the unknowns."""
    if not present or not factor.is_polynomial(*present):
        return shortened(factor)
    terms = (
        shortened(c) * sp.Mul(*(s**d for s, d in zip(present, degrees, strict=True)))
        for degrees, c in sp.Poly(factor, *present).terms()
    )
    return sp.Add(*terms)


def _is_outside(number: mpc, *, bounded: bool) -> bool:
    """Tell if a root is not real, or no value of a sine or cosine."""
    return bool(
        abs(number.imag) > _MARGIN * (1 + abs(number))
        or (bounded and abs(number.real) > 1 + _MARGIN)
    )


def _number(value: sp.Expr, known: Mapping[sp.Symbol, sp.Expr]) -> mpc | None:
    """Value at the known parameters; None if one is missing."""
    at = sp.N(value.xreplace(dict(known)), _DIGITS)
    real, imaginary = at.as_real_imag()
    if not (real.is_Float or real.is_Integer) or not (imaginary.is_Float or imaginary.is_Integer):
        return None
    return mpc(mpf(str(real)), mpf(str(imaginary)))


def with_angle(
    zero: Zero, surface: Surface, coordinates: Sequence[sp.Symbol], angles: Mapping[str, sp.Expr]
) -> Zero:
    """Add the sine or cosine of an output that is the angle of a polar form on the surface.

    ``angles``: outputs by name. With θ = atan2(u, w) and u² + w² = ρ², w = ρ cos θ.
    """
    if not isinstance(zero.left, sp.Symbol) or zero.right == zero.left:
        return zero
    for name, output in angles.items():
        if not isinstance(output, sp.atan2):
            continue
        square = reduced(surface, output.args[0] ** 2 + output.args[1] ** 2)
        if square == 0 or square.free_symbols & set(coordinates):
            continue
        angle = sp.Symbol(name, real=True)
        for function, side in zip((sp.sin, sp.cos), output.args, strict=True):
            here = reduced(surface, side)
            if here.free_symbols & set(coordinates) == {zero.left}:
                value = here.xreplace({zero.left: zero.right}) / sp.sqrt(square)
                return Zero(zero.left, zero.right, zero.number, (function(angle), shortened(value)))
    return zero
