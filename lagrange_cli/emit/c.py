"""C99: a header and a source file with the C interface of the documentation.

The code allocates nothing, keeps no state, calls only ``<math.h>``, and
compiles without warnings as C99 and as C++.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from lagrange_cli.emit.c_header import header_text
from lagrange_cli.emit.c_main import main_text
from lagrange_cli.emit.c_names import CNames, Real, file_stem, real_type
from lagrange_cli.emit.c_solvers import EPSILON_NAME, helper_text, solver_text, work_size
from lagrange_cli.emit.printing import Dialect, expression, functions_in
from lagrange_cli.emit.program import (
    FUNCTIONS,
    Operand,
    Product,
    Program,
    Variable,
    build_program,
    input_names,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["emit", "function_names", "function_text", "functions_used"]

#: Lines of arithmetic are broken before this column.
WIDTH = 96

#: Function of the interface → outputs that it writes, one after the other.
_OUTPUTS: dict[str, tuple[str, ...]] = {
    "rhs": ("acceleration",),
    "mass_matrix": ("mass_matrix",),
    "forcing": ("forcing",),
    "energy": ("kinetic", "potential", "energy"),
    "positions": ("positions",),
}


def emit(equations: Equations, options: Mapping[str, str | bool]) -> dict[str, str]:
    """``NAME.h`` and ``NAME.c``.

    Parameters
    ----------
    options
        ``real``: ``float``, ``double`` or ``long-double``; ``main``: whether
        the source ends with a ``main`` that integrates and prints CSV.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in C.
    InputError
        A constant is outside the range of the number type.
    """
    real = real_type(str(options["real"]))
    names = CNames.of(equations)
    programs = {
        function: build_program(equations, outputs) for function, outputs in _OUTPUTS.items()
    }
    work = work_size(programs["rhs"].blocks)
    stem = file_stem(equations.name)
    source = _source(equations, names, real, programs, stem)
    if options["main"]:
        source += main_text(equations, names, real)
    return {f"{stem}.h": header_text(equations, names, real, work), f"{stem}.c": source}


def _source(
    equations: Equations, names: CNames, real: Real, programs: Mapping[str, Program], stem: str
) -> str:
    dialect = Dialect(real.literal, function_names(names, real), names.inputs)
    used = set().union(*(functions_used(program) for program in programs.values()))
    parts = [
        f"/* {names.prefix}: see {stem}.h, which documents every function. */\n",
        f'#include "{stem}.h"\n\n#include <math.h>\n',
        helper_text(used, names, real),
        solver_text(programs["rhs"].blocks, names, real),
        _defaults(equations, names, real),
    ]
    for function, program in programs.items():
        parts.append(function_text(function, program, names, real, dialect))
    return "\n".join(part for part in parts if part)


def function_names(names: CNames, real: Real) -> dict[str, str]:
    """Every function of a program by its C name."""
    own = {"sign", "min", "max"}
    table = {name: name + real.suffix for name in FUNCTIONS if name not in own}
    table["abs"] = "fabs" + real.suffix
    return table | {name: f"{names.prefix}_{name}" for name in sorted(own)}


def functions_used(program: Program) -> set[str]:
    """The functions that a program calls."""
    operands = [operand for _, operand in program.assignments]
    operands += [operand for _, of in program.outputs for operand in of]
    return set().union(*map(functions_in, operands))


def _defaults(equations: Equations, names: CNames, real: Real) -> str:
    lines = [f"void {names.prefix}_defaults({names.prefix}_params *p)", "{"]
    for parameter, field in zip(equations.parameters, names.fields, strict=True):
        value = "NAN" if parameter.value is None else real.value(parameter.value)
        lines.append(f"    p->{field} = {value};")
    if not equations.parameters:
        lines.append(f"    p->{names.empty_field} = {real.value(0.0)};")
    return "\n".join([*lines, "}", ""])


def function_text(
    function: str, program: Program, names: CNames, real: Real, dialect: Dialect
) -> str:
    """The definition of one function of the interface: a right-hand side where it has blocks."""
    body = _Body(program, names, real, dialect)
    if program.blocks:
        body.write_rhs()
    elif function == "mass_matrix":
        body.write_matrix()
    else:
        body.write_outputs()
    result = "dydt" if program.blocks else "out"
    return "\n".join(
        [
            f"int {names.prefix}_{function}({names.arguments(real, result)})",
            "{",
            *body.text(result),
            "}",
            "",
        ]
    )


class _Body:
    """The body of one function, collected line by line."""

    def __init__(self, program: Program, names: CNames, real: Real, dialect: Dialect) -> None:
        self.program = program
        self.names = names
        self.real = real
        self.dialect = dialect
        self.lines: list[str] = []
        self.results = 0
        self.uses_work = False
        self.reads = set(input_names(program))

    def text(self, result: str) -> list[str]:
        """Declarations, the lines, and the check of the results."""
        opening = self._loads()
        if self.results:
            opening.insert(0, "    int i;")
        return [*opening, *self._assignments(), *self.lines, *self._check(result)]

    def _loads(self) -> list[str]:
        """Read the state that is used, and touch the arguments that are not."""
        n = self.program.coordinates
        state = [f"{kind}{i}" for kind in "qv" for i in range(n)]
        loads = [
            f"    const {self.real.name} {self.names.inputs[name]} = y[{k}];"
            for k, name in enumerate(state)
            if name in self.reads
        ]
        unused = {
            "t": "t" not in self.reads,
            "y": not loads,
            "u": True,
            "p": not any(name.startswith("p") for name in self.reads),
            "work": not self.uses_work,
            "out": not self.results,
        }
        return [*loads, *(f"    (void){name};" for name, is_so in unused.items() if is_so)]

    def _assignments(self) -> list[str]:
        lines = []
        for name, operand in self.program.assignments:
            lines += self._statement(f"const {self.real.name} {name}", operand)
        return lines

    def _statement(self, target: str, operand: Operand) -> list[str]:
        text = f"{target} = {expression(operand, self.dialect)};"
        return wrap(
            text,
            WIDTH,
            initial_indent=" " * 4,
            subsequent_indent=" " * 8,
            break_long_words=False,
            break_on_hyphens=False,
        )

    def _store(self, target: str, operand: Operand) -> None:
        self.lines += self._statement(target, operand)

    def _check(self, result: str) -> list[str]:
        if not self.results:
            return ["    return 0;"]
        return [
            f"    for (i = 0; i < {self.results}; ++i) {{",
            f"        if (!isfinite({result}[i])) {{",
            "            return 2;",
            "        }",
            "    }",
            "    return 0;",
        ]

    def write_outputs(self) -> None:
        """Store the operands of all outputs one after the other."""
        for _, operands in self.program.outputs:
            for operand in operands:
                self._store(f"out[{self.results}]", operand)
                self.results += 1

    def write_matrix(self) -> None:
        """Store the upper triangle and its mirror image, by rows."""
        n = self.program.coordinates
        operands = iter(self.program.output("mass_matrix"))
        for i in range(n):
            for j in range(i, n):
                self._store(f"out[{i * n + j}]", next(operands))
                if j > i:
                    self.lines.append(f"    out[{j * n + i}] = out[{i * n + j}];")
        self.results = n * n

    def write_rhs(self) -> None:
        """Check the pivots, store velocities and accelerations."""
        n = self.program.coordinates
        self.reads |= {f"v{i}" for i in range(n)}
        self.results = 2 * n
        self._check_pivots()
        for i in range(n):
            self.lines.append(f"    dydt[{i}] = {self.names.inputs[f'v{i}']};")
        accelerations = iter(self.program.output("acceleration"))
        matrix = iter(self.program.output("dense_matrix"))
        forcing = iter(self.program.output("dense_forcing"))
        for block in self.program.blocks:
            if block.unrolled:
                for i in block.coordinates:
                    self._store(f"dydt[{n + i}]", next(accelerations))
            else:
                size = len(block.coordinates)
                upper = [next(matrix) for _ in range(size * (size + 1) // 2)]
                self._write_loop(block.coordinates, block.definite, upper, forcing)

    def _check_pivots(self) -> None:
        pivots = zip(self.program.output("pivots"), self.program.output("scales"), strict=True)
        for block in self.program.blocks:
            for k in range(len(block.coordinates) if block.unrolled else 0):
                pivot, scale = next(pivots)
                text = expression(pivot, self.dialect)
                if not block.definite:
                    test = f"{self.dialect.functions['abs']}({text}) > {self.real.value(0.0)}"
                elif k and not block.exact:
                    bound = Product((Variable(f"{self.names.prefix}_{EPSILON_NAME}"), scale), ())
                    test = f"{text} > {expression(bound, self.dialect)}"
                else:
                    test = f"{text} > {self.real.value(0.0)}"
                self.lines += [f"    if (!({test})) {{", "        return 1;", "    }"]

    def _write_loop(
        self,
        coordinates: Sequence[int],
        definite: bool,
        upper: Iterable[Operand],
        forcing: Iterator[Operand],
    ) -> None:
        """Fill the workspace with matrix and right-hand side, and call the solver."""
        n = len(coordinates)
        self.uses_work = True
        entries = iter(upper)
        for i in range(n):
            for j in range(i, n):
                self._store(f"work[{i * n + j}]", next(entries))
                if j > i and not definite:
                    self.lines.append(f"    work[{j * n + i}] = work[{i * n + j}];")
        for i in range(n):
            self._store(f"work[{n * n + i}]", next(forcing))
        solver = f"{self.names.prefix}_solve_{'definite' if definite else 'pivoted'}"
        call = f"{solver}({n}, work, work + {n * n})"
        self.lines += [f"    if ({call} != 0) {{", "        return 1;", "    }"]
        for k, i in enumerate(coordinates):
            self.lines.append(f"    dydt[{self.program.coordinates + i}] = work[{n * n + k}];")
