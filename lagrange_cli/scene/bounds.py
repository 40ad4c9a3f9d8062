"""Limits on what an expression may stand for, checked before anything is computed.

Constant parts stay below 10^±400 and 20,000 digits, so that no tower such as
``9^9^9^9`` is ever evaluated. Constant powers of anything else are at most 100:
twice the steepest exponent in use for interatomic potentials (the (50, 49) Mie
potential of Jover et al., J. Chem. Phys. 137, 144505, 2012). Powers of powers
multiply.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from lagrange_cli.scene.expression import Add, Mul, Name, Neg, Node, Number, Pow, walk
from lagrange_cli.scene.tokens import MAX_EXPONENT, ExpressionError

__all__ = ["MAX_POWER", "Extent", "check_bounds", "extent_of"]

MAX_POWER = 100
#: Bits of numerator or denominator of a constant: 20,000 digits.
_MAX_BITS = 66_439
#: Bits of 10^400.
_MAGNITUDE_BITS = MAX_EXPONENT * 3322 // 1000 + 1

_TOO_LARGE = f"a constant beyond 10^{MAX_EXPONENT} or of more than 20000 digits"


@dataclass(frozen=True, slots=True)
class Extent:
    """What an expression may grow to: its value if constant, else its largest power."""

    constant: Fraction | None = None
    power: Fraction = Fraction(1)


_ANY = Extent()


def check_bounds(node: Node, depth: int) -> None:
    """Refuse a tree deeper than ``depth``, or one that stands for too much.

    Raises
    ------
    ExpressionError
        At the part that exceeds a limit, or divides by zero.
    """
    _check_depth(node, depth)
    extent_of(node, {})


def extent_of(node: Node, names: Mapping[str, Extent]) -> Extent:
    """The extent of a tree, given those of names that stand for expressions.

    Raises
    ------
    ExpressionError
        At the part that exceeds a limit, or divides by zero.
    """
    found: dict[int, Extent] = {}
    for part in reversed(list(walk(node))):
        found[id(part)] = _extent(part, found, names)
    return found[id(node)]


def _check_depth(node: Node, depth: int) -> None:
    level = [node]
    for _ in range(depth):
        level = [below for above in level for below in _below(above)]
        if not level:
            return
    raise ExpressionError(f"nested more than {depth} deep", level[0].span, rule="limit")


def _below(node: Node) -> list[Node]:
    match node:
        case Add(terms=parts) | Mul(factors=parts):
            return [part for _, part in parts]
        case Neg(operand=operand):
            return [operand]
        case Pow(base=base, exponent=exponent):
            return [base, exponent]
        case Number() | Name():
            return []
    return list(node.arguments)


def _extent(node: Node, found: dict[int, Extent], names: Mapping[str, Extent]) -> Extent:
    match node:
        case Number(value=value):
            return Extent(value)
        case Name(name=name):
            return names.get(name, _ANY)
        case Neg(operand=operand):
            inner = found[id(operand)]
            return inner if inner.constant is None else Extent(-inner.constant)
        case Add():
            return _sum(node, found)
        case Mul():
            return _product(node, found)
        case Pow():
            return _power(node, found)
    return _ANY


def _sum(node: Add, found: dict[int, Extent]) -> Extent:
    total: Fraction | None = Fraction(0)
    power = Fraction(1)
    for sign, term in node.terms:
        part = found[id(term)]
        power = max(power, part.power)
        if total is not None and part.constant is not None:
            total = total + part.constant if sign == "+" else total - part.constant
            _check_size(total, node)
        else:
            total = None
    return Extent(total, power)


def _product(node: Mul, found: dict[int, Extent]) -> Extent:
    coefficient = Fraction(1)
    constant = True
    power = Fraction(1)
    for operator, factor in node.factors:
        part = found[id(factor)]
        power = max(power, part.power)
        if part.constant is None:
            constant = False
        elif operator == "*":
            coefficient *= part.constant
        elif part.constant == 0:
            raise ExpressionError("division by zero", factor.span, rule="division")
        else:
            coefficient /= part.constant
        _check_size(coefficient, node)
    return Extent(coefficient if constant else None, power)


def _power(node: Pow, found: dict[int, Extent]) -> Extent:
    base, exponent = found[id(node.base)], found[id(node.exponent)].constant
    if exponent is None:
        return _ANY
    if base.constant is None:
        power = base.power * abs(exponent)
        if power > MAX_POWER:
            raise ExpressionError(
                f"a power beyond {MAX_POWER}", node.exponent.span, rule="limit"
            )
        return Extent(None, max(power, Fraction(1)))
    return _constant_power(node, base.constant, exponent)


def _constant_power(node: Pow, base: Fraction, exponent: Fraction) -> Extent:
    if base == 0 and exponent < 0:
        raise ExpressionError("division by zero", node.span, rule="division")
    bits = max(base.numerator.bit_length(), base.denominator.bit_length())
    if abs(base) != 1 and base != 0 and abs(exponent) * bits > _MAX_BITS:
        raise ExpressionError(_TOO_LARGE, node.span, rule="limit")
    if exponent.denominator != 1:
        return _ANY
    if abs(base) == 1:
        # The exponent may be as large as any constant; only its parity matters.
        return Extent(base if exponent.numerator % 2 else Fraction(1))
    value = Fraction(base ** exponent.numerator)
    _check_size(value, node)
    return Extent(value)


def _check_size(value: Fraction, node: Node) -> None:
    above, below = value.numerator.bit_length(), value.denominator.bit_length()
    if max(above, below) > _MAX_BITS or (value and abs(above - below) > _MAGNITUDE_BITS):
        raise ExpressionError(_TOO_LARGE, node.span, rule="limit")
