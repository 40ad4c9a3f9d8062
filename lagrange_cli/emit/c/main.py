"""The optional ``main`` of emitted C: fixed-step integration that prints CSV.

With contacts it searches each step for events and reports them; recorded inputs are evaluated
from the polynomials of their interpolation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.solvers import routine_texts
from lagrange_cli.emit.c.target import CTarget, Real, c_string
from lagrange_cli.emit.initial_state import ROWS, residual_labels, steps_per_row
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.shared_code import (
    described_input,
    polynomial_rows,
    recorded_inputs,
    switch_places,
)
from lagrange_cli.emit.template_files import c_template, event_lines, filled
from lagrange_cli.program.lowered.routines.projection import START_TOLERANCE
from lagrange_cli.program.solvers.tolerances import MOST_EVENTS_A_STEP, MOST_REBOUNDS

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
        Tables of polynomials, and the function that evaluates them.
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
    tables: list[str] = []
    setting, checks = "", ""
    for number, pieces in recorded_inputs(equations):
        name = comment_text(described_input(equations, number))
        rows = [", ".join(map(real.value, row)) for row in polynomial_rows(pieces)]
        width, table = pieces.coefficients.shape[1] + 1, f"{prefix}_recording_{number}"
        numbers = ",\n".join(f"    {row}" for row in rows)
        tables.append(
            f"/* {name}: starts, each with coefficients behind it. */\n"
            f"static const {real.name} {table}[{len(rows) * width}] = {{\n{numbers}\n}};\n"
        )
        setting += f"        u[{number}] = {prefix}_interpolated({len(rows)}, {width}, {table},\n"
        setting += "                t + at[stage]*h, t + at[1]*h);\n"
        ends = "" if math.isinf(pieces.end) else f" && until <= {real.value(pieces.end)}"
        says = "goes on" if math.isinf(pieces.end) else f"ends at t = {pieces.end!r}"
        message = c_string(f"{name}: begins at t = {float(pieces.starts[0])!r}, {says}")
        bounds = _C_BOUNDS.replace("@FIRST@", real.value(float(pieces.starts[0])))
        checks += bounds.replace("@UNTIL@", ends).replace("@TEXT@", message.replace("@", r"\100"))
    functions = routine_texts(["interpolated"], target) if tables else []
    return CRecorded("\n".join([*functions, *tables]), setting, checks)


#: Expression of C that names the reason of a nonzero status.
_REASON_IN_CONTACT = (
    'status == 1 ? "singular configuration"\n'
    '                        : status == 2 ? "result is not finite"\n'
    '                        : status == 3 ? "too far from the closures"\n'
    '                        : status == 4 ? "the contacts leave no motion"\n'
    '                        : "contacts open and close without end"'
)
_REASON_AT_SWITCH = (
    'status == 1 ? "singular mass matrix"\n'
    '                        : status == 2 ? "result is not finite"\n'
    '                        : status == 4 ? "a state with two values has neither"\n'
    '                        : "states with two values change without end"'
)

_STEP = "@NAME@_stepped(start + (@REAL@)(row*steps + step)*h, h, &p, y)"

_BEGUN = """\
    if (@NAME@_begin(start, until, y, &p, mode) != 0) {
        return 2;
    }
"""


#: What a run with states with two values knows beside its contacts.
_SWITCHED = """\
    static const char *const switches[] = {@SWITCHES@};
    static const int places[] = {@SWITCH_PLACES@};
    static int now[@COUNT@];
    int k;
"""

_NOW_MODE = """\
        memcpy(now, mode, @NAME@_CONTACTS*sizeof *now);
"""

_NOW_VALUES = """\
        for (k = 0; k < @NAME@_SWITCHES; ++k) {
            now[@FIRST@k] = y[places[k]] > @ZERO@;
        }
"""

_BEGUN_SWITCHES = """\
    if (@NAME@_begin_values(start, y, &p) != 0) {
        return 2;
    }
