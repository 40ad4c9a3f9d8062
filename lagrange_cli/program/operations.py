"""Numbers of floating-point operations of programs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

from lagrange_cli.program.graph.operands import Constant, FunctionCall, Operand, Product, Sum
from lagrange_cli.program.graph.statement_groups import Assignment
from lagrange_cli.program.systems.loops import IndexedLoop, ProgramPart, SparseSolve


class Statements(Protocol):
    """The parts of a program that hold operations."""

    @property
    def assignments(self) -> tuple[Assignment, ...]: ...
    @property
    def results_in_order(self) -> list[Operand]: ...
    @property
    def parts(self) -> tuple[ProgramPart, ...]: ...


@dataclass(frozen=True)
class Operations:
    """Numbers of floating-point operations of a program.

    Attributes
    ----------
    additions, multiplications, divisions
        Operations of these kinds; subtractions are additions.
    calls
        Calls of functions.
    """

    additions: int = 0
    multiplications: int = 0
    divisions: int = 0
    calls: int = 0

    @property
    def total(self) -> int:
        return self.additions + self.multiplications + self.divisions + self.calls

    def times(self, number: int) -> Operations:
        return Operations(
            number * self.additions,
            number * self.multiplications,
            number * self.divisions,
            number * self.calls,
        )

    def __add__(self, added: Operations) -> Operations:
        return Operations(
            self.additions + added.additions,
            self.multiplications + added.multiplications,
            self.divisions + added.divisions,
            self.calls + added.calls,
        )


def operands_of(program: Statements) -> Iterator[tuple[Operand, int]]:
    """Yield the operands of all statements, each with the number of its evaluations."""
    yield from ((operand, 1) for _, operand in program.assignments)
    yield from ((operand, 1) for operand in program.results_in_order)
    for part in program.parts:
        if isinstance(part, IndexedLoop):
            fixed = part.fixed
            for name, operand in part.assignments:
                yield operand, 1 if name in fixed else part.members
            yield from ((operand, part.members) for _, operand in part.results)


def count_operations(program: Statements) -> Operations:
    """Count the operations of all statements (a negation is an addition)."""
    total = Operations()
    for operand, times in operands_of(program):
        total += _operations_in(operand).times(times)
    return total


def elimination_operations(program: Statements) -> int:
    """Count the operations that solve for multipliers between the statements of a large system."""
    return sum(p.factors.operations for p in program.parts if isinstance(p, SparseSolve))


def _operations_in(whole: Operand) -> Operations:
    total, stack = Operations(), [whole]
    while stack:
        operand = stack.pop()
        if isinstance(operand, Sum):
            total += _sum_operations(operand)
            stack.extend(o for _, o in operand.terms)
        elif isinstance(operand, Product):
            total += _product_operations(operand)
            stack.extend((*operand.numerator, *operand.denominator))
        elif isinstance(operand, FunctionCall):
            total = replace(total, calls=total.calls + 1)
            stack.extend(operand.arguments)
    return total


def _sum_operations(operand: Sum) -> Operations:
    scaled = sum(abs(c) != 1 and not isinstance(o, Constant) for c, o in operand.terms)
    negated = len(operand.terms) == 1 and operand.terms[0][0] == -1
    return Operations(additions=len(operand.terms) - 1 + negated, multiplications=scaled)


def _product_operations(operand: Product) -> Operations:
    factors = max(0, len(operand.numerator) - 1) + max(0, len(operand.denominator) - 1)
    return Operations(multiplications=factors, divisions=bool(operand.denominator))
