"""What the ``main`` of emitted C has more with contacts: a search for events, and their report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.c_names import Real, c_string
from lagrange_cli.emit.constants import BOUNCES, EVENTS
from lagrange_cli.emit.naming import comment_text

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["REASON", "contact_replacements"]

_ADVANCE = """
/* out[0..@NAME@_CONTACTS-1]: what falls through zero at events. */
static int @NAME@_numbers(@REAL@ t, const @REAL@ *y, const @NAME@_params *p,
                          const int *mode, @REAL@ *out)
{
    static @REAL@ work[@NAME@_WORK];
@INPUTS@    int status;
@EVENTS@    return status;
}

/* A contact that has to open or close, or -1. Numbers are measured by the largest so far, so
 * that rounding is no event; nor is what was below zero before (a gap that only touches). */
static int @NAME@_due(const int *mode, const @REAL@ *before, const @REAL@ *out)
{
    static @REAL@ largest[2][@NAME@_CONTACTS];
    int k, due = -1;
    for (k = 0; k < @NAME@_CONTACTS; ++k) {
        @REAL@ *const size = &largest[mode[k] != 0][k];
        const @REAL@ least = before[k] < @ZERO@ ? before[k] : @ZERO@;
        *size = @FABS@(out[k]) > *size ? @FABS@(out[k]) : *size;
        due = due < 0 && out[k] < least - @NOISE@**size ? k : due;
    }
    return due;
}

/* From t on by h; contacts open and close on the way, at times found by bisection. */
static int @NAME@_advance(@REAL@ t, @REAL@ h, const @NAME@_params *p, int *mode,
                          @REAL@ *y)
{
    static const char *const contacts[] = {@CONTACTS@};
    static @REAL@ from[@NAME@_STATE], work[@NAME@_WORK];
    static @REAL@ before[@NAME@_CONTACTS], out[@NAME@_CONTACTS];
@INPUTS@    const @REAL@ end = t + h;
    int events, status;
    for (events = 0; t < end; ++events) {
        @REAL@ early = @ZERO@, late = end - t, next = late;
        int event = -1, closes;
        memcpy(from, y, sizeof from);
        status = @NAME@_numbers(t, y, p, mode, before);
        for (;;) {
            int due = -1;
            status = status != 0 ? status : @NAME@_step(t, next, p, mode, y);
            status = status != 0 ? status : @NAME@_numbers(t + next, y, p, mode, out);
            if (status == 0) {
                due = @NAME@_due(mode, before, out);
            }
            if (status != 0 || (event < 0 && due < 0)) {
                return status;
            }
            if (due >= 0) {
                event = due;
                late = next;
            } else {
                early = next;
            }
            next = early + (late - early)/@TWO@;
            if (!(early < next && next < late && late - early > @ULP@*@FABS@(t))) {
                break;
            }
            memcpy(y, from, sizeof from);
        }
        memcpy(y, from, sizeof from);
        status = @NAME@_step(t, late, p, mode, y);
        if (status != 0 || events == @MOST@) {
            return status != 0 ? status : 5;
        }
        t += late;
        closes = mode[event] == 0;
@RESET@        fprintf(stderr, "t = @FORMAT@: %s:%s\\n", @CAST@t, closes ? "contact" : "release",
                contacts[event]);
        if (status != 0) {
            return status;
        }
        if (events == @BOUNCES@) {
            fprintf(stderr, "t = @FORMAT@: ever shorter bounces end here\\n", @CAST@t);
        }
    }
    return 0;
}