"""


def event_replacements(equations: Equations, target: CTarget, recorded: str) -> dict[str, str]:
    """Return token → text for the places in ``main`` that events fill; little without any.

    Parameters
    ----------
    recorded
        Statements that set ``u`` to the recorded inputs at time t.
    """
    contacts, switches = equations.system.contacts, equations.system.switches
    if not (contacts or switches):
        none = ("@MODE@", "@MODED@", "@CLEAR@", "@ADVANCE@", "@MODES@", "@BEGUN@")
        return {**dict.fromkeys(none, ""), "@STEP@": _STEP}
    count = " + ".join(["@NAME@_CONTACTS"] * bool(contacts) + ["@NAME@_SWITCHES"] * bool(switches))
    count = f"({count})" if contacts and switches else count
    named = "    static const char *const contacts[] = {@CONTACTS@};\n" if contacts else ""
    now = _NOW_MODE * bool(contacts) + _NOW_VALUES
    texts = [c_template("main_events"), *([c_template("main_contacts")] if contacts else [])]
    texts += [c_template("main_switches")] if switches else []
    return {
        "@ADVANCE@": "\n" + "\n".join(texts),
        "@HAPPENS@": event_lines(
            c_template,
            ["contacts"] * bool(contacts) + ["switches"] * bool(switches),
            ("if (event < @NAME@_CONTACTS) {", "}"),
            *("        ", "    "),
        ),
        "@IGNORED@": "" if contacts else "    (void)mode;\n",
        "@NAMED@": named + (_SWITCHED if switches else ""),
        "@NOW@": now if switches else "",
        "@VALUES@": "now" if switches else "mode",
        "@FIRST@": "@NAME@_CONTACTS + " if contacts else "",
        "@COUNT@": count,
        "@MODE@": "const int *mode, " if contacts else "",
        "@MODE_CHANGED@": "int *mode," if contacts else "",
        "@MODED@": "mode, " if contacts else "",
        "@CLEAR@": "0, " if contacts else "",
        "@MODES@": "    static int mode[@NAME@_CONTACTS];\n" if contacts else "",
        "@BEGUN@": (_BEGUN if contacts else "") + (_BEGUN_SWITCHES if switches else ""),
        "@SEARCH@": "\n".join(routine_texts(["advance"], target)),
        "@STEP@": _STEP.replace("stepped(", "follow(").replace(
            "&p, y", "&p, mode, y" if contacts else "&p, y"
        ),
        **_event_calls(equations, recorded),
        "@CONTACTS@": ", ".join(c_string(comment_text(contact.name)) for contact in contacts),
        "@SWITCHES@": ", ".join(c_string(comment_text(s.name)) for s in switches),
        "@SWITCH_PLACES@": ", ".join(map(str, switch_places(equations))),
        "@MOST@": str(MOST_EVENTS_A_STEP),
        "@BOUNCES@": str(MOST_REBOUNDS),
    }


def _event_calls(equations: Equations, recorded: str) -> dict[str, str]:
    """Return token → statements that set ``status`` by functions of events."""
    contacts, switches = equations.system.contacts, equations.system.switches
    u = "u" if equations.system.inputs else "0"
    bounce = f"events < {MOST_REBOUNDS} ? @ONE@ : @ZERO@"
    number = "event < @NAME@_CONTACTS ? -1 : event - @NAME@_CONTACTS" if contacts else "event"
    numbers = [f"events(t, y, {u}, p, mode, work, out)"] if contacts else []
    behind = "out + @NAME@_CONTACTS" if contacts else "out"
    numbers += [f"switches(t, y, {u}, p, work, {behind})"] if switches else []
    calls = {
        "@EVENTS@": (4, numbers),
        "@RESET@": (4, [f"reset(t, y, {u}, p, mode, event, {bounce}, work)"]),
        "@SETTLED@": (0, [f"reset(t, y, {u}, p, mode, -1, @ONE@, work)"]),
        "@CHANGED@": (0, [f"change(t, y, {u}, p, {number}, work)"]),
        "@BEGIN@": (4, [f"reset(t, y, {u}, p, mode, -1, @ONE@, work)"]),
        "@BEGIN_VALUES@": (4, [f"change(t, y, {u}, p, -1, work)"]),
    }
    return {
        place: _called(equations, recorded, " " * space, call)
        for place, (space, call) in calls.items()
    }


def _called(equations: Equations, recorded: str, space: str, calls: Sequence[str]) -> str:
    """Write calls that set ``status``, each as long as that is 0, with the inputs at their time."""
    lines = []
    if equations.system.inputs:
        inputs = "u" if recorded else "0"
        lines += [line.strip() for line in recorded.splitlines()]
        calls = [f"inputs(t, y, {inputs}, p, work, u)", *calls]
    for k, call in enumerate(calls):
        if k:
            lines += ["if (status == 0) {", f"    status = @NAME@_{call};", "}"]
        else:
            lines.append(f"status = @NAME@_{call};")
    return "".join(f"{space}{line}\n" for line in lines)


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
    """Return the text of ``main`` and what it needs, to stand at the end of ``NAME.c``."""
    names, real = target.names, target.real
    fields = list(zip(equations.system.parameters, names.fields, strict=True))
    parameters = [_named(_PARAMETER, p.name, field) for p, field in fields]
    needed = [_named(_NEEDED, p.name, field) for p, field in fields if p.value is None]
    recorded = c_recorded(equations, target)
    replacements = {
        "@WITHIN@": recorded.checks,
        "@PARAMETERS@": "".join(parameters),
        "@NEEDED@": "".join(needed),
        "@RHS@": _RHS_DRIVEN if equations.system.inputs else _RHS,
        "@RECORD@": recorded.setting,
        "@GIVEN_INPUTS@": "u" if recorded.setting else "0",
        **_projection(equations),
        **event_replacements(equations, target, recorded.setting.replace(*_NOW)),
        **_size(equations),
        "@INPUTS@": "    static @REAL@ u[@NAME@_INPUTS];\n" if equations.system.inputs else "",
        "@TOLERANCE@": real.value(max(START_TOLERANCE, 1024.0 * float(real.epsilon))),
        "@ROUNDING@": real.value(64.0 * float(real.epsilon)),
        "@SHORT@": real.print_format(3),
        "@FABS@": f"fabs{real.suffix}",
        **_state_replacements(equations, real),
        **_run_replacements(equations, real),
        "@NAME@": names.prefix,
        "@REAL@": real.name,
        "@PARSE@": real.parse,
        "@FORMAT@": real.print_format(real.digits),
        "@CAST@": "(double)" if real.name == "float" else "",
        "@ROWS@": str(ROWS),
    }
    constants = {"ZERO": 0.0, "HALF": 0.5, "ONE": 1.0, "TWO": 2.0, "SIX": 6.0}
    replacements |= {f"@{name}@": real.value(number) for name, number in constants.items()}
    replacements["@RECORDED@"] = f"{recorded.functions}\n".lstrip("\n")
    text = "\n" + c_template("main")
    return filled(text, replacements)


def _projection(equations: Equations) -> dict[str, str]:
    """Return the places where a state is led back to the closures, where there are any."""
    closed, stepped = bool(equations.system.closures), bool(equations.system.multipliers)
    return {
        "@START_CHECKED@": "\n" + c_template("main_start") if closed else "",
        "@START_PROJECTED@": _START_PROJECTED if closed else "",
        "@RESIDUALS@": ", ".join(map(c_string, residual_labels(equations))),
        "@STEPPED@": "@NAME@_project(t + h, y, 0, p, @MODED@work)" if stepped else "0",
        "@REASON@": _REASON_IN_CONTACT
        if equations.system.contacts
        else _REASON_CLOSED
        if closed
        else _REASON_AT_SWITCH
        if equations.system.switches
        else _REASON,
    }


def _size(equations: Equations) -> dict[str, str]:
    """Return the numbers of a state, and those of positions and velocities among them."""
    count = "@NAME@_COORDINATES" if equations.system.closures else "@NAME@_DOF"
    size = f"2*{count}"
    if not equations.system.states:
        return {"@SIZE@": f"({size})", "@MOVING@": "@NAME@_STATE", "@PLACES@": "@NAME@_STATE/2"}
    return {"@SIZE@": f"({size} + @NAME@_STATES)", "@MOVING@": size, "@PLACES@": count}


def _named(template: str, name: str, field: str) -> str:
    return template.replace("@FIELD@", field).replace("@TEXT@", c_string(name))


def _state_replacements(equations: Equations, real: Real) -> dict[str, str]:
    size = equations.system.layout.size
    labels = equations.system.state_names
    initial = equations.system.initial
    values = (0.0,) * size if initial is None else initial.numbers
    # What a solution of the constraints leaves of a zero is zero in a short type.
    least = 10.0**-real.largest_exponent
    return {
        "@STATE_NAMES@": ", ".join(map(c_string, labels)),
        "@INITIAL@": ", ".join(real.value(x if abs(x) >= least else 0.0) for x in values),
        "@GIVEN@": ", ".join(["0" if initial is None else "1"] * size),
    }


def _run_replacements(equations: Equations, real: Real) -> dict[str, str]:
    defaults = equations.system.simulate
    until = defaults.start + 10.0 if defaults.until is None else defaults.until
    return {
        "@START@": real.value(defaults.start),
        "@UNTIL@": real.value(until),
        "@STEPS@": str(steps_per_row(equations)),
    }
