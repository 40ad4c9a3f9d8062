"""Bodies of emitted Python functions of large systems: arrays in place of loops."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap

from lagrange_cli.emit.python.styles import array_functions
from lagrange_cli.program.printing import Dialect, double_literal, local_name, local_text
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.sparse_factorization import BandFactors
from lagrange_cli.program.systems.loops import (
    IndexColumn,
    IndexedLoop,
    ProgramPart,
    SparseSolve,
    Total,
    Zeros,
    columns_of,
    relative_indices,
    supernode_tables,
    table_name,
    tables_of,
)

#: Longer lines are broken.
_WIDTH = 92

_TAB = " " * 4

_DIALECT = Dialect(double_literal, array_functions("np"), {})


def index_tables_source(programs: Iterable[Program]) -> str:
    """Return definitions of the tables of indices that the functions of programs look into."""
    tables = dict.fromkeys(table for program in programs for table in tables_of(program.parts))
    lines = []
    for table in tables:
        lines += [f"{_name(table)} = np.array(", *_wrapped(f"[{', '.join(map(str, table))}]", 1)]
        lines.append(")")
    return "\n".join([*lines, ""]) if lines else ""


def loops_source(program: Program, apart: int | None = None) -> list[str]:
    """Return the lines of a function that gives an array of the results.

    Parameters
    ----------
    apart
        Where flags and targets of contacts begin, if they stand in ``contact`` and not in ``p``.
    """
    writer = _Writer(program, apart)
    arrays = {column.array for column in columns_of(program.parts)}
    indexed = {
        writer.array(c) for c in columns_of(program.parts) if c.array in "ps" and not c.is_fixed
    }
    lines = ["u = array(u(t, y, p), float)"] if "u" in arrays else []
    lines += [f"{array} = array({array}, float)" for array in sorted(indexed)]
    if program.work:
        lines.append(f"w = np.empty(({program.work}, *y.shape[1:]))")
    lines.append(f"out = np.empty(({program.results}, *y.shape[1:]))")
    lines.append('with np.errstate(all="ignore"):')
    body = [line for part in program.parts for line in writer.lines(part)]
    return [*lines, *(_TAB + line for line in body or ["pass"])]


class _Writer:
    """Writes parts of a program."""

    def __init__(self, program: Program, apart: int | None) -> None:
        self.before = {"v": program.coordinates, "s": -(apart or 0)}
        self.arrays = {"q": "y", "v": "y", "s": "p" if apart is None else "contact"}

    def lines(self, part: ProgramPart) -> list[str]:
        if isinstance(part, IndexedLoop):
            return self._loop(part)
        if isinstance(part, Zeros):
            return [f"{part.array}[{part.start}:{part.start + part.count}] = 0.0"]
        if isinstance(part, Total):
            end = part.start + part.count
            return [f"w[{part.start}] = w[{part.start}:{end}].sum(axis=0)"]
        return _elimination(part)

    def _loop(self, loop: IndexedLoop) -> list[str]:
        lines = [
            f"l{k} = {self._place(column, loop.members)}" for k, column in enumerate(loop.inputs)
        ]
        lines += [f"{local_name(name)} = {local_text(o, _DIALECT)}" for name, o in loop.assignments]
        lines += [
            f"{self._place(c, loop.members)} = {local_text(o, _DIALECT)}" for c, o in loop.results
        ]
        return [piece for line in lines for piece in _wrapped(line, 0)]

    def _place(self, column: IndexColumn, members: int) -> str:
        """Write the cells of a name of a loop: a number, or an array with one for each member."""
        if column.array == "t":
            return "t"
        start = column.indices[0] + self.before.get(column.array, 0)
        return f"{self.array(column)}[{_indices(column, start, members)}]"

    def array(self, column: IndexColumn) -> str:
        """Return the name of the array that a column is of."""
        return self.arrays.get(column.array, column.array)


def _indices(column: IndexColumn, start: int, members: int) -> str:
    """One index, a slice, or a look into a table."""
    step = column.step
    if members == 1 or step == 0:
        return str(start)
    if step is None:
        name = _name(relative_indices(column))
        return f"{name} + {start}" if start else name
    if step < 0:
        return f"np.arange({start}, {start + step * members}, {step})"
    end = start + step * (members - 1) + 1
    return f"{start}:{end}" if step == 1 else f"{start}:{end}:{step}"


def _elimination(part: SparseSolve) -> list[str]:
    factors, m = part.factors, len(part.factors.order)
    matrix = f"w[{part.matrix}:{part.matrix + factors.numbers}]"
    vector = f"w[{part.vector}:{part.vector + m}]"
    if isinstance(factors, BandFactors):
        width = factors.numbers // m
        return [f"{vector} = _solve_banded(_shaped({matrix}, {m}, {width}), {vector})"]
    node, rows, sources, spots = map(_name, supernode_tables(factors))
    tables = f"{node}.reshape(-1, 6), {rows}, {sources}.reshape(-1, 4), {spots}"
    return _wrapped(f"_solve_sparse({m}, {tables}, {matrix}, {vector})", 0)


def _name(table: tuple[int, ...]) -> str:
    return table_name("_", table)[1:]


def _wrapped(text: str, depth: int) -> list[str]:
    """Return lines of a statement: a long one in parentheses."""
    indent = _TAB * depth
    if len(text) <= _WIDTH:
        return [indent + text]
    target, equals, value = text.partition(" = ")
    if equals:
        lines = wrap(value, _WIDTH, break_long_words=False, break_on_hyphens=False)
        return [f"{target} = (", *(_TAB + line for line in lines), ")"]
    return wrap(
        text,
        _WIDTH,
        initial_indent=indent,
        subsequent_indent=indent + _TAB,
        break_long_words=False,
        break_on_hyphens=False,
    )
