"""The optional ``main`` of emitted C: fixed-step integration that prints CSV."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.main_contacts import REASON, contact_replacements
from lagrange_cli.emit.c.names import Real, c_string
from lagrange_cli.emit.c.recorded import c_recorded
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.initial_state import START_TOLERANCE, residual_labels, steps_per_row
from lagrange_cli.emit.template_files import c_template, filled

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Rows of output, and steps from one row to the next.
_ROWS = 500
_STEPS_PER_ROW = 20


_PARAMETER = """\
            if (!known && strcmp(argv[i], @TEXT@) == 0) {
                p.@FIELD@ = @PARSE@(value, &end);
                known = 1;
            }
"""

_NEEDED = """\
    if (isnan(p.@FIELD@)) {
        fprintf(stderr, "parameter needed: %s=VALUE\\n", @TEXT@);
        return 2;
    }
"""

_START_PROJECTED = """\
    if (@NAME@_start(start, until, y, &p, state) != 0) {
        return 2;
    }
"""


_RHS = """\
        status = @NAME@_rhs(t + at[stage]*h, s, 0, p, @MODED@work, k[stage]);
"""

_RHS_DRIVEN = """\
@RECORD@        status = @NAME@_inputs(t + at[stage]*h, s, @GIVEN_INPUTS@, p, work, u);
        if (status == 0) {
            status = @NAME@_rhs(t + at[stage]*h, s, u, p, @MODED@work, k[stage]);
        }
"""

#: The times at which recorded inputs are taken in a step, and at an event.
_NOW = ("t + at[stage]*h, t + at[1]*h", "t, t")

_REASON = 'status == 1 ? "singular mass matrix" : "result is not finite"'
_REASON_CLOSED = (
    'status == 1 ? "singular configuration"\n'
    '                        : status == 2 ? "result is not finite"'
    ' : "too far from the closures"'
)


def main_text(equations: Equations, target: CTarget) -> str:
    """The text of ``main`` and what it needs, to stand at the end of ``NAME.c``."""
    names, real = target.names, target.real
    fields = list(zip(equations.parameters, names.fields, strict=True))
    parameters = [_named(_PARAMETER, p.name, field) for p, field in fields]
    needed = [_named(_NEEDED, p.name, field) for p, field in fields if p.value is None]
    recorded = c_recorded(equations, target)
    replacements = {
        "@WITHIN@": recorded.checks,
        "@PARAMETERS@": "".join(parameters),
        "@NEEDED@": "".join(needed),
        "@RHS@": _RHS_DRIVEN if equations.inputs else _RHS,
        "@RECORD@": recorded.setting,
        "@GIVEN_INPUTS@": "u" if recorded.setting else "0",
        **_projection(equations),
        **contact_replacements(equations, real, recorded.setting.replace(*_NOW)),
        "@INPUTS@": "    static @REAL@ u[@NAME@_INPUTS];\n" if equations.inputs else "",
        "@TOLERANCE@": real.value(max(START_TOLERANCE, 1024.0 * float(real.epsilon))),
        "@ROUNDING@": real.value(64.0 * float(real.epsilon)),
        "@SHORT@": re.sub(r"\d+", "3", real.print_format),
        "@FABS@": f"fabs{real.suffix}",
        **_state_replacements(equations, real),
        **_run_replacements(equations, real),
        "@NAME@": names.prefix,
        "@REAL@": real.name,
        "@PARSE@": real.parse,
        "@FORMAT@": real.print_format,
        "@CAST@": "(double)" if real.name == "float" else "",
        "@ROWS@": str(_ROWS),
    }
    constants = {"ZERO": 0.0, "HALF": 0.5, "ONE": 1.0, "TWO": 2.0, "SIX": 6.0}
    replacements |= {f"@{name}@": real.value(number) for name, number in constants.items()}
    replacements["@RECORDED@"] = f"{recorded.functions}\n".lstrip("\n")
    text = "\n" + c_template("main")
    return filled(text, replacements)


def _projection(equations: Equations) -> dict[str, str]:
    """The places where a state is led back to the closures, where there are any."""
    closed, stepped = bool(equations.closures), bool(equations.multipliers)
    return {
        "@START_CHECKED@": "\n" + c_template("main_start") if closed else "",
        "@START_PROJECTED@": _START_PROJECTED if closed else "",
        "@RESIDUALS@": ", ".join(map(c_string, residual_labels(equations))),
        "@STEPPED@": "@NAME@_project(t + h, y, 0, p, @MODED@work)" if stepped else "0",
        "@REASON@": REASON if equations.contacts else _REASON_CLOSED if closed else _REASON,
        "@COUNT@": "@NAME@_COORDINATES" if closed else "@NAME@_DOF",
    }


def _named(template: str, name: str, field: str) -> str:
    return template.replace("@FIELD@", field).replace("@TEXT@", c_string(name))


def _state_replacements(equations: Equations, real: Real) -> dict[str, str]:
    n = len(equations.coordinates)
    labels = [c.name for c in equations.coordinates]
    labels += [f"dot({name})" for name in labels]
    initial = equations.initial
    values = (0.0,) * 2 * n if initial is None else (*initial.positions, *initial.velocities)
    # What a solution of the constraints leaves of a zero is zero in a short type.
    least = 10.0**-real.largest_exponent
    return {
        "@STATE_NAMES@": ", ".join(map(c_string, labels)),
        "@INITIAL@": ", ".join(real.value(x if abs(x) >= least else 0.0) for x in values),
        "@GIVEN@": ", ".join(["0" if initial is None else "1"] * 2 * n),
    }


def _run_replacements(equations: Equations, real: Real) -> dict[str, str]:
    defaults = equations.simulate
    until = defaults.start + 10.0 if defaults.until is None else defaults.until
    return {
        "@START@": real.value(defaults.start),
        "@UNTIL@": real.value(until),
        "@STEPS@": str(steps_per_row(equations, _ROWS, _STEPS_PER_ROW)),
    }
