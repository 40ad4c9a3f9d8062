"""Functions of emitted C on constraints: ``project``, ``events``, ``reset``, those of a mode.

``project`` leads a state back to closures that it has left; ``events`` and ``reset`` are routines
(:mod:`lagrange_cli.program.lowered.routines.impacts`).

The functions of the interface take a mode; they call static ones that take the flags of closed
contacts in an array.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from lagrange_cli.emit.c.solvers import routine_texts
from lagrange_cli.emit.c.target import CTarget, wrapped
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.emitted_functions import (
    DERIVATIVES,
    ENTRIES,
    INTERNAL_FUNCTIONS,
)
from lagrange_cli.program.lowered.routines.impacts import reset_arrays
from lagrange_cli.program.lowered.routines.projection import (
    NEWTON_STEPS,
    RESIDUAL_AT_REST,
    RESIDUAL_ROUNDING,
)
from lagrange_cli.program.lowered.workspace import given_size, program_workspace_size
from lagrange_cli.program.program import Program, result_count


def impact_text(programs: Mapping[str, Program], target: CTarget) -> str:
    """Return ``events`` and ``reset`` of flags that stand behind the parameters.

    Empty if there are no contacts.
    """
    if "gaps" not in programs:
        return ""
    replacements = {
        "@FIRST@": str(programs["gaps"].parameters - 2 * _contacts(programs)),
        "@EVENTS@": _statement(f"return {_falling(programs, target)} ? 0 : 1;"),
        "@RESET@": _statement(f"return {_reset(programs, target)};"),
    }
    text = target.fill(c_template("contacts"), replacements)
    return "\n".join([*routine_texts(_ROUTINES, target), text])


#: Routines that contacts need.
_ROUTINES = ("falling", "reset_contacts")


def _statement(text: str) -> str:
    return "\n".join(wrapped(text, 1, 1))


def _falling(programs: Mapping[str, Program], target: CTarget) -> str:
    """Return the call of the routine behind ``events``."""
    c, m = _contacts(programs), _multipliers(programs)
    start = _workspace_below_impact(programs)
    arrays = f"y, contact, out, work + {start}, work + {start + 2 * c}"
    return f"{target.prefix}_falling({c}, {m - c}, t, u, p, work, {arrays})"


def _reset(programs: Mapping[str, Program], target: CTarget) -> str:
    """Return the call of the routine behind ``reset``."""
    c, late = _contacts(programs), target.real.value(128 * float(target.real.epsilon))
    arrays, start = [], _workspace_below_impact(programs)
    for size in _arrays(programs).values():
        arrays.append(f"work + {start}")
        start += size
    arguments = [
        f"{programs['gaps'].coordinates}, {c}, t, u, p, work, event < 0 ? {c} : (int)event, bounce",
        f"{late}*fabs{target.real.suffix}(t), y, contact",
        *arrays,
    ]
    return f"{target.prefix}_reset_contacts({', '.join(arguments)})"


def _arrays(programs: Mapping[str, Program]) -> dict[str, int]:
    flight = programs["flight_rhs" if "flight_rhs" in programs else "rhs"]
    c, m = _contacts(programs), _multipliers(programs)
    return reset_arrays(flight.coordinates, flight.layout.size, c, m)


def impact_workspace_size(programs: Mapping[str, Program]) -> int:
    """Return the numbers of workspace for ``events`` and ``reset``; 0 if there are no contacts."""
    if "gaps" not in programs:
        return 0
    return _workspace_below_impact(programs) + sum(_arrays(programs).values())


def _workspace_below_impact(programs: Mapping[str, Program]) -> int:
    """Return the numbers of workspace that the called functions need."""
    called = ("gaps", "gap_terms", "impulse", "contact_multipliers", "rhs", "flight_rhs")
    return max(program_workspace_size(programs[name]) for name in called if name in programs)


def _contacts(programs: Mapping[str, Program]) -> int:
    """Return the number of contacts: each has a gap, and its magnitude."""
    return result_count(programs["gaps"]) // 2


def _multipliers(programs: Mapping[str, Program]) -> int:
    return sum(len(block.closures) for block in programs["contact_multipliers"].blocks)


def change_text(programs: Mapping[str, Program], target: CTarget, places: Sequence[int]) -> str:
    """Return the definition of ``NAME_change``; empty without states with two values.

    Parameters
    ----------
    places
        Places of these states in y.
    """
    if not places:
        return ""
    size, count = programs["switches"].layout.size, len(places)
    start = _workspace_below_change(programs)
    arguments = f"{size}, {count}, t, u, p, work, event < 0 ? {count} : event"
    arrays = f"places, y, work + {start}, work + {start + count}"
    call = f"return {target.prefix}_change_values({arguments}, {arrays});"
    tokens = {
        "@CHANGE@": change_arguments(target),
        "@S@": str(count),
        "@PLACES@": ", ".join(map(str, places)),
        "@CALL@": _statement(call),
    }
    return "\n".join(
        [*routine_texts(["change_values"], target), target.fill(c_template("switches"), tokens)]
    )


def change_arguments(target: CTarget) -> str:
    """Return the parameter list of the function that changes states with two values."""
    return _with_further(target, "int event, ").state_arguments()


def residual_text(programs: Mapping[str, Program], target: CTarget) -> str:
    """Return the helpers of all projections; empty if there is none."""
    used = any(name.endswith("velocity_change") for name in programs)
    more = {"@NEXT@": "nextafter" + target.real.suffix}
    text = target.fill(c_template("residual"), more) if used else ""
    positions = any(name.endswith("position_change") for name in programs)
    return "\n".join([text, target.fill(c_template("coupled_residual"))]) if positions else text


def project_text(programs: Mapping[str, Program], target: CTarget, prefix: str = "") -> str:
    """Return the definition of ``NAME_project``; empty if there are no closures.

    Parameters
    ----------
    prefix
        ``contact_`` for the projection onto closures and closed contacts; else empty.
    """
    if f"{prefix}velocity_change" not in programs:
        return ""
    positions = f"{prefix}position_change" in programs
    names, real = target.names, target.real
    return target.fill(
        c_template("project"),
        {
            "@LED@": c_template("project_positions") if positions else "    int i, status;\n",
            "@OF@": prefix,
            "@STATIC@": "" if names.contact_from is None else "static ",
            "@ARGUMENTS@": target.state_arguments(),
            "@PASSED@": names.passed,
            "@START@": str(_workspace_below_projection(programs, prefix)),
            "@N@": str(programs[f"{prefix}velocity_change"].coordinates),
            "@POSITIONS@": str(_closures(programs, f"{prefix}position_change")),
            "@CLOSURES@": str(_closures(programs, f"{prefix}velocity_change")),
            "@ROUNDS@": str(NEWTON_STEPS),
            "@NEAR@": real.value(RESIDUAL_AT_REST),
            "@FAR@": real.value(RESIDUAL_ROUNDING),
            "@TWO@": real.value(2.0),
        },
    )


def workspace_size(programs: Mapping[str, Program]) -> int:
    """Return the numbers of workspace that suffice for every function."""
    each = max(map(program_workspace_size, programs.values()))
    projections = (_projection_workspace(programs, prefix) for prefix in ("", "contact_"))
    behind = max(map(given_size, programs.values()))
    change = _workspace_below_change(programs) + 2 * _switches(programs)
    return behind + max(each, *projections, impact_workspace_size(programs), change)


def _workspace_below_change(programs: Mapping[str, Program]) -> int:
    return program_workspace_size(programs["switches"]) if "switches" in programs else 0


def _switches(programs: Mapping[str, Program]) -> int:
    """Return the number of states with two values, each of which has a number."""
    return result_count(programs["switches"]) if "switches" in programs else 0


def _projection_workspace(programs: Mapping[str, Program], prefix: str) -> int:
    if f"{prefix}velocity_change" not in programs:
        return 0
    closures = _closures(programs, f"{prefix}velocity_change")
    results = max(programs[f"{prefix}velocity_change"].coordinates, 3 * closures)
    return _workspace_below_projection(programs, prefix) + results


def _workspace_below_projection(programs: Mapping[str, Program], prefix: str) -> int:
    """Return the numbers of workspace that functions called by ``project`` need."""
    called = INTERNAL_FUNCTIONS.intersection(name for name in programs if name.startswith(prefix))
    return max(program_workspace_size(programs[name]) for name in called)


def _closures(programs: Mapping[str, Program], function: str) -> int:
    if function not in programs:
        return 0
    return sum(len(block.closures) for block in programs[function].blocks)


def contact_target(target: CTarget, contacts: int) -> CTarget:
    """Return the target of the functions that take flags and targets in an array of their own."""
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
    """Return the target of the functions of the interface, which take a mode."""
    return _with_further(target, "const int *mode, ")


def _with_further(target: CTarget, further: str) -> CTarget:
    return replace(target, names=replace(target.names, further=further))


def mode_workspace_size(programs: Mapping[str, Program], contacts: int) -> int:
    """Return numbers of workspace with flags and targets."""
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
        "@FALLING@": _statement(f"return {_falling(programs, target)} ? 0 : 1;"),
        "@CHANGED@": _statement(f"status = {_reset(programs, target)};"),
    }
    functions = (
        c_template("mode_function").replace("@FUNCTION@", name)
        for name in ("multipliers", "constraints", *_derivatives())
        if f"contact_{name}" in programs
    )
    flags, rhs, events, project, reset = (
        c_template(f"mode_{name}") for name in ("flags", "rhs", "events", "project", "reset")
    )
    texts = [flags, rhs, *functions, events, project, reset]
    return "\n".join(
        [
            project_text(programs, inner, "contact_"),
            *routine_texts(_ROUTINES, inner),
            *(target.fill(text, replacements) for text in texts),
        ]
    )


def _derivatives() -> list[str]:
    return [function + tail for function in DERIVATIVES for tail in ("", ENTRIES)]


def _reset_arguments(target: CTarget) -> str:
    """Return the parameter list of the function that changes state and mode."""
    further = f"int *mode, int event, {target.real.name} bounce, "
    return _with_further(target, further).state_arguments()
