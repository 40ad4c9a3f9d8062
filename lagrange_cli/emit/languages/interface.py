"""The interface of an emitted module: functions, names, order, documentation, and the run.

Every language of :mod:`lagrange_cli.emit.languages` has these functions under these names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from lagrange_cli.emit.initial_state import ROWS, rates_note, residual_labels, steps_per_row
from lagrange_cli.emit.naming import (
    comment_text,
    described,
    domain_note,
    input_identifier,
    unique_identifiers,
)
from lagrange_cli.emit.routines.signatures import routines_called
from lagrange_cli.emit.shared_code import recorded_inputs
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.emitted_functions import (
    INTERNAL_FUNCTIONS,
    constraint_programs,
    derivative_programs,
    optional_outputs,
)
from lagrange_cli.program.lowered.functions import Function, Let, LocalArray, steps_in
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.lowered.routines.registry import ROUTINES
from lagrange_cli.program.program import Program, build_program
from lagrange_cli.state_layout import StateLayout
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
}

#: Names of routines, which no identifier of a scene may be.
_ROUTINES = frozenset(routine.name for routine in routines_called(ROUTINES))

_STATE = "The state y holds the coordinates q, then their velocities v. Functions have no result"

_FUNCTIONS = ("rhs", "mass_matrix", "forcing", "energy", "positions", "velocities")


@dataclass(frozen=True)
class Quantity:
    """A coordinate, parameter or input.

    Attributes
    ----------
    name
        Its name in the scene.
    identifier
        Its name in the module.
    note
        Name, unit and description, as text of a comment.
    value
        Its value in the scene; None where it must be given.
    """

    name: str
    identifier: str
    note: str
    value: float | None = None


@dataclass(frozen=True)
class Projection:
    """The functions by which a state is led back to its closures.

    Attributes
    ----------
    functions
        Functions that only the routines ``lead_positions`` and ``lead_velocities`` call, each with
        its documentation.
    positions, closures
        Numbers of closures of positions, and of all closures.
    residuals
        Names of the results of ``constraints``.
    driven
        A function depends on inputs.
    """

    functions: tuple[tuple[Function, str], ...]
    positions: int
    closures: int
    residuals: tuple[str, ...]
    driven: bool


@dataclass(frozen=True)
class Interface:
    """Everything that a module of one scene holds, without a language.

    Attributes
    ----------
    name
        The scene's name as an identifier that none of the others is.
    heading
        Lines of the comment at its head.
    coordinates, parameters, inputs, states
        The quantities that functions take, in their order.
    functions
        The functions, each with its documentation.
    names
        Name of an input of programs (``q0``, ``v0``, ``z0``, ``p0``, ``u0``) → its identifier.
    projection
        The closures that a state is led back to; None without any.
    initial
        Initial state; None where the scene has none.
    start, until
        Times at which the script's run begins and ends.
    rows, steps
        Intervals of the table that the script prints, and integration steps in each.
    """

    name: str
    heading: tuple[str, ...]
    coordinates: tuple[Quantity, ...]
    parameters: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    functions: tuple[tuple[Function, str], ...]
    names: Mapping[str, str]
    projection: Projection | None
    initial: tuple[float, ...] | None
    start: float
    until: float
    rows: int
    steps: int
    states: tuple[Quantity, ...] = ()

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the numbers of the state, as the script's table has them."""
        return self.layout.names([c.name for c in self.coordinates], [s.name for s in self.states])

    @property
    def layout(self) -> StateLayout:
        """Layout of the state vector."""
        return StateLayout(len(self.coordinates), len(self.states))


def interface_of(
    equations: Equations,
    language: str,
    reserved: frozenset[str],
    *,
    jacobian: bool = False,
    caseless: bool = False,
    longest: int | None = None,
) -> Interface:
    """Return the interface of a scene's module.

    Parameters
    ----------
    language
        Name of the language, for refusals.
    reserved
        Words that identifiers must not be.
    jacobian
        Derivatives of the right-hand side are among the functions.
    caseless, longest
        What tells identifiers apart, see :func:`.naming.unique_identifiers`.

    Raises
    ------
    InputError
        The scene has contacts or recorded inputs.
    """
    _require_held(equations, language)
    functions = tuple(
        (lowered(program, name), _documentation(name, equations))
        for name, program in _programs(equations, jacobian=jacobian)
    )
    projection = _projection(equations)
    all_functions = functions if projection is None else (*functions, *projection.functions)
    taken = reserved | _local_names(all_functions) | _ROUTINES
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
        None if system.initial is None else system.initial.numbers,
        float(defaults.start),
        float(until),
        ROWS,
        steps_per_row(equations),
        _quantities(names, "z", [(s.name, described(s), None) for s in system.states]),
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
    text = _DOCUMENTATION[name]
    return text.replace("[v, a]", "[v, a, rates of states]") if equations.system.states else text


def _projection(equations: Equations) -> Projection | None:
    closures = equations.system.closures
    if not closures:
        return None
    functions = tuple(
        (lowered(program, name), _DOCUMENTATION[name])
        for name, program in constraint_programs(equations).items()
        if name in INTERNAL_FUNCTIONS
    )
    return Projection(
        functions,
        sum(closure.kind == "position" for closure in closures),
        len(closures),
        tuple(residual_labels(equations)),
        any(function.driven for function, _ in functions),
    )


def _require_held(equations: Equations, language: str) -> None:
    """Refuse scenes that need more than functions of a state."""
    if equations.system.contacts:
        reason = "contacts open and close at events, which emitted C and Python follow"
    elif recorded_inputs(equations):
        reason = "inputs from a file are looked up, which emitted C and Python do"
    else:
        return
    problem = f"--to {language} does not hold this scene: {reason}"
    raise InputError(Problem(problem, hint="--to c and --to python hold it", rule="language"))


def _programs(equations: Equations, *, jacobian: bool) -> Iterator[tuple[str, Program]]:
    for name in (*_FUNCTIONS, *optional_outputs(equations)):
        yield name, build_program(equations, ["acceleration" if name == "rhs" else name])
    for name, program in constraint_programs(equations).items():
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


def _heading(equations: Equations) -> Iterator[str]:
    """Yield what the module says of itself."""
    presentation, system = equations.presentation, equations.system
    name = comment_text(presentation.name)
    yield f"{name}: {comment_text(presentation.title)}" if presentation.title else name
    if presentation.description:
        yield ""
        yield comment_text(presentation.description)
    yield ""
    if system.multipliers:
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
    yield from domain_note(equations)
    yield from _listed("Coordinates", [described(c) for c in system.coordinates])
    yield from _listed("States", [described(s) for s in system.states])
    yield from _listed("Parameters", [described(p) for p in system.parameters])
    yield from _listed("Inputs", [comment_text(u.name) for u in system.inputs])
    yield from _listed("Outputs", [comment_text(name) for name, _ in system.outputs])
    yield from _listed("Positions", [comment_text(c.name) for c in system.cartesian_names])
    yield from _listed("Closures", [comment_text(f"{c.name}: {c.text}") for c in system.closures])
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
