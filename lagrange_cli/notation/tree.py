"""The display tree: an expression as a person would write it.

A tree is ordered and unsigned: signs stand in the terms of sums, numbers are
not negative, and divisions are fractions. Printers walk it and decide nothing
about order. Each node carries what ordering needs (:class:`Traits`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TypeAlias

__all__ = [
    "Atom",
    "Call",
    "Fraction",
    "Level",
    "Node",
    "Number",
    "Pi",
    "Power",
    "Product",
    "Root",
    "Sum",
    "Term",
    "Traits",
    "as_terms",
    "factors_of",
]


class Level(IntEnum):
    """What an expression depends on: the highest of its symbols."""

    NUMBER = 0
    PARAMETER = 1
    TIME = 2
    COORDINATE = 3
    VELOCITY = 4
    ACCELERATION = 5


@dataclass(frozen=True, slots=True)
class Traits:
    """What ordering looks at.

    ``degree`` is the lowest total degree in coordinates and time among its
    terms; ``functional`` says that a function of them is a factor; ``text`` is
    a canonical form in which symbols are their ranks, so that comparing texts
    compares by order of declaration and ties never depend on chance.
    """

    level: Level
    degree: float
    functional: bool
    text: str


@dataclass(frozen=True, slots=True)
class Number:
    """A rational ≥ 0; ``literal`` is the decimal to show for it, if any."""

    numerator: int
    denominator: int
    traits: Traits = field(compare=False)
    literal: str | None = None


@dataclass(frozen=True, slots=True)
class Pi:
    traits: Traits = field(compare=False)


@dataclass(frozen=True, slots=True)
class Atom:
    """A symbol by its name; ``order`` counts the dots of a coordinate."""

    name: str
    order: int
    latex: str | None
    traits: Traits = field(compare=False)


@dataclass(frozen=True, slots=True)
class Term:
    """A signed node."""

    negative: bool
    node: Node


@dataclass(frozen=True, slots=True)
class Sum:
    """Terms in order; a single one if it stands for a negative expression."""

    terms: tuple[Term, ...]
    traits: Traits = field(compare=False)


@dataclass(frozen=True, slots=True)
class Product:
    """Two or more factors in order; none is a product, a fraction or negative."""

    factors: tuple[Node, ...]
    traits: Traits = field(compare=False)


@dataclass(frozen=True, slots=True)
class Fraction:
    """``numerator / denominator``; neither is itself a fraction."""

    numerator: Node
    denominator: Node
    traits: Traits = field(compare=False)


@dataclass(frozen=True, slots=True)
class Power:
    """``base ^ exponent``; the exponent is a positive rational or any other expression."""

    base: Node
    exponent: Node
    traits: Traits = field(compare=False)


@dataclass(frozen=True, slots=True)
class Root:
    """A square root."""

    radicand: Node
    traits: Traits = field(compare=False)


@dataclass(frozen=True, slots=True)
class Call:
    """A function of the scene language."""

    function: str
    arguments: tuple[Node, ...]
    traits: Traits = field(compare=False)


Node: TypeAlias = Number | Pi | Atom | Sum | Product | Fraction | Power | Root | Call


def as_terms(node: Node) -> tuple[Term, ...]:
    """The terms of a sum, or the node as the only term."""
    return node.terms if isinstance(node, Sum) else (Term(False, node),)


def factors_of(node: Node) -> tuple[Node, ...]:
    """The factors of a product, or the node as the only factor."""
    return node.factors if isinstance(node, Product) else (node,)
