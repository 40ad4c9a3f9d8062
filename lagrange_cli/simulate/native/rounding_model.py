"""A program in which every operation is off by its rounding error.

Each result is multiplied by a factor of its own, after the stochastic
arithmetic of Vignes, *Math. Comput. Simul.* 35 (1993) 233. The distance of a value
from that of the program itself shows how much of it is rounding: a sum in
which digits cancel amplifies the errors of its terms. The factors are further
parameters of the program, so that one text serves every choice of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations_with_replacement, count
from math import isqrt

from lagrange_cli.program.graph.operands import FunctionCall, Operand, Product, Sum, Variable
from lagrange_cli.program.program import Program
from lagrange_cli.program.systems.loops import IndexColumn, IndexedLoop, ProgramPart


def perturb(program: Program) -> Program:
    """Multiply every sum, product and call of a program by a factor of its own.

    The factors are parameters after those of the program, in order; some are of no operation.
    """
    if program.parts:
        return _perturbed_parts(program)
    factors = _Factors(program.parameters)
    assignments = tuple((name, _off(operand, factors)) for name, operand in program.assignments)
    outputs = tuple(
        (name, _perturbed_triangle(operands, factors))
        if name == "dense_matrix" and _is_large_triangle(program)
        else (name, tuple(_off(operand, factors) for operand in operands))
        for name, operands in program.outputs
    )
    return replace(program, assignments=assignments, outputs=outputs, parameters=factors.end)


class _Factors(Iterator[Variable]):
    """Parameters one after the other, from the first that is not in use."""

    def __init__(self, end: int) -> None:
        self.end = end

    def __next__(self) -> Variable:
        self.end += 1
        return Variable(f"p{self.end - 1}")


def _is_large_triangle(program: Program) -> bool:
    """Tell whether the matrix to solve is one upper triangle, by rows, that loops store."""
    if not program.is_large or len(program.blocks) != 1:
        return False
    size = program.blocks[0].size
    return len(program.output("dense_matrix")) == size * (size + 1) // 2


def _perturbed_triangle(entries: Sequence[Operand], factors: _Factors) -> tuple[Operand, ...]:
    """Number the factors of an upper triangle as if it were a square: rows that are equally far
    apart remain one loop."""
    size = isqrt(2 * len(entries))
    start, most = factors.end, max(map(_operations, entries))
    perturbed = []
    for entry, (i, j) in zip(entries, combinations_with_replacement(range(size), 2), strict=True):
        factors.end = start + most * (size * i + j)
        perturbed.append(_off(entry, factors))
    factors.end = start + most * size * size
    return tuple(perturbed)


def _operations(operand: Operand) -> int:
    """Count the factors that an operand takes."""
    if isinstance(operand, Sum):
        inexact = not _is_exact(operand)
        return inexact + sum([_operations(part) for _, part in operand.terms])
    if isinstance(operand, Product):
        return 1 + sum(map(_operations, (*operand.numerator, *operand.denominator)))
    if isinstance(operand, FunctionCall):
        return 1 + sum(map(_operations, operand.arguments))
    return 0


def _is_exact(operand: Sum) -> bool:
    """Tell whether a sum is one term with a sign."""
    return len(operand.terms) == 1 and abs(operand.terms[0][0]) == 1


def _perturbed_parts(program: Program) -> Program:
    """Perturb loops, whose members have factors of their own; solutions of systems have none."""
    parts: list[ProgramPart] = []
    end = program.parameters
    for part in program.parts:
        if isinstance(part, IndexedLoop):
            part, used = _perturbed_loop(part, end)
            end += used
        parts.append(part)
    return replace(program, parts=tuple(parts), parameters=end)


def _perturbed_loop(loop: IndexedLoop, start: int) -> tuple[IndexedLoop, int]:
    """Let a loop read factors from a parameter on; return it and the number of factors."""
    numbers = count(len(loop.inputs))
    factors = (Variable(f"l{number}") for number in numbers)
    assignments = tuple((name, _off(operand, factors)) for name, operand in loop.assignments)
    results = tuple((column, _off(operand, factors)) for column, operand in loop.results)
    each, members = next(numbers) - len(loop.inputs), loop.members
    columns = [
        IndexColumn("p", tuple(range(start + k * members, start + (k + 1) * members)))
        for k in range(each)
    ]
    inputs = (*loop.inputs, *columns)
    return IndexedLoop(members, inputs, assignments, results), each * members


def _off(operand: Operand, factors: Iterator[Variable]) -> Operand:
    if isinstance(operand, Sum):
        terms = tuple((c, _off(o, factors)) for c, o in operand.terms)
        return Sum(terms) if _is_exact(operand) else Product((Sum(terms), next(factors)), ())
    if isinstance(operand, Product):
        numerator = tuple(_off(o, factors) for o in operand.numerator)
        denominator = tuple(_off(o, factors) for o in operand.denominator)
        return Product((*numerator, next(factors)), denominator)
    if isinstance(operand, FunctionCall):
        arguments = tuple(_off(o, factors) for o in operand.arguments)
        return Product((FunctionCall(operand.function, arguments), next(factors)), ())
    return operand
