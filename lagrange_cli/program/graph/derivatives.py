"""Values of a graph over any numbers, and its derivatives in forward mode with sparse tangents.

Each node carries the derivatives by those inputs alone that it depends on, so that the work
grows with the numbers that are not zero; every derivative is a value of the same graph, and
shares what it can with the values themselves (Griewank and Walther, *Evaluating Derivatives*,
2nd ed., ch. 3 and 7).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.program.graph.operands import Coefficient
from lagrange_cli.program.graph.schedule import order_of
from lagrange_cli.program.graph.value_graph import (
    ONE,
    CallNode,
    InputNode,
    ProductNode,
    ScaledNode,
    SumNode,
    ValueGraph,
)

Tangent: TypeAlias = "Mapping[int, ScaledNode]"
"""Number of a direction → derivative along it, of those that are not zero."""

UNIT: ScaledNode = (1, ONE)


def derivatives(
    values: ValueGraph, wanted: Sequence[ScaledNode], seeds: Mapping[int, Tangent]
) -> list[Tangent]:
    """Differentiate values along directions.

    Where a function has a kink its derivative is the mean of both sides, and a jump has none.

    Parameters
    ----------
    wanted
        Values of the graph.
    seeds
        Derivatives of input nodes; all others are constants.

    Raises
    ------
    InternalError
        A function has no derivative here.
    """
    tangents = dict(seeds)
    for number in order_of(values, [number for _, number in wanted]):
        if number not in tangents:
            tangents[number] = _tangent(values, number, tangents)
    return [
        {by: scaled(value, coefficient) for by, value in tangents[number].items()}
        for coefficient, number in wanted
    ]


def scaled(value: ScaledNode, by: Coefficient) -> ScaledNode:
    """Return a value times a number."""
    return value[0] * by, value[1] if by else ONE


def _tangent(values: ValueGraph, number: int, tangents: Mapping[int, Tangent]) -> Tangent:
    """Differentiate a node whose parts are differentiated."""
    node = values.nodes[number]
    if isinstance(node, InputNode):
        return {}
    if isinstance(node, SumNode):
        return _added(values, [(c, tangents[part]) for part, c in node.terms])
    if isinstance(node, ProductNode):
        moving = [(part, e) for part, e in node.factors if tangents[part]]
        slopes = [(_without_one(node, part, values), tangents[part]) for part, _ in moving]
        return _combined(values, slopes)
    if not any(tangents[part] for part in node.arguments):
        return {}
    slopes_of = SLOPES.get(node.function)
    if slopes_of is None:
        message = f"the function {node.function} has no derivative in emitted code"
        raise InternalError(Problem(message, rule="unprintable"))
    arguments: list[ScaledNode] = [(1, part) for part in node.arguments]
    by_argument = slopes_of(values, (1, number), *arguments)
    parts = zip(by_argument, node.arguments, strict=True)
    return _combined(values, [(slope, tangents[part]) for slope, part in parts])


def _without_one(node: ProductNode, part: int, values: ValueGraph) -> ScaledNode:
    """Differentiate a product by one of its factors."""
    exponent = dict(node.factors)[part]
    factors = [((1, n), e - (n == part)) for n, e in node.factors]
    coefficient, number = values.multiply(factors)
    return coefficient * exponent, number


def _combined(values: ValueGraph, slopes: Sequence[tuple[ScaledNode, Tangent]]) -> Tangent:
    """Return Σ slope·tangent."""
    terms: dict[int, list[ScaledNode]] = {}
    for slope, tangent in slopes:
        if slope[0]:
            for by, value in tangent.items():
                terms.setdefault(by, []).append(product(values, slope, value))
    sums = {by: values.add(parts) for by, parts in terms.items()}
    return {by: value for by, value in sums.items() if value[0]}


def _added(values: ValueGraph, terms: Sequence[tuple[Coefficient, Tangent]]) -> Tangent:
    """Return Σ number·tangent; a derivative of one term alone is as it is."""
    parts: dict[int, list[ScaledNode]] = {}
    for coefficient, tangent in terms:
        for by, value in tangent.items():
            parts.setdefault(by, []).append(scaled(value, coefficient))
    sums = {
        by: summands[0] if len(summands) == 1 else values.add(summands)
        for by, summands in parts.items()
    }
    return {by: value for by, value in sums.items() if value[0]}


def product(values: ValueGraph, *factors: ScaledNode) -> ScaledNode:
    """Multiply values; products among them become one flat product."""
    flat: list[tuple[ScaledNode, int]] = []
    for coefficient, number in factors:
        node = values.nodes[number]
        flat.append(((coefficient, ONE), 1))
        if isinstance(node, ProductNode):
            flat.extend(((1, base), exponent) for base, exponent in node.factors)
        else:
            flat.append(((1, number), 1))
    return values.multiply(flat)


_Slopes: TypeAlias = "Callable[..., tuple[ScaledNode, ...]]"
"""(graph, value of the function, its arguments) → derivative by each argument."""


def _of_one(slope: Callable[[ValueGraph, ScaledNode, ScaledNode], ScaledNode]) -> _Slopes:
    return lambda values, f, x: (slope(values, f, x),)


def _quadratic(g: ValueGraph, x: ScaledNode, constant: int, square: int) -> ScaledNode:
    """constant + square·x²."""
    coefficient, number = product(g, x, x)
    return g.add([(Fraction(constant), ONE), (square * coefficient, number)])


def _inverse(g: ValueGraph, x: ScaledNode) -> ScaledNode:
    return g.multiply([(x, -1)])


def _inverse_root(g: ValueGraph, x: ScaledNode) -> ScaledNode:
    """1/√x."""
    return _inverse(g, g.call("sqrt", x))


def _from_one(g: ValueGraph, x: ScaledNode, sign: int) -> ScaledNode:
    """sign·(1 − x²), by factors that keep their digits near 1."""
    minus = -1
    first, second = ((UNIT, scaled(x, minus)), (UNIT, x))
    if sign < 0:
        first = ((minus, ONE), x)
    return product(g, g.add(first), g.add(second))


def _atan2(
    g: ValueGraph, f: ScaledNode, y: ScaledNode, x: ScaledNode
) -> tuple[ScaledNode, ScaledNode]:
    square = g.add([product(g, x, x), product(g, y, y)])
    by_y = g.multiply([(x, 1), (square, -1)])
    return by_y, scaled(g.multiply([(y, 1), (square, -1)]), -1)


def _power(
    g: ValueGraph, f: ScaledNode, x: ScaledNode, a: ScaledNode
) -> tuple[ScaledNode, ScaledNode]:
    lower = g.call("pow", x, g.add([a, (-1, ONE)]))
    return g.multiply([(a, 1), (lower, 1)]), g.multiply([(f, 1), (g.call("log", x), 1)])


def _extremum(sign: int) -> _Slopes:
    """max(a, b) = (a + b + |a − b|)/2, min with a minus."""

    def slopes(
        g: ValueGraph, f: ScaledNode, a: ScaledNode, b: ScaledNode
    ) -> tuple[ScaledNode, ScaledNode]:
        side = g.call("sign", g.add([a, scaled(b, -1)]))
        half = Fraction(1, 2)
        first = g.add([(half, ONE), scaled(side, sign * half)])
        return first, g.add([(half, ONE), scaled(side, -sign * half)])

    return slopes


#: Function of a program → the derivatives by its arguments.
SLOPES: dict[str, _Slopes] = {
    "sin": _of_one(lambda g, f, x: g.call("cos", x)),
    "cos": _of_one(lambda g, f, x: scaled(g.call("sin", x), -1)),
    "tan": _of_one(lambda g, f, x: _quadratic(g, f, 1, 1)),
    "asin": _of_one(lambda g, f, x: _inverse_root(g, _from_one(g, x, 1))),
    "acos": _of_one(lambda g, f, x: scaled(_inverse_root(g, _from_one(g, x, 1)), -1)),
    "atan": _of_one(lambda g, f, x: _inverse(g, _quadratic(g, x, 1, 1))),
    "sinh": _of_one(lambda g, f, x: g.call("cosh", x)),
    "cosh": _of_one(lambda g, f, x: g.call("sinh", x)),
    "tanh": _of_one(lambda g, f, x: _quadratic(g, f, 1, -1)),
    "asinh": _of_one(lambda g, f, x: _inverse_root(g, _quadratic(g, x, 1, 1))),
    "acosh": _of_one(lambda g, f, x: _inverse_root(g, _from_one(g, x, -1))),
    "atanh": _of_one(lambda g, f, x: _inverse(g, _from_one(g, x, 1))),
    "exp": _of_one(lambda g, f, x: f),
    "log": _of_one(lambda g, f, x: _inverse(g, x)),
    "sqrt": _of_one(lambda g, f, x: scaled(_inverse(g, f), Fraction(1, 2))),
    "abs": _of_one(lambda g, f, x: g.call("sign", x)),
    "sign": _of_one(lambda g, f, x: (0, ONE)),
    "atan2": _atan2,
    "pow": _power,
    "max": _extremum(1),
    "min": _extremum(-1),
}


def replaced(
    values: ValueGraph, wanted: Sequence[ScaledNode], known: Mapping[int, ScaledNode]
) -> list[ScaledNode]:
    """Put values in the place of input nodes."""
    new = dict(known)
    for number in order_of(values, [number for _, number in wanted]):
        if number not in new:
            new[number] = _rebuilt(values, number, new)
    return [scaled(new[number], coefficient) for coefficient, number in wanted]


def _rebuilt(values: ValueGraph, number: int, new: Mapping[int, ScaledNode]) -> ScaledNode:
    """Make a node of the new values of its parts."""
    node = values.nodes[number]
    if all(new[part] == (1, part) for part in values.parts(number)):
        return 1, number
    if isinstance(node, SumNode):
        return values.add(scaled(new[part], c) for part, c in node.terms)
    if isinstance(node, ProductNode):
        return values.multiply((new[part], exponent) for part, exponent in node.factors)
    assert isinstance(node, CallNode)
    return values.call(node.function, *(new[part] for part in node.arguments))
