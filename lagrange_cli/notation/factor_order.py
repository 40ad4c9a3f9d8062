"""The places of factors in a product: numbers, parameters, coordinates, what moves, functions."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import TypeAlias

from lagrange_cli.notation.tree import (
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPower,
    DisplayRoot,
    DisplaySeries,
    DisplaySum,
    DisplaySymbol,
    Role,
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
    PARAMETER = 5
    PARAMETER_ROOT = 6
    PARAMETER_SUM = 7
    TIME = 8
    ABBREVIATION = 9
    UNIT_SUM = 10
    COORDINATE = 11
    COORDINATE_SUM = 12
    VELOCITY = 13
    VELOCITY_SUM = 14
    ACCELERATION = 15
    ACCELERATION_SUM = 16
    ROOT = 17
    FUNCTION = 18
    TRIGONOMETRIC = 19
    SERIES = 20


_ROLES = {
    Role.COUPLING: Place.COUPLING,
    Role.MASS: Place.MASS,
    Role.GRAVITY: Place.GRAVITY,
    Role.START: Place.COORDINATE,
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
        if base.abbreviates and level >= Dependence.TIME:
            return Place.ABBREVIATION
        return SYMBOL_PLACES[level] if base.role == Role.OTHER else _ROLES[base.role]
    if not isinstance(base, DisplaySum):
        return SYMBOL_PLACES[level]
    leader = _leader(base)
    if leader is not None:
        return _ROLES[leader.role]
    return Place.UNIT_SUM if _is_unit_sum(base) else _SUM_PLACES[level]


def _leader(node: DisplaySum) -> DisplaySymbol | None:
    """The parameter at whose place a sum of them stands: the first that is a term by itself.

    None of sums with a number, which stand behind the parameters: ``g (1 - e)``.
    """
    levels = {t.node.traits.level for t in node.terms}
    if levels != {Dependence.PARAMETER}:
        return None
    alone = [_linear_symbol(t.node) for t in node.terms]
    symbols = [s for s in alone if s is not None]
    return min(symbols, key=lambda s: (_ROLES[s.role], s.traits.text), default=None)


def _linear_symbol(node: DisplayNode) -> DisplaySymbol | None:
    """The symbol of a term that is one, or a number times one."""
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
    """The key of factors of one product: g stands beside masses, else as declared."""
    if any(_place(f) == Place.MASS for f in factors):
        return factor_key

    def key(node: DisplayNode) -> FactorKey:
        place, level, text, power = factor_key(node)
        return Place.PARAMETER if place == Place.GRAVITY else place, level, text, power

    return key


def value_of(exponent: DisplayNumber) -> float:
    return exponent.numerator / exponent.denominator
