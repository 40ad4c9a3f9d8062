"""Evaluation of expression trees, written against the tree's definition alone."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from lagrange_cli.scene.language.expression import Add, Call, Mul, Name, Neg, Node, Number, Pow


def value(
    node: Node,
    names: Mapping[str, Any],
    exact: bool = False,
    rate: Callable[[Node], Any] | None = None,
) -> Any:
    """Evaluate a tree; ``rate`` gives values of ``dot``."""

    def of(part: Node) -> Any:
        return value(part, names, exact, rate)

    match node:
        case Number():
            return node.value if exact else float(node.value)
        case Name():
            return math.pi if node.name == "pi" else names[node.name]
        case Neg():
            return -of(node.operand)
        case Pow():
            return of(node.base) ** of(node.exponent)
        case Add():
            total = 0
            for sign, term in node.terms:
                total = total + of(term) if sign == "+" else total - of(term)
            return total
        case Mul():
            product = 1
            for operator, factor in node.factors:
                product = product * of(factor) if operator == "*" else product / of(factor)
            return product
        case Call(function="dot") if rate is not None:
            return rate(node.arguments[0])
        case Call():
            function = math.hypot if node.function == "norm" else getattr(math, node.function)
            return function(*(of(argument) for argument in node.arguments))
