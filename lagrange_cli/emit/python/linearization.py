"""Linearization in emitted Python: first-order matrices, put together of derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.template_files import filled, python_template
from lagrange_cli.program.program import Program

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


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
    if not equations.coordinates:
        return []
    n, m, k = len(equations.coordinates), len(equations.inputs), len(equations.outputs)
    passed = ", ".join(argument.split("=")[0] for argument in arguments.split(", "))
    contacts = bool(equations.contacts)
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
    elif equations.closures:
        lines.append(f"E = _constraint_jacobian(t, y, {passed})")
    closed = bool(equations.pushing)
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
