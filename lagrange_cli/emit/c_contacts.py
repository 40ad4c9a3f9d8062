"""Emitted C with contacts: functions that take a mode, around those that take flags."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lagrange_cli.emit.c_names import CNames, Real
from lagrange_cli.emit.c_project import project_text, workspace
from lagrange_cli.emit.c_reset import reset_text
from lagrange_cli.emit.c_solvers import fill
from lagrange_cli.emit.program import Program

__all__ = ["contact_names", "interface_text", "mode_names", "mode_workspace"]

_MODE = """\
/* contact[0..2*@U@-1]: 1 for what is closed, then zeros; whether anything is closed. */
static int @NAME@_flags(const int *mode, @REAL@ *contact)
{
    int k, any = 0;
    for (k = 0; k < @U@; ++k) {
        const int closed = mode != 0 && mode[k] != 0;
        contact[k] = closed ? @ONE@ : @ZERO@;
        contact[@U@ + k] = @ZERO@;
        any = any || closed;
    }
    return any;
}
"""

_RHS = """\
int @NAME@_rhs(@DYDT@)
{
    @REAL@ *const contact = work + @START@;
    if (!@NAME@_flags(mode, contact)) {
        return @NAME@_flight_rhs(t, y, u, p, work, dydt);
    }
    return @NAME@_contact_rhs(t, y, u, p, contact, work, dydt);
}
"""

_FUNCTION = """\
int @NAME@_@FUNCTION@(@OUT@)
{
    @REAL@ *const contact = work + @START@;
    (void)@NAME@_flags(mode, contact);
    return @NAME@_contact_@FUNCTION@(t, y, u, p, contact, work, out);
}
"""

_PROJECT = """\
int @NAME@_project(@STATE@)
{
    @REAL@ *const contact = work + @START@;
    (void)@NAME@_flags(mode, contact);
    return @NAME@_contact_project(t, y, u, p, contact, work);
}
"""

_RESET = """\
int @NAME@_reset(@RESET@)
{
    @REAL@ *const contact = work + @START@;
    int k, status;
    (void)@NAME@_flags(mode, contact);
    status = @NAME@_contact_reset(t, y, u, p, contact, event, bounce, work);
    for (k = 0; status == 0 && k < @U@; ++k) {
        mode[k] = contact[k] > @ZERO@;
    }
    return status;
}
"""


def contact_names(names: CNames, real: Real, contacts: int) -> CNames:
    """Names of the functions that take flags and targets in an array of their own."""
    own = len(names.fields)
    further = {f"p{own + k}": f"contact[{k}]" for k in range(2 * contacts)}
    return replace(
        names,
        inputs={**names.inputs, **further},
        contact_from=own,
        further=f"const {real.name} *contact, ",
    )


def mode_names(names: CNames) -> CNames:
    """Names of the functions of the interface, which take a mode."""
    return replace(names, further="const int *mode, ")


def mode_workspace(programs: Mapping[str, Program], contacts: int) -> int:
    """Numbers of workspace with flags and targets."""
    return workspace(programs) + 2 * contacts


def interface_text(
    programs: Mapping[str, Program], names: CNames, real: Real, contacts: int
) -> str:
    """Projection, events and impacts, and the functions of the interface around them."""
    inner, outer = contact_names(names, real, contacts), mode_names(names)
    given = {
        "@U@": str(contacts),
        "@START@": str(workspace(programs)),
        "@DYDT@": outer.arguments(real, "dydt"),
        "@OUT@": outer.arguments(real, "out"),
        "@STATE@": outer.state_arguments(real),
        "@RESET@": reset_arguments(names, real),
    }
    functions = (
        _FUNCTION.replace("@FUNCTION@", name) for name in ("multipliers", "constraints", "events")
    )
    texts = [_MODE, _RHS, *functions, _PROJECT, _RESET]
    return "\n".join(
        [
            project_text(programs, inner, real, "contact_"),
            reset_text(programs, inner, real),
            *(fill(text, names, real, given) for text in texts),
        ]
    )


def reset_arguments(names: CNames, real: Real) -> str:
    """The parameter list of the function that changes state and mode."""
    further = f"int *mode, int event, {real.name} bounce, "
    return replace(names, further=further).state_arguments(real)
