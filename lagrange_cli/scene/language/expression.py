"""The syntax tree of the scene language's expressions.

The tree holds what was written, with the place of every part; it knows
nothing of SymPy. Sums and products are flat, so that a sum of ten thousand
terms is no deeper than one of two.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal, TypeAlias

from lagrange_cli.errors import Mark

#: Functions of the language with the number of arguments each takes (None: one or more).
FUNCTIONS: dict[str, int | None] = {
    **dict.fromkeys(("sin", "cos", "tan", "asin", "acos", "atan"), 1),
    **dict.fromkeys(("sinh", "cosh", "tanh", "asinh", "acosh", "atanh"), 1),
    **dict.fromkeys(("exp", "log", "sqrt", "abs", "sign", "heaviside"), 1),
    "atan2": 2,
    "min": None,
    "max": None,
    "norm": None,
    "piecewise": None,
    "dot": 1,
    "ddot": 1,
}

#: Functions that take derivatives with respect to time, with the number of them.
TIME_DERIVATIVES = {"dot": 1, "ddot": 2}

#: Components of the angular velocity of a body or frame, in space and along its own axes:
#: ``omega_x(top)`` is a name, whose argument is no value.
ANGULAR_VELOCITIES = ("omega_x", "omega_y", "omega_z", "omega_1", "omega_2", "omega_3")

#: A sum over ranges, until it is written out: ``Call(SUM, (body, range, ...))``.
SUM = "sum"
#: Values under conditions: ``Call(PIECEWISE, (piece, ..., otherwise))``. A piece ``[value, a < b]``
#: is ``Call("<", (value, a, b))``.
PIECEWISE = "piecewise"
#: Relations in the condition of a piece.
CONDITIONS = (">=", ">", "<=", "<")
#: A range ``i=1..n``: ``Call(RANGE, (Name("i"), first, last))``.
RANGE = ".."

#: Names that a scene cannot declare.
RESERVED = frozenset(FUNCTIONS) | {"t", "pi", SUM}

Span: TypeAlias = tuple[int, int]
"""Start and end offset of a part within the expression's text."""


@dataclass(frozen=True, slots=True)
class Number:
    """A literal.

    Attributes
    ----------
    value
        Its exact value.
    text
        As it was written.
    span
        Its place in the text.
    """

    value: Fraction
    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class Name:
    """A name, ``pi`` and ``t`` included.

    Attributes
    ----------
    name
        The name without indices; of an element that is written out, ``x[3]``.
    span
        Its place in the text.
    indices
        Indices of a family's element as written, as in ``x[i-1]``.
    """

    name: str
    span: Span
    indices: tuple[Node, ...] = ()


@dataclass(frozen=True, slots=True)
class Neg:
    operand: Node
    span: Span


@dataclass(frozen=True, slots=True)
class Add:
    """A flat sum; each term comes with its sign."""

    terms: tuple[tuple[Literal["+", "-"], Node], ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Mul:
    """A flat product; each factor multiplies or divides what stands before it."""

    factors: tuple[tuple[Literal["*", "/"], Node], ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Pow:
    """A power.

    Attributes
    ----------
    base, exponent
        Its two parts.
    span
        Its place in the text.
    """

    base: Node
    exponent: Node
    span: Span


@dataclass(frozen=True, slots=True)
class Call:
    """A call of a function; before families are written out, also a sum or a range.

    Attributes
    ----------
    function
        One of :data:`FUNCTIONS`, :data:`SUM` or :data:`RANGE`, or a function of the scene, with a
        prime for each derivative.
    arguments
        Its arguments, in order.
    span
        Its place in the text.
    """

    function: str
    arguments: tuple[Node, ...]
    span: Span


Relation: TypeAlias = Literal["=", ">=", "<="]

Node: TypeAlias = Number | Name | Neg | Add | Mul | Pow | Call


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression with its text and the place where the text begins.

    Attributes
    ----------
    node
        Its syntax tree.
    text
        Its text; in that of a family's element the indices have their values.
    origin
        Its place in the file.
    exact
        True if spans of its parts are offsets in that line. They are not in block scalars and in
        quoted scalars with escapes, whose parts are reported at ``origin``.
    """

    node: Node
    text: str
    origin: Mark
    exact: bool = True

    def mark(self, span: Span | None = None) -> Mark:
        """Return the place of a part of the expression, or of the whole."""
        if not self.exact or span is None:
            return self.origin
        start, end = span
        return replace(self.origin, column=self.origin.column + start, length=max(1, end - start))


@dataclass(frozen=True, slots=True)
class Equation:
    """``left = right``, or an inequality, as written.

    Attributes
    ----------
    left, right
        Its sides, which share its text and origin.
    text
        Its text.
    origin
        Its place in the file.
    relation
        The sign between the sides.
    """

    left: Expression
    right: Expression
    text: str
    origin: Mark
    relation: Relation = "="

    def mark(self) -> Mark:
        return self.origin


def own_function(call: str) -> str:
    """Return the name of a scene's own function, without the primes of a derivative."""
    return call.rstrip("'")


def children(node: Node) -> tuple[Node, ...]:
    """Return the parts directly below a node, in reading order."""
    if isinstance(node, Number):
        return ()
    if isinstance(node, Name):
        return node.indices
    if isinstance(node, Add):
        return tuple(part for _, part in node.terms)
    if isinstance(node, Mul):
        return tuple(part for _, part in node.factors)
    if isinstance(node, Pow):
        return (node.base, node.exponent)
    if isinstance(node, Neg):
        return (node.operand,)
    return node.arguments


def walk(node: Node) -> Iterator[Node]:
    """Yield a node and all below it, parents first."""
    stack: list[Node] = [node]
    while stack:
        top = stack.pop()
        yield top
        below = children(top)
        if below:
            stack.extend(below[::-1])


def names_in(node: Node) -> list[Name]:
    """Return all names of a tree, in reading order."""
    return [n for n in walk(node) if isinstance(n, Name)]
