"""Bodies of emitted C functions of large systems: loops over members.

Indices into arrays advance by constant steps, or are looked up in tables: static arrays of
the source file, which functions share.
"""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import wrap

from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.printing import local_name, local_text
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.sparse_factorization import BandFactors, SupernodalFactors
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

#: Lines are broken before this column.
_WIDTH = 96


def _table_text(prefix: str, table: tuple[int, ...]) -> str:
    rows = wrapped(", ".join(map(str, table)), 1, 0)
    name = table_name(prefix, table)
    return "\n".join([f"static const int {name}[] = {{", *rows, "};", ""])


def loop_helpers(programs: Mapping[str, Program], target: CTarget) -> str:
    """Write what the loops of a source file need: solvers, sums, tables."""
    parts = [part for program in programs.values() for part in program.parts]
    solved = [part.factors for part in parts if isinstance(part, SparseSolve)]
    texts = []
    if any(isinstance(factors, BandFactors) for factors in solved):
        texts.append(target.fill(c_template("solve_banded")))
    if any(isinstance(factors, SupernodalFactors) for factors in solved):
        texts.append(target.fill(c_template("solve_sparse")))
    if any(isinstance(part, Total) for part in parts):
        texts.append(target.fill(c_template("total")))
    tables = dict.fromkeys(t for program in programs.values() for t in tables_of(program.parts))
    texts += [_table_text(target.prefix, table) for table in tables]
    return "\n".join(filter(None, texts))


def loops_workspace_size(program: Program) -> int:
    """Return numbers of workspace: values, then parameters that loops index."""
    return program.work + (program.parameters if _indexes_parameters(program) else 0)


def _indexes_parameters(program: Program) -> bool:
    return any(c.array == "p" and not c.is_fixed for c in columns_of(program.parts))


def loops_text(program: Program, target: CTarget, result: str) -> list[str]:
    """Return the lines of a function that runs the parts of a program.

    ``result``: the name of the array of results.
    """
    writer = _Writer(program, target, result)
    for part in program.parts:
        writer.write(part)
    counted = program.results or "(i = 0;" in "".join(writer.lines)
    counter = ["    int i;"] if counted else []
    check = finite_check(result, program.results)
    return [*counter, *writer.opening(), *writer.lines, *check, "    return 0;"]


def finite_check(result: str, count: int) -> list[str]:
    """Return the lines of a function that return 2 where a result is not finite."""
    if not count:
        return []
    return [
        f"    for (i = 0; i < {count}; ++i) {{",
        f"        if (!isfinite({result}[i])) {{",
        "            return 2;",
        "        }",
        "    }",
    ]


