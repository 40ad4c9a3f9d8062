"""Elementary functions with their first two derivatives, in decimal arithmetic.

Sums and products of :mod:`decimal` are compiled and fast, but it lacks these functions:
mpmath evaluates them, and decimals go in and come out.
"""

from __future__ import annotations

import decimal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from decimal import Decimal
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Any, TypeAlias

import mpmath
import sympy as sp
from mpmath import mpf
from mpmath.libmp import from_man_exp

from lagrange_cli.mechanics.free_symbols import stand_in
from lagrange_cli.mechanics.numerics.bounded_functions import (
    BOUNDED_FUNCTIONS,
    LARGEST_ANGLE,
    LONGEST_ANGLE,
    DomainError,
    Mpf,
    bounded,
    exponential,
    hyperbolic_tangent,
    power,
)

Jet = tuple[Decimal, Decimal, Decimal]
"""A value with its first and second derivative."""

DecimalRow: TypeAlias = Mapping[int, Decimal]
"""The entries of a row that are not zero, by column."""

DecimalValues: TypeAlias = Mapping[sp.Symbol, Decimal]
"""Values of symbols at a state."""

_MpfJet = tuple[Mpf, Mpf, Mpf]

_MPF_ZERO = mpf(0)
_ZERO = Decimal(0)
_NAN = Decimal("NaN")
_FLAT: Jet = (_ZERO, _ZERO, _ZERO)


@cache
def decimal_context(digits: int) -> decimal.Context:
    """Make decimal arithmetic of ``digits`` that never runs out of exponents."""
    return decimal.Context(
        prec=digits,
        Emin=decimal.MIN_EMIN,
        Emax=decimal.MAX_EMAX,
        rounding=decimal.ROUND_HALF_EVEN,
        traps=[decimal.InvalidOperation, decimal.DivisionByZero, decimal.Overflow],
    )


@contextmanager
def in_decimals() -> Iterator[None]:
    """Calculate in decimals with the digits of mpmath and some more.

    Raises
    ------
    DomainError
        A value is not a finite real number.
    """
    with decimal.localcontext(decimal_context(mpmath.mp.dps + 5)):
        try:
            yield
        except decimal.DecimalException as error:
            raise DomainError from error


@cache
def _power_of_two(exponent: int, digits: int) -> Decimal:
    with decimal.localcontext(decimal_context(digits + 5)):
        return Decimal(2) ** exponent


@cache
def _decimal_scale(bits: int) -> tuple[int, decimal.Context]:
    """Give the digits to which decimals are rounded on their way to so many bits."""
    digits = mpmath.libmp.prec_to_dps(bits) + 5
    return digits, decimal_context(digits + 5)


@cache
def _power_of_ten(exponent: int, bits: int) -> tuple[int, int]:
    """Give mantissa and binary exponent of a power of ten, with some bits more."""
    with mpmath.workprec(bits + 20):
        _, mantissa, power, _ = (mpf(10) ** exponent)._mpf_
    return mantissa, power


def to_decimal(x: Mpf) -> Decimal:
    """Convert an mpf to a decimal of the current context's precision."""
    if not isinstance(x, mpf):
        raise DomainError
    sign, mantissa, exponent, _ = x._mpf_
    if not mantissa:
        if exponent:
            raise DomainError  # infinite or not a number
        return _ZERO
    value = Decimal(int(mantissa)) * _power_of_two(exponent, decimal.getcontext().prec)
    return -value if sign else value


def to_mpf(x: Decimal) -> Mpf:
    """Convert a decimal to an mpf; DomainError for one that is not a number."""
    if not x:
        return _MPF_ZERO
    if not x.is_finite():
        raise DomainError
    bits = mpmath.mp.prec
    digits, context = _decimal_scale(bits)
    exponent = x.adjusted() - digits
    mantissa = int(x.scaleb(-exponent, context))
    ten, power = _power_of_ten(exponent, bits)
    # mpf(mantissa)·10^exponent, rounded once, by the functions behind these operators.
    return mpmath.mp.make_mpf(from_man_exp(mantissa * ten, power, bits, "n"))


