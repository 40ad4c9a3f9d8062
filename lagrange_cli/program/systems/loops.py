"""Programs of large systems as values: loops, each over all the values of one shape.

A loop is a small program over local names with the places that its names stand for in
each of its members. Sparse solves for the multipliers stand between loops. Both look indices up in
tables where these do not advance evenly.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from hashlib import sha256
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.program.graph.operands import Operand, variables
from lagrange_cli.program.solvers.sparse_factorization import Factors, SupernodalFactors

if TYPE_CHECKING:
    from lagrange_cli.program.graph.statement_groups import Assignment


@dataclass(frozen=True)
class IndexColumn:
    """The indices of one name of a loop in an array, for each member."""

    array: str
    indices: tuple[int, ...]

    @property
    def step(self) -> int | None:
        """Difference of the indices of neighbouring members; None if it varies."""
        indices = self.indices
        step = indices[1] - indices[0] if len(indices) > 1 else 0
        even = all(b - a == step for a, b in pairwise(indices))
        return step if even else None

    @property
    def is_fixed(self) -> bool:
        """Tell whether all members read the same number."""
        return self.step == 0


@dataclass(frozen=True)
class IndexedLoop:
    """Statements that are executed for each member.

    Attributes
    ----------
    members
        Number of members.
    inputs
        Places of the names ``l0, l1, …`` that statements read.
    assignments
        Statements that assign the names ``w0, w1, …``.
    results
        Values with the places at which they are stored.
    """

    members: int
    inputs: tuple[IndexColumn, ...]
    assignments: tuple[Assignment, ...]
    results: tuple[tuple[IndexColumn, Operand], ...]

    @property
    def columns(self) -> list[IndexColumn]:
        """Columns of the inputs, then of the results."""
        return [*self.inputs, *(column for column, _ in self.results)]

    @property
    def read(self) -> frozenset[str]:
        """The names that statements read."""
        statements = (*self.assignments, *self.results)
        return frozenset(v.name for _, operand in statements for v in variables(operand))

    @property
    def fixed(self) -> frozenset[str]:
        """The names that stand for the same number in all members."""
        names = {f"l{k}" for k, column in enumerate(self.inputs) if column.is_fixed}
        for name, operand in self.assignments:
            if all(variable.name in names for variable in variables(operand)):
                names.add(name)
        return frozenset(names)


@dataclass(frozen=True)
class Total:
    """Sum of ``count`` numbers of the workspace from ``start`` on, stored in the first of them.

    All of these numbers are overwritten.
    """

    start: int
    count: int


@dataclass(frozen=True)
class Zeros:
    """Numbers of an array, to be set to zero.

    Attributes
    ----------
    array
        Name of the array.
    start, count
        Index of the first number, and number of numbers.
    """

    array: str
    start: int
    count: int


@dataclass(frozen=True)
class SparseSolve:
    """Solution of S x = b in the workspace.

    Attributes
    ----------
    factors
        Layout and factorization of S.
    matrix
        Index of the first number of S.
    vector
        Index of b, which x replaces; workspace that ``factors`` needs follows it.
    """

    factors: Factors
    matrix: int
    vector: int


ProgramPart: TypeAlias = IndexedLoop | Total | Zeros | SparseSolve


def table_name(prefix: str, table: tuple[int, ...]) -> str:
    """Name a table by its content, so that functions that need the same one share it."""
    return f"{prefix}_at_{sha256(repr(table).encode()).hexdigest()[:12]}"


def tables_of(parts: Iterable[ProgramPart]) -> Iterator[tuple[int, ...]]:
    """Yield the tables that the parts of a program look into, in the order of first need."""
    for part in parts:
        if isinstance(part, IndexedLoop):
            yield from (relative_indices(column) for column in part.columns if column.step is None)
        elif isinstance(part, SparseSolve) and isinstance(part.factors, SupernodalFactors):
            yield from supernode_tables(part.factors)


def columns_of(parts: Iterable[ProgramPart]) -> list[IndexColumn]:
    """List the columns of all loops among the parts of a program."""
    return [c for part in parts if isinstance(part, IndexedLoop) for c in part.columns]


def relative_indices(column: IndexColumn) -> tuple[int, ...]:
    """Subtract the first index from all, so that neighbouring columns share one table."""
    return tuple(index - column.indices[0] for index in column.indices)


def supernode_tables(factors: SupernodalFactors) -> tuple[tuple[int, ...], ...]:
    """Tables ``node``, ``rows``, ``from`` and ``spots`` of the solver by supernodes."""
    nodes: list[int] = []
    rows: list[int] = []
    sources: list[int] = []
    spots: list[int] = []
    for node in factors.nodes:
        for update in node.updates:
            sources += [update.source, update.first, update.last, len(spots)]
            spots += update.rows
        nodes += [node.first, node.columns, len(node.rows), node.start, len(rows)]
        nodes.append(len(sources) // 4)
        rows += node.rows
    # An array of C has elements.
    return tuple(nodes), tuple(rows), tuple(sources or [0] * 4), tuple(spots or [0])
