"""Limits on the size of constants and powers, checked before anything is computed.

Constant parts stay below 10^±400 and 20,000 digits, so that no tower such as
``9^9^9^9`` is ever evaluated. Constant powers of anything else are at most 100:
twice the steepest exponent in use for interatomic potentials (the (50, 49) Mie
potential of Jover et al., J. Chem. Phys. 137, 144505, 2012). Powers of powers
multiply.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from lagrange_cli.scene.language.expression import (
    Add,
    Call,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    children,
    walk,
)
from lagrange_cli.scene.language.tokens import (
    MAX_EXPONENT,
    ExpressionError,
    ExpressionLimitError,
    NotRealExpressionError,
)

#: Largest constant power of an expression that is not constant.
MAX_POWER = 100
#: Bits of numerator or denominator of a constant: 20,000 digits.
_MAX_BITS = 66_439
#: Bits of 10^400.
_MAGNITUDE_BITS = MAX_EXPONENT * 3322 // 1000 + 1


@dataclass(frozen=True, slots=True)
class Extent:
    """Value of a constant expression, or the largest power in another one.

    Attributes
    ----------
    value
        Its value, exact if it is rational; None if it is not constant.
    power
        Otherwise, the largest constant power in it.
    """

    value: Fraction | float | None = None
    power: float = 1


ANY_EXTENT = Extent()

_FUNCTIONS: dict[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan")},
    **{name: getattr(math, name) for name in ("sinh", "cosh", "tanh", "asinh", "acosh", "atanh")},
    **{name: getattr(math, name) for name in ("exp", "log", "sqrt", "atan2")},
    "abs": abs,
    "sign": lambda x: (x > 0) - (x < 0),
    "min": lambda *values: min(values),
    "max": lambda *values: max(values),
    "norm": math.hypot,
    "heaviside": lambda x: 0.5 if x == 0 else float(x > 0),
}


def check_depth(node: Node, depth: int) -> None:
    """Refuse a tree of more than ``depth`` levels.

    Raises
    ------
    ExpressionError
        At the first part below that depth.
    """
    level = [node]
    for _ in range(depth):
        level = [below for above in level for below in children(above)]
        if not level:
            return
    raise ExpressionLimitError(f"nested more than {depth} deep", level[0].span, rule="limit")


def extent_of(node: Node, names: Mapping[str, Extent]) -> Extent:
    """Return the extent of a tree, given those of names that stand for expressions.

    Raises
    ------
    ExpressionError
        At the part that exceeds a limit, or that is not a finite real number.
    """
    extents: dict[int, Extent] = {}
    for part in reversed(list(walk(node))):
        try:
            extents[id(part)] = _extent(part, extents, names)
        except OverflowError:
            raise _too_large(part) from None
        except ZeroDivisionError:
            raise NotRealExpressionError("division by zero", part.span, rule="not-real") from None
        except ValueError:
            raise _not_real(part) from None
    return extents[id(node)]


def require_bounded(node: Node, values: Mapping[str, Fraction | float]) -> None:
    """Refuse an expression that becomes too large a constant once names have their values.

    Parts that are not real or not constant are left to the caller: rounded values do not decide.

    Raises
    ------
    ExpressionError
        At the part that exceeds a limit.
    """
    names = {name: Extent(value) for name, value in values.items()}
    extents: dict[int, Extent] = {}
    for part in reversed(list(walk(node))):
        below = [extents[id(inner)] for inner in children(part)]
        if not all(extent.value is not None for extent in below):
            extents[id(part)] = ANY_EXTENT
            continue
        try:
            extents[id(part)] = _extent(part, extents, names)
        except OverflowError:
            raise _too_large(part) from None
        except (ZeroDivisionError, ValueError):
            extents[id(part)] = ANY_EXTENT
        except ExpressionLimitError:
            raise
        except ExpressionError:
            extents[id(part)] = ANY_EXTENT


def _extent(node: Node, extents: Mapping[int, Extent], names: Mapping[str, Extent]) -> Extent:
    match node:
        case Number(value=value):
            return Extent(value)
        case Name(name="pi"):
            return Extent(math.pi)
        case Name(name=name):
            return names.get(name, ANY_EXTENT)
        case Neg(operand=operand):
            inner = extents[id(operand)]
            return inner if inner.value is None else Extent(-inner.value)
        case Add():
            return _sum(node, extents)
        case Mul():
            return _product(node, extents)
        case Pow():
            return _power(node, extents)
    return _application(node, extents)


def _sum(node: Add, extents: Mapping[int, Extent]) -> Extent:
    total: Fraction | float | None = Fraction(0)
    power: float = 1
    for sign, term in node.terms:
        part = extents[id(term)]
        power = max(power, part.power)
        if total is not None and part.value is not None:
            total = total + part.value if sign == "+" else total - part.value
            _check_size(total, node)
        else:
            total = None
    return Extent(total, power)


def _product(node: Mul, extents: Mapping[int, Extent]) -> Extent:
    coefficient: Fraction | float = Fraction(1)
    constant = True
    power: float = 1
    for operator, factor in node.factors:
        part = extents[id(factor)]
        power = max(power, part.power)
        if part.value is None:
            constant = False
        elif operator == "*":
            coefficient = coefficient * part.value
        elif part.value == 0:
            raise NotRealExpressionError("division by zero", factor.span, rule="not-real")
        else:
            coefficient = coefficient / part.value
        _check_size(coefficient, node)
    return Extent(coefficient if constant else None, power)


def _power(node: Pow, extents: Mapping[int, Extent]) -> Extent:
    base, exponent = extents[id(node.base)], extents[id(node.exponent)].value
    if exponent is None:
        return ANY_EXTENT
    if base.value is not None:
        return Extent(_constant_power(node, base.value, exponent))
    power = base.power * abs(float(exponent))
    if power > MAX_POWER:
        raise ExpressionLimitError(f"a power beyond {MAX_POWER}", node.exponent.span, rule="limit")
    return Extent(None, max(power, 1))


def _constant_power(
    node: Pow, base: Fraction | float, exponent: Fraction | float
) -> Fraction | float:
    if isinstance(base, float) or isinstance(exponent, float) or exponent.denominator != 1:
        if isinstance(base, Fraction):
            _check_bits(node, base, exponent)
        # math.pow refuses what is not real; ** would give a complex number.
        return math.pow(float(base), float(exponent))
    if base in (0, 1, -1):
        # The exponent may be as large as any constant; only its parity and sign matter.
        if base == 0 and exponent < 0:
            raise ZeroDivisionError
        odd = exponent.numerator % 2 == 1
        return base if odd or (base == 0 and exponent) else Fraction(1)
    _check_bits(node, base, exponent)
    value: Fraction = Fraction(base) ** exponent.numerator
    _check_size(value, node)
    return value


def _check_bits(node: Pow, base: Fraction, exponent: Fraction | float) -> None:
    if abs(float(exponent)) * _bits(base) > _MAX_BITS:
        raise _too_large(node)


def _application(node: Call, extents: Mapping[int, Extent]) -> Extent:
    """Return the extent of a function of constants; rates have no value."""
    values = [extents[id(argument)].value for argument in node.arguments]
    known = [value for value in values if value is not None]
    function = _FUNCTIONS.get(node.function)
    if function is None or len(known) < len(values):
        return ANY_EXTENT
    if node.function == "log" and known[0] == 0:
        raise _not_real(node)
    value = float(function(*known))
    _check_size(value, node)
    return Extent(value)


def _bits(value: Fraction) -> int:
    return max(value.numerator.bit_length(), value.denominator.bit_length())


def _check_size(value: Fraction | float, node: Node) -> None:
    if isinstance(value, float):
        if not math.isfinite(value):
            raise _too_large(node)
        return
    magnitude = abs(value.numerator.bit_length() - value.denominator.bit_length())
    if _bits(value) > _MAX_BITS or (value and magnitude > _MAGNITUDE_BITS):
        raise _too_large(node)


def _too_large(node: Node) -> ExpressionError:
    return ExpressionLimitError(
        "this constant is too large",
        node.span,
        f"constants stay within 10^-{MAX_EXPONENT} to 10^{MAX_EXPONENT} and 20000 digits",
        rule="limit",
    )


def _not_real(node: Node) -> ExpressionError:
    return NotRealExpressionError("this constant is not a real number", node.span, rule="not-real")