def numbers_as_decimals(numbers: Mapping[Any, Mpf]) -> dict[Any, Decimal]:
    """Convert the values of a mapping to decimals of the current context's precision."""
    return {key: to_decimal(x) for key, x in numbers.items()}


def numbers_as_mpf(numbers: Mapping[Any, Decimal]) -> dict[Any, Mpf]:
    """Convert the values of a mapping to mpf."""
    return {key: to_mpf(x) for key, x in numbers.items()}


def finite(x: Decimal) -> Decimal:
    """Return a number; DomainError for one that is infinite or not a number."""
    if not x.is_finite():
        raise DomainError
    return x


def _real(x: Mpf) -> Mpf:
    if isinstance(x, mpf) and mpmath.isfinite(x):
        return x
    raise DomainError


def _reciprocal(x: Mpf) -> Mpf:
    return 1 / x if x else mpmath.nan  # an infinite slope at a finite value


@lru_cache(maxsize=2**17)
def _cos_sin(x: Decimal, digits: int) -> tuple[Decimal, Decimal]:
    """Evaluate cosine and sine at once and keep them: most angles occur under both."""
    if x.adjusted() > LONGEST_ANGLE:
        raise DomainError
    c, s = mpmath.cos_sin(to_mpf(x))
    return to_decimal(c), to_decimal(s)


def _sin(x: Decimal) -> Jet:
    c, s = _cos_sin(x, mpmath.mp.dps)
    return s, c, -s


def _cos(x: Decimal) -> Jet:
    c, s = _cos_sin(x, mpmath.mp.dps)
    return c, -s, -c


def _tan(x: Mpf) -> _MpfJet:
    y = BOUNDED_FUNCTIONS["tan"](x)
    return y, 1 + y * y, 2 * y * (1 + y * y)


def _asin(x: Mpf) -> _MpfJet:
    r = _reciprocal(mpmath.sqrt(_real(1 - x * x)))
    return mpmath.asin(x), r, x * r**3


def _acos(x: Mpf) -> _MpfJet:
    r = _reciprocal(mpmath.sqrt(_real(1 - x * x)))
    return mpmath.acos(x), -r, -x * r**3


def _atan(x: Mpf) -> _MpfJet:
    r = 1 / (1 + x * x)
    return mpmath.atan(x), r, -2 * x * r * r


def _sinh(x: Mpf) -> _MpfJet:
    s, c = BOUNDED_FUNCTIONS["sinh"](x), BOUNDED_FUNCTIONS["cosh"](x)
    return s, c, s


def _cosh(x: Mpf) -> _MpfJet:
    s, c, _ = _sinh(x)
    return c, s, c


def _tanh(x: Mpf) -> _MpfJet:
    y = hyperbolic_tangent(x)
    return y, 1 - y * y, -2 * y * (1 - y * y)


def _asinh(x: Mpf) -> _MpfJet:
    r = 1 / mpmath.sqrt(1 + x * x)
    return mpmath.asinh(x), r, -x * r**3


def _acosh(x: Mpf) -> _MpfJet:
    r = _reciprocal(mpmath.sqrt(_real(x * x - 1)))
    return mpmath.acosh(x), r, -x * r**3


def _atanh(x: Mpf) -> _MpfJet:
    r = _reciprocal(1 - x * x)
    return mpmath.atanh(x), r, 2 * x * r * r


def _exp(x: Mpf) -> _MpfJet:
    y = exponential(x)
    return y, y, y


def _log(x: Mpf) -> _MpfJet:
    if not x:
        raise DomainError
    r = 1 / x
    return mpmath.log(x), r, -r * r


def _abs(x: Mpf) -> _MpfJet:
    return abs(x), mpmath.sign(x), _MPF_ZERO


def _sign(x: Mpf) -> _MpfJet:
    return mpmath.sign(x), _MPF_ZERO, _MPF_ZERO


