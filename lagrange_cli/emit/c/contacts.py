"""Emitted C with contacts: functions that take a mode, around those that take flags."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lagrange_cli.emit.c.impact import impact_text
from lagrange_cli.emit.c.projection import project_text, workspace_size
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.emitted_functions import DERIVATIVES
from lagrange_cli.program.program import Program


def contact_target(target: CTarget, contacts: int) -> CTarget:
    """The target of the functions that take flags and targets in an array of their own."""
    names = target.names
    fields = len(names.fields)
    further = {f"p{fields + k}": f"contact[{k}]" for k in range(2 * contacts)}
    flagged = replace(
        names,
        inputs={**names.inputs, **further},
        contact_from=fields,
        further=f"const {target.real.name} *contact, ",
    )
    return replace(target, names=flagged)


def mode_target(target: CTarget) -> CTarget:
    """The target of the functions of the interface, which take a mode."""
    return _with_further(target, "const int *mode, ")


def _with_further(target: CTarget, further: str) -> CTarget:
    return replace(target, names=replace(target.names, further=further))


def mode_workspace_size(programs: Mapping[str, Program], contacts: int) -> int:
    """Numbers of workspace with flags and targets."""
    return workspace_size(programs) + 2 * contacts


def interface_text(programs: Mapping[str, Program], target: CTarget, contacts: int) -> str:
    """Projection, events and impacts, and the functions of the interface around them."""
    inner, outer = contact_target(target, contacts), mode_target(target)
    replacements = {
        "@U@": str(contacts),
        "@START@": str(workspace_size(programs)),
        "@DYDT@": outer.arguments("dydt"),
        "@OUT@": outer.arguments("out"),
        "@STATE@": outer.state_arguments(),
        "@RESET@": _reset_arguments(target),
    }
    functions = (
        c_template("mode_function").replace("@FUNCTION@", name)
        for name in ("multipliers", "constraints", "events", *DERIVATIVES)
        if f"contact_{name}" in programs or name == "events"
    )
    flags, rhs, project, reset = (
        c_template(f"mode_{name}") for name in ("flags", "rhs", "project", "reset")
    )
    texts = [flags, rhs, *functions, project, reset]
    return "\n".join(
        [
            project_text(programs, inner, "contact_"),
            impact_text(programs, inner),
            *(target.fill(text, replacements) for text in texts),
        ]
    )


def _reset_arguments(target: CTarget) -> str:
    """The parameter list of the function that changes state and mode."""
    further = f"int *mode, int event, {target.real.name} bounce, "
    return _with_further(target, further).state_arguments()
