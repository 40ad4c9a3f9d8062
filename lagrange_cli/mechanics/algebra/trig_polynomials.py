"""Trigonometric polynomials in normal form Σ a cos w + b sin w (Fourier).

Two of them are equal only if frequencies and coefficients are. Products of sines and
cosines hide an identity such as

    sin²(a − c) + sin²(b − c) − 2 cos(a − b) sin(a − c) sin(b − c) = sin²(a − b),

which shows in the normal form; so do sums of squares.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from typing import TypeAlias

import sympy as sp

from lagrange_cli.mechanics.algebra.identities import Rational, TrigMonomial

#: Trigonometric monomial → coefficient.
TrigPolynomial: TypeAlias = dict[TrigMonomial, Rational]
#: ("cos" or "sin", frequency) → coefficient; a frequency and its negative are one.
_Series: TypeAlias = dict[tuple[str, sp.Expr], Fraction]

_OTHER = {"sin": "cos", "cos": "sin"}
_CONSTANT = ("cos", sp.Integer(0))

#: Factors of a monomial above which it is left alone: it has 2^factors waves.
_LARGEST_DEGREE = 8


def refined(polynomial: TrigPolynomial, arguments: Collection[sp.Expr]) -> TrigPolynomial:
    """Write a polynomial as at most one term, or as a sum of squares with positive coefficients.

    Unchanged if it is neither with the given arguments.
    """
    series = _series(polynomial) if len(polynomial) > 1 else None
    if series is None:
        return polynomial
    for form in _FORMS:
        rewritten = form(series)
        if rewritten is None or any(a not in arguments for m in rewritten for (_, a), _ in m):
            continue
        if len(rewritten) < 2 or not _is_sum_of_squares(polynomial):
            return rewritten
    return polynomial


def _is_sum_of_squares(polynomial: TrigPolynomial) -> bool:
    return all(
        coefficient > 0 and all(power % 2 == 0 for _, power in monomial)
        for monomial, coefficient in polynomial.items()
    )


def _wave(series: _Series) -> TrigPolynomial | None:
    """Write a series of at most one wave as a monomial; None of more waves."""
    if len(series) > 1:
        return None
    return {_monomial([wave])[1]: coefficient for wave, coefficient in series.items()}


def _product(series: _Series) -> TrigPolynomial | None:
    """Write two waves of one kind and size as a product, None of other series.

    cos A − cos B = −2 sin ((A+B)/2) sin ((A−B)/2), and so on; sin A with B = 0 is
    2 sin (A/2) cos (A/2).
    """
    if len(series) > 2 or not series:
        return None
    ((name, a), c), *second_wave = series.items()
    ((other_name, b), d) = second_wave[0] if second_wave else (("sin", sp.Integer(0)), c)
    if name != other_name or abs(c) != abs(d):
        return None
    half_sum, half_difference = (a + b) / 2, (a - b) / 2
    first = name if c == d else _OTHER[name]
    second = "cos" if c == d else "sin"
    if name == "cos" and c != d:
        c = -c
    sign, monomial = _monomial([(first, half_sum), (second, half_difference)])
    return {monomial: 2 * c * sign}


def _squares(series: _Series) -> TrigPolynomial | None:
    """c₀ + Σ c cos w = (c₀ − Σ |c|) + Σ 2 |c| cos²(w/2), with sin² for negative c.

    None if c₀ < Σ |c|, or there are sines.
    """
    remainder = 2 * series.get(_CONSTANT, Fraction(0)) - sum(map(abs, series.values()))
    if remainder < 0 or any(name == "sin" for name, _ in series):
        return None
    squares: TrigPolynomial = {(): remainder} if remainder else {}
    for (_, frequency), c in series.items():
        if frequency != 0:
            squares[((("cos" if c > 0 else "sin", frequency / 2), 2),)] = 2 * abs(c)
    return squares


def _monomial(factors: list[tuple[str, sp.Expr]]) -> tuple[int, TrigMonomial]:
    """Give sign and monomial of a product of waves, none of them sin 0."""
    sign = 1
    powers: dict[tuple[str, sp.Expr], int] = {}
    for name, argument in factors:
        if argument.could_extract_minus_sign():
            argument, sign = -argument, sign if name == "cos" else -sign
        if argument != 0:
            powers[name, argument] = powers.get((name, argument), 0) + 1
    return sign, tuple(powers.items())


_FORMS = (_wave, _product, _squares)


def _series(polynomial: Mapping[TrigMonomial, Rational]) -> _Series | None:
    """Expand to the normal form without zeros; None for a negative power or too high a degree."""
    total: _Series = {}
    for monomial, coefficient in polynomial.items():
        powers = [power for _, power in monomial]
        if min(powers, default=0) < 0 or sum(powers) > _LARGEST_DEGREE:
            return None
        series: _Series = {_CONSTANT: Fraction(coefficient)}
        for (name, argument), power in monomial:
            for _ in range(power):
                series = _times(series, name, argument)
        for wave, c in series.items():
            total[wave] = total.get(wave, Fraction(0)) + c
    return {wave: c for wave, c in total.items() if c}


def _times(series: _Series, name: str, argument: sp.Expr) -> _Series:
    """Multiply a series by sin or cos with 2 cos w cos u = cos(w + u) + cos(w − u) and the like."""
    product: _Series = {}
    for (wave, frequency), c in series.items():
        result = "cos" if wave == name else "sin"
        upper = -c if wave == name == "sin" else c
        lower = -c if wave == "cos" and name == "sin" else c
        for made, half in ((frequency + argument, upper), (frequency - argument, lower)):
            if made.could_extract_minus_sign():
                made, half = -made, -half if result == "sin" else half
            if made != 0 or result == "cos":
                key = (result, made)
                product[key] = product.get(key, Fraction(0)) + half / 2
    return product
