"""Operands and exact numbers as text of a C-like expression language.

C and Python write ``a*b + c/d`` and ``f(x)`` the same way; a :class:`Dialect` holds what differs
between them: numbers and names of functions and variables. Literals read back to the value nearest
to the exact number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import floor, isfinite, log10
from typing import Protocol

from lagrange_cli.errors import InputError, InternalError, Problem
from lagrange_cli.program.graph.operands import (
    Coefficient,
    Constant,
    Element,
    FunctionCall,
    Operand,
    Product,
    Sum,
    Variable,
    magnitude,
)

#: Precedence of a sum.
_SUM = 0
#: Precedence of a product.
_PRODUCT = 1
#: Precedence of operands that never need parentheses.
_ATOM = 2


class _NumberFormat(Protocol):
    def __call__(self, value: Coefficient, /) -> str: ...


@dataclass(frozen=True)
class Dialect:
    """Numbers, functions and names of a target language.

    Attributes
    ----------
    number
        Writes a rational number.
    functions
        Function of a program → text of the callee.
    names
        Input → its name there; names that are missing stay.
    element
        Writes a number of an array; None where no loop is printed.
    """

    number: _NumberFormat
    functions: Mapping[str, str]
    names: Mapping[str, str]
    element: Callable[[Element], str] | None = None


def expression_text(operand: Operand, dialect: Dialect) -> str:
    """Write an operand as text."""
    return _format(operand, dialect)[0]


def functions_in(operands: Iterable[Operand]) -> set[str]:
    """Collect the functions that operands call."""
    called: set[str] = set()
    stack = list(operands)
    while stack:
        operand = stack.pop()
        if isinstance(operand, Sum):
            stack.extend([part for _, part in operand.terms])
        elif isinstance(operand, Product):
            stack.extend(operand.numerator)
            stack.extend(operand.denominator)
        elif isinstance(operand, FunctionCall):
            called.add(operand.function)
            stack.extend(operand.arguments)
    return called


def _format(operand: Operand, dialect: Dialect) -> tuple[str, int]:
    """Text and precedence of an operand."""
    if isinstance(operand, Constant):
        return dialect.number(operand.value), _ATOM if operand.value >= 0 else _SUM
    if isinstance(operand, Element):
        assert dialect.element is not None
        return dialect.element(operand), _ATOM
    if isinstance(operand, Variable):
        return dialect.names.get(operand.name, operand.name), _ATOM
    if isinstance(operand, FunctionCall):
        return _format_call(operand, dialect), _ATOM
    if isinstance(operand, Product):
        return _format_product(operand, dialect), _PRODUCT
    return _format_sum(operand, dialect)


def _at_least(precedence: int, operand: Operand, dialect: Dialect) -> str:
    """Write an operand, in parentheses if it binds more loosely than ``precedence``."""
    text, binding = _format(operand, dialect)
    return text if binding >= precedence else f"({text})"


def _format_call(call: FunctionCall, dialect: Dialect) -> str:
    callee = dialect.functions.get(call.function)
    if callee is None:
        problem = f"the function {call.function} has no counterpart in emitted code"
        raise InternalError(Problem(problem, rule="unprintable"))
    return f"{callee}({', '.join(expression_text(a, dialect) for a in call.arguments)})"


def _format_product(product: Product, dialect: Dialect) -> str:
    first = _PRODUCT  # a*b/c reads from the left, so only the first factor may be a product
    parts = []
    for factor in product.numerator:
        parts.append(_at_least(first, factor, dialect))
        first = _ATOM
    numerator = "*".join(parts) or dialect.number(1)
    if not product.denominator:
        return numerator
    denominator = "*".join(_at_least(_ATOM, d, dialect) for d in product.denominator)
    return (
        f"{numerator}/({denominator})"
        if len(product.denominator) > 1
        else (f"{numerator}/{denominator}")
    )


def _format_sum(operand: Sum, dialect: Dialect) -> tuple[str, int]:
    text = ""
    for coefficient, term in operand.terms:
        sign = "-" if coefficient < 0 else "+"
        body = _format_term(magnitude(coefficient), term, dialect)
        if text:
            text += f" {sign} {body}"
        else:
            text = f"-{body}" if sign == "-" else body
    positive_product = len(operand.terms) == 1 and operand.terms[0][0] > 0
    return text, _PRODUCT if positive_product else _SUM


def _format_term(size: Coefficient, term: Operand, dialect: Dialect) -> str:
    if isinstance(term, Constant):
        return dialect.number(size * term.value)
    if size == 1:
        return _at_least(_PRODUCT, term, dialect)
    # The first factor of a product may join the coefficient without parentheses.
    return f"{dialect.number(size)}*{_at_least(_PRODUCT, term, dialect)}"


#: Significant digits of non-terminating decimals: enough for quadruple precision.
_DECIMAL_DIGITS = 36


def double_literal(value: Coefficient) -> str:
    """Write the shortest decimal that reads as the double nearest to ``value``.

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
    """Write a decimal for types other than double, correctly rounded to 36 significant digits.

    It is exact where it terminates within these.
    """
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
