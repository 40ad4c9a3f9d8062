"""Equations → Model: programs built, lowered and printed in C, symbols left behind."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from sympy import Integer

from lagrange_cli.emit.c.constraints import workspace_size
from lagrange_cli.errors import InputError, Mark, placed
from lagrange_cli.mechanics.symbols.inputs import closed_loop
from lagrange_cli.mechanics.symbols.values import decimal
from lagrange_cli.mechanics.system import Parameter
from lagrange_cli.program.emitted_functions import (
    constraint_programs,
    contact_programs,
    program_of,
    shifting_programs,
)
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.lowered.stored import StoredFunctions
from lagrange_cli.program.program import build_program
from lagrange_cli.program.systems.contact_systems import with_contact_flags
from lagrange_cli.simulate.model.charts import (
    chart_singularities,
    coordinate_kinds,
    former_chart,
    guard_program,
    positive_program,
    singular_program,
)
from lagrange_cli.simulate.model.expressions import (
    calls_and_powers,
    outputs_program,
    with_accelerations,
)
from lagrange_cli.simulate.model.inputs import substitute_inputs
from lagrange_cli.simulate.model.labels import labels_of
from lagrange_cli.simulate.model.model import (
    Code,
    Model,
    ModelController,
    ModelParameter,
    ModelQuantity,
)
from lagrange_cli.simulate.model.sharp_functions import (
    peak_exponents,
    steep_arguments,
    steep_places,
    steep_program,
)
from lagrange_cli.simulate.model.switching_surfaces import (
    OneSided,
    one_sided,
    surface_events,
    surface_rates,
    surface_values,
)
from lagrange_cli.simulate.model.table_ends import table_ends, vanishing_slips
from lagrange_cli.simulate.native.rounding_model import perturb
from lagrange_cli.simulate.native.sources import (
    C_DOUBLE,
    GUARD_PROGRAM,
    guard_source,
    lane_tables_source,
    lanes_source,
    library_source,
    taylor_source,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.program.program import Program

#: Evaluators of a simulation, beside the disturbed right-hand side.
_EVALUATORS = ("rhs", "energy", "positions", "velocities")


@dataclass(frozen=True)
class _Evaluated:
    """Equations as a simulation evaluates them, and their kinks, peaks and steep arguments.

    Attributes
    ----------
    equations
        With functions of time in place of inputs, weights of the sides of surfaces, and flags of
        contacts.
    one_side
        The equations on one side of each switching surface; None if nothing has a kink.
    exponents
        Exponents of sharp functions.
    steep
        Arguments of functions with unbounded slopes.
    """

    equations: Equations
    one_side: OneSided | None
    exponents: tuple[Expr, ...]
    steep: tuple[Expr, ...]

    @classmethod
    def from_equations(cls, equations: Equations) -> _Evaluated:
        known = substitute_inputs(equations)
        parts = calls_and_powers(known)
        exponents, steep = peak_exponents(known, parts), steep_arguments(known, parts)
        one_side = one_sided(known, parts)
        if one_side is not None:
            known = replace(
                known, system=replace(known.system, parameters=one_side.equations.system.parameters)
            )
        if known.system.contacts:
            known = with_contact_flags(known)
        return cls(known, one_side, exponents, steep)


def model_of(equations: Equations) -> Model:
    """Build the model of a system for the parameters' values and the initial state it has.

    Raises
    ------
    InputError
        At the scene's place: a number of the equations is beyond doubles.
    """
    try:
        return _model_of(closed_loop(equations))
    except InputError as refusal:
        raise placed(refusal, Mark(equations.presentation.file, 1, 1)) from refusal


def _model_of(equations: Equations) -> Model:
    unused = equations.derivation.facts.unused_parameters
    initial = equations.system.initial
    facts = asdict(equations.derivation.facts)
    del facts["unused_parameters"]
    facts["autonomous"] &= not equations.system.controllers
    evaluated = _Evaluated.from_equations(_with_terms(equations))
    return Model(
        name=equations.presentation.name,
        coordinates=tuple(c.name for c in equations.system.coordinates),
        states=tuple(s.name for s in equations.system.states),
        controllers=tuple(_controllers(equations)),
        kinds=coordinate_kinds(equations.system.coordinates),
        cartesian=tuple(c.name for c in equations.system.cartesian_names),
        parameters=tuple(
            ModelParameter(p.name, p.value, p.name not in unused, p.decimal)
            for p in equations.system.parameters
        ),
        initial=None if initial is None else initial.numbers,
        initial_decimals=() if initial is None else initial.decimals,
        defaults=equations.system.simulate,
        conserved=tuple(c.kind for c in equations.derivation.conserved),
        facts=facts,
        formulation=equations.system.formulation,
        code=_code(evaluated, _forces(equations)),
        multipliers=tuple(c.name for c in equations.system.closures),
        symbols=tuple(c.multiplier.name for c in equations.system.pushing),
        residuals=sum(1 + (c.kind == "position") for c in equations.system.closures),
        outputs=tuple(name for name, _ in equations.system.outputs),
        quantities=None
        if equations.derivation.followed is None
        else tuple(ModelQuantity(f.name, len(f.terms)) for f in equations.derivation.followed),
        suggested=equations.derivation.suggested,
        forces=tuple(name for name, _ in _force_columns(equations)),
        contacts=tuple(c.name for c in equations.system.contacts),
        recordings=tuple(
            u.recording for u in equations.system.inputs if u.recording is not None and not u.order
        ),
        driven=tuple(u.name for u in equations.system.inputs if u.driven),
        singular=chart_singularities(equations),
        positive=tuple(name for name, _ in equations.system.positive),
        table_ends=tuple(name for name, _ in table_ends(evaluated.equations)),
        slips=tuple(name for name, _ in vanishing_slips(evaluated.equations)),
        chart=former_chart(substitute_inputs(equations)),
        massless=_massless(equations),
        steep=steep_places(evaluated.equations, evaluated.steep),
        **_surfaces(evaluated),
        labels=labels_of(equations),
        landmarks=len(evaluated.exponents),
    )


def _controllers(equations: Equations) -> Iterator[ModelController]:
    """Yield the controllers, with the places in y of what they set."""
    places = {name: k for k, name in enumerate(equations.system.state_names)}
    for controller in equations.system.controllers:
        every = controller.every
        text = (
            every.name if every.is_Symbol else str(every) if every.is_Rational else decimal(every)
        )
        named = (*controller.held_inputs, *controller.memory)
        yield ModelController(text, tuple(places[name] for name, _ in named))


def _massless(equations: Equations) -> tuple[str, ...]:
    """List the coordinates whose inertia vanishes everywhere because a parameter is 0."""
    vanished = {p.symbol: Integer(0) for p in equations.system.parameters if p.value == 0}
    diagonal = (row[k] for k, row in enumerate(equations.system.mass_matrix)) if vanished else ()
    return tuple(
        c.name
        for c, inertia in zip(equations.system.coordinates, diagonal, strict=False)
        if not vanished.keys().isdisjoint(inertia.free_symbols) and inertia.xreplace(vanished) == 0
    )


def programs_of(equations: Equations) -> dict[str, Program]:
    """Make the programs of a simulation by name, without the perturbed ones."""
    return _programs(_Evaluated.from_equations(equations).equations)


def _surfaces(evaluated: _Evaluated) -> dict[str, Any]:
    """Describe the switching surfaces by fields of a model; empty where there are none."""
    one_side = evaluated.one_side
    if one_side is None:
        return {}
    from lagrange_cli.notation.scene_language import to_scene_language  # imports all of notation

    system = evaluated.equations.system
    velocities = {c.v for c in system.coordinates} | {s.symbol for s in system.states}
    return {
        "surfaces": tuple(s.free_symbols.isdisjoint(velocities) for s in one_side.surfaces),
        "surface_names": tuple(to_scene_language(e, evaluated.equations) for e in one_side.written),
        "continuous": len(one_side.continuous),
        "switches": one_side.switches,
    }


def _programs(equations: Equations) -> dict[str, Program]:
    programs = {name: program_of(equations, name) for name in _EVALUATORS}
    if equations.system.outputs:
        programs["outputs"] = program_of(equations, "outputs")
    if equations.system.controllers:
        sampled = (e for c in equations.system.controllers for _, e in (*c.held_inputs, *c.memory))
        programs["sampled"] = outputs_program(equations, sampled)
    constrained = constraint_programs(equations, programs["rhs"])
    return programs | constrained | contact_programs(equations)


def _sided_programs(one_side: OneSided | None) -> dict[str, Program]:
    """Make the programs of right-hand sides on one side of each surface, and those that locate
    its crossings; none if nothing has a kink."""
    if one_side is None:
        return {}
    programs = {}
    if one_side.equations.system.contacts:
        one_side = replace(one_side, equations=with_contact_flags(one_side.equations))
        programs["sided_contact_rhs"] = build_program(one_side.equations, ("contact_acceleration",))
    return programs | {
        "sided_rhs": build_program(one_side.equations, ("acceleration",)),
        "continuous": outputs_program(one_side.equations, one_side.continuous),
        "surfaces": outputs_program(one_side.equations, surface_events(one_side)),
        "surface_values": outputs_program(one_side.equations, surface_values(one_side)),
        "surface_rates": outputs_program(
            with_accelerations(one_side.equations), surface_rates(one_side)
        ),
    }


def _code(evaluated: _Evaluated, forces: Program | None) -> Code:
    equations = evaluated.equations
    sided_programs = _sided_programs(evaluated.one_side)
    programs = _programs(equations) | sided_programs
    disturbed = {
        name.replace("rhs", "disturbed"): perturb(programs[name])
        for name in ("rhs", "contact_rhs", "sided_rhs", "sided_contact_rhs")
        if name in programs
    }
    programs |= disturbed | shifting_programs(equations)
    watched = programs | _watched(evaluated)
    apart = {"forces": forces, "singular": singular_program(equations)}
    compiled = watched | _present(apart)
    python = {
        "positive": positive_program(equations),
        "steep": steep_program(equations, evaluated.steep),
    }
    interpreted = compiled | _present(python)
    guarded = guard_program(equations)
    bounded = equations.system.positive or table_ends(equations) or vanishing_slips(equations)
    places, rates = ({}, []) if guarded is None else ({GUARD_PROGRAM: guarded[0]}, guarded[1])
    compiled |= places
    lanes = lanes_source(programs)
    return Code(
        c=library_source(compiled) + guard_source(compiled, rates, C_DOUBLE),
        lanes=lanes + guard_source(compiled, rates, C_DOUBLE, lanes),
        # The series know nothing of the borders.
        taylor="" if sided_programs or bounded else taylor_source(programs),
        tables=lane_tables_source(programs),
        functions=StoredFunctions.from_functions(
            {name: lowered(program, name) for name, program in interpreted.items()}
        ),
        work=workspace_size(compiled),
        factors=max(d.parameters for d in disturbed.values()) - len(equations.system.parameters),
    )


def _present(programs: Mapping[str, Program | None]) -> dict[str, Program]:
    return {name: program for name, program in programs.items() if program is not None}


def _with_terms(equations: Equations) -> Equations:
    """Add the terms of quantities that are followed to the outputs."""
    terms = (
        (f"term({k}, {f.name})", e)
        for f in equations.derivation.followed or ()
        for k, e in enumerate(f.terms)
    )
    return replace(
        equations, system=replace(equations.system, outputs=(*equations.system.outputs, *terms))
    )


def _watched(evaluated: _Evaluated) -> dict[str, Program]:
    """Make the program for exponents of sharp functions, if there are any."""
    if not evaluated.exponents:
        return {}
    return {"landmarks": outputs_program(evaluated.equations, evaluated.exponents)}


def _force_columns(equations: Equations) -> list[tuple[str, Expr]]:
    """Return columns of constraint forces, if these were asked for.

    They are components, and multipliers that are no unknowns.
    """
    forces = equations.derivation.constraint_forces
    if forces is None:
        return []
    from lagrange_cli.notation.labels import multiplier_column  # imports all of notation

    columns = [
        (f"force_{axis}({body.name})", component)
        for body in forces.bodies
        for axis, component in zip("xyz", body.components, strict=True)
    ]
    unknowns = {closure.multiplier for closure in equations.system.pushing}
    known = [r for r in forces.reactions if r.multiplier not in unknowns]
    return columns + [(multiplier_column(equations, r.name), r.multiplier) for r in known]


def _forces(equations: Equations) -> Program | None:
    """Make the program for columns of constraint forces, if they were asked for."""
    columns = _force_columns(equations)
    if not columns:
        return None
    closures = [
        *equations.system.closures,
        *(contact.closure for contact in equations.system.contacts),
    ]
    unknowns = [*(c.a for c in equations.system.coordinates), *(c.multiplier for c in closures)]
    known = (*equations.system.parameters, *(Parameter(s.name, s) for s in unknowns))
    asked = replace(
        equations, system=replace(equations.system, parameters=known, outputs=tuple(columns))
    )
    return program_of(substitute_inputs(asked), "outputs")