/* Which contacts are closed at the start t; where a gap is below zero this is an error. */
static int @NAME@_begin(@REAL@ t, @REAL@ until, @REAL@ *y, const @NAME@_params *p,
                        int *mode)
{
    static const char *const contacts[] = {@CONTACTS@};
    static @REAL@ out[@NAME@_CONTACTS], work[@NAME@_WORK];
@INPUTS@    @REAL@ scale = @ZERO@;
    int i, k, status = @NAME@_numbers(t, y, p, mode, out);
    if (until < t) {
        fprintf(stderr, "until=T: impacts cannot be followed back in time\\n");
        return 2;
    }
    if (status != 0) {
        fprintf(stderr, "no finite gaps at the initial state\\n");
        return 2;
    }
    for (i = 0; i < @NAME@_STATE/2; ++i) {
        scale = @FABS@(y[i]) > scale ? @FABS@(y[i]) : scale;
    }
    for (k = 0; k < @NAME@_CONTACTS; ++k) {
        if (out[k] < -@TOLERANCE@*scale) {
            fprintf(stderr, "the initial state violates %s by @SHORT@\\n", contacts[k],
                    @CAST@-out[k]);
            return 2;
        }
    }
@BEGIN@    if (status != 0) {
        fprintf(stderr, "no motion begins at the initial state\\n");
    }
    return status != 0 ? 2 : 0;
}
"""

REASON = (
    'status == 1 ? "singular configuration"\n'
    '                        : status == 2 ? "result is not finite"\n'
    '                        : status == 3 ? "too far from the closures"\n'
    '                        : status == 4 ? "the contacts leave no motion"\n'
    '                        : "contacts open and close without end"'
)


_STEP = "@NAME@_step(start + (@REAL@)(row*steps + step)*h, h, &p, y)"

_BEGUN = """\
    if (@NAME@_begin(start, until, y, &p, mode) != 0) {
        return 2;
    }
"""


def contact_replacements(equations: Equations, real: Real, recorded: str) -> dict[str, str]:
    """What stands in ``main`` in the places that contacts fill, little without any.

    Parameters
    ----------
    recorded
        Statements that set ``u`` to what recorded inputs are at time t.
    """
    if not equations.contacts:
        none = ("@MODE@", "@MODED@", "@CLEAR@", "@ADVANCE@", "@MODES@", "@BEGUN@")
        return {**dict.fromkeys(none, ""), "@STEP@": _STEP}
    names = (c_string(comment_text(contact.name)) for contact in equations.contacts)
    u = "u" if equations.inputs else "0"
    bounce = f"events < {BOUNCES} ? @ONE@ : @ZERO@"
    calls = {
        "@EVENTS@": ("    ", f"events(t, y, {u}, p, mode, work, out)"),
        "@RESET@": ("        ", f"reset(t, y, {u}, p, mode, event, {bounce}, work)"),
        "@BEGIN@": ("    ", f"reset(t, y, {u}, p, mode, -1, @ONE@, work)"),
    }
    return {
        "@MODE@": "const int *mode, ",
        "@MODED@": "mode, ",
        "@CLEAR@": "0, ",
        "@ADVANCE@": _ADVANCE,
        "@MODES@": "    static int mode[@NAME@_CONTACTS];\n",
        "@BEGUN@": _BEGUN,
        "@STEP@": _STEP.replace("step(", "advance(").replace("&p, y", "&p, mode, y"),
        **{place: _called(equations, recorded, *call) for place, call in calls.items()},
        "@CONTACTS@": ", ".join(names),
        "@NOISE@": real.value(1024.0 * float(real.epsilon)),
        "@ULP@": real.value(2.0 * float(real.epsilon)),
        "@MOST@": str(EVENTS),
        "@BOUNCES@": str(BOUNCES),
    }


def _called(equations: Equations, recorded: str, space: str, call: str) -> str:
    """A call that sets ``status``, with the inputs at its time."""
    if not equations.inputs:
        return f"{space}status = @NAME@_{call};\n"
    given = "u" if recorded else "0"
    lines = [line.strip() for line in recorded.splitlines()]
    lines += [f"status = @NAME@_inputs(t, y, {given}, p, work, u);", "if (status == 0) {"]
    lines += [f"    status = @NAME@_{call};", "}"]
    return "".join(f"{space}{line}\n" for line in lines)
