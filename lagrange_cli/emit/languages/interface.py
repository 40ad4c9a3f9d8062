"""The interface of an emitted module: functions, names, order, documentation, and the run.

Every language of :mod:`lagrange_cli.emit.languages` has these functions under these names.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING

from lagrange_cli.emit.initial_state import ROWS, rates_note, residual_labels, steps_per_row
from lagrange_cli.emit.languages.values import (
    Contacts,
    Interface,
    Projection,
    Quantity,
    Recorded,
    Switches,
)
from lagrange_cli.emit.naming import (
    comment_text,
    described,
    domain_note,
    input_identifier,
    unique_identifiers,
)
from lagrange_cli.emit.routines.signatures import routines_called
from lagrange_cli.emit.shared_code import (
    RECORDED_ROUNDING,
    described_input,
    input_lines,
    polynomial_rows,
    recorded_inputs,
    switch_places,
)
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.emitted_functions import (
    INTERNAL_FUNCTIONS,
    constraint_programs,
    contact_programs,
    derivative_programs,
    optional_outputs,
    program_of,
)
from lagrange_cli.program.lowered.functions import Function, Let, LocalArray, steps_in
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.lowered.routines.registry import ROUTINES
from lagrange_cli.program.program import Program
from lagrange_cli.program.systems.contact_systems import with_contact_flags
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Function → its documentation.
_DOCUMENTATION = {
    "rhs": "State derivative [v, a].",
    "mass_matrix": "Mass matrix M(q, t) of M a = f, n by n, by rows.",
    "forcing": "Forcing f(q, v, t) of M a = f.",
    "energy": "Energy function: the sum of v dL/dv, less L (T + V in most systems).",
    "positions": "Positions, in the order of the heading.",
    "velocities": "Time derivatives of the positions.",
    "inputs": "Inputs as the scene has them at time t.",
    "outputs": "Outputs, in the order of the heading.",
    "switches": "For each state with two values what is positive as long as its value stays.",
    "multipliers": "Multipliers, in the order of the closures.",
    "constraints": "Residuals: lhs - rhs of closures of positions, then rates of all closures.",
    "jacobian": "Derivatives of rhs by the state, by rows.",
    "jacobian_u": "Derivatives of rhs by the inputs, by rows.",
    "jacobian_p": "Derivatives of rhs by the parameters, by rows.",
    "position_error": "Residuals of closures of positions, then magnitudes of their terms.",
    "position_reach": "Squares of the gradients of closures of positions.",
    "position_change": "Change of q that leads to the closures, in the metric of the energy.",
    "velocity_error": "Residuals of the rates of closures, then magnitudes of their terms.",
    "velocity_change": "Change of v that leads to the closures, in the metric of the energy.",
    "flight_rhs": "State derivative while all contacts are open.",
    "gaps": "Gaps of all contacts, then magnitudes of their terms.",
    "gap_terms": "Gradients of the gaps, by rows, their rates, biases and restitutions.",
    "impulse": "Change of v that changes the rates of closed contacts by the targets behind mode.",
}

#: Names of routines, which no identifier of a scene may be.
_ROUTINES = frozenset(routine.name for routine in routines_called(ROUTINES))

_STATE = "The state y holds the coordinates q, then their velocities v. Functions have no result"

_FUNCTIONS = ("rhs", "mass_matrix", "forcing", "energy", "positions", "velocities")


def interface_of(
    equations: Equations,
    reserved: frozenset[str],
    *,
    jacobian: bool = False,
    caseless: bool = False,
    longest: int | None = None,
) -> Interface:
    """Return the interface of a scene's module.

    Parameters
    ----------
    reserved
        Words that identifiers must not be.
    jacobian
        Derivatives of the right-hand side are among the functions.
    caseless, longest
        What tells identifiers apart, see :func:`.naming.unique_identifiers`.

    Raises
    ------
    InputError
        A recorded input is too long to be written into code, or cannot be read.
    """
    if jacobian and equations.system.contacts:
        problem = "--with jacobian does not hold this scene: derivatives with contacts keep a mode"
        raise InputError(Problem(problem, hint="--to c and --to python hold it", rule="language"))
    functions = _lowered(equations, _programs(equations, jacobian=jacobian))
    contacts = _contacts(equations)
    projection = _projection(equations)
    inner = () if projection is None else projection.functions
    inner += () if contacts is None else contacts.functions
    taken = reserved | _local_names((*functions, *inner)) | _ROUTINES
    unique = partial(unique_identifiers, caseless=caseless, longest=longest)
    inputs = _inputs(equations)
    names = dict(zip(inputs, unique(inputs.values(), taken), strict=True))
    (name,) = unique([equations.presentation.name], taken | frozenset(names.values()))
    system, defaults = equations.system, equations.system.simulate
    until = defaults.start + 10.0 if defaults.until is None else defaults.until
    return Interface(
        name,
        tuple(_heading(equations)),
        _quantities(names, "q", [(c.name, described(c), None) for c in system.coordinates]),
        _quantities(names, "p", [(p.name, described(p), p.value) for p in system.parameters]),
        _quantities(names, "u", [(u.name, comment_text(u.name), None) for u in system.inputs]),
        functions,
        names,
        projection,
        contacts,
        tuple(_recorded(equations)),
        None if system.initial is None else system.initial.numbers,
        float(defaults.start),
        float(until),
        ROWS,
        steps_per_row(equations),
        _quantities(names, "z", [(s.name, described(s), None) for s in system.states]),
        Switches(tuple(state.name for state in system.switches), switch_places(equations)),
    )


def _quantities(
    names: Mapping[str, str], letter: str, entries: Sequence[tuple[str, str, float | None]]
) -> tuple[Quantity, ...]:
    """Return quantities of a kind, of their names, notes and values."""
    return tuple(
        Quantity(name, names[f"{letter}{k}"], note, value)
        for k, (name, note, value) in enumerate(entries)
    )


def _documentation(name: str, equations: Equations) -> str:
    text = _DOCUMENTATION[name.removeprefix("contact_")]
    return text.replace("[v, a]", "[v, a, rates of states]") if equations.system.states else text


def _lowered(
    equations: Equations, programs: Iterable[tuple[str, Program]]
) -> tuple[tuple[Function, str], ...]:
    return tuple(
        (lowered(program, name), _documentation(name, equations)) for name, program in programs
    )


def _projection(equations: Equations) -> Projection | None:
    system = equations.system
    if not system.pushing:
        return None
    if system.contacts:
        programs = contact_programs(with_contact_flags(equations))
    else:
        programs = constraint_programs(equations)
    positions = sum(closure.kind == "position" for closure in system.closures)
    return Projection(
        _lowered(
            equations, ((name, p) for name, p in programs.items() if name in INTERNAL_FUNCTIONS)
        ),
        positions + len(system.contacts),
        len(system.closures) + len(system.contacts),
        tuple(residual_labels(equations)),
    )


def _contacts(equations: Equations) -> Contacts | None:
    contacts = equations.system.contacts
    if not contacts:
        return None
    programs = contact_programs(with_contact_flags(equations))
    inner = [(name, p) for name, p in programs.items() if name not in INTERNAL_FUNCTIONS]
    functions = _lowered(equations, [("flight_rhs", program_of(equations, "rhs")), *inner])
    public = {f.name.removeprefix("contact_"): f for f, _ in functions}
    return Contacts(
        tuple(contact.name for contact in contacts),
        functions,
        {name: public[name] for name in ("rhs", "multipliers", "constraints")},
        len(equations.system.closures),
    )


def _recorded(equations: Equations) -> Iterator[Recorded]:
    for number, pieces in recorded_inputs(equations):
        rows = polynomial_rows(pieces)
        first, last = rows[0][0], float(pieces.end)
        within = RECORDED_ROUNDING * (last - first) if isfinite(last) else 0.0
        yield Recorded(
            number,
            comment_text(described_input(equations, number)),
            len(rows[0]),
            tuple(number for row in rows for number in row),
            first - within,
            last + within,
        )


def _programs(equations: Equations, *, jacobian: bool) -> Iterator[tuple[str, Program]]:
    contacts = bool(equations.system.contacts)
    for name in (*_FUNCTIONS[contacts:], *optional_outputs(equations)):
        yield name, program_of(equations, name)
    for name, program in () if contacts else constraint_programs(equations).items():
        if name not in INTERNAL_FUNCTIONS:
            yield name, program
    yield from derivative_programs(
        equations, jacobian=jacobian, linearization=False, sparse=False
    ).items()


def _local_names(functions: tuple[tuple[Function, str], ...]) -> set[str]:
    """Collect the names that statements of the functions define."""
    return {
        step.name
        for function, _ in functions
        for step in steps_in(function.body)
        if isinstance(step, Let | LocalArray)
    } | {function.name for function, _ in functions}


def _inputs(equations: Equations) -> dict[str, str]:
    """Return what each input of the programs is called in the scene."""
    system = equations.system
    entries = {f"p{i}": p.name for i, p in enumerate(system.parameters)}
    entries |= {f"u{i}": input_identifier(u) for i, u in enumerate(system.inputs)}
    entries |= {f"q{i}": c.name for i, c in enumerate(system.coordinates)}
    entries |= {f"v{i}": f"{c.name}_dot" for i, c in enumerate(system.coordinates)}
    return entries | {f"z{i}": s.name for i, s in enumerate(system.states)}


_CONTACTS = """\
Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with contacts beside them, behind
closures if there are any: l[k] is the multiplier and g[k] the gradient of closure or gap k. A
contact pushes, l[k] >= 0, while it is closed. A mode is 1 for each closed contact and 0 for each
open one. Integrate with a fixed mode until a number of events falls through zero, say number k;
find when; reset state and mode there by event k; go on with these. Begin with a mode of zeros,
reset without an event."""

_SWITCHES = """\
States with two values are 1 or 0 and have no rate. Integrate until a number of switches falls
through zero, say number k; find when; change the state there by event k; go on with it. Begin with
a change without an event."""


def _heading(equations: Equations) -> Iterator[str]:
    """Yield what the module says of itself."""
    presentation, system = equations.presentation, equations.system
    name = comment_text(presentation.name)
    yield f"{name}: {comment_text(presentation.title)}" if presentation.title else name
    if presentation.description:
        yield ""
        yield comment_text(presentation.description)
    yield ""
    if system.contacts:
        yield from _CONTACTS.splitlines()
    elif system.multipliers:
        yield "Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with closures beside"
        yield "them: l[k] is the multiplier and g[k] the gradient of closure k."
    else:
        yield "Equations of motion M(q, t) a = f(q, v, t)."
    if system.states:
        yield "The state y holds the coordinates q, their velocities v, then the states x of first"
        yield "order, dx/dt = r(q, v, x, t). Functions have no result (NaN, or a status that is not"
        yield "0) where M is singular or a number is not finite."
    else:
        yield _STATE
        yield "(NaN, or a status that is not 0) where M is singular or a number is not finite."
    if system.switches:
        yield from _SWITCHES.splitlines()
    yield from domain_note(equations)
    yield from _listed("Coordinates", [described(c) for c in system.coordinates])
    yield from _listed("States", [described(s) for s in system.states])
    yield from _listed("Parameters", [described(p) for p in system.parameters])
    yield from _listed("Inputs", list(map(comment_text, input_lines(equations))))
    yield from _listed("Outputs", [comment_text(name) for name, _ in system.outputs])
    yield from _listed("Positions", [comment_text(c.name) for c in system.cartesian_names])
    yield from _listed("Closures", [comment_text(f"{c.name}: {c.text}") for c in system.closures])
    contacts = [contact.closure for contact in system.contacts]
    yield from _listed("Contacts", [comment_text(f"{c.name}: {c.text}") for c in contacts])
    yield from rates_note(equations)
    yield ""
    yield f"Made by lagrange {__version__} from the scene with SHA-256"
    yield comment_text(presentation.digest)
    yield "This output is yours: use it as you like, under any terms."


def _listed(title: str, entries: list[str]) -> Iterator[str]:
    if entries:
        yield ""
        yield f"{title}, in their order:"
        yield from (f"  {entry}" for entry in entries)


def is_input(name: str) -> bool:
    """Tell whether a variable of a function is one of its inputs."""
    return re.fullmatch(r"[pquvz]\d+", name) is not None
