"""The order of terms in a sum: the highest derivative, squares, powers, functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from lagrange_cli.notation.factor_order import (
    SYMBOL_PLACES,
    FactorKey,
    Place,
    factor_key,
    value_of,
)
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplaySum,
    DisplaySymbol,
    SignedNode,
    factors_of,
)


class TermKey(NamedTuple):
    """What terms of a sum are compared by, the first entry first.

    Attributes
    ----------
    unlike_number
        0 of numbers, 1 of others.
    moving
        Minus the highest derivative.
    speed
        Minus the degree in velocities and accelerations.
    rates_crossed
        True of a product of two of these.
    driven
        True of what depends on t alone, or is an input.
    functions
        Number of factors that are functions, a denominator that moves among them.
    degree
        The degree in coordinates.
    crossed
        True of a product of two coordinates.
    compound
        True with a sum of coordinates as a factor.
    ranks
        Order of declaration of what moves, or of the arguments of a function.
    divisor
        The denominator, if it moves.
    factors, text
        What tells all others apart.
    """

    unlike_number: int
    moving: int
    speed: float
    rates_crossed: bool
    driven: bool
    functions: float
    degree: float
    crossed: bool
    compound: bool
    ranks: tuple[str, ...]
    divisor: str
    factors: tuple[FactorKey, ...]
    text: str

    def falling(self) -> TermKey:
        """The key by which numbers and low powers are last."""
        return self._replace(
            unlike_number=-self.unlike_number,
            functions=-self.functions,
            degree=-self.degree,
            compound=not self.compound,
        )


def term_key(term: SignedNode) -> TermKey:
    node = term.node
    traits = node.traits
    above = factors_of(node.numerator if isinstance(node, DisplayFraction) else node)
    factors = [f for f in above if not isinstance(f, (DisplayNumber, DisplayPi))]
    keys = tuple(factor_key(f) for f in factors)
    rates = [key for key in keys if Place.VELOCITY <= key[0] <= Place.ACCELERATION_SUM]
    coordinates = [key for key in keys if key[0] == Place.COORDINATE]
    below = node.denominator.traits if isinstance(node, DisplayFraction) else None
    divisor = below.text if below is not None and below.level >= Dependence.TIME else ""
    return TermKey(
        unlike_number=0 if traits.level == Dependence.NUMBER else 1,
        moving=-int(traits.level) if traits.level >= Dependence.VELOCITY else 0,
        speed=-_speed(node),
        rates_crossed=_is_cross(rates),
        driven=traits.level == Dependence.TIME,
        functions=_functions(factors, bool(rates)) + bool(divisor),
        degree=traits.degree,
        crossed=_is_cross(coordinates),
        compound=any(key[0] == Place.COORDINATE_SUM for key in keys),
        ranks=_rate_ranks(node) or _ranks(coordinates) or _arguments(factors),
        divisor=divisor,
        factors=keys,
        text=traits.text,
    )


def _speed(node: DisplayNode) -> float:
    """The degree of a term in velocities and accelerations."""
    if isinstance(node, DisplaySymbol):
        return float(node.traits.level >= Dependence.VELOCITY)
    if isinstance(node, DisplaySum):
        return max(_speed(t.node) for t in node.terms)
    if isinstance(node, DisplayPower):
        exponent = value_of(node.exponent) if isinstance(node.exponent, DisplayNumber) else 0
        return _speed(node.base) * exponent
    if isinstance(node, DisplayFraction):
        return _speed(node.numerator)
    return sum(map(_speed, node.factors)) if isinstance(node, DisplayProduct) else 0


def _functions(factors: Sequence[DisplayNode], moving: bool) -> float:
    """The number of functions; those in coefficients of velocities do not count."""
    counted = [f for f in factors if not moving or not _is_sum(f)]
    return sum(f.traits.functions for f in counted)


def _is_sum(node: DisplayNode) -> bool:
    return isinstance(node.base if isinstance(node, DisplayPower) else node, DisplaySum)


def _ranks(keys: list[FactorKey]) -> tuple[str, ...]:
    """The order of declaration of letters, not of sums of them."""
    return tuple(key[2] for key in keys if key[0] in SYMBOL_PLACES.values())


def _rate_ranks(node: DisplayNode) -> tuple[str, ...]:
    """The order of declaration of velocities and accelerations in a term, the first of each sum."""
    if isinstance(node, DisplaySymbol):
        return (node.traits.text,) if node.traits.level >= Dependence.VELOCITY else ()
    if isinstance(node, DisplayPower):
        return _rate_ranks(node.base)
    if isinstance(node, DisplayFraction):
        return _rate_ranks(node.numerator)
    if isinstance(node, DisplaySum):
        return min((r for t in node.terms if (r := _rate_ranks(t.node))), default=())[:1]
    if isinstance(node, DisplayProduct):
        return tuple(rank for factor in node.factors for rank in _rate_ranks(factor))
    return ()


def _is_cross(keys: list[FactorKey]) -> bool:
    """Tell whether these are two different factors, each to the power 1."""
    return [key[3] for key in keys] == [-1, -1]


def _arguments(factors: Sequence[DisplayNode]) -> tuple[str, ...]:
    """The arguments of a term that is one function: in sums they count before its name."""
    if len(factors) != 1:
        return ()
    node = factors[0]
    base = node.base if isinstance(node, DisplayPower) else node
    if not isinstance(base, DisplayCall):
        return ()
    return tuple(a.traits.text for a in base.arguments)
