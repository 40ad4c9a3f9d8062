"""Bodies of emitted C functions: assignments, loops, stores and solvers.

A small program is straight-line code over named values. In a large one,
statements of one shape are loops over the values ``w[0], w[1], …``, which then
live in the workspace; the others keep names of their own.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from lagrange_cli.emit.c.loops import finite_check, loops_text, loops_workspace_size, wrapped
from lagrange_cli.emit.c.parts import (
    Part,
    Pivots,
    Solve,
    SolveColumns,
    Steps,
    Stores,
    Zeros,
    parts_of,
)
from lagrange_cli.emit.c.solvers import EPSILON_NAME, solver_workspace_size
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.program.graph.operands import (
    Cell,
    Operand,
    Product,
    Variable,
    array_named,
    cell_named,
    rebuilt,
)
from lagrange_cli.program.graph.statement_groups import dependents
from lagrange_cli.program.printing import expression_text
from lagrange_cli.program.program import Program, ProgramKind
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.program.systems.loop_rolling import (
    COUNTED,
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

#: Those of accelerations and multipliers, behind the velocities in an array ``given``.
_GIVEN = "al"


def program_workspace_size(program: Program) -> int:
    """Return numbers of workspace: what the solver needs, then values and parameters of loops
    (at least 1, so that an array of that size exists)."""
    if program.parts:
        return max(loops_workspace_size(program), 1)
    values = len(program.assignments) + program.parameters if program.is_large else 0
    return max(_solver_workspace(program) + values, 1)


def _solver_workspace(program: Program) -> int:
    if program.jacobian is not None:
        return program.jacobian.workspace
    return solver_workspace_size(program.blocks)


def given_size(program: Program) -> int:
    """Return numbers of workspace that hold accelerations and multipliers that a program reads."""
    kinds = set(map(array_named, program.reads))
    if not kinds.intersection(_GIVEN):
        return 0
    return 2 * program.coordinates + ("l" in kinds) * program.multipliers


def body_text(program: Program, target: CTarget) -> list[str]:
    """Return the lines of a function that stores the outputs of a program.

    Programs that solve a system store the solution that their kind names; the mass matrix is
    stored in full; all others store their outputs one after the other.
    """
    if program.parts:
        return loops_text(program, target, result_name(program))
    parts, results = parts_of(program)
    return _Writer(program, target).text(parts, results, result_name(program))


def result_name(program: Program) -> str:
    """Return the array that a function stores its results in."""
    return "dydt" if program.kind is ProgramKind.RIGHT_HAND_SIDE else "out"


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
        self.cells: dict[str, Cell] = {}

    def text(self, parts: Sequence[Part], results: int, result: str) -> list[str]:
        """Declarations, the assignments, the parts, and the check of the results."""
        blocks = self.program.blocks
        late = {
            name for b in blocks for name, _ in dependents(self.program.assignments, b.multipliers)
        }
        first = [step for step in self.program.assignments if step[0] not in late]
        steps: list[tuple[Part, list[Statement | LoopNest]]]
        steps = [(part, self._items(part)) for part in (Steps(first), *parts)]
        self._place_values([item for _, items in steps for item in items])
        for part, items in steps:
            self._write(part, items)
        self._check(result, results)
        velocities = result == "dydt"
        return [*self._opening(parts, results, velocities), *self.lines]

    # -- where values are ----------------------------------------------------

    def _items(self, part: Part) -> list[Statement | LoopNest]:
        if isinstance(part, Steps):
            return self._rolled([Statement(self._cell(n), o) for n, o in part.assignments], False)
        if isinstance(part, Stores):
            return self._rolled(part.statements, True, part.rolled)
        return []

    def _rolled(
        self, statements: Sequence[Statement], independent: bool, always: bool = False
    ) -> list[Statement | LoopNest]:
        if not (self.program.is_large or always):
            return list(statements)
        return roll_loops(statements, self._locate, independent)

    def _locate(self, name: str) -> Cell | None:
        return None if name == "t" else self._cell(name)

    def _cell(self, name: str) -> Cell:
        cell = self.cells.get(name)
        if cell is None:
            array, number = cell_named(name)
            n = self.program.coordinates
            if array in _GIVEN:
                cell = Cell("given", number + (n if array == "a" else 2 * n))
            else:
                cell = Cell(_ARRAYS[array], number + (n if array == "v" else 0))
            self.cells[name] = cell
        return cell

    def _place_values(self, items: Sequence[Statement | LoopNest]) -> None:
        """Tell how values are written: those that loops touch live in the workspace."""
        loops = [item for item in items if isinstance(item, LoopNest)]
        self.stored = {number for loop in loops for number in loop.numbers("w")}
        if self.names.parameter_array is None:
            self.copied = {number for loop in loops for number in loop.numbers("p")}
        texts = {f"w{k}": f"w[{k}]" for k in self.stored}
        multipliers = (d for block in self.program.blocks for d in block.multipliers)
        texts |= {d: f"work[{cell_named(d).number}]" for d in multipliers}
        n = self.program.coordinates
        texts |= {f"a{k}": f"given[{n + k}]" for k in range(n)}
        texts |= {f"l{k}": f"given[{2 * n + k}]" for k in range(self.program.multipliers)}
        if self.program.is_large:
            texts |= {f"q{k}": f"y[{k}]" for k in range(n)}
            texts |= {f"v{k}": f"y[{n + k}]" for k in range(n)}
        self.dialect = replace(self.dialect, names={**self.dialect.names, **texts})

    # -- lines -----------------------------------------------------------------

    def _opening(self, parts: Sequence[Part], results: int, velocities: bool) -> list[str]:
        """Counters, what is read from the arguments, and the arguments that are not used."""
        real, program = self.real.name, self.program
        reads = program.reads
        if velocities:
            reads |= {f"v{i}" for i in range(program.coordinates)}
        state = [name for name in self._state() if name in reads]
        solves = any(isinstance(p, Solve | SolveColumns) for p in parts)
        uses_work = self.stored or self.copied or solves or given_size(program)
        lines = [f"    int {', '.join(_COUNTERS[: self.depth])};"] if self.depth else []
        if not program.is_large:
            lines += [
                f"    const {real} {self._name(s)} = y[{self._cell(s).number}];" for s in state
            ]
        unused = {
            "t": "t" not in reads,
            "y": not state,
            "u": "u" not in map(array_named, reads),
            **self._unread(reads),
            "work": not uses_work,
            "out": not results,
        }
        lines += [f"    (void){name};" for name, is_so in unused.items() if is_so]
        return lines + self._given() + self._workspace()

    def _given(self) -> list[str]:
        """Call the functions that give accelerations and multipliers, where they are read."""
        program, names = self.program, self.names
        size, n = given_size(program), program.coordinates
        if not size:
            return []
        prefix = names.prefix + ("" if names.contact_from is None else "_contact")
        passed = f"{names.passed}, work + {size}"
        failed = ["    if (status != 0) {", "        return status;", "    }"]
        lines = [
            f"    {self.real.name} *const given = work;",
            f"    int status = {prefix}_rhs({passed}, given);",
            *failed,
        ]
        if size > 2 * n:
            lines += [f"    status = {prefix}_multipliers({passed}, given + {2 * n});", *failed]
        return [*lines, f"    work += {size};"]

    def _unread(self, reads: Collection[str]) -> dict[str, bool]:
        """Tell which arguments that hold parameters are not used."""
        if (first := self.names.contact_from) is None:
            return {"p": "p" not in map(array_named, reads)}
        read = {k for array, k in map(cell_named, reads) if array == "p"}
        return {"p": not any(k < first for k in read), "contact": not any(k >= first for k in read)}

    def _state(self) -> list[str]:
        return [f"{kind}{i}" for kind in "qv" for i in range(self.program.coordinates)]

    def _name(self, dummy: str) -> str:
        return self.dialect.names.get(dummy, dummy)

    def _workspace(self) -> list[str]:
        """Declare the arrays in which loops find values and parameters."""
        start = _solver_workspace(self.program)
        lines = []
        if self.stored:
            lines.append(f"    {self.real.name} *const w = work + {start};")
        if self.copied:
            start += len(self.program.assignments)
            lines.append(f"    {self.real.name} *const c = work + {start};")
            lines += [f"    c[{k}] = {self._name(f'p{k}')};" for k in sorted(self.copied)]
        return lines

    def _write(self, part: Part, items: Sequence[Statement | LoopNest]) -> None:
        if isinstance(part, Pivots):
            self._write_pivots()
        elif isinstance(part, Solve):
            self._write_call(part.block)
        elif isinstance(part, SolveColumns):
            self._write_columns(part)
        elif isinstance(part, Zeros):
            self._write_zeros(part)
        else:
            comment = part.comment if isinstance(part, Stores) else ""
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
        if array == COUNTED:
            return f"({self.real.name})({_index(index)})"
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

    def _write_columns(self, part: SolveColumns) -> None:
        n, size, columns = len(part.block.coordinates), part.block.size, len(part.block.columns)
        right = size * size
        arrays = f"work, work + {right}, work + {right + size * columns}"
        call = f"{self.names.prefix}_solve_columns({n}, {size}, {columns}, {arrays})"
        self.lines += [f"    if ({call} != 0) {{", "        return 1;", "    }"]

    def _write_zeros(self, part: Zeros) -> None:
        self.depth = max(self.depth, 1)
        start = f"{part.start} + i" if part.start else "i"
        self.lines += [
            f"    for (i = 0; i < {part.count}; ++i) {{",
            f"        {part.array}[{start}] = {self.real.value(0.0)};",
            "    }",
        ]

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