def integer_power(x: Decimal, n: int) -> Jet:
    """Evaluate x**n for an integer exponent, with both derivatives."""
    if n == 2:
        return x * x, 2 * x, Decimal(2)
    if not x:
        if n < 0:
            raise DomainError
        return Decimal(n == 0), Decimal(n == 1), Decimal(2 * (n == 2))
    y = x**n
    first = n * y / x
    return y, first, (n - 1) * first / x


def rational_power(x: Decimal, exponent: sp.Rational) -> Jet:
    """Evaluate x**(p/q), with both derivatives; DomainError for negative x."""
    if x < 0:
        raise DomainError
    n = Decimal(int(exponent.p)) / Decimal(int(exponent.q))
    if not x:
        if n < 0:
            raise DomainError
        return _ZERO, _ZERO if n > 1 else _NAN, _ZERO if n > 2 else _NAN
    if exponent.q == 2:
        y = x.sqrt() ** int(exponent.p)
    else:
        y = to_decimal(power(to_mpf(x), mpf(int(exponent.p)) / int(exponent.q)))
    first = n * y / x
    return y, first, (n - 1) * first / x


@cache
def constant_decimal(expr: sp.Expr, digits: int) -> Decimal:
    """Evaluate a number to the precision of the current context.

    ``digits`` is that precision, which distinguishes kept values.

    Raises
    ------
    DomainError
        It is no real number, as sin ∞.
    """
    if expr.is_Rational:
        return Decimal(int(expr.p)) / Decimal(int(expr.q))
    value = expr.evalf(digits + 5)
    if not (value.is_Float or value.is_Rational):
        raise DomainError
    return to_decimal(mpf(value))


def _slope(x: Mpf) -> Decimal:
    """Convert a derivative; an infinite one becomes a NaN, which propagates."""
    return to_decimal(x) if mpmath.isfinite(x) else _NAN


def _through_mpf(function: Callable[[Mpf], _MpfJet]) -> Callable[[Decimal], Jet]:
    def convert(x: Decimal) -> Jet:
        value, first, second = function(to_mpf(x))
        return to_decimal(value), _slope(first), _slope(second)

    return convert


#: Derivatives by argument and order, by the name of a function that is known after all.
KnownFunctions = Mapping[str, Callable[[Mpf, int], Mpf]]

_known: ContextVar[KnownFunctions] = ContextVar("known", default=MappingProxyType({}))


@contextmanager
def evaluating(functions: KnownFunctions) -> Iterator[None]:
    """Give functions their own values, in place of those of stand-ins."""
    token = _known.set(functions)
    try:
        yield
    finally:
        _known.reset(token)


@cache
def unknown_jet(name: str) -> Callable[[Decimal], Jet]:
    """Return the stand-in for an unknown function, with both derivatives."""
    functions = [stand_in(name + "'" * order) for order in range(3)]
    base = name.rstrip("'")
    lowest = len(name) - len(base)

    def values(x: Mpf) -> _MpfJet:
        known = _known.get().get(base)
        if known is not None:
            return known(x, lowest), known(x, lowest + 1), known(x, lowest + 2)
        value, first, second = (f(bounded(x, LARGEST_ANGLE)) for f in functions)
        return value, first, second

    return _through_mpf(values)


#: Each function of one argument: value, first and second derivative.
ELEMENTARY_FUNCTIONS: dict[Any, Callable[[Decimal], Jet]] = {
    sp.sin: _sin,
    sp.cos: _cos,
    sp.tan: _through_mpf(_tan),
    sp.asin: _through_mpf(_asin),
    sp.acos: _through_mpf(_acos),
    sp.atan: _through_mpf(_atan),
    sp.sinh: _through_mpf(_sinh),
    sp.cosh: _through_mpf(_cosh),
    sp.tanh: _through_mpf(_tanh),
    sp.asinh: _through_mpf(_asinh),
    sp.acosh: _through_mpf(_acosh),
    sp.atanh: _through_mpf(_atanh),
    sp.exp: _through_mpf(_exp),
    sp.log: _through_mpf(_log),
    sp.Abs: _through_mpf(_abs),
    sp.sign: _through_mpf(_sign),
}
