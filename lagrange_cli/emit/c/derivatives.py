"""Derivatives of the accelerations in emitted C: what the header says, and where results are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from lagrange_cli.emit.c.contacts import mode_target
from lagrange_cli.emit.c.loops import wrapped
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.program.emitted_functions import DERIVATIVES
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.jacobians import Jacobian

#: Function → what it differentiates by, and how many there are.
_BY = {
    "jacobian": ("y[k]", "2n"),
    "jacobian_u": ("input u[k]", "@NAME@_INPUTS"),
    "jacobian_p": ("parameter k of the structure", "@NAME@_PARAMETERS"),
}

_WHOLE = """
/* out[i*@COLUMNS@ + k]: the derivative of acceleration i, dydt[n + i],
 * by @BY@@WHILE@. */
int @NAME@_@FUNCTION@(@OUT@);
"""

_PATTERN = """
/* out[m], m < @MACRO@: the derivative of acceleration i,
 * dydt[n + i], by @BY@@WHILE@, for i = @NAME@_@FUNCTION@_rows[m]
 * and k = @NAME@_@FUNCTION@_columns[m]; all others are zero. */
#define @MACRO@ @SIZE@
extern const int @NAME@_@FUNCTION@_rows[@SIZE@];
extern const int @NAME@_@FUNCTION@_columns[@SIZE@];
int @NAME@_@FUNCTION@(@OUT@);
"""


def derivatives_of(programs: Mapping[str, Program]) -> dict[str, Jacobian]:
    """Function of the interface → where its results are."""
    return {
        function: program.jacobian
        for function in DERIVATIVES
        for name, program in programs.items()
        if name.removeprefix("contact_") == function and program.jacobian is not None
    }


def derivative_declarations(
    derivatives: Mapping[str, Jacobian], target: CTarget, *, contacts: bool
) -> str:
    """Declare the functions, with their comments."""
    outer = mode_target(target) if contacts else target
    texts = []
    for function, jacobian in derivatives.items():
        by, columns = _BY[function]
        replacements = {
            "@WHILE@": " while mode stays" if contacts else "",
            "@BY@": by,
            "@COLUMNS@": columns,
            "@MACRO@": f"@NAME@_{function.upper()}_NONZERO",
            "@SIZE@": str(jacobian.size),
            "@FUNCTION@": function,
            "@OUT@": outer.arguments("out"),
        }
        text = _WHOLE if jacobian.pattern is None else _PATTERN
        for token, replacement in replacements.items():
            text = text.replace(token, replacement)
        texts.append(text)
    return "".join(texts)


def pattern_texts(programs: Mapping[str, Program], target: CTarget) -> Iterator[str]:
    """Define the arrays that tell where sparse results stand."""
    for function, jacobian in derivatives_of(programs).items():
        if jacobian.pattern is None:
            continue
        rows, columns = zip(*jacobian.pattern, strict=True)
        for name, numbers in (("rows", rows), ("columns", columns)):
            head = f"const int {target.prefix}_{function}_{name}[{jacobian.size}] = {{"
            yield "\n".join([head, *wrapped(", ".join(map(str, numbers)), 1, 1), "};", ""])
