"""Loops of large systems as statements: each over the members of a family.

Indices into arrays advance by constant steps, or are looked up in tables.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from lagrange_cli.program.graph.operands import (
    AffineIndex,
    Constant,
    Element,
    Operand,
    Variable,
    rebuilt,
)
from lagrange_cli.program.lowered.functions import For, Let, LocalArray, Scope, Solve, Step, Store
from lagrange_cli.program.lowered.functions import Total as TotalStep
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.sparse_factorization import BandFactors
from lagrange_cli.program.systems.loops import (
    IndexColumn,
    IndexedLoop,
    SparseSolve,
    Total,
    Zeros,
    relative_indices,
    supernode_tables,
)

#: Array of the values of a large system.
_VALUES = "work"

#: Arrays of a program of loops that are called otherwise in functions.
_NAMED = {"q": "y", "v": "y", "w": _VALUES, "s": "p"}


def indexed_body(program: Program) -> Iterator[Step]:
    """Yield the statements of a program of loops."""
    if program.work:
        yield LocalArray(_VALUES, (program.work,), 0)
    for part in program.parts:
        if isinstance(part, IndexedLoop):
            yield _loop(part, program.coordinates)
        elif isinstance(part, Zeros):
            yield zeros(part)
        elif isinstance(part, Total):
            yield TotalStep(part.count, _value(part.start))
        else:
            yield _elimination(part)


def zeros(part: Zeros) -> For:
    """Return the loop that sets numbers to zero."""
    array = _NAMED.get(part.array, part.array)
    target = Element(array, AffineIndex(part.start, (1,)))
    body = (Store(target, Constant(Fraction(0))),)
    return For(AffineIndex(part.count), body, independent=True)


def _value(number: int) -> Element:
    return Element(_VALUES, AffineIndex(number))


def _elimination(part: SparseSolve) -> Solve:
    """Solve for the numbers of a vector, behind which the pivots and a column are overwritten."""
    factors, unknowns = part.factors, len(part.factors.order)
    starts = (part.matrix, part.vector, part.vector + unknowns, part.vector + 2 * unknowns)
    arrays = tuple(map(_value, starts))
    if isinstance(factors, BandFactors):
        return Solve("banded", (unknowns, factors.width), arrays[:3])
    return Solve("sparse", (unknowns, len(factors.nodes)), arrays, supernode_tables(factors))


def _loop(loop: IndexedLoop, coordinates: int) -> Scope:
    """Name what is the same for all members, then repeat the rest."""
    repeats, fixed = loop.members > 1, loop.fixed
    outside: list[Step] = []
    inside: list[Step] = []
    for k, column in enumerate(loop.inputs):
        name = f"l{k}"
        step = Let(name, _place(column, coordinates, repeats))
        (outside if name in fixed else inside).append(step)
    for name, operand in loop.assignments:
        step = Let(_local(name), _of_locals(operand))
        (outside if name in fixed else inside).append(step)
    for column, operand in loop.results:
        target = _place(column, coordinates, repeats)
        assert isinstance(target, Element)
        inside.append(Store(target, _of_locals(operand)))
    if not repeats:
        return Scope((*outside, *inside))
    return Scope((*outside, For(AffineIndex(loop.members), tuple(inside), independent=True)))


def _local(name: str) -> str:
    """Rename a variable that a loop assigns, to distinguish it from the array of values."""
    return name.replace("w", "s")


def _of_locals(operand: Operand) -> Operand:
    return rebuilt(operand, lambda variable: Variable(_local(variable.name)))


def _place(column: IndexColumn, coordinates: int, repeats: bool) -> Variable | Element:
    """Return what a name of a loop stands for in a repetition."""
    first, step = column.indices[0], column.step
    if column.array == "t":
        return Variable("t")
    if column.array in "ps" and column.is_fixed:
        return Variable(f"p{first}")
    array = _NAMED.get(column.array, column.array)
    start = first + (coordinates if column.array == "v" else 0)
    if not repeats or step == 0:
        return Element(array, AffineIndex(start))
    if step is not None:
        return Element(array, AffineIndex(start, (step,)))
    return Element(array, AffineIndex(start), relative_indices(column))
