"""Functions of emitted C on constraints: ``project``, ``events``, ``reset``, those of a mode.

``project`` leads a state back to closures that it has left. At an event the closed contacts take
an impact if one of them approaches, by Newton's law with
impulses that only push (Moreau, *Unilateral contact and dry friction in finite freedom dynamics*,
1988; Glocker and Pfeiffer, *Nonlinear Dynamics* 7 (1995) 471): w = u⁺ + e·min(u⁻, 0) ≥ 0, Λ ≥ 0,
w·Λ = 0 for the rates u. Contacts that do not leave stay closed if they have to push: λ ≥ 0, φ̈ ≥ 0,
λ·φ̈ = 0. Both are the optimality conditions of a projection in the metric of the kinetic energy,
which the dual method of Goldfarb and Idnani finds (*Math. Programming* 27 (1983) 1): it copes with
contacts that depend on others.

The functions of the interface take a mode; they call static ones that take the flags of closed
contacts in an array.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lagrange_cli.emit.c.target import CNames, CTarget
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.emitted_functions import (
    DERIVATIVES,
    ENTRIES,
    INTERNAL_FUNCTIONS,
)
from lagrange_cli.program.lowered.routines.projection import (
    NEWTON_STEPS,
    RESIDUAL_AT_REST,
    RESIDUAL_ROUNDING,
)
from lagrange_cli.program.lowered.workspace import given_size, program_workspace_size
from lagrange_cli.program.program import Program, result_count
from lagrange_cli.program.solvers.tolerances import (
    COMPLEMENTARITY_STEPS,
    IMPACT_TOLERANCES,
    RATE_TOLERANCE,
)

#: Number of contacts from which on those that push are guessed first: the dual method alone is
#: cheap for few contacts, and each guess costs a factorization. Chosen as that trade; not tuned.
_FEWEST_GUESSED = 8

#: Rounds of guesses of the contacts that push: most sets settle in a few, and a set that has not
#: is left to the dual method, which always ends. Chosen as that trade; not tuned.
_ROUNDS = 12

#: Pivot of a matrix with ones on the diagonal that ends the guesses: contacts that nearly depend on
#: others would give pushes without digits. Chosen well above rounding; not tuned.
_SMALLEST = 1e-6


def impact_text(programs: Mapping[str, Program], target: CTarget) -> str:
    """Return ``events`` and ``reset`` with their helpers; empty if there are no contacts."""
    if "gaps" not in programs:
        return ""
    names, real, contacts = target.names, target.real, _contacts(programs)
    guessed = contacts >= _FEWEST_GUESSED
    replacements = _arguments(names, programs["gaps"].parameters - 2 * contacts) | {
        "@PASSED@": names.passed,
        "@ARGUMENTS@": target.arguments("out"),
        "@U@": str(contacts),
        "@M@": str(_multipliers(programs) - contacts),
        "@N@": str(programs["gaps"].coordinates),
        "@START@": str(_workspace_below_impact(programs)),
        "@RESULTS@": str(_results(programs)),
        "@STEPS@": str(COMPLEMENTARITY_STEPS),
        "@ROUNDS@": str(_ROUNDS),
        "@SMALLEST@": real.value(max(_SMALLEST, 64 * float(real.epsilon))),
        "@GUESSED@": "    @NAME@_guess(n, w, size, c);\n" if guessed else "",
        "@MIN@": f"fmin{real.suffix}",
        "@MAX@": f"fmax{real.suffix}",
        "@TOLERANCE@": real.value(max(RATE_TOLERANCE, 64 * float(real.epsilon))),
        "@LOOSER@": real.value(IMPACT_TOLERANCES),
        "@ULPS@": real.value(128 * float(real.epsilon)),
    }
    guess = ["guess"] if guessed else []
    templates = ("events", "closing", "among_active", *guess, "push", "impact", "reset")
    return "\n".join(target.fill(target.fill(c_template(name), replacements)) for name in templates)


def _arguments(names: CNames, flags_from: int) -> dict[str, str]:
    """Return the tokens of argument lists; flags are behind the parameters, or in an array."""
    inside = names.contact_from is None
    constant = "" if inside else ", const @REAL@ *contact"
    changing = "" if inside else ", @REAL@ *contact"
    state = f"@REAL@ t, {{}}@REAL@ *y, const @REAL@ *u, {{}}{names.prefix}_params *p"
    changed = "" if inside else "const "
    return {
        "@OF@": "" if inside else "contact_",
        "@STATIC@": "" if inside else "static ",
        "@INT@": "long" if inside else "int",
        "@FLIGHT@": "" if inside else "flight_",
        "@FREE@": "t, y, u, p",
        "@STATE@": state.format("const ", "const ") + constant,
        "@MUTABLE@": state.format("const ", changed) + changing,
        "@MUTABLE_STATE@": state.format("", changed) + changing,
        "@CONTACT@": f"    const @REAL@ *const contact = p->p + {flags_from};\n" if inside else "",
        "@CHANGING@": f"    @REAL@ *const contact = p->p + {flags_from};\n" if inside else "",
    }


def impact_workspace_size(programs: Mapping[str, Program]) -> int:
    """Return the numbers of workspace for ``events`` and ``reset``; 0 if there are no contacts."""
    if "gaps" not in programs:
        return 0
    n, u = programs["gaps"].coordinates, _contacts(programs)
    events = max(2 * u, _multipliers(programs))
    known = 2 * u + u * (n + 3) + 7 * u + u * u + _results(programs)
    return _workspace_below_impact(programs) + max(events, known + u * u + 3 * u)


def _workspace_below_impact(programs: Mapping[str, Program]) -> int:
    """Return the numbers of workspace that the called functions need."""
    called = ("gaps", "gap_terms", "impulse", "contact_multipliers", "rhs", "flight_rhs")
    return max(program_workspace_size(programs[name]) for name in called if name in programs)


def _contacts(programs: Mapping[str, Program]) -> int:
    """Return the number of contacts: each has a gap, and its magnitude."""
    return result_count(programs["gaps"]) // 2


def _multipliers(programs: Mapping[str, Program]) -> int:
    return sum(len(block.closures) for block in programs["contact_multipliers"].blocks)


def _results(programs: Mapping[str, Program]) -> int:
    """Return the most numbers that a called function returns, besides terms."""
    return max(2 * programs["gaps"].coordinates, _multipliers(programs))


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
    return behind + max(each, *projections, impact_workspace_size(programs))


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
    }
    functions = (
        c_template("mode_function").replace("@FUNCTION@", name)
        for name in ("multipliers", "constraints", "events", *_derivatives())
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


def _derivatives() -> list[str]:
    return [function + tail for function in DERIVATIVES for tail in ("", ENTRIES)]


def _reset_arguments(target: CTarget) -> str:
    """Return the parameter list of the function that changes state and mode."""
    further = f"int *mode, int event, {target.real.name} bounce, "
    return _with_further(target, further).state_arguments()
