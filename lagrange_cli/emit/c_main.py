"""The optional ``main`` of emitted C: fixed-step integration that prints CSV."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from lagrange_cli.emit.c_main_contacts import REASON, contact_replacements
from lagrange_cli.emit.c_names import Real, c_string
from lagrange_cli.emit.c_recorded import c_recorded
from lagrange_cli.emit.c_target import CTarget
from lagrange_cli.emit.starting import TOLERANCE, residual_labels, steps_per_row

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["main_text"]

#: Rows of output, and steps from one row to the next.
ROWS = 500
STEPS_PER_ROW = 20

_MAIN = """
/*
 * A small program around the functions above: classical Runge-Kutta steps of
 * fixed size, a CSV line for each of @ROWS@ intervals. Arguments: NAME=VALUE sets
 * a parameter or an initial value; until=T and steps=N (steps in an interval).
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define @NAME@_STATE (2*@COUNT@)

@RECORDED@/* One step of size h from time t; y is advanced. */
static int @NAME@_step(@REAL@ t, @REAL@ h, const @NAME@_params *p, @MODE@@REAL@ *y)
{
    static @REAL@ k[4][@NAME@_STATE], s[@NAME@_STATE], work[@NAME@_WORK];
@INPUTS@    static const @REAL@ at[4] = {@ZERO@, @HALF@, @HALF@, @ONE@};
    int stage, i, status;
    for (stage = 0; stage < 4; ++stage) {
        for (i = 0; i < @NAME@_STATE; ++i) {
            s[i] = y[i] + (stage > 0 ? at[stage]*h*k[stage - 1][i] : @ZERO@);
        }
@RHS@        if (status != 0) {
            return status;
        }
    }
    for (i = 0; i < @NAME@_STATE; ++i) {
        y[i] += h/@SIX@*(k[0][i] + @TWO@*(k[1][i] + k[2][i]) + k[3][i]);
    }
    return @STEPPED@;
}
@ADVANCE@@START_CHECKED@
int main(int argc, char **argv)
{
    static const char *const state[] = {@STATE_NAMES@};
    static @REAL@ y[@NAME@_STATE] = {@INITIAL@};
    static int given[@NAME@_STATE] = {@GIVEN@};
@MODES@    @NAME@_params p;
    @REAL@ start = @START@, until = @UNTIL@;
    long steps = @STEPS@, row, step;
    int i, k, status;
    @NAME@_defaults(&p);
    for (i = 1; i < argc; ++i) {
        char *value = strchr(argv[i], '='), *end = 0;
        int known = 0;
        if (value != 0) {
            *value++ = '\\0';
            for (k = 0; k < @NAME@_STATE; ++k) {
                if (strcmp(argv[i], state[k]) == 0) {
                    y[k] = @PARSE@(value, &end);
                    given[k] = known = 1;
                }
            }
@PARAMETERS@            if (!known && strcmp(argv[i], "until") == 0) {
                until = @PARSE@(value, &end);
                known = 1;
            }
            if (!known && strcmp(argv[i], "steps") == 0) {
                steps = strtol(value, &end, 10);
                known = steps > 0;
            }
        }
        if (!known || end == value || *end != '\\0') {
            fprintf(stderr, "%s: not NAME=NUMBER with a known name\\n", argv[i]);
            return 2;
        }
    }
    for (k = 0; k < @NAME@_STATE; ++k) {
        if (!given[k]) {
            fprintf(stderr, "initial value needed: %s=VALUE\\n", state[k]);
            return 2;
        }
    }
@NEEDED@@WITHIN@@START_PROJECTED@@BEGUN@    printf("t");
    for (k = 0; k < @NAME@_STATE; ++k) {
        printf(",%s", state[k]);
    }
    for (row = 0; row <= @ROWS@; ++row) {
        const @REAL@ h = (until - start)/((@REAL@)@ROWS@*(@REAL@)steps);
        printf("\\n@FORMAT@", @CAST@(start + (@REAL@)(row*steps)*h));
        for (k = 0; k < @NAME@_STATE; ++k) {
            printf(",@FORMAT@", @CAST@y[k]);
        }
        for (step = 0; row < @ROWS@ && step < steps; ++step) {
            status = @STEP@;
            if (status != 0) {
                fprintf(stderr, "\\nstopped: %s\\n",
                        @REASON@);
                return 1;
            }
        }
    }
    printf("\\n");
    return 0;
}
"""

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

_START = """
/* Takes rounding out of the initial state y; one that violates the closures is an error. */
static int @NAME@_start(@REAL@ t, @REAL@ until, @REAL@ *y, const @NAME@_params *p,
                        const char *const *state)
{
    static const char *const residuals[] = {@RESIDUALS@};
    static @REAL@ given[@NAME@_STATE], out[@NAME@_CONSTRAINTS], work[@NAME@_WORK];
    @REAL@ scale[2] = {@ZERO@, @ZERO@}, bound[2];
    int i, worst = 0, near = 1, status;
    for (i = 0; i < @NAME@_STATE; ++i) {
        given[i] = y[i];
    }
    if (@NAME@_constraints(t, y, 0, p, @CLEAR@work, out) != 0) {
        fprintf(stderr, "no finite constraints at the initial state\\n");
        return 2;
    }
    for (i = 1; i < @NAME@_CONSTRAINTS; ++i) {
        worst = @FABS@(out[i]) > @FABS@(out[worst]) ? i : worst;
    }
    status = @NAME@_project(t, y, 0, p, @CLEAR@work);
    for (i = 0; i < @NAME@_STATE; ++i) {
        @REAL@ *const of = scale + (i >= @NAME@_COORDINATES);
        *of = @FABS@(given[i]) > *of ? @FABS@(given[i]) : *of;
    }
    bound[0] = @TOLERANCE@*scale[0];
    bound[1] = @TOLERANCE@*scale[1];
    if (until != t) {
        /* Velocities that move no coordinate by more than rounding are none. */
        bound[1] += @ROUNDING@*scale[0]/@FABS@(until - t);
    }
    for (i = 0; i < @NAME@_STATE; ++i) {
        near = near && @FABS@(y[i] - given[i]) <= bound[i >= @NAME@_COORDINATES];
    }
    if (status == 0 && near) {
        return 0;
    }
    fprintf(stderr, "the initial state violates the constraints by @SHORT@ (%s)\\n",
            @CAST@@FABS@(out[worst]), residuals[worst]);
    if (status != 0) {
        fprintf(stderr, "no state that obeys them was found near it\\n");
        return 2;
    }
    fprintf(stderr, "nearest:");
    for (i = 0; i < @NAME@_STATE; ++i) {
        fprintf(stderr, " %s=@FORMAT@", state[i], @CAST@y[i]);
    }
    fprintf(stderr, "\\n");
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
    given = [_named(_PARAMETER, p.name, field) for p, field in fields]
    needed = [_named(_NEEDED, p.name, field) for p, field in fields if p.value is None]
    recorded = c_recorded(equations, target)
    replacements = {
        "@RECORDED@": f"{recorded.functions}\n".lstrip("\n"),
        "@WITHIN@": recorded.checks,
        "@PARAMETERS@": "".join(given),
        "@NEEDED@": "".join(needed),
        "@RHS@": _RHS_DRIVEN if equations.inputs else _RHS,
        "@RECORD@": recorded.setting,
        "@GIVEN_INPUTS@": "u" if recorded.setting else "0",
        **_projection(equations),
        **contact_replacements(equations, real, recorded.setting.replace(*_NOW)),
        "@INPUTS@": "    static @REAL@ u[@NAME@_INPUTS];\n" if equations.inputs else "",
        "@TOLERANCE@": real.value(max(TOLERANCE, 1024.0 * float(real.epsilon))),
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
        "@ROWS@": str(ROWS),
    }
    constants = {"ZERO": 0.0, "HALF": 0.5, "ONE": 1.0, "TWO": 2.0, "SIX": 6.0}
    replacements |= {f"@{name}@": real.value(number) for name, number in constants.items()}
    text = _MAIN
    for token, replacement in replacements.items():
        text = text.replace(token, replacement)
    return text


def _projection(equations: Equations) -> dict[str, str]:
    """The places where a state is led back to the closures, where there are any."""
    closed, stepped = bool(equations.closures), bool(equations.multipliers)
    return {
        "@START_CHECKED@": _START if closed else "",
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
        "@STEPS@": str(steps_per_row(equations, ROWS, STEPS_PER_ROW)),
    }
