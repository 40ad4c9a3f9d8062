"""The ``main`` of emitted C with contacts: a search for events, and their report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.c.names import Real, c_string
from lagrange_cli.emit.constants import MOST_EVENTS_A_STEP, MOST_REBOUNDS
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.template_files import c_template

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Expression of C that names the reason of a nonzero status.
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
    """Return token → text for the places in ``main`` that contacts fill; little without any.

    Parameters
    ----------
    recorded
        Statements that set ``u`` to the recorded inputs at time t.
    """
    if not equations.contacts:
        none = ("@MODE@", "@MODED@", "@CLEAR@", "@ADVANCE@", "@MODES@", "@BEGUN@")
        return {**dict.fromkeys(none, ""), "@STEP@": _STEP}
    names = (c_string(comment_text(contact.name)) for contact in equations.contacts)
    u = "u" if equations.inputs else "0"
    bounce = f"events < {MOST_REBOUNDS} ? @ONE@ : @ZERO@"
    calls = {
        "@EVENTS@": ("    ", f"events(t, y, {u}, p, mode, work, out)"),
        "@RESET@": ("        ", f"reset(t, y, {u}, p, mode, event, {bounce}, work)"),
        "@BEGIN@": ("    ", f"reset(t, y, {u}, p, mode, -1, @ONE@, work)"),
    }
    return {
        "@MODE@": "const int *mode, ",
        "@MODED@": "mode, ",
        "@CLEAR@": "0, ",
        "@ADVANCE@": "\n" + c_template("main_contacts"),
        "@MODES@": "    static int mode[@NAME@_CONTACTS];\n",
        "@BEGUN@": _BEGUN,
        "@STEP@": _STEP.replace("step(", "advance(").replace("&p, y", "&p, mode, y"),
        **{place: _called(equations, recorded, *call) for place, call in calls.items()},
        "@CONTACTS@": ", ".join(names),
        "@NOISE@": real.value(1024.0 * float(real.epsilon)),
        "@ULP@": real.value(2.0 * float(real.epsilon)),
        "@MOST@": str(MOST_EVENTS_A_STEP),
        "@BOUNCES@": str(MOST_REBOUNDS),
    }


def _called(equations: Equations, recorded: str, space: str, call: str) -> str:
    """Write a call that sets ``status``, with the inputs at its time."""
    if not equations.inputs:
        return f"{space}status = @NAME@_{call};\n"
    inputs = "u" if recorded else "0"
    lines = [line.strip() for line in recorded.splitlines()]
    lines += [f"status = @NAME@_inputs(t, y, {inputs}, p, work, u);", "if (status == 0) {"]
    lines += [f"    status = @NAME@_{call};", "}"]
    return "".join(f"{space}{line}\n" for line in lines)
