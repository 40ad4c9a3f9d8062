"""Function → values, each once, in an order in which each needs earlier ones alone.

Loops are unrolled and numbers of arrays are values like all others. Operations have the order that
texts of languages have: from the left, with coefficients before the first factor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from lagrange_cli.program.graph.operands import (
    COUNTED,
    Coefficient,
    Constant,
    Element,
    FunctionCall,
    Operand,
    Product,
    Sum,
    Variable,
    array_named,
    cell_named,
    magnitude,
)
from lagrange_cli.program.lowered.functions import (
    EPSILON,
    RESULTS,
    For,
    Function,
    Let,
    LocalArray,
    Require,
    Scope,
    Solve,
    Step,
    Store,
    Total,
)


class Value(NamedTuple):
    """A leaf, or an operation on other values.

    Attributes
    ----------
    operation
        ``constant``, ``epsilon``; ``t`` and the arrays ``p``, ``u``, ``y``, ``given``; ``+ - * /``,
        ``negate`` or a function; ``solve`` and the ``item`` of a solution.
    operands
        Numbers of values; of a system they are its matrix by rows, then its right-hand side.
    which
        The constant; the index in an array or in a solution; the :class:`Solve`.
    """

    operation: str
    operands: tuple[int, ...] = ()
    which: Any = 0


_ONE, _ZERO = Constant(1), Constant(0)


class Values:
    """The values of a function.

    Attributes
    ----------
    values
        All values, those of operands first.
    results
        Numbers of the results.
    tests
        Pairs of which the first must be greater.
    """

    def __init__(self, function: Function) -> None:
        self.values: list[Value] = []
        self.tests: list[tuple[int, int]] = []
        self._function = function
        self._numbers: dict[Value, int] = {}
        self._names: dict[str, int] = {}
        self._arrays: dict[str, dict[int, int]] = {RESULTS: {}}
        self._run(function.body, ())
        stored = self._arrays[RESULTS]
        self.results = [stored[k] for k in range(math.prod(function.shape))]

    def _value(self, operation: str, *operands: int, which: Any = 0) -> int:
        value = Value(operation, operands, which)
        number = self._numbers.get(value)
        if number is None:
            number = self._numbers[value] = len(self.values)
            self.values.append(value)
        return number

    # -- statements --------------------------------------------------------------

    def _run(self, body: Sequence[Step], counters: tuple[int, ...]) -> None:
        for step in body:
            if isinstance(step, Let):
                self._names[step.name] = self._operand(step.operand, counters)
            elif isinstance(step, Store):
                value = self._operand(step.operand, counters)
                self._arrays[step.target.name][_place(step.target, counters)] = value
            elif isinstance(step, For):
                for k in range(step.count.at(counters)):
                    self._run(step.body, (*counters, k))
            elif isinstance(step, Scope):
                self._run(step.body, counters)
            elif isinstance(step, LocalArray):
                self._arrays[step.name] = {}
            elif isinstance(step, Solve):
                self._solve(step)
            elif isinstance(step, Total):
                self._total(step)
            elif isinstance(step, Require):
                value, bound = (self._operand(o, counters) for o in (step.value, step.bound))
                self.tests.append((value, bound))

    def _total(self, step: Total) -> None:
        array, first = self._arrays[step.start.name], step.start.index.base
        total = array[first]
        for k in range(first + 1, first + step.count):
            total = self._value("+", total, array[k])
        array[first] = total

    def _solve(self, step: Solve) -> None:
        """Gather the whole matrix, solve, and name the numbers of the solution."""
        matrix, vector = step.arrays[:2]
        cells = self._arrays[matrix.name]
        right, first = self._arrays[vector.name], vector.index.base
        rows, columns = solution_shape(step)
        zero = self._operand(_ZERO, ())
        places, start = matrix_places(step), matrix.index.base
        if step.routine in ("banded", "sparse"):
            entries = [cells.get(start + k, zero) for k in places]
        else:
            # Of symmetric matrices one triangle is enough.
            mirrored = ((start + k, start + k % rows * rows + k // rows) for k in places)
            entries = [cells.get(k, cells.get(beyond, zero)) for k, beyond in mirrored]
        unknowns = [right[first + k] for k in range(rows * columns)]
        solved = self._value("solve", *entries, *unknowns, which=step)
        for k in range(rows * columns):
            right[first + k] = self._value("item", solved, which=k)

    # -- operands ----------------------------------------------------------------

    def _operand(self, operand: Operand, counters: tuple[int, ...]) -> int:
        if isinstance(operand, Constant):
            return self._value("constant", which=Fraction(operand.value))
        if isinstance(operand, Element):
            return self._element(operand, counters)
        if isinstance(operand, Variable):
            return self._variable(operand.name)
        if isinstance(operand, FunctionCall):
            arguments = [self._operand(argument, counters) for argument in operand.arguments]
            return self._value(operand.function, *arguments)
        if isinstance(operand, Product):
            return self._product(operand, counters)
        return self._sum(operand, counters)

    def _product(self, product: Product, counters: tuple[int, ...]) -> int:
        above = self._factors(product.numerator, counters)
        if not product.denominator:
            return above
        return self._value("/", above, self._factors(product.denominator, counters))

    def _factors(self, factors: Sequence[Operand], counters: tuple[int, ...]) -> int:
        first, *others = factors or (_ONE,)
        product = self._operand(first, counters)
        for factor in others:
            product = self._value("*", product, self._operand(factor, counters))
        return product

    def _sum(self, operand: Sum, counters: tuple[int, ...]) -> int:
        total: int | None = None
        for coefficient, part in operand.terms:
            term = self._operand(_scaled(magnitude(coefficient), part), counters)
            if total is not None:
                total = self._value("+" if coefficient > 0 else "-", total, term)
            else:
                total = term if coefficient > 0 else self._value("negate", term)
        assert total is not None
        return total

    def _element(self, element: Element, counters: tuple[int, ...]) -> int:
        place = _place(element, counters)
        if element.name == COUNTED:
            return self._value("constant", which=Fraction(place))
        if element.name in self._arrays:
            return self._arrays[element.name][place]
        return self._value(element.name, which=place)

    def _variable(self, name: str) -> int:
        if name in self._names:
            return self._names[name]
        if name == EPSILON:
            return self._value("epsilon")
        if name == "t":
            return self._value("t")
        letter, number = array_named(name), cell_named(name).number
        if letter in "qvz":
            return self._value("y", which=self._function.layout.place(letter, number))
        return self._value(letter, which=number)


def solution_shape(step: Solve) -> tuple[int, int]:
    """Return the numbers of rows and columns of a solution."""
    if step.routine == "columns":
        return step.sizes[1], step.sizes[2]
    return sum(step.sizes) if step.routine == "saddle" else step.sizes[0], 1


def matrix_places(step: Solve) -> range:
    """Return the places of the numbers that a routine is handed of a matrix."""
    rows, _ = solution_shape(step)
    if step.routine == "banded":
        return range(rows * (step.sizes[1] + 1))
    if step.routine == "sparse":
        node = step.tables[0]
        _, columns, height, start, _, _ = node[-6:]
        return range(start + columns * height)
    return range(rows * rows)


def _scaled(size: Coefficient, part: Operand) -> Operand:
    """Multiply by a coefficient, which stands before the first factor of a product."""
    if isinstance(part, Constant):
        return Constant(size * part.value)
    if size == 1:
        return part
    if isinstance(part, Product):
        return Product((Constant(size), *(part.numerator or (_ONE,))), part.denominator)
    return Product((Constant(size), part), ())


def _place(element: Element, counters: Sequence[int]) -> int:
    offset = element.table[counters[-1]] if element.table is not None else 0
    return element.index.at(counters) + offset
