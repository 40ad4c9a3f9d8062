"""Values of a graph in numbers of any type, by steps that are listed once for many evaluations."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from lagrange_cli.program.graph.schedule import order_of
from lagrange_cli.program.graph.value_graph import (
    ONE,
    InputNode,
    ProductNode,
    ScaledNode,
    SumNode,
    ValueGraph,
)

if TYPE_CHECKING:
    from lagrange_cli.program.graph.operands import Coefficient

#: Of a term the place of its coefficient, -1 for 1, and that of its value.
_Terms: TypeAlias = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Arithmetic:
    """Operations on numbers of a type.

    Attributes
    ----------
    functions
        Function of a program → the same function for these numbers.
    number
        Makes a number of a coefficient.
    add, multiply, divide, power
        The operations; powers have integer exponents above 1.
    """

    functions: Mapping[str, Callable[..., Any]]
    number: Callable[[Coefficient], Any]
    add: Callable[[Any, Any], Any] = operator.add
    multiply: Callable[[Any, Any], Any] = operator.mul
    divide: Callable[[Any, Any], Any] = operator.truediv
    power: Callable[[Any, int], Any] = operator.pow


class Evaluation:
    """The steps of an evaluation: products that begin alike are multiplied once.

    Parameters
    ----------
    values, wanted
        The graph, and its values that are wanted.
    """

    def __init__(self, values: ValueGraph, wanted: Sequence[ScaledNode]) -> None:
        self._coefficients: dict[Coefficient, int] = {}
        #: What a step does, and on the values of which places: each makes the value of the next.
        self._steps: list[tuple[str, Any]] = []
        self._made: dict[tuple[str, Any], int] = {}
        self._places = {ONE: 0}
        for number in order_of(values, [n for _, n in wanted]):
            if number != ONE:
                self._places[number] = self._place(values, number)
        self._wanted = self._terms(wanted)

    def _place(self, values: ValueGraph, number: int) -> int:
        node = values.nodes[number]
        if isinstance(node, InputNode):
            return self._step("input", node.name)
        if isinstance(node, SumNode):
            return self._step("sum", self._terms([(c, part) for part, c in node.terms]))
        if isinstance(node, ProductNode):
            return self._product(node)
        return self._step(node.function, tuple(self._places[part] for part in node.arguments))

    def _product(self, node: ProductNode) -> int:
        result: int | None = None
        for part, exponent in node.factors:
            power, size = self._places[part], abs(exponent)
            if size > 1:
                power = self._step("power", (power, size))
            if exponent < 0:
                result = self._step("quotient", (0 if result is None else result, power))
            else:
                result = power if result is None else self._step("product", (result, power))
        assert result is not None
        return result

    def _step(self, kind: str, data: Any) -> int:
        """Add a step, or find the same one."""
        if (kind, data) not in self._made:
            self._steps.append((kind, data))
            self._made[kind, data] = len(self._steps)
        return self._made[kind, data]

    def _terms(self, terms: Sequence[ScaledNode]) -> _Terms:
        return tuple((self._coefficient(c), self._places[part]) for c, part in terms)

    def _coefficient(self, coefficient: Coefficient) -> int:
        if coefficient == 1:
            return -1
        return self._coefficients.setdefault(coefficient, len(self._coefficients))

    def at(self, inputs: Mapping[str, Any], arithmetic: Arithmetic) -> list[Any]:
        """Evaluate what is wanted.

        ``inputs``: name of each input that is needed → its value.
        """
        constants = [arithmetic.number(c) for c in self._coefficients]
        known = [arithmetic.number(1)]
        functions, multiply = arithmetic.functions, arithmetic.multiply
        for kind, data in self._steps:
            if kind == "product":
                value = multiply(known[data[0]], known[data[1]])
            elif kind == "sum":
                value = _sum(data, known, constants, arithmetic)
            elif kind == "quotient":
                value = arithmetic.divide(known[data[0]], known[data[1]])
            elif kind == "power":
                value = arithmetic.power(known[data[0]], data[1])
            elif kind == "input":
                value = inputs[data]
            else:
                value = functions[kind](*[known[part] for part in data])
            known.append(value)
        return [_sum((term,), known, constants, arithmetic) for term in self._wanted]


def _sum(terms: _Terms, known: list[Any], constants: list[Any], arithmetic: Arithmetic) -> Any:
    add, multiply, total = arithmetic.add, arithmetic.multiply, None
    for coefficient, part in terms:
        if coefficient < 0:
            term = known[part]
        elif part == 0:
            term = constants[coefficient]
        else:
            term = multiply(constants[coefficient], known[part])
        total = term if total is None else add(total, term)
    return total
