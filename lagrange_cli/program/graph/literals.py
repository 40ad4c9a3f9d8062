"""Exact numbers as floating-point literals that read back to the nearest value."""

from __future__ import annotations

from fractions import Fraction
from math import floor, isfinite, log10

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.graph.operands import Coefficient, magnitude

#: Significant digits of non-terminating decimals: enough for quadruple precision.
_DECIMAL_DIGITS = 36


def double_literal(value: Coefficient) -> str:
    """The shortest decimal that reads as the double nearest to ``value``.

    Raises
    ------
    InputError
        The number overflows, or underflows to zero.
    """
    try:
        number = float(value)
    except OverflowError:
        raise out_of_range(value) from None
    if not isfinite(number) or (value and not number):
        raise out_of_range(value)
    return repr(number)


def decimal_literal(value: Coefficient) -> str:
    """A decimal for types other than double: exact where it terminates within
    :data:`DECIMAL_DIGITS` significant digits, else correctly rounded to them."""
    if not value:
        return "0.0"
    sign, value = ("-", -value) if value < 0 else ("", value)
    exponent = _decimal_exponent(value)
    scaled = value * Fraction(10) ** (_DECIMAL_DIGITS - 1 - exponent)
    digits = str(round(scaled))
    if len(digits) > _DECIMAL_DIGITS:
        exponent += 1
    fraction = digits[1:].rstrip("0") or "0"
    if -5 < exponent < 16:
        return sign + _positional(digits[0] + fraction, exponent)
    return f"{sign}{digits[0]}.{fraction}e{exponent:+03d}"


def _decimal_exponent(value: Coefficient) -> int:
    """The e with 10^e <= value < 10^(e+1)."""
    bits = value.numerator.bit_length() - value.denominator.bit_length()
    exponent = floor(bits * log10(2))
    while Fraction(10) ** exponent > value:
        exponent -= 1
    while Fraction(10) ** (exponent + 1) <= value:
        exponent += 1
    return exponent


def _positional(digits: str, exponent: int) -> str:
    if exponent < 0:
        return "0." + "0" * (-exponent - 1) + digits.rstrip("0")
    whole = digits[: exponent + 1].ljust(exponent + 1, "0")
    return f"{whole}.{digits[exponent + 1 :].rstrip('0') or '0'}"


def out_of_range(value: Coefficient) -> InputError:
    """The refusal of a constant that the type cannot hold."""
    size = _decimal_exponent(magnitude(value))
    return InputError(
        Problem(
            f"a constant of magnitude 1e{size:+d} is outside the range of the number type",
            hint="write the scene in units that keep its numbers between 1e-300 and 1e300",
            rule="range",
        )
    )