class _Writer:
    """Writes parts of a program line by line."""

    def __init__(
        self,
        program: Program,
        target: CTarget,
        result: str,
    ) -> None:
        self.program = program
        self.names = target.names
        self.dialect = target.dialect
        self.real = target.real.name
        self.zero = target.real.value(0.0)
        self.result = result
        self.lines: list[str] = []
        self.copies = target.names.parameter_array is None and _indexes_parameters(program)

    def opening(self) -> list[str]:
        """Return the arguments that are not used, and parameters that loops index."""
        arrays = {column.array for column in columns_of(self.program.parts)}
        uses_work = "w" in arrays or self.copies
        unused = {
            "t": "t" not in arrays,
            "y": not arrays & {"q", "v"},
            "u": "u" not in arrays,
            **self._unread(arrays),
            "work": not uses_work,
            self.result: not self.program.results,
        }
        lines = [f"    (void){name};" for name, is_so in unused.items() if is_so]
        if self.copies:
            lines.append(f"    {self.real} *const c = work + {self.program.work};")
            fields = range(self.names.contact_from or self.program.parameters)
            lines += [f"    c[{k}] = {self.dialect.names[f'p{k}']};" for k in fields]
        return lines

    def _unread(self, arrays: set[str]) -> dict[str, bool]:
        """Tell which arguments that hold parameters are not used."""
        if self.names.contact_from is None:
            return {"p": arrays.isdisjoint({"p", "s"})}
        return {"p": "p" not in arrays, "contact": "s" not in arrays}

    def write(self, part: ProgramPart) -> None:
        if isinstance(part, IndexedLoop):
            self._loop(part)
        elif isinstance(part, Zeros):
            array = self._array(part.array)
            self.lines += [
                f"    for (i = 0; i < {part.count}; ++i) {{",
                f"        {array}[{_sum(part.start, 'i')}] = {self.zero};",
                "    }",
            ]
        elif isinstance(part, Total):
            call = f"{self.names.prefix}_total({part.count}, {_pointer(part.start)})"
            self.lines.append(f"    (void){call};")
        else:
            self._elimination(part)

    def _elimination(self, part: SparseSolve) -> None:
        factors, prefix = part.factors, f"{self.names.prefix}_solve"
        matrix, vector = _pointer(part.matrix), _pointer(part.vector)
        if isinstance(factors, BandFactors):
            call = f"{prefix}_banded({len(factors.order)}, {factors.width}, {matrix}, {vector})"
        else:
            tables = ", ".join(table_name(self.names.prefix, t) for t in supernode_tables(factors))
            sizes = f"{len(factors.order)}, {len(factors.nodes)}"
            call = f"{prefix}_sparse({sizes}, {tables}, {matrix}, {vector})"
        self.lines += [*wrapped(f"if ({call} != 0) {{", 1, 2), "        return 1;", "    }"]

    def _loop(self, loop: IndexedLoop) -> None:
        """Write what is the same for all members, then a loop over them."""
        repeats = loop.members > 1
        fixed = loop.fixed
        outside: list[str] = []
        inside: list[str] = []
        for k, column in enumerate(loop.inputs):
            line = f"const {self.real} l{k} = {self._place(column, repeats)};"
            (outside if f"l{k}" in fixed else inside).append(line)
        for name, operand in loop.assignments:
            line = f"const {self.real} {local_name(name)} = {local_text(operand, self.dialect)};"
            (outside if name in fixed else inside).append(line)
        for column, operand in loop.results:
            inside.append(f"{self._place(column, repeats)} = {local_text(operand, self.dialect)};")
        self.lines.append("    {")
        self.lines += [line for text in outside for line in wrapped(text, 2, 1)]
        if repeats:
            self.lines.append(f"        for (i = 0; i < {loop.members}; ++i) {{")
        self.lines += [line for text in inside for line in wrapped(text, 2 + repeats, 1)]
        self.lines += ["        }", "    }"] if repeats else ["    }"]

    def _place(self, column: IndexColumn, repeats: bool) -> str:
        """Write the cell of a name of a loop, for one member."""
        first, step = column.indices[0], column.step
        if column.array == "t":
            return "t"
        if column.array == "p" and column.is_fixed:
            return self.dialect.names[f"p{first}"]
        before = {"v": self.program.coordinates, "s": -(self.names.contact_from or 0)}
        start = first + before.get(column.array, 0)
        array = self._array(column.array)
        if not repeats or step == 0:
            return f"{array}[{start}]"
        if step is not None:
            return f"{array}[{_sum(start, 'i' if step == 1 else f'{step}*i')}]"
        table = table_name(self.names.prefix, relative_indices(column))
        return f"{array}[{_sum(start, f'{table}[i]')}]"

    def _array(self, array: str) -> str:
        parameters = self.names.parameter_array or "c"
        flags = parameters if self.names.contact_from is None else "contact"
        named = {"q": "y", "v": "y", "w": "work", "p": parameters, "s": flags, "out": self.result}
        return named.get(array, array)


def _pointer(start: int) -> str:
    return f"work + {start}" if start else "work"


def _sum(start: int, term: str) -> str:
    """start + term without what is zero, and without a place to break a line."""
    if term.startswith("-"):
        return f"{start}{term}"
    return f"{start}+{term}" if start else term


def wrapped(text: str, depth: int, deeper: int) -> list[str]:
    """Return lines of a statement at a depth; further ones stand deeper."""
    return wrap(
        text,
        _WIDTH,
        initial_indent="    " * depth,
        subsequent_indent="    " * (depth + deeper),
        break_long_words=False,
        break_on_hyphens=False,
    )
