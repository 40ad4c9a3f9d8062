"""Bodies of emitted C functions: assignments, loops, stores and solvers.

A small program is straight-line code over named values. In a large one,
statements of one shape are loops over the values ``w[0], w[1], …``, which then
live in the workspace; the others keep names of their own.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from lagrange_cli.emit.c.loops import finite_check, loops_text, loops_workspace_size, wrapped
from lagrange_cli.emit.c.solvers import EPSILON_NAME, solver_workspace_size
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.program.graph.operands import (
    Cell,
    Constant,
    Operand,
    Product,
    Variable,
    cell_named,
    rebuilt,
)
from lagrange_cli.program.graph.statement_groups import Assignment
from lagrange_cli.program.printing import expression_text
from lagrange_cli.program.program import Program, ProgramKind, dependents, input_names
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.program.systems.loop_rolling import (
    AffineIndex,
    ArrayAccess,
    LoopNest,
    LoopStatement,
    Statement,
    roll_loops,
)

#: Counters of nested loops, outermost first.
_COUNTERS = "ijkl"

#: Names in C of the arrays of a program.
_ARRAYS = {"q": "y", "v": "y", "u": "u", "p": "p", "w": "w", "d": "work", "o": "out"}


def program_workspace_size(program: Program) -> int:
    """Numbers of workspace: what the solver needs, then values and parameters of loops
    (at least 1, so that an array of that size exists)."""
    if program.parts:
        return max(loops_workspace_size(program), 1)
    values = len(program.assignments) + program.parameters if program.is_large else 0
    return max(solver_workspace_size(program.blocks) + values, 1)


def body_text(program: Program, target: CTarget) -> list[str]:
    """Return the lines of a function that stores the outputs of a program.

    Programs that solve a system store the solution that their kind names; the mass matrix is
    stored in full; all others store their outputs one after the other.
    """
    parts: Sequence[_Part]
    n = program.coordinates
    if program.parts:
        return loops_text(program, target, result_name(program))
    if program.kind is ProgramKind.MULTIPLIERS:
        results = sum(len(block.closures) for block in program.blocks)
        parts = _solution(program, {}, {k: Cell("out", k) for k in range(results)})
    elif program.kind is ProgramKind.CHANGE:
        parts, results = _change(program), n
    elif program.kind is ProgramKind.RIGHT_HAND_SIDE:
        parts, results = _right_hand_side(program), 2 * n
    elif program.kind is ProgramKind.MATRIX:
        parts, results = _matrix(program), program.coordinates**2
    else:
        stores = _in_order(program)
        parts, results = [_Stores(stores)], len(stores)
    return _Writer(program, target).text(parts, results, result_name(program))


def result_name(program: Program) -> str:
    """The array that a function stores its results in."""
    return "dydt" if program.kind is ProgramKind.RIGHT_HAND_SIDE else "out"


@dataclass(frozen=True)
class _Stores:
    """Results to store, in any order, and a comment for loops that do so."""

    statements: Sequence[Statement]
    comment: str = ""


@dataclass(frozen=True)
class _Steps:
    """Assignments in their order."""

    assignments: Sequence[Assignment]


@dataclass(frozen=True)
class _Pivots:
    """Tests of the pivots of unrolled blocks."""


@dataclass(frozen=True)
class _Solve:
    """A call of the solver for a block whose matrix stands in the workspace."""

    block: MatrixBlock


_Part = _Stores | _Steps | _Pivots | _Solve

_RIGHT = "Right-hand sides: of the coordinates, then of the closures."


def _in_order(program: Program) -> list[Statement]:
    return [Statement(Cell("out", k), o) for k, o in enumerate(program.results_in_order)]


def _matrix(program: Program) -> list[_Stores]:
    n = program.coordinates
    upper = _upper("out", n, n, program.output("mass_matrix"))
    return [_Stores(upper, "Upper triangle, by rows."), _Stores(_mirrored("out", "o", n))]


def _upper(array: str, n: int, width: int, operands: Sequence[Operand]) -> list[Statement]:
    """Stores of the upper triangle, given by rows, of the n rows first in a wider matrix."""
    indices = [i * width + j for i in range(n) for j in range(i, n)]
    pairs = zip(indices, operands, strict=True)
    return [Statement(Cell(array, index), operand) for index, operand in pairs]


def _mirrored(array: str, kind: str, n: int) -> list[Statement]:
    """Copies of the upper triangle of a matrix to the lower one."""
    return [
        Statement(Cell(array, j * n + i), Variable(f"{kind}{i * n + j}"))
        for i in range(n)
        for j in range(i + 1, n)
    ]


def _right_hand_side(program: Program) -> list[_Part]:
    """Check the pivots, store velocities and accelerations."""
    n = program.coordinates
    velocities = _Stores([Statement(Cell("dydt", i), Variable(f"v{i}")) for i in range(n)])
    pivots, *solved = _solution(program, {i: Cell("dydt", n + i) for i in range(n)}, {})
    return [pivots, velocities, *solved]


def _change(program: Program) -> list[_Part]:
    """Changes of the coordinates that closures hold; those of the others are zero."""
    coupled = {i for block in program.blocks for i in block.coordinates}
    free = [i for i in range(program.coordinates) if i not in coupled]
    zeros = [Statement(Cell("out", i), Constant(Fraction(0))) for i in free]
    return [_Stores(zeros), *_solution(program, {i: Cell("out", i) for i in coupled}, {})]


def _solution(
    program: Program, coordinates: Mapping[int, Cell], closures: Mapping[int, Cell]
) -> list[_Part]:
    """Check the pivots, solve the blocks, store what is found for coordinates and closures."""
    parts: list[_Part] = [_Pivots()]
    accelerations = iter(program.output("acceleration"))
    matrix = iter(program.output("dense_matrix"))
    forcing = iter(program.output("dense_forcing"))
    for block in program.blocks:
        members, size = block.coordinates, len(block.coordinates)
        if block.band is not None:
            entries = [next(matrix) for _ in range(len(block.closures) * (block.band + 1))]
            parts += _band(block, entries, [next(forcing) for _ in block.closures])
            parts.append(_Steps(dependents(program, block.multipliers)))
            named = zip(block.closures, block.multipliers, strict=True)
            copies = [Statement(closures[k], Variable(d)) for k, d in named if k in closures]
            parts.append(_Stores(copies))
        if block.unrolled or block.band is not None:
            if coordinates:
                stores = [Statement(coordinates[i], next(accelerations)) for i in members]
                parts.append(_Stores(stores))
            continue
        entries = [next(matrix) for _ in range(size * (size + 1) // 2)]
        gradients = [next(matrix) for _ in range((size + block.compliant) * len(block.closures))]
        right = [next(forcing) for _ in range(block.size)]
        parts += _dense_block(block, entries, gradients, right)
        targets = [*map(coordinates.get, members), *map(closures.get, block.closures)]
        start = block.size**2
        unknowns = ((cell, Variable(f"d{start + k}")) for k, cell in enumerate(targets))
        parts.append(_Stores([Statement(cell, d) for cell, d in unknowns if cell is not None]))
    return parts


def _band(
    block: MatrixBlock, entries: Sequence[Operand], right: Sequence[Operand]
) -> Iterator[_Part]:
    """Fill the workspace with band and right-hand side, and call the solver."""
    start, size = block.start, len(entries)
    band = [Cell("work", i) for i in range(start - size, start)]
    yield _Stores(list(map(Statement, band, entries)), "The band of the multipliers, by rows.")
    drive = [Cell("work", start + k) for k in range(len(right))]
    yield _Stores(list(map(Statement, drive, right)), "What drives them.")
    yield _Solve(block)


def _dense_block(
    block: MatrixBlock,
    entries: Sequence[Operand],
    gradients: Sequence[Operand],
    right: Sequence[Operand],
) -> Iterator[_Part]:
    """Fill the workspace with matrix and right-hand side, and call the solver."""
    n, size = len(block.coordinates), block.size
    upper = _upper("work", n, size, entries)
    yield _Stores(upper, "Upper triangle of the mass matrix, by rows.")
    if not (block.definite or block.closures):
        yield _Stores(_mirrored("work", "d", n))
    below = [Cell("work", i * size + j) for i in range(n, size) for j in range(n)]
    if block.compliant:
        below += [Cell("work", i * size + i) for i in range(n, size)]
    yield _Stores(list(map(Statement, below, gradients)), "Gradients of the closures, by rows.")
    forcing = [Statement(Cell("work", size * size + i), f) for i, f in enumerate(right)]
    yield _Stores(forcing, _RIGHT if block.closures else "Forcing.")
    yield _Solve(block)


class _Writer:
    """Writes the body of one function line by line."""

    def __init__(self, program: Program, target: CTarget) -> None:
        self.program = program
        self.names = target.names
        self.real = target.real
        self.dialect = target.dialect
        self.lines: list[str] = []
        self.depth = 0
        self.copied: set[int] = set()

    def text(self, parts: Sequence[_Part], results: int, result: str) -> list[str]:
        """Declarations, the assignments, the parts, and the check of the results."""
        blocks = self.program.blocks
        late = {name for b in blocks for name, _ in dependents(self.program, b.multipliers)}
        first = [step for step in self.program.assignments if step[0] not in late]
        steps: list[tuple[_Part, list[Statement | LoopNest]]]
        steps = [(part, self._items(part)) for part in (_Steps(first), *parts)]
        self._place_values([item for _, items in steps for item in items])
        for part, items in steps:
            self._write(part, items)
        self._check(result, results)
        velocities = result == "dydt"
        return [*self._opening(parts, results, velocities), *self.lines]

    # -- where values are ----------------------------------------------------

    def _items(self, part: _Part) -> list[Statement | LoopNest]:
        if isinstance(part, _Steps):
            return self._rolled([Statement(self._cell(n), o) for n, o in part.assignments], False)
        return self._rolled(part.statements if isinstance(part, _Stores) else [], True)

    def _rolled(
        self, statements: Sequence[Statement], independent: bool
    ) -> list[Statement | LoopNest]:
        if not self.program.is_large:
            return list(statements)
        return roll_loops(statements, self._locate, independent)

    def _locate(self, name: str) -> Cell | None:
        return None if name == "t" else self._cell(name)

    def _cell(self, name: str) -> Cell:
        array, number = cell_named(name)
        shift = self.program.coordinates if array == "v" else 0
        return Cell(_ARRAYS[array], number + shift)

    def _place_values(self, items: Sequence[Statement | LoopNest]) -> None:
        """Tell how values are written: those that loops touch live in the workspace."""
        cells = {cell for item in items if isinstance(item, LoopNest) for cell in item.cells()}
        self.stored = {cell.number for cell in cells if cell.array == "w"}
        if self.names.parameter_array is None:
            self.copied = {cell.number for cell in cells if cell.array == "p"}
        texts = {f"w{k}": f"w[{k}]" for k in self.stored}
        multipliers = (d for block in self.program.blocks for d in block.multipliers)
        texts |= {d: f"work[{cell_named(d).number}]" for d in multipliers}
        if self.program.is_large:
            n = self.program.coordinates
            texts |= {f"q{k}": f"y[{k}]" for k in range(n)}
            texts |= {f"v{k}": f"y[{n + k}]" for k in range(n)}
        self.dialect = replace(self.dialect, names={**self.dialect.names, **texts})

    # -- lines -----------------------------------------------------------------

    def _opening(self, parts: Sequence[_Part], results: int, velocities: bool) -> list[str]:
        """Counters, what is read from the arguments, and the arguments that are not used."""
        real, program = self.real.name, self.program
        reads = input_names(program)
        if velocities:
            reads |= {f"v{i}" for i in range(program.coordinates)}
        state = [name for name in self._state() if name in reads]
        uses_work = self.stored or self.copied or any(isinstance(p, _Solve) for p in parts)
        lines = [f"    int {', '.join(_COUNTERS[: self.depth])};"] if self.depth else []
        if not program.is_large:
            lines += [
                f"    const {real} {self._name(s)} = y[{self._cell(s).number}];" for s in state
            ]
        unused = {
            "t": "t" not in reads,
            "y": not state,
            "u": not any(cell_named(name).array == "u" for name in reads),
            **self._unread(reads),
            "work": not uses_work,
            "out": not results,
        }
        lines += [f"    (void){name};" for name, is_so in unused.items() if is_so]
        return lines + self._workspace()

    def _unread(self, reads: Collection[str]) -> dict[str, bool]:
        """Tell which arguments that hold parameters are not used."""
        read = {k for array, k in map(cell_named, reads) if array == "p"}
        if (first := self.names.contact_from) is None:
            return {"p": not read}
        return {"p": not any(k < first for k in read), "contact": not any(k >= first for k in read)}

    def _state(self) -> list[str]:
        return [f"{kind}{i}" for kind in "qv" for i in range(self.program.coordinates)]

    def _name(self, dummy: str) -> str:
        return self.dialect.names.get(dummy, dummy)

    def _workspace(self) -> list[str]:
        """Declare the arrays in which loops find values and parameters."""
        start = solver_workspace_size(self.program.blocks)
        lines = []
        if self.stored:
            lines.append(f"    {self.real.name} *const w = work + {start};")
        if self.copied:
            start += len(self.program.assignments)
            lines.append(f"    {self.real.name} *const c = work + {start};")
            lines += [f"    c[{k}] = {self._name(f'p{k}')};" for k in sorted(self.copied)]
        return lines

    def _write(self, part: _Part, items: Sequence[Statement | LoopNest]) -> None:
        if isinstance(part, _Pivots):
            self._write_pivots()
        elif isinstance(part, _Solve):
            self._write_call(part.block)
        else:
            comment = part.comment if isinstance(part, _Stores) else ""
            if comment and any(isinstance(item, LoopNest) for item in items):
                self.lines.append(f"    /* {comment} */")
            for item in items:
                self._write_item(item)

    def _write_item(self, item: Statement | LoopNest) -> None:
        if isinstance(item, LoopNest):
            self._write_loop(item)
            return
        array, number = item.target
        target = f"{array}[{number}]"
        if array == "w" and number not in self.stored:
            target = f"const {self.real.name} w{number}"
        operand = item.operand
        if isinstance(operand, Variable) and operand.cell.array in "do":
            cell = self._cell(operand.name)
            operand = Variable(f"{cell.array}[{cell.number}]")
        self._assign(target, operand, 1)

    def _assign(self, target: str, operand: Operand, depth: int) -> None:
        text = expression_text(operand, self.dialect)
        self.lines += wrapped(f"{target} = {text};", depth, 1)

    def _write_loop(self, loop: LoopNest) -> None:
        depth = len(loop.counts)
        self.depth = max(self.depth, depth)
        for level, count in enumerate(loop.counts):
            c = _COUNTERS[level]
            head = f"for ({c} = 0; {c} < {_index(count)}; ++{c}) {{"
            self.lines.append("    " * (level + 1) + head)
        for statement in loop.body:
            self._write_repeated(statement, depth + 1)
        self.lines += ["    " * level + "}" for level in range(depth, 0, -1)]

    def _write_repeated(self, statement: LoopStatement, depth: int) -> None:
        target, *texts = map(self._place, statement.places)
        read = iter(texts)

        def placed(variable: Variable) -> Variable:
            text = next(read)
            return variable if text is None else Variable(text)

        self._assign(str(target), rebuilt(statement.operand, placed), depth)

    def _place(self, place: ArrayAccess | None) -> str | None:
        if place is None:
            return None
        array, index = place
        name = (self.names.parameter_array or "c") if array == "p" else array
        return f"{name}[{_index(index)}]"

    def _write_pivots(self) -> None:
        program, zero = self.program, self.real.value(0.0)
        pivots = zip(program.output("pivots"), program.output("scales"), strict=True)
        for block in program.blocks:
            for k in range(len(block.coordinates) if block.unrolled else 0):
                pivot, scale = next(pivots)
                text = expression_text(pivot, self.dialect)
                if not block.definite:
                    test = f"{self.dialect.functions['abs']}({text}) > {zero}"
                elif k and not block.exact:
                    bound = Product((Variable(f"{self.names.prefix}_{EPSILON_NAME}"), scale), ())
                    test = f"{text} > {expression_text(bound, self.dialect)}"
                else:
                    test = f"{text} > {zero}"
                self.lines += [f"    if (!({test})) {{", "        return 1;", "    }"]

    def _write_call(self, block: MatrixBlock) -> None:
        n, m, size = len(block.coordinates), len(block.closures), block.size
        prefix = f"{self.names.prefix}_solve"
        kind = "definite" if block.definite else "saddle" if block.closures else "pivoted"
        sizes = f"{n}, {m}" if block.closures else f"{n}"
        call = f"{prefix}_{kind}({sizes}, work, work + {size * size})"
        if block.band is not None:
            start = _index(AffineIndex(block.start - m * (block.band + 1), ()))
            place = "work" if start == "0" else f"work + {start}"
            call = f"{prefix}_banded({m}, {block.band}, {place}, work + {block.start})"
        self.lines += [f"    if ({call} != 0) {{", "        return 1;", "    }"]

    def _check(self, result: str, results: int) -> None:
        self.depth = max(self.depth, 1 if results else 0)
        self.lines += finite_check(result, results)
        self.lines.append("    return 0;")


def _index(affine: AffineIndex) -> str:
    """base+step*counter+…, without what is zero, and without a place to break a line."""
    text = str(affine.base) if affine.base else ""
    for step, counter in zip(affine.steps, _COUNTERS, strict=False):
        if step:
            term = counter if abs(step) == 1 else f"{abs(step)}*{counter}"
            sign = "-" if step < 0 else "+" if text else ""
            text += sign + term
    return text or "0"
