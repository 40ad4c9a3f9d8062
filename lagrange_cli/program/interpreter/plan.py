"""Values → registers and the closures that fill them.

A value that is read once is part of the closure that reads it; all others have registers. Values of
parameters and inputs alone are evaluated first, so that a function with bound parameters has them
once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from lagrange_cli.program.interpreter.arithmetic import Arithmetic, UnsupportedError
from lagrange_cli.program.interpreter.closures import Closure, Expression, closure
from lagrange_cli.program.interpreter.values import Value, Values, solution_shape
from lagrange_cli.program.lowered.functions import Function

#: Closures within each other; deeper ones would be more than Python calls.
_DEEPEST = 24

#: Leaves that are the same for all states.
_FIXED = frozenset({"constant", "epsilon", "p", "u"})

#: Operation → its sign in the shapes of closures.
_SIGNS = {"+": "+", "-": "-", "*": "*", "/": "/", "negate": "~"}

#: A step that appends one value to the registers, or one that appends a solution.
_Steps = list[tuple[list[Closure], Closure | None]]


@dataclass(frozen=True)
class Plan:
    """Closures of a function over registers: constants, p, u, what these give, t, y, given, values.

    Attributes
    ----------
    constants
        Numbers with which the registers begin.
    parameters, inputs
        Numbers of parameters and inputs up to the last one that is read.
    prologue, steps
        Closures of values of parameters and inputs alone, and of all others: lists, each with the
        closure of a solution that follows it, if any.
    fixed_tests, tests
        Conditions under which there are results.
    results
        Returns the results from the registers.
    """

    constants: list[Any]
    parameters: int
    inputs: int
    prologue: list[Closure]
    steps: _Steps
    fixed_tests: list[Closure]
    tests: list[Closure]
    results: Closure


class Planner:
    """Assigns registers to the values of a function."""

    def __init__(self, function: Function, arithmetic: Arithmetic, earlier: int) -> None:
        table = Values(function)
        self._values, self._arithmetic = table.values, arithmetic
        self._tests, self._results = table.tests, table.results
        self._function, self._earlier = function, earlier
        self._fixed = self._fixed_values()
        self._uses = self._counted_uses()
        self._registers: dict[int, int] = {}
        self._depths: dict[int, int] = {}
        self._solutions: dict[int, int] = {}

    def _fixed_values(self) -> list[bool]:
        fixed: list[bool] = []
        for value in self._values:
            if value.operands:
                known = value.operation not in ("solve", "item")
                fixed.append(known and all(fixed[k] for k in value.operands))
            else:
                fixed.append(value.operation in _FIXED)
        return fixed

    def _counted_uses(self) -> list[int]:
        """Count how often each value is read; 0 if no result needs it, and 2 for a register."""
        uses = [0] * len(self._values)
        for number in self._results:
            uses[number] += 2
        for test in self._tests:
            apart = not all(self._fixed[k] for k in test)
            for number in test:
                uses[number] += 2 if apart and self._fixed[number] else 1
        for number in reversed(range(len(uses))):
            if uses[number]:
                value = self._values[number]
                for operand in value.operands:
                    apart = self._fixed[operand] and not self._fixed[number]
                    uses[operand] += 2 if apart or value.operation == "solve" else 1
        return uses

    def plan(self) -> Plan:
        """Return the closures."""
        function, arithmetic = self._function, self._arithmetic
        constants: list[Any] = []
        for number, value in enumerate(self._values):
            if value.operation in ("constant", "epsilon") and self._uses[number]:
                self._registers[number] = len(constants)
                exact = value.operation == "constant"
                constants.append(arithmetic.number(value.which) if exact else arithmetic.epsilon)
        end = len(constants)
        parameters, inputs = self._numbers_read("p"), self._numbers_read("u")
        self._place_leaves("p", end)
        self._place_leaves("u", end + parameters)
        end += parameters + inputs
        prologue = [step for step, _ in self._filled(end, fixed=True)]
        end += len(prologue)
        self._place_leaves("t", end)
        self._place_leaves("y", end + 1)
        self._place_leaves("given", end + 1 + function.layout.size)
        end += 1 + function.layout.size + self._earlier
        steps: _Steps = []
        closures: list[Closure] = []
        for step, solves in self._filled(end, fixed=False):
            if solves:
                steps.append((closures, step))
                closures = []
            else:
                closures.append(step)
        if closures or not steps:
            steps.append((closures, None))
        fixed_tests, tests = self._conditions()
        return Plan(
            constants,
            parameters,
            inputs,
            prologue,
            steps,
            fixed_tests,
            tests,
            self._picked(self._results),
        )

    def _numbers_read(self, array: str) -> int:
        """Return how many numbers of an array there must be for those that are read."""
        return max((v.which + 1 for v in self._values if v.operation == array), default=0)

    def _place_leaves(self, array: str, start: int) -> None:
        for number, value in enumerate(self._values):
            if value.operation == array and not value.operands:
                self._registers[number] = start + value.which

    def _filled(self, end: int, *, fixed: bool) -> Iterator[tuple[Closure, bool]]:
        """Yield closures that fill registers one after the other; True if with a solution."""
        for number, value in enumerate(self._values):
            if not value.operands or not self._uses[number] or self._fixed[number] != fixed:
                continue
            if value.operation == "item":
                self._registers[number] = self._solutions[value.operands[0]] + value.which
            elif value.operation == "solve":
                yield self._solution(value), True
                self._solutions[number] = end
                end += math.prod(solution_shape(value.which))
            elif self._uses[number] > 1 or self._depth(number) > _DEEPEST:
                yield closure(self._operation(value)), False
                self._registers[number] = end
                end += 1

    def _depth(self, number: int) -> int:
        """Return the number of closures within each other, those of registers left out."""
        operands = self._values[number].operands
        depth = 1 + max((self._depths.get(k, 0) for k in operands), default=0)
        if depth <= _DEEPEST:
            self._depths[number] = depth
        return depth

    def _expression(self, number: int) -> Expression:
        """Return the operations that a value takes, registers as they are."""
        register = self._registers.get(number)
        return self._operation(self._values[number]) if register is None else register

    def _operation(self, value: Value) -> Expression:
        parts = map(self._expression, value.operands)
        if value.operation in _SIGNS:
            return (_SIGNS[value.operation], *parts)
        function = self._arithmetic.functions.get(value.operation)
        if function is None:
            raise UnsupportedError(value.operation)
        return ("f" if len(value.operands) == 1 else "g", function, *parts)

    def _solution(self, value: Value) -> Closure:
        """Return the closure that gathers equations and solves them."""
        solve, step = self._arithmetic.solve, value.which
        unknowns = math.prod(solution_shape(step))
        matrix, right = (
            self._picked(part) for part in (value.operands[:-unknowns], value.operands[-unknowns:])
        )
        return lambda r: solve(step, matrix(r), right(r))

    def _picked(self, numbers: Sequence[int]) -> Closure:
        """Return the closure that lists registers."""
        places = [self._registers[number] for number in numbers]
        if len(places) > 1:
            return itemgetter(*places)
        return lambda r: tuple(r[k] for k in places)

    def _conditions(self) -> tuple[list[Closure], list[Closure]]:
        """Return the conditions on parameters alone, and the others."""
        sides: tuple[list[Closure], list[Closure]] = [], []
        for pair in dict.fromkeys(self._tests):
            test = closure((">", *map(self._expression, pair)))
            sides[not all(self._fixed[k] for k in pair)].append(test)
        return sides
