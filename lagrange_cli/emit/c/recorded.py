"""Recorded inputs in the main of emitted C."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.names import c_string
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.recorded_inputs import described_input, polynomial_rows, recorded_inputs
from lagrange_cli.emit.template_files import c_template, filled

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Check that a run begins and ends within a recording.
_C_BOUNDS = """\
    if (!(start >= @FIRST@@UNTIL@)) {
        fprintf(stderr, "%s\\n", @TEXT@);
        return 2;
    }
"""


@dataclass(frozen=True)
class CRecorded:
    """The parts of a ``main`` with recorded inputs; all are empty without any.

    Attributes
    ----------
    functions
        Functions that evaluate them.
    setting
        Statements that set ``u``.
    checks
        Checks that the run lies within the recordings.
    """

    functions: str
    setting: str
    checks: str


def c_recorded(equations: Equations, target: CTarget) -> CRecorded:
    """Write the parts of ``main`` for recorded inputs."""
    prefix, real = target.prefix, target.real
    functions, setting, checks = "", "", ""
    for number, pieces in recorded_inputs(equations):
        name = comment_text(described_input(equations, number))
        rows = [", ".join(map(real.value, row)) for row in polynomial_rows(pieces)]
        replacements = {
            "@NUMBERS@": ",\n".join(f"        {{{row}}}" for row in rows),
            "@REAL@": real.name,
            "@NAME@": prefix,
            "@K@": str(number),
            "@ROWS@": str(len(rows)),
            "@WIDTH@": str(pieces.coefficients.shape[1] + 1),
            "@ZERO@": real.value(0.0),
            # The last: names of files and columns may look like tokens.
            "@TEXT@": name,
        }
        functions += "\n" + filled(c_template("recorded"), replacements)
        call = f"{prefix}_recorded_{number}(t + at[stage]*h, t + at[1]*h)"
        setting += f"        u[{number}] = {call};\n"
        ends = "" if math.isinf(pieces.end) else f" && until <= {real.value(pieces.end)}"
        says = "goes on" if math.isinf(pieces.end) else f"ends at t = {pieces.end!r}"
        message = c_string(f"{name}: begins at t = {float(pieces.starts[0])!r}, {says}")
        bounds = _C_BOUNDS.replace("@FIRST@", real.value(float(pieces.starts[0])))
        checks += bounds.replace("@UNTIL@", ends).replace("@TEXT@", message.replace("@", r"\100"))
    return CRecorded(functions, setting, checks)
