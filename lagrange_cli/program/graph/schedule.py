"""Values → statements: each shared part gets a name, after those that it needs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from lagrange_cli.program.graph import value_graph as graph
from lagrange_cli.program.graph.common_subexpressions import (
    share_products,
    share_scaled,
    share_sums,
)
from lagrange_cli.program.graph.factoring import factor_sums
from lagrange_cli.program.graph.operands import (
    Coefficient,
    Constant,
    FunctionCall,
    Operand,
    Product,
    Sum,
    Variable,
)
from lagrange_cli.program.graph.statement_groups import (
    Assignment,
    grouped_by_shape,
    in_canonical_order,
)
from lagrange_cli.program.graph.value_graph import ONE, ScaledNode, ValueGraph

#: An expression with more leaves than this gets a name of its own.
_LARGEST_INLINE = 12

#: The terms of a sum with more terms than this get names of their own.
_LONGEST_INLINE_SUM = 20

#: A program of more statements has those of one shape brought together.
LARGEST_IN_ORDER = 100

#: Sums with more terms than this are added up in groups.
LONGEST_SUM = 24

_Assignments: TypeAlias = tuple[Assignment, ...]
_Results: TypeAlias = tuple[tuple[str, tuple[Operand, ...]], ...]


def schedule(
    values: ValueGraph, wanted: list[tuple[str, list[ScaledNode]]]
) -> tuple[_Assignments, _Results]:
    """Order the nodes that ``wanted`` needs and write them as assignments.

    Returns the assignments, and the operands of each of ``wanted`` by name. Statements of one shape
    are not brought together yet (:func:`in_families`).
    """
    scaled = [value for _, nodes in wanted for value in nodes]
    roots = [number for _, number in scaled]
    share_products(values, reachable_from(values, roots))
    order = order_of(values, roots)
    if factor_sums(values, order):
        order = order_of(values, roots)
        share_products(values, order)
    share_sums(values, order)  # sharing products makes no sums: `order` still has them all
    scaled = share_scaled(values, reachable_from(values, roots), scaled)
    roots = [number for _, number in scaled]
    _split_long_sums(values)
    order = order_of(values, roots)
    uses = _count_uses(values, order, roots)
    writer = _Writer(values)
    for number in order:
        writer.write(number, uses[number])
    operands = iter([writer.scaled(*value) for value in scaled])
    results = tuple((name, tuple(next(operands) for _ in nodes)) for name, nodes in wanted)
    return tuple(writer.assignments), results


def in_families(assignments: _Assignments, results: _Results) -> tuple[_Assignments, _Results]:
    """Group statements of one shape where there are many, and name them in the new order."""
    if len(assignments) + sum(len(operands) for _, operands in results) <= LARGEST_IN_ORDER:
        return assignments, results
    grouped, new = grouped_by_shape(assignments)
    return tuple(grouped), tuple(
        (name, tuple([in_canonical_order(operand, new) for operand in operands]))
        for name, operands in results
    )


def reachable_from(values: ValueGraph, roots: Iterable[int]) -> set[int]:
    """Return every node that the roots need, unordered."""
    nodes, reached = values.nodes, set(roots)
    stack = list(reached)
    while stack:
        new = [part for part in nodes[stack.pop()].parts if part not in reached]
        reached.update(new)
        stack += new
    return reached


def order_of(values: ValueGraph, roots: Iterable[int]) -> list[int]:
    """List every node that the roots need, parts first, in the order of first need."""
    order: list[int] = []
    entered: set[int] = set()
    nodes = values.nodes
    stack = list(roots)[::-1]
    while stack:
        number = stack.pop()
        if number < 0:  # ~number says that all parts of the node are listed
            order.append(~number)
        elif number not in entered:
            entered.add(number)
            stack.append(~number)
            parts = nodes[number].parts[::-1]
            stack += [part for part in parts if part not in entered]
    return order


def _split_long_sums(values: ValueGraph) -> None:
    """Replace sums of many terms by sums of sums: shallow trees, and less rounding."""
    for number in range(len(values.nodes)):
        node = values.nodes[number]
        while isinstance(node, graph.SumNode) and len(node.terms) > LONGEST_SUM:
            groups = []
            for start in range(0, len(node.terms), LONGEST_SUM):
                part = node.terms[start : start + LONGEST_SUM]
                rank = max(values.rank[n] for n, _ in part)
                groups.append((values.intern(graph.SumNode(part), rank), 1))
            node = values.nodes[number] = graph.SumNode(tuple(groups))


def _count_uses(values: ValueGraph, order: list[int], roots: list[int]) -> dict[int, int]:
    uses = dict.fromkeys(order, 0)
    for root in roots:
        uses[root] += 1
    for number in order:
        node = values.nodes[number]
        if isinstance(node, graph.ProductNode):
            for part, exponent in node.factors:
                uses[part] += abs(exponent)
        else:
            for part in values.parts(number):
                uses[part] += 1
    return uses


class _Writer:
    """Turns nodes into operands, naming those that are used twice or large."""

    def __init__(self, values: ValueGraph) -> None:
        self.values = values
        self.assignments: list[tuple[str, Operand]] = []
        self.operands: dict[int, Operand] = {ONE: Constant(1)}
        self.sizes: dict[int, int] = {ONE: 1}

    def write(self, number: int, uses: int) -> None:
        """Write a node whose parts are written."""
        node = self.values.nodes[number]
        if number == ONE:
            return
        if isinstance(node, graph.InputNode):
            operand: Operand = Variable(node.name)
            size = 1
        else:
            operand = self._operand(node)
            size = sum(self.sizes[part] for part in self.values.parts(number))
        if uses > 1 or size > _LARGEST_INLINE:
            operand, size = self._named(operand), 1
        self.operands[number] = operand
        self.sizes[number] = size

    def _named(self, operand: Operand) -> Operand:
        """Name an operand, unless it is a name or a number already."""
        if isinstance(operand, Variable | Constant):
            return operand
        name = f"w{len(self.assignments)}"
        self.assignments.append((name, operand))
        return Variable(name)

    def scaled(self, coefficient: Coefficient, number: int) -> Operand:
        """A coefficient times a written node."""
        operand = self.operands[number]
        if number == ONE:
            return Constant(coefficient)
        if coefficient == 1:
            return operand
        if isinstance(operand, Sum) and coefficient == -1:
            return Sum(tuple((-c, o) for c, o in operand.terms))
        return Sum(((coefficient, operand),))

    def _operand(self, node: graph.SumNode | graph.ProductNode | graph.CallNode) -> Operand:
        operands = self.operands
        if isinstance(node, graph.CallNode):
            return FunctionCall(node.function, tuple(operands[a] for a in node.arguments))
        if isinstance(node, graph.ProductNode):
            return self._product(node)
        if len(node.terms) == 1:
            ((number, coefficient),) = node.terms
            return self.scaled(coefficient, number)
        # A sum starts with a positive term where it has one.
        terms = sorted(node.terms, key=lambda term: term[1] < 0)
        if len(terms) > _LONGEST_INLINE_SUM:
            return Sum(tuple((c, self._named(operands[n])) for n, c in terms))
        return Sum(tuple((c, operands[n]) for n, c in terms)) if terms else Constant(0)

    def _product(self, node: graph.ProductNode) -> Operand:
        numerator: list[Operand] = []
        denominator: list[Operand] = []
        for number, exponent in node.factors:
            side = numerator if exponent > 0 else denominator
            side.extend([self.operands[number]] * abs(exponent))
        if len(numerator) == 1 and not denominator:
            return numerator[0]
        return Product(tuple(numerator), tuple(denominator))
