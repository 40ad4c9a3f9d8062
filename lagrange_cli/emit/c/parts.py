"""Parts of the bodies of emitted C functions, in the order in which they are written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from lagrange_cli.program.graph.operands import Cell, Constant, Operand, Variable
from lagrange_cli.program.graph.statement_groups import Assignment, dependents
from lagrange_cli.program.program import Program, ProgramKind
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.program.solvers.jacobians import ColumnBlock
from lagrange_cli.program.systems.loop_rolling import Statement


@dataclass(frozen=True)
class Stores:
    """Results to store, in any order, and a comment for loops that do so.

    Attributes
    ----------
    rolled
        Loops are sought in a small program too.
    """

    statements: Sequence[Statement]
    comment: str = ""
    rolled: bool = False


@dataclass(frozen=True)
class Steps:
    """Assignments in their order."""

    assignments: Sequence[Assignment]


@dataclass(frozen=True)
class Pivots:
    """Tests of the pivots of unrolled blocks."""


@dataclass(frozen=True)
class Solve:
    """A call of the solver for a block whose matrix stands in the workspace."""

    block: MatrixBlock


@dataclass(frozen=True)
class Zeros:
    """Numbers of an array that are set to zero."""

    array: str
    start: int
    count: int


@dataclass(frozen=True)
class SolveColumns:
    """A call of the solver for many right-hand sides that stand in the workspace."""

    block: ColumnBlock


Part = Stores | Steps | Pivots | Solve | Zeros | SolveColumns

_COLUMNS = "Right-hand sides, a column for each number by which is differentiated."

_RIGHT = "Right-hand sides: of the coordinates, then of the closures."


def parts_of(program: Program) -> tuple[Sequence[Part], int]:
    """Return what follows the assignments of a program, and how many results that stores."""
    n = program.coordinates
    if program.jacobian is not None:
        return _derivatives(program), program.results
    if program.kind is ProgramKind.MULTIPLIERS:
        results = sum(len(block.closures) for block in program.blocks)
        return _solution(program, {}, {k: Cell("out", k) for k in range(results)}), results
    if program.kind is ProgramKind.CHANGE:
        return _change(program), n
    if program.kind is ProgramKind.RIGHT_HAND_SIDE:
        return _right_hand_side(program), 2 * n
    if program.kind is ProgramKind.MATRIX:
        return _matrix(program), n**2
    stores = _in_order(program)
    return [Stores(stores)], len(stores)


def _in_order(program: Program) -> list[Statement]:
    return [Statement(Cell("out", k), o) for k, o in enumerate(program.results_in_order)]


def _matrix(program: Program) -> list[Stores]:
    n = program.coordinates
    upper = _upper("out", n, n, program.output("mass_matrix"))
    return [Stores(upper, "Upper triangle, by rows."), Stores(_mirrored("out", "o", n))]


def _upper(array: str, n: int, width: int, operands: Sequence[Operand]) -> list[Statement]:
    """Return stores of the upper triangle, given by rows, of the n rows first in a wider matrix."""
    indices = [i * width + j for i in range(n) for j in range(i, n)]
    pairs = zip(indices, operands, strict=True)
    return [Statement(Cell(array, index), operand) for index, operand in pairs]


def _mirrored(array: str, kind: str, n: int) -> list[Statement]:
    """Return copies of the upper triangle of a matrix to the lower one."""
    return [
        Statement(Cell(array, j * n + i), Variable(f"{kind}{i * n + j}"))
        for i in range(n)
        for j in range(i + 1, n)
    ]


def _right_hand_side(program: Program) -> list[Part]:
    """Check the pivots, store velocities and accelerations."""
    n = program.coordinates
    velocities = Stores([Statement(Cell("dydt", i), Variable(f"v{i}")) for i in range(n)])
    pivots, *solved = _solution(program, {i: Cell("dydt", n + i) for i in range(n)}, {})
    return [pivots, velocities, *solved]


def _change(program: Program) -> list[Part]:
    """Return changes of the coordinates that closures hold; those of the others are zero."""
    coupled = {i for block in program.blocks for i in block.coordinates}
    free = [i for i in range(program.coordinates) if i not in coupled]
    zeros = [Statement(Cell("out", i), Constant(Fraction(0))) for i in free]
    return [Stores(zeros), *_solution(program, {i: Cell("out", i) for i in coupled}, {})]


def _solution(
    program: Program, coordinates: Mapping[int, Cell], closures: Mapping[int, Cell]
) -> list[Part]:
    """Check the pivots, solve the blocks, store what is found for coordinates and closures."""
    parts: list[Part] = [Pivots()]
    accelerations = iter(program.output("acceleration"))
    matrix = iter(program.output("dense_matrix"))
    forcing = iter(program.output("dense_forcing"))
    for block in program.blocks:
        members, size = block.coordinates, len(block.coordinates)
        if block.band is not None:
            entries = [next(matrix) for _ in range(len(block.closures) * (block.band + 1))]
            parts += _band(block, entries, [next(forcing) for _ in block.closures])
            parts.append(Steps(dependents(program.assignments, block.multipliers)))
            named = zip(block.closures, block.multipliers, strict=True)
            copies = [Statement(closures[k], Variable(d)) for k, d in named if k in closures]
            parts.append(Stores(copies))
        if block.unrolled or block.band is not None:
            if coordinates:
                stores = [Statement(coordinates[i], next(accelerations)) for i in members]
                parts.append(Stores(stores))
            continue
        entries = [next(matrix) for _ in range(size * (size + 1) // 2)]
        gradients = [next(matrix) for _ in range((size + block.compliant) * len(block.closures))]
        right = [next(forcing) for _ in range(block.size)]
        parts += _dense_block(block, entries, gradients, right)
        targets = [*map(coordinates.get, members), *map(closures.get, block.closures)]
        start = block.size**2
        unknowns = ((cell, Variable(f"d{start + k}")) for k, cell in enumerate(targets))
        parts.append(Stores([Statement(cell, d) for cell, d in unknowns if cell is not None]))
    return parts


def _band(
    block: MatrixBlock, entries: Sequence[Operand], right: Sequence[Operand]
) -> Iterator[Part]:
    """Fill the workspace with band and right-hand side, and call the solver."""
    start, size = block.start, len(entries)
    band = [Cell("work", i) for i in range(start - size, start)]
    yield Stores(list(map(Statement, band, entries)), "The band of the multipliers, by rows.")
    drive = [Cell("work", start + k) for k in range(len(right))]
    yield Stores(list(map(Statement, drive, right)), "What drives them.")
    yield Solve(block)


def _dense_block(
    block: MatrixBlock,
    entries: Sequence[Operand],
    gradients: Sequence[Operand],
    right: Sequence[Operand],
) -> Iterator[Part]:
    """Fill the workspace with matrix and right-hand side, and call the solver."""
    n, size = len(block.coordinates), block.size
    stores = _matrix_of(n, size, entries, gradients, compliant=block.compliant)
    yield stores[0]
    if not (block.definite or block.closures):
        yield Stores(_mirrored("work", "d", n))
    yield stores[1]
    forcing = [Statement(Cell("work", size * size + i), f) for i, f in enumerate(right)]
    yield Stores(forcing, _RIGHT if block.closures else "Forcing.")
    yield Solve(block)


def _matrix_of(
    n: int, size: int, entries: Sequence[Operand], gradients: Sequence[Operand], *, compliant: bool
) -> list[Stores]:
    """Fill the workspace with the mass matrix of a block and the gradients of its closures."""
    upper = _upper("work", n, size, entries)
    below = [Cell("work", i * size + j) for i in range(n, size) for j in range(n)]
    if compliant:
        below += [Cell("work", i * size + i) for i in range(n, size)]
    return [
        Stores(upper, "Upper triangle of the mass matrix, by rows."),
        Stores(list(map(Statement, below, gradients)), "Gradients of the closures, by rows."),
    ]


def _derivatives(program: Program) -> list[Part]:
    """Store derivatives of the accelerations: those written out, then those of each block."""
    jacobian = program.jacobian
    assert jacobian is not None
    place = jacobian.stored
    parts: list[Part] = []
    if len(place) < jacobian.size:
        parts.append(Zeros("out", 0, jacobian.size))
    written = zip(jacobian.entries, program.output("entries"), strict=True)
    parts.append(Stores([Statement(Cell("out", place[at]), x) for at, x in written]))
    matrix = iter(program.output("dense_matrix"))
    forcing = iter(program.output("dense_forcing"))
    for block in jacobian.blocks:
        n, size, columns = len(block.coordinates), block.size, len(block.columns)
        entries = [next(matrix) for _ in range(n * (n + 1) // 2)]
        below = [next(matrix) for _ in range((n + block.compliant) * len(block.closures))]
        below += [] if block.compliant else [Constant(Fraction(0))] * len(block.closures)
        right = [
            Statement(Cell("work", size * size + i * columns + k), next(forcing))
            for i, k in block.places
        ]
        parts += _matrix_of(n, size, entries, below, compliant=True)
        parts += [Zeros("work", size * size, size * columns), Stores(right, _COLUMNS)]
        parts.append(SolveColumns(block))
        solved = [
            Statement(
                Cell("out", place[i, k]), Variable(f"d{size * size + row * columns + number}")
            )
            for row, i in enumerate(block.coordinates)
            for number, k in enumerate(block.columns)
        ]
        parts.append(Stores(solved, rolled=True))
    return parts
