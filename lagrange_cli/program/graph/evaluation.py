"""Values of a graph over any numbers: one walk, with the arithmetic of the numbers themselves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from lagrange_cli.program.graph.operands import Coefficient
from lagrange_cli.program.graph.schedule import order_of
from lagrange_cli.program.graph.value_graph import (
    ONE,
    InputNode,
    ProductNode,
    ScaledNode,
    SumNode,
    ValueGraph,
)


def evaluated(
    values: ValueGraph,
    wanted: Sequence[ScaledNode],
    inputs: Mapping[str, Any],
    functions: Mapping[str, Callable[..., Any]],
    number: Callable[[Coefficient], Any],
    order: Sequence[int] | None = None,
) -> list[Any]:
    """Evaluate values of a graph.

    Parameters
    ----------
    inputs
        Name of each input that is needed → its value, of any type with +, ·, / and integer powers.
    functions
        Function of a program → the same of that type.
    number
        Makes a number of that type.
    order
        The nodes that are needed, parts first, where values are found again and again; None to
        find them.
    """
    known: dict[int, Any] = {ONE: number(1)}

    def scaled(coefficient: Coefficient, part: int) -> Any:
        if part == ONE:
            return number(coefficient)
        return known[part] if coefficient == 1 else number(coefficient) * known[part]

    for node_number in order_of(values, [n for _, n in wanted]) if order is None else order:
        node = values.nodes[node_number]
        if node_number == ONE:
            continue
        if isinstance(node, InputNode):
            known[node_number] = inputs[node.name]
        elif isinstance(node, SumNode):
            first, *rest = (scaled(c, part) for part, c in node.terms)
            known[node_number] = sum(rest, first)
        elif isinstance(node, ProductNode):
            result = known[ONE]
            for part, exponent in node.factors:
                power = known[part] if abs(exponent) == 1 else known[part] ** abs(exponent)
                result = result * power if exponent > 0 else result / power
            known[node_number] = result
        else:
            arguments = (known[part] for part in node.arguments)
            known[node_number] = functions[node.function](*arguments)
    return [scaled(coefficient, node_number) for coefficient, node_number in wanted]
