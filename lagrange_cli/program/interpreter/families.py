"""Functions of large families through NumPy: a statement is an operation on whole arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from operator import mul
from typing import Any, TypeAlias

import numpy as np

from lagrange_cli.program.graph.operands import (
    Constant,
    Element,
    FunctionCall,
    Operand,
    Product,
    Sum,
    Variable,
)
from lagrange_cli.program.interpreter.solvers import solution
from lagrange_cli.program.interpreter.values import matrix_places, solution_shape
from lagrange_cli.program.lowered.functions import (
    RESULTS,
    For,
    Function,
    Let,
    LocalArray,
    Scope,
    Solve,
    Step,
    Store,
    Total,
    steps_in,
)

#: Members a loop above which NumPy is faster than closures of numbers.
MANY = 16

#: Functions that NumPy calls otherwise than a program.
_OTHERWISE = {
    **{f"a{name}": f"arc{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")},
    "atan2": "arctan2",
    "pow": "power",
    "min": "minimum",
    "max": "maximum",
}

#: Arrays and numbers by name.
_Names: TypeAlias = dict[str, Any]
_Evaluation: TypeAlias = Callable[[_Names], Any]
_Action: TypeAlias = Callable[[_Names], None]


def members_of(function: Function) -> float:
    """Return the members of a loop, on average; 0 without loops."""
    counts = [step.count.base for step in steps_in(function.body) if isinstance(step, For)]
    return sum(counts) / len(counts) if counts else 0.0


def with_numpy(function: Function) -> Callable[[Any, Any, Any, Any], Any]:
    """Return the function of t, y, p and u that gives the numbers of the results in a row."""
    actions = [action for step in function.body for action in _actions(step, 1)]
    size = int(np.prod(function.shape, dtype=int))

    def run(t: Any, y: Any, p: Any, u: Any) -> Any:
        names: _Names = {
            "t": t,
            "y": np.asarray(y, float),
            "p": np.asarray(p, float),
            "u": np.asarray(u, float),
            RESULTS: np.empty(size),
        }
        for action in actions:
            action(names)
        return names[RESULTS]

    return run


def _actions(step: Step, members: int) -> list[_Action]:
    if isinstance(step, Scope):
        return [action for inner in step.body for action in _actions(inner, members)]
    if isinstance(step, For):
        return [action for inner in step.body for action in _actions(inner, step.count.base)]
    if isinstance(step, LocalArray):
        return [_allocated(step)]
    if isinstance(step, Let):
        return [_named(step.name, _evaluation(step.operand, members))]
    if isinstance(step, Store):
        return [_stored(step.target.name, _index(step.target, members), step.operand, members)]
    if isinstance(step, Total):
        return [_summed(step)]
    return [_solved(step)] if isinstance(step, Solve) else []


def _allocated(step: LocalArray) -> _Action:
    def action(names: _Names) -> None:
        names[step.name] = np.empty(int(np.prod(step.shape)))

    return action


def _named(name: str, value: _Evaluation) -> _Action:
    def action(names: _Names) -> None:
        names[name] = value(names)

    return action


def _stored(array: str, index: Any, operand: Operand, members: int) -> _Action:
    value = _evaluation(operand, members)

    def action(names: _Names) -> None:
        names[array][index] = value(names)

    return action


def _summed(step: Total) -> _Action:
    array, first = step.start.name, step.start.index.base
    part = slice(first, first + step.count)

    def action(names: _Names) -> None:
        names[array][first] = names[array][part].sum()

    return action


def _solved(step: Solve) -> _Action:
    matrix, vector = step.arrays[:2]
    start, first = matrix.index.base, vector.index.base
    numbers = slice(start, start + len(matrix_places(step)))
    rows, columns = solution_shape(step)
    right = slice(first, first + rows * columns)

    def action(names: _Names) -> None:
        entries, sides = names[matrix.name][numbers], names[vector.name][right]
        names[vector.name][right] = solution(step, entries.tolist(), sides.tolist())

    return action


def _index(element: Element, members: int) -> Any:
    """Return one index, a slice, or an array of indices."""
    step = element.index.steps[0] if element.index.steps else 0
    if element.table is not None:
        return np.array(element.table[:members]) + element.index.base + step * np.arange(members)
    start = element.index.base
    if not step or members == 1:
        return start
    if step < 0:
        return start + step * np.arange(members)
    return slice(start, start + step * (members - 1) + 1, step)


def _evaluation(operand: Operand, members: int) -> _Evaluation:
    if isinstance(operand, Constant):
        number = float(operand.value)
        return lambda names: number
    if isinstance(operand, Element):
        array, index = operand.name, _index(operand, members)
        return lambda names: names[array][index]
    if isinstance(operand, Variable):
        return _variable(operand.name)
    if isinstance(operand, FunctionCall):
        function: Any = getattr(np, _OTHERWISE.get(operand.function, operand.function))
        return _applied(function, [_evaluation(a, members) for a in operand.arguments])
    if isinstance(operand, Product):
        return _product(operand, members)
    return _sum(operand, members)


def _variable(name: str) -> _Evaluation:
    if name[0] == "p" and name[1:].isdigit():
        number = int(name[1:])
        return lambda names: names["p"][number]
    return lambda names: names[name]


def _applied(function: Callable[..., Any], arguments: Sequence[_Evaluation]) -> _Evaluation:
    return lambda names: function(*(argument(names) for argument in arguments))


def _product(product: Product, members: int) -> _Evaluation:
    above, below = (
        [_evaluation(factor, members) for factor in factors]
        for factors in (product.numerator, product.denominator)
    )

    def value(names: _Names) -> Any:
        numerator = reduce(mul, [factor(names) for factor in above]) if above else 1.0
        return numerator / reduce(mul, [f(names) for f in below]) if below else numerator

    return value


def _sum(operand: Sum, members: int) -> _Evaluation:
    terms = [(float(c), _evaluation(part, members)) for c, part in operand.terms]

    def value(names: _Names) -> Any:
        return sum([c * part(names) for c, part in terms[1:]], terms[0][0] * terms[0][1](names))

    return value
