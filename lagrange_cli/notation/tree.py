"""The display tree: an expression as a person would write it.

A tree is ordered and unsigned: signs stand in the terms of sums, numbers are
not negative, and divisions are fractions. Printers walk it and decide nothing
about order. The ``traits`` of each node are for ordering (:class:`OrderTraits`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum, IntEnum
from typing import TypeAlias


class Dependence(IntEnum):
    """Dependence of an expression: that of the highest of its symbols."""

    NUMBER = 0
    PARAMETER = 1
    TIME = 2
    COORDINATE = 3
    VELOCITY = 4
    ACCELERATION = 5


class Role(Enum):
    """Role of a symbol that decides on its place in a product."""

    COUPLING = "G"
    MASS = "a mass"
    GRAVITY = "g"
    STRENGTH = "a factor of potentials or of dissipation alone, such as a stiffness"
    START = "a coordinate at the start"
    TRIGONOMETRIC = "an abbreviation of a trigonometric function"
    OTHER = "anything else"


@dataclass(frozen=True, slots=True)
class OrderTraits:
    """Traits of a node by which it is ordered.

    Attributes
    ----------
    level
        Highest dependence of its symbols.
    degree
        Lowest total degree in coordinates and time among its terms.
    functions
        Number of factors that are functions of these.
    text
        Canonical form in which symbols are their ranks, so that comparing texts compares by
        order of declaration and ties never depend on chance.
    """

    level: Dependence
    degree: float
    functions: float
    text: str


@dataclass(frozen=True, slots=True)
class DisplayNumber:
    """A rational number ≥ 0.

    Attributes
    ----------
    numerator, denominator
        Its parts, without a common factor.
    traits
        Traits for ordering.
    literal
        Decimal to show for it, None to show a fraction.
    """

    numerator: int
    denominator: int
    traits: OrderTraits = field(compare=False)
    literal: str | None = None


@dataclass(frozen=True, slots=True)
class DisplayPi:
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplaySymbol:
    """A symbol.

    Attributes
    ----------
    name
        Its name in the scene.
    order
        Number of dots over a coordinate.
    latex
        LaTeX that the scene gives for it, None if it gives none.
    traits
        Traits for ordering.
    role
        What it stands for.
    abbreviates
        True if the scene defines it by an expression.
    spelled
        True if the name is in the letters of the format that the tree is for.
    label
        A general formula or words in place of the name, which a writer puts into its letters
        before the tree is printed; None for most.
    """

    name: str
    order: int
    latex: str | None
    traits: OrderTraits = field(compare=False)
    role: Role = field(default=Role.OTHER, compare=False)
    abbreviates: bool = False
    spelled: bool = False
    label: object = None


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
    """A fraction.

    Attributes
    ----------
    numerator, denominator
        Its parts; neither is itself a fraction.
    traits
        Traits for ordering.
    """

    numerator: DisplayNode
    denominator: DisplayNode
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplayPower:
    """A power.

    Attributes
    ----------
    base
        Its base.
    exponent
        A positive rational number, or an expression that is not a number.
    traits
        Traits for ordering.
    """

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
    """A call of a function.

    Attributes
    ----------
    function
        Its name in the scene language.
    arguments
        Its arguments, in order.
    traits
        Traits for ordering.
    order
        Number of derivatives of a function of the scene; None for those of the language.
    latex
        Text that a function of the scene prints as; None for that of its name.
    """

    function: str
    arguments: tuple[DisplayNode, ...]
    traits: OrderTraits = field(compare=False)
    order: int | None = None
    latex: str | None = None


@dataclass(frozen=True, slots=True)
class DisplayRange:
    """The values of an index.

    Attributes
    ----------
    letter
        The index.
    first, last
        Its ends, as ``n-1``.
    besides
        An outer index that it is not equal to, empty if it takes all values.
    after
        An outer index than which it is greater, where nothing else need be said; or empty.
    is_whole
        True if the ends are those of all elements, so that an exception alone need be said.
    """

    letter: str
    first: str
    last: str
    besides: str = ""
    after: str = ""
    is_whole: bool = False


@dataclass(frozen=True, slots=True)
class DisplaySeries:
    """A sum over indices, with Σ.

    Attributes
    ----------
    body
        What is summed.
    ranges
        The indices, the outermost first.
    traits
        Traits for ordering.
    """

    body: DisplayNode
    ranges: tuple[DisplayRange, ...]
    traits: OrderTraits = field(compare=False)


@dataclass(frozen=True, slots=True)
class DisplayRate:
    """The time derivative of a quantity that is not carried out: ``d/dt (p)``."""

    quantity: DisplayNode
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
    | DisplaySeries
    | DisplayRate
)


def as_terms(node: DisplayNode) -> tuple[SignedNode, ...]:
    """Return the terms of a sum, or the node as the only term."""
    return node.terms if isinstance(node, DisplaySum) else (SignedNode(False, node),)


def factors_of(node: DisplayNode) -> tuple[DisplayNode, ...]:
    """Return the factors of a product, or the node as the only factor."""
    return node.factors if isinstance(node, DisplayProduct) else (node,)


def abbreviations_in(node: DisplayNode) -> set[str]:
    """Return names of the abbreviations in a tree."""
    if isinstance(node, DisplaySymbol):
        return {node.name} if node.abbreviates else set()
    return {name for child in _children(node) for name in abbreviations_in(child)}


def _children(node: DisplayNode) -> tuple[DisplayNode, ...]:
    match node:
        case DisplaySum():
            return tuple(t.node for t in node.terms)
        case DisplayProduct():
            return node.factors
        case DisplayFraction():
            return (node.numerator, node.denominator)
        case DisplayPower():
            return (node.base, node.exponent)
        case DisplayRoot():
            return (node.radicand,)
        case DisplaySeries():
            return (node.body,)
        case DisplayRate():
            return (node.quantity,)
        case DisplayCall():
            return node.arguments
        case _:
            return ()


def with_symbols(
    node: DisplayNode, change: Callable[[DisplaySymbol], DisplaySymbol]
) -> DisplayNode:
    """Return a tree with each symbol changed."""

    def changed(child: DisplayNode) -> DisplayNode:
        return with_symbols(child, change)

    match node:
        case DisplaySymbol():
            return change(node)
        case DisplaySum(terms):
            return replace(node, terms=tuple(replace(t, node=changed(t.node)) for t in terms))
        case DisplayProduct(factors):
            return replace(node, factors=tuple(map(changed, factors)))
        case DisplayCall(_, arguments):
            return replace(node, arguments=tuple(map(changed, arguments)))
        case DisplayFraction(numerator, denominator):
            return replace(node, numerator=changed(numerator), denominator=changed(denominator))
        case DisplayPower(base, exponent):
            return replace(node, base=changed(base), exponent=changed(exponent))
        case DisplayRoot(radicand):
            return replace(node, radicand=changed(radicand))
        case DisplaySeries(body):
            return replace(node, body=changed(body))
        case DisplayRate(quantity):
            return replace(node, quantity=changed(quantity))
        case _:
            return node


def is_rate(node: DisplayCall) -> bool:
    """Tell whether a function is the first or second derivative of one of the time: ``Ẋ``."""
    (argument, *others) = node.arguments
    return (
        node.order in (1, 2)
        and not others
        and isinstance(argument, DisplaySymbol)
        and argument.name == "t"
        and argument.traits.level == Dependence.TIME
    )
