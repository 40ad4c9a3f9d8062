"""The order of factors in a product and of terms in a sum, as books have it.

Factors: numbers, parameters, coordinates, what moves, functions. Terms: the highest derivative,
squares, powers, functions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import NamedTuple, TypeAlias

from lagrange_cli.notation.tree import (
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplayRoot,
    DisplaySeries,
    DisplaySum,
    DisplaySymbol,
    Role,
    SignedNode,
    factors_of,
)

#: Place, dependence, order of declaration, minus the power.
FactorKey: TypeAlias = tuple[int, int, str, float]

#: Functions that stand behind all others, in their order.
TRIGONOMETRIC = ("sin", "cos", "tan", "sinh", "cosh", "tanh")


class Place(IntEnum):
    """The place of a factor's kind in a product."""

    NUMBER = 0
    CONSTANT = 1
    COUPLING = 2
    MASS = 3
    GRAVITY = 4
    STRENGTH = 5
    PARAMETER = 6
    PARAMETER_ROOT = 7
    PARAMETER_SUM = 8
    TIME = 9
    ABBREVIATION = 10
    UNIT_SUM = 11
    COORDINATE = 12
    COORDINATE_SUM = 13
    VELOCITY = 14
    VELOCITY_SUM = 15
    ACCELERATION = 16
    ACCELERATION_SUM = 17
    ROOT = 18
    FUNCTION = 19
    TRIGONOMETRIC = 20
    SERIES = 21


_ROLES = {
    Role.COUPLING: Place.COUPLING,
    Role.MASS: Place.MASS,
    Role.GRAVITY: Place.GRAVITY,
    Role.STRENGTH: Place.STRENGTH,
    Role.START: Place.COORDINATE,
    Role.TRIGONOMETRIC: Place.TRIGONOMETRIC,
    Role.OTHER: Place.PARAMETER,
}
#: The places of symbols and of sums, by dependence.
SYMBOL_PLACES = {
    Dependence.NUMBER: Place.CONSTANT,
    Dependence.PARAMETER: Place.PARAMETER,
    Dependence.TIME: Place.TIME,
    Dependence.COORDINATE: Place.COORDINATE,
    Dependence.VELOCITY: Place.VELOCITY,
    Dependence.ACCELERATION: Place.ACCELERATION,
}
_SUM_PLACES = {
    Dependence.NUMBER: Place.CONSTANT,
    Dependence.PARAMETER: Place.PARAMETER_SUM,
    Dependence.TIME: Place.COORDINATE_SUM,
    Dependence.COORDINATE: Place.COORDINATE_SUM,
    Dependence.VELOCITY: Place.VELOCITY_SUM,
    Dependence.ACCELERATION: Place.ACCELERATION_SUM,
}


def _place(node: DisplayNode) -> Place:
    if isinstance(node, DisplayNumber):
        return Place.NUMBER
    base = node.base if isinstance(node, DisplayPower) else node
    level = node.traits.level
    if isinstance(node, DisplayPower) and not isinstance(node.exponent, DisplayNumber):
        return Place.FUNCTION if level > Dependence.PARAMETER else Place.PARAMETER_ROOT
    if isinstance(base, DisplaySeries):
        return Place.SERIES
    if isinstance(base, DisplayCall):
        is_last = base.function in TRIGONOMETRIC
        return Place.TRIGONOMETRIC if is_last else Place.FUNCTION
    if isinstance(base, DisplayRoot):
        if level == Dependence.NUMBER:
            return Place.CONSTANT
        return Place.PARAMETER_ROOT if level == Dependence.PARAMETER else Place.ROOT
    if isinstance(base, DisplaySymbol):
        if base.role != Role.OTHER:
            return _ROLES[base.role]
        moves = base.abbreviates and level >= Dependence.TIME
        return Place.ABBREVIATION if moves else SYMBOL_PLACES[level]
    if not isinstance(base, DisplaySum):
        return SYMBOL_PLACES[level]
    leader = _leader(base)
    if leader is not None:
        return _ROLES[leader.role]
    return Place.UNIT_SUM if _is_unit_sum(base) else _SUM_PLACES[level]


