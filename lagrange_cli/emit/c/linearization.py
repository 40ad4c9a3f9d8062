"""Linearization in emitted C: first-order matrices at any state, put together of derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.contacts import mode_target
from lagrange_cli.emit.c.derivatives import derivatives_of
from lagrange_cli.emit.c.projection import workspace_size
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.initial_state import residual_labels
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.jacobians import Jacobian

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


def linearization_declaration(equations: Equations, target: CTarget) -> str:
    """Declare the function, with its comment."""
    n = len(equations.coordinates)
    held = [" While mode stays."] if equations.contacts else []
    outputs = "outputs z in the order above" if equations.outputs else "coordinates z = q"
    driven = f"{2 * n} by {len(equations.inputs)}" if equations.inputs else "not there, no inputs"
    rows = len(equations.outputs) or n
    lines = [
        "The linearization at a state, of first order, by rows:",
        "  d/dt dy = A dy + B du,  dz = C dy + D du",
        f"of small changes dy of y and du of u, and of the {outputs}.",
        f"A {2 * n} by {2 * n}; B {driven}; C {rows} by {2 * n};"
        f" D {f'{rows} by {len(equations.inputs)}' if equations.inputs else 'likewise'}.",
        *([_CLOSED.format(len(residual_labels(equations)), 2 * n)] if equations.pushing else []),
        "A null pointer stands for what is not wanted." + "".join(held),
    ]
    text = "\n".join(f" * {line}" for part in lines for line in part.splitlines())
    return f"\n/*\n{text}\n */\nint @NAME@_linearization({_arguments(equations, target)});\n"


_CLOSED = """\
E {} by {}, the derivative of the numbers of @NAME@_constraints by y: changes
that the constraints allow have E dy = 0. A is that of @NAME@_rhs, which has
accelerations off the constraints too."""


def linearization_text(
    equations: Equations, programs: Mapping[str, Program], target: CTarget
) -> str:
    """Define the function."""
    n, m = len(equations.coordinates), len(equations.inputs)
    found = derivatives_of(programs)
    calls = [*_lower("A", found["jacobian"], n, 2 * n, "jacobian", unit=True)]
    if m:
        calls += _lower("B", found["jacobian_u"], n, m, "jacobian_u", unit=False)
    calls += _outputs(equations, n, m)
    calls += _constraints(equations)
    unused = [] if m else ["    (void)B;", "    (void)D;"]
    body = "\n".join([*unused, *calls])
    text = c_template("linearization").replace("@BODY@", body)
    replacements = {
        "@ARGUMENTS@": _arguments(equations, target),
        "@PASSED@": f"t, y, u, p, {'mode, ' if equations.contacts else ''}work",
        "@START@": str(workspace_size(programs)),
    }
    return target.fill(text, replacements)


def _arguments(equations: Equations, target: CTarget) -> str:
    outer = mode_target(target) if equations.contacts else target
    matrices = ", ".join(
        f"{target.real.name} *{name}" for name in ("ABCDE" if equations.pushing else "ABCD")
    )
    return outer.arguments("A").removesuffix(f"{target.real.name} *A") + matrices


def _lower(
    array: str, jacobian: Jacobian, n: int, columns: int, function: str, *, unit: bool
) -> list[str]:
    """Fill a matrix of 2n rows, of which those of the accelerations are a Jacobian.

    Sparse results wait in the upper half, which is larger than they are.
    """
    half = n * columns
    ones = [f"for (i = 0; i < {n}; ++i) {{", f"    {array}[i*{columns} + {n} + i] = @ONE@;", "}"]
    zeros = [f"for (i = 0; i < {half}; ++i) {{", f"    {array}[i] = @ZERO@;", "}"]
    if jacobian.pattern is None:
        lines = [
            *zeros,
            *(ones if unit else []),
            f"status = @NAME@_{function}(@PASSED@, {array} + {half});",
        ]
    else:
        name = f"@NAME@_{function}"
        lines = [
            f"status = {name}(@PASSED@, {array});",
            f"for (i = {half}; i < {2 * half}; ++i) {{",
            f"    {array}[i] = @ZERO@;",
            "}",
            f"for (i = 0; i < {jacobian.size}; ++i) {{",
            f"    {array}[({n} + {name}_rows[i])*{columns} + {name}_columns[i]] = {array}[i];",
            "}",
            *zeros,
            *(ones if unit else []),
        ]
    return _wanted(array, lines)


def _outputs(equations: Equations, n: int, m: int) -> list[str]:
    """Fill C and D; without outputs of the scene they are the coordinates."""
    if equations.outputs:
        lines = _wanted("C", ["status = @NAME@_output_jacobian(@PLAIN@, C);"])
        if m:
            lines += _wanted("D", ["status = @NAME@_output_jacobian_u(@PLAIN@, D);"])
        return [line.replace("@PLAIN@", "t, y, u, p, work") for line in lines]
    zeros = [f"for (i = 0; i < {2 * n * n}; ++i) {{", "    C[i] = @ZERO@;", "}"]
    ones = [f"for (i = 0; i < {n}; ++i) {{", f"    C[i*{2 * n} + i] = @ONE@;", "}"]
    lines = _wanted("C", [*zeros, *ones])
    if m:
        lines += _wanted("D", [f"for (i = 0; i < {n * m}; ++i) {{", "    D[i] = @ZERO@;", "}"])
    return lines


def _constraints(equations: Equations) -> list[str]:
    if equations.contacts:
        lines = [
            "@REAL@ *const contact = work + @START@;",
            "(void)@NAME@_flags(mode, contact);",
            "status = @NAME@_contact_constraint_jacobian(t, y, u, p, contact, work, E);",
        ]
        return _wanted("E", lines)
    if equations.closures:
        return _wanted("E", ["status = @NAME@_constraint_jacobian(@PASSED@, E);"])
    return []


def _wanted(array: str, lines: list[str]) -> list[str]:
    inner = (f"        {line}" for line in lines)
    return [f"    if (status == 0 && {array} != 0) {{", *inner, "    }"]
