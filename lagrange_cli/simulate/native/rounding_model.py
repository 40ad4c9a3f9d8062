"""A program in which every operation is off by its rounding error.

Each result is multiplied by a factor of its own, after the stochastic
arithmetic of Vignes, *Math. Comput. Simul.* 35 (1993) 233. The distance of a value
from that of the program itself shows how much of it is rounding: a sum in
which digits cancel amplifies the errors of its terms. The factors are further
parameters of the program, so that one text serves every choice of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import count

from lagrange_cli.program.graph.operands import FunctionCall, Operand, Product, Sum, Variable
from lagrange_cli.program.program import Program
from lagrange_cli.program.systems.loops import IndexColumn, IndexedLoop, ProgramPart


def perturb(program: Program) -> Program:
    """Multiply every sum, product and call of a program by a factor of its own.

    The factors are parameters after those of the program, in order.
    """
    if program.parts:
        return _perturbed_parts(program)
    numbers = count(program.parameters)
    factors = (Variable(f"p{number}") for number in numbers)
    perturbed = replace(
        program,
        assignments=tuple((name, _off(operand, factors)) for name, operand in program.assignments),
        outputs=tuple(
            (name, tuple(_off(operand, factors) for operand in operands))
            for name, operands in program.outputs
        ),
    )
    return replace(perturbed, parameters=next(numbers))


def _perturbed_parts(program: Program) -> Program:
    """Loops whose members have factors of their own; solutions of systems have none."""
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
        exact = len(terms) == 1 and abs(terms[0][0]) == 1
        return Sum(terms) if exact else Product((Sum(terms), next(factors)), ())
    if isinstance(operand, Product):
        numerator = tuple(_off(o, factors) for o in operand.numerator)
        denominator = tuple(_off(o, factors) for o in operand.denominator)
        return Product((*numerator, next(factors)), denominator)
    if isinstance(operand, FunctionCall):
        arguments = tuple(_off(o, factors) for o in operand.arguments)
        return Product((FunctionCall(operand.function, arguments), next(factors)), ())
    return operand
