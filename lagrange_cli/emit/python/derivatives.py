"""Derivatives in emitted Python: Jacobians of the accelerations, linearizations made of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.emit.python.statements import bordered, symmetric, vector_text
from lagrange_cli.emit.template_files import filled, python_template
from lagrange_cli.program.printing import Dialect
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.jacobians import Jacobian

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


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


def linearization_source(
    equations: Equations, programs: Mapping[str, Program], arguments: str
) -> list[str]:
    """Define the type of the result and the function; nothing without its parts.

    Parameters
    ----------
    programs
        Programs of the derivatives by function.
    arguments
        Parameters of the functions of the interface, with their defaults.
    """
    if not equations.system.coordinates:
        return []
    n, m, k = (
        len(equations.system.coordinates),
        len(equations.system.inputs),
        len(equations.system.outputs),
    )
    passed = ", ".join(argument.split("=")[0] for argument in arguments.split(", "))
    contacts = bool(equations.system.contacts)
    mode = ", mode" if contacts else ""
    lines = [
        f"A = np.zeros(({2 * n}, {2 * n}, *many))",
        f"A[range({n}), range({n}, {2 * n})] = 1.0",
        _lower("A", "jacobian", programs, n, f"{passed}{mode}", contacts),
        f"B = np.zeros(({2 * n}, {m}, *many))",
        *([_lower("B", "jacobian_u", programs, n, f"{passed}{mode}", contacts)] if m else []),
        f"C = np.zeros(({k or n}, {2 * n}, *many))",
        f"C[:] = _output_jacobian(t, y, {passed})" if k else f"C[range({n}), range({n})] = 1.0",
        f"D = np.zeros(({k or n}, {m}, *many))",
        *([f"D[:] = _output_jacobian_u(t, y, {passed})"] if k and m else []),
    ]
    if contacts:
        lines.append(f"E = _contact_constraint_jacobian(t, y, {passed}, _flags(mode))")
    elif equations.system.closures:
        lines.append(f"E = _constraint_jacobian(t, y, {passed})")
    closed = bool(equations.system.pushing)
    replacements = {
        "@LINES@": "\n    ".join(lines),
        "@FIELDS@": _FIELD if closed else "",
        "@NOTE@": _NOTE if closed else "",
        "@HELD@": " The mode is kept." if contacts else "",
        "@OF@": "OUTPUTS" if k else "COORDINATES",
        "@P@": arguments + (", mode=FLIGHT" if contacts else ""),
        "@MATRICES@": "A, B, C, D, E" if closed else "A, B, C, D",
    }
    return [filled(python_template("linearization"), replacements)]


_FIELD = "    E: np.ndarray\n"

_NOTE = """
    E dy = 0 are the changes that the constraints allow, E the derivative of their numbers, in
    the order of RESIDUALS. A is that of rhs, which has accelerations off the constraints too."""


def _lower(
    array: str, function: str, programs: Mapping[str, Program], n: int, passed: str, contacts: bool
) -> str:
    """Put the derivatives of the accelerations below those of the coordinates."""
    jacobian = programs["contact_" * contacts + function].jacobian
    assert jacobian is not None
    name = function.upper()
    if jacobian.pattern is None:
        return f"{array}[{n}:] = {function}(t, y, {passed})"
    rows = f"[{n} + i for i in {name}_ROWS]"
    return f"{array}[{rows}, {name}_COLUMNS] = {function}(t, y, {passed})"