def _leader(node: DisplaySum) -> DisplaySymbol | None:
    """Return the parameter at whose place a sum of them stands: the first that is a term by itself.

    None of sums with a number, which stand behind the parameters: ``g (1 - e)``.
    """
    levels = {t.node.traits.level for t in node.terms}
    if levels != {Dependence.PARAMETER}:
        return None
    alone = [_linear_symbol(t.node) for t in node.terms]
    symbols = [s for s in alone if s is not None]
    return min(symbols, key=lambda s: (_ROLES[s.role], s.traits.text), default=None)


def _linear_symbol(node: DisplayNode) -> DisplaySymbol | None:
    """Return the symbol of a term that is one, or a number times one."""
    *numbers, last = factors_of(node)
    is_linear = all(isinstance(n, DisplayNumber) for n in numbers)
    return last if is_linear and isinstance(last, DisplaySymbol) else None


def _is_unit_sum(node: DisplaySum) -> bool:
    """Tell whether a sum is a number and small terms, a coefficient: ``1 + 4 a² x²``."""
    return (
        node.traits.level in (Dependence.TIME, Dependence.COORDINATE)
        and any(t.node.traits.level == Dependence.NUMBER for t in node.terms)
        and not any(_linear_symbol(t.node) for t in node.terms)
        and not _is_trigonometric(node)
    )


def _is_trigonometric(node: DisplayNode) -> bool:
    if isinstance(node, DisplaySum):
        return any(_is_trigonometric(t.node) for t in node.terms)
    if isinstance(node, DisplayFraction):
        return _is_trigonometric(node.numerator) or _is_trigonometric(node.denominator)
    return any(_place(f) == Place.TRIGONOMETRIC for f in factors_of(node))


def factor_key(node: DisplayNode) -> FactorKey:
    """Place, dependence of functions, order of declaration, then the higher power first."""
    place = _place(node)
    level = int(place >= Place.ROOT and node.traits.level > Dependence.PARAMETER)
    base, power = node, 1.0
    if isinstance(node, DisplayPower) and isinstance(node.exponent, DisplayNumber):
        base, power = node.base, value_of(node.exponent)
    text = base.traits.text
    leader = _leader(base) if isinstance(base, DisplaySum) else None
    if leader is not None:
        # Behind the symbol itself.
        text = f"{leader.traits.text}{text}"
    return place, level, text, -power


def key_beside(factors: list[DisplayNode]) -> Callable[[DisplayNode], FactorKey]:
    """Return the key of factors of one product: g stands beside masses, else as declared.

    Before a sum of parameters it stands too: ``g (R + a) sin θ``.
    """
    if any(_place(f) == Place.MASS or _is_led(f) for f in factors):
        return factor_key

    def key(node: DisplayNode) -> FactorKey:
        place, level, text, power = factor_key(node)
        return Place.PARAMETER if place == Place.GRAVITY else place, level, text, power

    return key


def _is_led(node: DisplayNode) -> bool:
    base = node.base if isinstance(node, DisplayPower) else node
    return isinstance(base, DisplaySum) and _leader(base) is not None


def value_of(exponent: DisplayNumber) -> float:
    return exponent.numerator / exponent.denominator


class TermKey(NamedTuple):
    """Key by which the terms of a sum are ordered: the first entry decides first.

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
        """Return the key by which numbers and low powers are last."""
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
    """Return the degree of a term in velocities and accelerations."""
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
    """Return the number of functions; those in coefficients of velocities do not count."""
    counted = [f for f in factors if not moving or not _is_sum(f)]
    return sum(f.traits.functions for f in counted)


def _is_sum(node: DisplayNode) -> bool:
    return isinstance(node.base if isinstance(node, DisplayPower) else node, DisplaySum)


def _ranks(keys: list[FactorKey]) -> tuple[str, ...]:
    """Return the order of declaration of letters, not of sums of them."""
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
    """Return the arguments of a term that is one function: in sums they count before its name."""
    if len(factors) != 1:
        return ()
    node = factors[0]
    base = node.base if isinstance(node, DisplayPower) else node
    if not isinstance(base, DisplayCall):
        return ()
    return tuple(a.traits.text for a in base.arguments)
