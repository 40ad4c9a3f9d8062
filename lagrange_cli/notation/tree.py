"""The display tree: an expression as a person would write it.

A tree is ordered and unsigned: signs stand in the terms of sums, numbers are
not negative, and divisions are fractions. Printers walk it and decide nothing
about order. Each node carries what ordering needs (:class:`OrderTraits`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TypeAlias


class Dependence(IntEnum):
    """What an expression depends on: the highest of its symbols."""

    NUMBER = 0
    PARAMETER = 1
    TIME = 2
    COORDINATE = 3
    VELOCITY = 4
    ACCELERATION = 5


@dataclass(frozen=True, slots=True)
class OrderTraits:
    """What ordering looks at.

    ``degree`` is the lowest total degree in coordinates and time among its
    terms; ``functional`` says that a function of them is a factor; ``text`` is
    a canonical form in which symbols are their ranks, so that comparing texts
    compares by order of declaration and ties never depend on chance.
    """

    level: Dependence
    degree: float
    functional: bool
    text: str


@dataclass(frozen=True, slots=True)
class DisplayNumber:
    """A rational ≥ 0; ``literal`` is the decimal to show for it, if any."""

    numerator: int
    denominator: int
    traits: OrderTraits = field(compare=False)
    literal: str | None = None


@dataclass(frozen=True, slots=True)
class DisplayPi:
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplaySymbol:
    """A symbol by its name; ``order`` counts the dots of a coordinate."""

    name: str
    order: int
    latex: str | None
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class SignedNode:
    """A signed node."""

    negative: bool
    node: DisplayNode


@dataclass(frozen=True, slots=True)
class DisplaySum:
    """Terms in order; a single one if it stands for a negative expression."""

    terms: tuple[SignedNode, ...]
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplayProduct:
    """Two or more factors in order; none is a product, a fraction or negative."""

    factors: tuple[DisplayNode, ...]
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplayFraction:
    """``numerator / denominator``; neither is itself a fraction."""

    numerator: DisplayNode
    denominator: DisplayNode
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplayPower:
    """``base ^ exponent``; the exponent is a positive rational or any other expression."""

    base: DisplayNode
    exponent: DisplayNode
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplayRoot:
    """A square root."""

    radicand: DisplayNode
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplayCall:
    """A function of the scene language."""

    function: str
    arguments: tuple[DisplayNode, ...]
    traits: OrderTraits = field(compare=False)


DisplayNode: TypeAlias = (
    DisplayNumber
    | DisplayPi
    | DisplaySymbol
    | DisplaySum
    | DisplayProduct
    | DisplayFraction
    | DisplayPower
    | DisplayRoot
    | DisplayCall
)


def as_terms(node: DisplayNode) -> tuple[SignedNode, ...]:
    """The terms of a sum, or the node as the only term."""
    return node.terms if isinstance(node, DisplaySum) else (SignedNode(False, node),)


def factors_of(node: DisplayNode) -> tuple[DisplayNode, ...]:
    """The factors of a product, or the node as the only factor."""
    return node.factors if isinstance(node, DisplayProduct) else (node,)
