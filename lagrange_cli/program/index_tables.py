"""Tables of indices that loops and sparse factorizations of a program look into."""

from __future__ import annotations

from collections.abc import Iterator
from hashlib import sha256

from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.sparse_factorization import SupernodalFactors
from lagrange_cli.program.systems.loops import IndexColumn, IndexedLoop, SparseSolve


def table_name(prefix: str, table: tuple[int, ...]) -> str:
    """Name a table by its content, so that functions that need the same one share it."""
    return f"{prefix}_at_{sha256(repr(table).encode()).hexdigest()[:12]}"


def tables_of(program: Program) -> Iterator[tuple[int, ...]]:
    """The tables that a program looks into, in the order of first need."""
    for part in program.parts:
        if isinstance(part, IndexedLoop):
            yield from (relative_indices(column) for column in part.columns if column.step is None)
        elif isinstance(part, SparseSolve) and isinstance(part.factors, SupernodalFactors):
            yield from supernode_tables(part.factors)


def columns_of(program: Program) -> list[IndexColumn]:
    """The columns of all loops of a program."""
    loops = (part for part in program.parts if isinstance(part, IndexedLoop))
    return [column for loop in loops for column in loop.columns]


def relative_indices(column: IndexColumn) -> tuple[int, ...]:
    """Indices as they differ from the first, so that neighbouring columns have one table."""
    return tuple(index - column.indices[0] for index in column.indices)


def supernode_tables(factors: SupernodalFactors) -> tuple[tuple[int, ...], ...]:
    """``node``, ``rows``, ``from`` and ``spots`` of the solver."""
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
