"""Lines of emitted Python that differentiate the accelerations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lagrange_cli.emit.python.statements import bordered, symmetric, vector_text
from lagrange_cli.program.printing import Dialect
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.jacobians import Jacobian


def jacobian_shape(jacobian: Jacobian) -> str:
    """Write the shape of the result."""
    if jacobian.pattern is not None:
        return str(jacobian.size)
    return f"({jacobian.rows}, {jacobian.columns})"


def pattern_constants(programs: Mapping[str, Program]) -> list[str]:
    """Define where the numbers of sparse results stand in the matrix."""
    lines = []
    for name, program in programs.items():
        if program.jacobian is not None and program.jacobian.pattern is not None:
            rows, columns = zip(*program.jacobian.pattern, strict=True)
            constant = name.removeprefix("contact_").upper()
            lines += [f"{constant}_ROWS = {rows!r}", f"{constant}_COLUMNS = {columns!r}"]
    return lines


def with_given(program: Program, dialect: Dialect) -> Dialect:
    """Name the accelerations and multipliers that a program reads."""
    accelerations = {f"a{k}": f"given[{k}]" for k in range(program.coordinates)}
    multipliers = {f"l{k}": f"pushes[{k}]" for k in range(program.multipliers)}
    return replace(dialect, names={**dialect.names, **accelerations, **multipliers})


def given_lines(program: Program, prefix: str, passed: str) -> list[str]:
    """Call the functions that give accelerations and multipliers, where they are read."""
    kinds = {name[0] for name in program.reads}
    lines = []
    if kinds.intersection("al"):
        lines.append(f"given = _numbers({prefix}rhs({passed})[{program.coordinates}:])")
    if "l" in kinds:
        lines.append(f"pushes = _numbers({prefix}multipliers({passed}))")
    return lines


def jacobian_lines(program: Program, dialect: Dialect, failure: str) -> list[str]:
    """Solve for the derivatives, and return them."""
    jacobian = program.jacobian
    assert jacobian is not None
    place = jacobian.stored
    lines = [f"out = np.zeros(({jacobian.size}, *y.shape[1:]))"]
    if jacobian.entries:
        written = vector_text(program.output("entries"), dialect)
        lines.append(f"out[{[place[at] for at in jacobian.entries]}] = {written}")
    matrix = iter(program.output("dense_matrix"))
    forcing = iter(program.output("dense_forcing"))
    for number, block in enumerate(jacobian.blocks):
        n, m = len(block.coordinates), len(block.closures)
        count = n * (n + 1) // 2 + n * m + m * block.compliant
        upper = bordered(n, m, [next(matrix) for _ in range(count)])
        texts, whole = symmetric(f"m{number}_", upper, block.size, dialect)
        columns = len(block.columns)
        flat = [i * columns + k for i, k in block.places]
        right = vector_text([next(forcing) for _ in flat], dialect)
        spots = [place[i, k] for i in block.coordinates for k in block.columns]
        lines += [
            *texts,
            f"b{number} = np.zeros(({block.size * columns}, *y.shape[1:]))",
            f"b{number}[{flat}] = {right}",
            f"out[{spots}] = _solve_columns(\n"
            f"            {whole},\n"
            f"            _shaped(b{number}, {block.size}, {columns}),\n"
            f"        ).reshape({block.size * columns}, *y.shape[1:])[:{n * columns}]",
        ]
    whole = f"_shaped(out, {jacobian.rows}, {jacobian.columns})"
    result = "out" if jacobian.pattern is not None else whole
    return [*lines, f"return {result} if np.isfinite(out).all() else {failure}"]
