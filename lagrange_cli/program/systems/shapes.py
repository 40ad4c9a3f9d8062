"""Shapes of expressions: one for all that differ only in the inputs they read.

A chain of a thousand links has a thousand closures of one shape. Each shape is turned into
statements once, and a loop runs them for all that have it.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import sympy

if TYPE_CHECKING:
    from collections.abc import Hashable

    from sympy import Expr

    from lagrange_cli.program.graph.operands import Cell

_COMMUTATIVE = (sympy.Add, sympy.Mul, sympy.Min, sympy.Max)

#: Fewest operations of a common part of several expressions that is computed once for all of them:
#: fewer operations are repeated in less time than a value is stored and fetched.
_FEWEST_SHARED = 4

#: Operations as which a function or a root counts.
_COSTLY = 10


ShapeAndLeaves: TypeAlias = "tuple[int, tuple[int, ...]]"
"""Number of a shape, and the leaves in its order, each as often as it stands there."""


class ShapeTable:
    """Numbers of shapes, and the leaves of expressions: inputs and values computed before."""

    def __init__(self, places: Mapping[Expr, Cell]) -> None:
        self.leaves: list[tuple[Expr, Cell]] = []
        self._numbers: dict[Hashable, int] = {}
        self._shapes: dict[Expr, ShapeAndLeaves] = {}
        self._known: set[Expr] = set()
        for expression, place in places.items():
            self.place(expression, place)

    def place(self, expression: Expr, place: Cell) -> None:
        """Make an expression a leaf whose value stands at a place."""
        self._shapes[expression] = self._number(place.array), (len(self.leaves),)
        self._known.add(expression)
        self.leaves.append((expression, place))

    def __contains__(self, expression: object) -> bool:
        """Tell whether an expression is a leaf."""
        return expression in self._known

    def shape(self, expression: Expr) -> ShapeAndLeaves:
        """Find the shape of an expression, and its leaves."""
        for part in _parts_first(expression, self._shapes):
            self._shapes[part] = self._shape(part)
        return self._shapes[expression]

    def _shape(self, expression: Expr) -> ShapeAndLeaves:
        if not expression.args:
            return self._number(expression), ()
        parts = [self._shapes[part] for part in expression.args]
        if isinstance(expression, _COMMUTATIVE):
            parts.sort()
        shape = (expression.func, tuple(shape for shape, _ in parts))
        return self._number(shape), tuple(leaf for _, leaves in parts for leaf in leaves)

    def _number(self, shape: Hashable) -> int:
        return self._numbers.setdefault(shape, len(self._numbers))


def joint_shape(shapes: Iterable[ShapeAndLeaves]) -> tuple[Hashable, tuple[int, ...]]:
    """Find the shape of several expressions together, and their leaves, each once."""
    numbers: dict[int, int] = {}
    joint = []
    for shape, leaves in shapes:
        joint.append((shape, *(numbers.setdefault(leaf, len(numbers)) for leaf in leaves)))
    return tuple(joint), tuple(numbers)


def _parts_first(expression: Expr, known: Container[Expr]) -> Iterator[Expr]:
    """Yield the unknown parts of an expression, parts before wholes."""
    stack = [expression]
    done = set()
    while stack:
        top = stack[-1]
        missing = [a for a in top.args if a not in known and a not in done]
        if top in known or top in done:
            stack.pop()
        elif missing:
            stack.extend(reversed(missing))
        else:
            done.add(stack.pop())
            yield top


def shared_parts(
    groups: Sequence[Sequence[Expr]], known: Container[Expr], longest: int
) -> list[Expr]:
    """List common parts of several groups that are computed once, parts before wholes.

    Sums of more than ``longest`` terms are among them.
    """
    order: list[Expr] = []
    seen: set[Expr] = set()
    for group in groups:
        for expression in group:
            for part in _parts_first(expression, _Either(known, seen)):
                seen.add(part)
                order.append(part)
    owners = _Owners(known)
    for number, group in enumerate(groups):
        for expression in group:
            owners.give(expression, number)
    costs = _costs(order, known)
    shared: list[Expr] = []
    for part in reversed(order):
        long = isinstance(part, sympy.Add) and len(part.args) > longest
        several = (
            owners.sole[part] is None and costs[part] >= _FEWEST_SHARED and not _is_multiple(part)
        )
        if part.args and (long or several):
            owners.sole[part] = len(groups) + len(shared)
            shared.append(part)
        for argument in part.args:
            owners.give(argument, owners.sole[part])
    return shared[::-1]


class _Either(NamedTuple):
    """The union of two containers."""

    first: Container[Expr]
    second: Container[Expr]

    def __contains__(self, expression: object) -> bool:
        return expression in self.first or expression in self.second


class _Owners:
    """The number of the one group that holds each expression; None if several do."""

    def __init__(self, known: Container[Expr]) -> None:
        self.known = known
        self.sole: dict[Expr, int | None] = {}

    def give(self, expression: Expr, owner: int | None) -> None:
        if expression not in self.known and self.sole.setdefault(expression, owner) != owner:
            self.sole[expression] = None


def _is_multiple(expression: Expr) -> bool:
    """Tell whether an expression is a number times another one, which is then shared instead."""
    return (
        isinstance(expression, sympy.Mul)
        and len(expression.args) == 2
        and (expression.args[0].is_Number)
    )


def _costs(order: Iterable[Expr], known: Container[Expr]) -> dict[Expr, int]:
    """Approximate number of operations of each expression, all its parts included."""
    costs: dict[Expr, int] = {}
    for part in order:
        inner = sum(costs.get(a, 0) for a in part.args if a not in known)
        costs[part] = inner + _own_cost(part)
    return costs


def _own_cost(expression: Expr) -> int:
    if isinstance(expression, (sympy.Add, sympy.Mul)):
        return len(expression.args) - 1
    if expression.is_Pow and expression.exp.is_Integer:
        return max(1, abs(int(expression.exp)) - 1) * (1 if expression.exp > 0 else 4)
    return _COSTLY if expression.args else 0
