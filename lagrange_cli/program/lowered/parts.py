"""Parts of a function behind the assignments of its program: results, tests, equations to solve.

Cells of the arrays ``matrix``, ``vector``, ``columns`` and ``out`` are read by variables ``m0, …``,
``b0, …``, ``c0, …`` and ``o0, …``; the multipliers of a band by the names that the program gives
them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

from lagrange_cli.program.graph.operands import (
    AffineIndex,
    Cell,
    Constant,
    Element,
    Operand,
    Product,
    Sum,
    Variable,
)
from lagrange_cli.program.graph.statement_groups import Assignment, dependents
from lagrange_cli.program.kinds import STATE_RATES, ProgramKind
from lagrange_cli.program.lowered.functions import (
    RESULTS,
    For,
    LocalArray,
    Solve,
    Step,
    Store,
)
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.program.solvers.jacobians import ColumnBlock
from lagrange_cli.program.systems.loop_rolling import Statement
from lagrange_cli.program.systems.loops import Zeros


@dataclass(frozen=True)
class Stores:
    """Results to store, in any order, and a remark for loops that do so.

    Attributes
    ----------
    rolled
        Loops are sought in a small program too.
    """

    statements: Sequence[Statement]
    remark: str = ""
    rolled: bool = False


@dataclass(frozen=True)
class Assignments:
    """Assignments in their order."""

    assignments: Sequence[Assignment]


@dataclass(frozen=True)
class Pivots:
    """Tests of the pivots of unrolled blocks."""


Part: TypeAlias = Stores | Assignments | Pivots | Zeros | LocalArray | Solve | For

_ZERO = Constant(Fraction(0))

_COLUMNS = "Right-hand sides, a column for each number by which is differentiated."

#: Array of numbers of composite bodies → what these are.
_COMPOSITE = {
    "axes": "Axes of the joints.",
    "steps": "Places of the joints, each from that of the joint before it.",
    "momenta": "Momentum, and moment of momentum, of all that a joint carries in its unit motion.",
}

_RIGHT = "Right-hand sides: of the coordinates, then of the closures."


def parts_of(program: Program) -> tuple[Sequence[Part], tuple[int, ...]]:
    """Return what follows the assignments of a program, and the shape of its results."""
    n, jacobian = program.coordinates, program.jacobian
    if jacobian is not None:
        whole = (jacobian.rows, jacobian.columns)
        return _derivatives(program), whole if jacobian.pattern is None else (jacobian.size,)
    if program.kind is ProgramKind.SOLUTION:
        (block,) = program.blocks
        accelerations = {i: Cell(RESULTS, i) for i in range(n)}
        multipliers = {k: Cell(RESULTS, n + k) for k in block.closures}
        return _solution(program, accelerations, multipliers), (n + len(multipliers),)
    if program.kind is ProgramKind.MULTIPLIERS:
        results = sum(len(block.closures) for block in program.blocks)
        return _solution(program, {}, {k: Cell(RESULTS, k) for k in range(results)}), (results,)
    if program.kind is ProgramKind.CHANGE:
        return _change(program), (n,)
    if program.kind is ProgramKind.RIGHT_HAND_SIDE:
        return _right_hand_side(program), (program.layout.size,)
    if program.kind is ProgramKind.MATRIX:
        return _matrix(program), (n, n)
    stores = _in_order(program)
    scalar = program.kind is ProgramKind.ENERGY and len(stores) == 1
    return [Stores(stores)], () if scalar else (len(stores),)


def _in_order(program: Program) -> list[Statement]:
    return [Statement(Cell(RESULTS, k), o) for k, o in enumerate(program.results_in_order)]


def _matrix(program: Program) -> list[Part]:
    n = program.coordinates
    if program.composite_numbers:
        return _composite(program)
    upper = _upper(RESULTS, n, n, program.output("mass_matrix"))
    return [Stores(upper, "Upper triangle, by rows."), Stores(_mirrored(RESULTS, "o", n))]


def _composite(program: Program) -> list[Part]:
    """Multiply the momenta of composite bodies by the axes below them, column by column."""
    n, start = program.coordinates, 0
    parts: list[Part] = []
    for name, operands in program.outputs:
        parts.append(LocalArray(name, (len(operands),), start))
        parts.append(Stores(_counted(name, operands), _COMPOSITE[name]))
        start += len(operands)
    width = len(program.output("axes")) // n

    def joint(array: str, size: int, k: int) -> Element:
        """Number k of the joint of a row, which a column is gone down to."""
        return Element(array, AffineIndex(k, (size, -size)))

    # F, then N, at the joint of the column.
    force, torque = (
        [Element("momenta", AffineIndex(k + first, (6,))) for k in range(3)] for first in (0, 3)
    )
    pairs = zip((joint("axes", width, k) for k in range(width)), (*torque, *force), strict=False)
    upper = Element(RESULTS, AffineIndex(0, (n + 1, -n)))
    lower = Element(RESULTS, AffineIndex(0, (n + 1, -1)))
    steps: list[Step] = [
        Store(upper, Sum(tuple((1, Product(pair, ())) for pair in pairs))),
        Store(lower, upper),
    ]
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        plus, minus = (Product((joint("steps", 3, a), force[b]), ()) for a, b in ((i, j), (j, i)))
        steps.append(Store(torque[k], Sum(((1, torque[k]), (1, plus), (-1, minus)))))
    return [*parts, For(AffineIndex(n), (For(AffineIndex(1, (1,)), tuple(steps)),))]


def _upper(array: str, n: int, width: int, operands: Sequence[Operand]) -> list[Statement]:
    """Return stores of the upper triangle, given by rows, of the n rows first in a wider matrix."""
    indices = [i * width + j for i in range(n) for j in range(i, n)]
    pairs = zip(indices, operands, strict=True)
    return [Statement(Cell(array, index), operand) for index, operand in pairs]


def _mirrored(array: str, letter: str, n: int) -> list[Statement]:
    """Return copies of the upper triangle of a matrix to the lower one."""
    return [
        Statement(Cell(array, j * n + i), Variable(f"{letter}{i * n + j}"))
        for i in range(n)
        for j in range(i + 1, n)
    ]


def _right_hand_side(program: Program) -> list[Part]:
    """Check the pivots, store velocities, accelerations and rates of states."""
    n = program.coordinates
    velocities = Stores([Statement(Cell(RESULTS, i), Variable(f"v{i}")) for i in range(n)])
    pivots, *solved = _solution(program, {i: Cell(RESULTS, n + i) for i in range(n)}, {})
    first = program.layout.first_order.start
    rates = program.output(STATE_RATES) if program.states else ()
    stores = [Statement(Cell(RESULTS, first + k), rate) for k, rate in enumerate(rates)]
    return [pivots, velocities, *solved, Stores(stores)]


def _change(program: Program) -> list[Part]:
    """Return changes of the coordinates that closures hold; those of the others are zero."""
    coupled = {i for block in program.blocks for i in block.coordinates}
    free = [i for i in range(program.coordinates) if i not in coupled]
    zeros = [Statement(Cell(RESULTS, i), _ZERO) for i in free]
    return [Stores(zeros), *_solution(program, {i: Cell(RESULTS, i) for i in coupled}, {})]


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
            parts.append(Assignments(dependents(program.assignments, block.multipliers)))
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
        # Multipliers apart from coordinates: a language may solve for them with the other sign.
        for first, targets in (
            (0, map(coordinates.get, members)),
            (size, map(closures.get, block.closures)),
        ):
            unknowns = ((cell, Variable(f"b{k}")) for k, cell in enumerate(targets, first))
            parts.append(Stores([Statement(cell, x) for cell, x in unknowns if cell is not None]))
    return parts


def _band(
    block: MatrixBlock, entries: Sequence[Operand], right: Sequence[Operand]
) -> Iterator[Part]:
    """Store band and right-hand side, and solve for the multipliers."""
    assert block.band is not None
    m, width = len(block.closures), block.band + 1
    yield LocalArray("band", (m, width), block.start - m * width)
    yield LocalArray("multipliers", (m,), block.start)
    yield LocalArray("pivots", (m,), block.start + m)
    yield Stores(_counted("band", entries), "The band of the multipliers, by rows.")
    yield Stores(_counted("multipliers", right), "What drives them.")
    yield Solve("banded", (m, block.band), _firsts("band", "multipliers", "pivots"))


def _counted(array: str, operands: Sequence[Operand]) -> list[Statement]:
    return [Statement(Cell(array, k), operand) for k, operand in enumerate(operands)]


def _firsts(*arrays: str) -> tuple[Element, ...]:
    return tuple(Element(array, AffineIndex(0)) for array in arrays)


def _dense_block(
    block: MatrixBlock,
    entries: Sequence[Operand],
    gradients: Sequence[Operand],
    right: Sequence[Operand],
) -> Iterator[Part]:
    """Store matrix and right-hand side, and solve the block."""
    n, size = len(block.coordinates), block.size
    yield LocalArray("matrix", (size, size), 0)
    yield LocalArray("vector", (size,), size * size)
    upper, below = _matrix_of(n, size, entries, gradients)
    yield upper
    if not (block.definite or block.closures):
        yield Stores(_mirrored("matrix", "m", n))
    yield below
    yield Stores(_counted("vector", right), _RIGHT if block.closures else "Forcing.")
    routine = "definite" if block.definite else "saddle" if block.closures else "pivoted"
    sizes = (n, len(block.closures)) if block.closures else (n,)
    overwritten = {"definite": {"pivots": 1}, "saddle": {"scales": 1, "copy": size, "defect": 1}}
    behind = overwritten.get(routine, {})
    start = size * size + size
    for name, columns in behind.items():
        yield LocalArray(name, (size * columns,), start)
        start += size * columns
    yield Solve(routine, sizes, _firsts("matrix", "vector", *behind))


def _matrix_of(
    n: int, size: int, entries: Sequence[Operand], below: Sequence[Operand]
) -> list[Stores]:
    """Store the mass matrix of a block, the gradients of its closures and their compliance."""
    upper = _upper("matrix", n, size, entries)
    cells = [Cell("matrix", i * size + j) for i in range(n, size) for j in range(n)]
    cells += [Cell("matrix", i * size + i) for i in range(n, size)]
    operands = [*below, *[_ZERO] * (len(cells) - len(below))]
    return [
        Stores(upper, "Upper triangle of the mass matrix, by rows."),
        Stores(list(map(Statement, cells, operands)), "Gradients of the closures, by rows."),
    ]


def _derivatives(program: Program) -> list[Part]:
    """Store derivatives of the state's rates: those written out, then those of each block."""
    jacobian = program.jacobian
    assert jacobian is not None
    place = jacobian.stored
    parts: list[Part] = []
    if len(place) < jacobian.size:
        parts.append(Zeros(RESULTS, 0, jacobian.size))
    written = zip(jacobian.entries, program.output("entries"), strict=True)
    parts.append(Stores([Statement(Cell(RESULTS, place[at]), x) for at, x in written]))
    matrix = iter(program.output("dense_matrix"))
    forcing = iter(program.output("dense_forcing"))
    for block in jacobian.blocks:
        n = len(block.coordinates)
        entries = [next(matrix) for _ in range(n * (n + 1) // 2)]
        below = [next(matrix) for _ in range((n + block.compliant) * len(block.closures))]
        parts += _columns(block, entries, below, [next(forcing) for _ in block.places])
        solved = [
            Statement(
                Cell(RESULTS, place[jacobian.first + i, k]),
                Variable(f"c{row * len(block.columns) + number}"),
            )
            for row, i in enumerate(block.coordinates)
            for number, k in enumerate(block.columns)
        ]
        parts.append(Stores(solved, rolled=True))
    return parts


def _columns(
    block: ColumnBlock,
    entries: Sequence[Operand],
    below: Sequence[Operand],
    right: Sequence[Operand],
) -> Iterator[Part]:
    """Store matrix and right-hand sides of a block of derivatives, and solve it."""
    n, size, columns = len(block.coordinates), block.size, len(block.columns)
    yield LocalArray("matrix", (size, size), 0)
    yield LocalArray("columns", (size, columns), size * size)
    yield LocalArray("scales", (size,), size * (size + columns))
    yield from _matrix_of(n, size, entries, below)
    yield Zeros("columns", 0, size * columns)
    cells = [Cell("columns", i * columns + k) for i, k in block.places]
    yield Stores(list(map(Statement, cells, right)), _COLUMNS)
    yield Solve("columns", (n, size, columns), _firsts("matrix", "columns", "scales"))
