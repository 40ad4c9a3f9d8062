"""The frozen ``Equations`` of a certified derivation, field by field."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache, partial

import mpmath
import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.arithmetic import negative, plain_sum
from lagrange_cli.mechanics.certify.certificate import Evidence, explained
from lagrange_cli.mechanics.certify.printed import (
    certify_energy,
    certify_euler,
    certify_lagrangian,
    certify_rates,
    certify_shown,
)
from lagrange_cli.mechanics.depiction import (
    MOST_BODIES,
    BodyLink,
    Depiction,
    PlacedPoint,
    StatedRelation,
)
from lagrange_cli.mechanics.diagnosis.errors import unwritten_chain
from lagrange_cli.mechanics.dynamics.element_motions import body_outlines, element_motions
from lagrange_cli.mechanics.dynamics.euler_form import euler_form
from lagrange_cli.mechanics.dynamics.idle_potentials import idle_potential_warnings
from lagrange_cli.mechanics.dynamics.jumps import jump_warnings
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.dynamics.momenta import as_rates
from lagrange_cli.mechanics.dynamics.potential_forces import raw_terms
from lagrange_cli.mechanics.dynamics.textbook_form import shown_equations
from lagrange_cli.mechanics.elements.motion import ElementMotion
from lagrange_cli.mechanics.energy_balance import energy_balance
from lagrange_cli.mechanics.equations import (
    Derivation,
    Equations,
    Presentation,
    ShownEquation,
    TextbookForm,
)
from lagrange_cli.mechanics.findings import Conserved, DerivationSources
from lagrange_cli.mechanics.formulation import replaced_chart, starting_state
from lagrange_cli.mechanics.initial.known_inputs import evaluating_inputs
from lagrange_cli.mechanics.initial.rank_deficient_start import rank_deficiency_warning
from lagrange_cli.mechanics.initial.simulation_defaults import simulation_defaults
from lagrange_cli.mechanics.initial.state_starts import with_states
from lagrange_cli.mechanics.initial.suggestions import degrees_remarks, possible_start
from lagrange_cli.mechanics.initial.written_start import written_start
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.sampling import working_digits
from lagrange_cli.mechanics.reduction.geometry import gap_over_names
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.structure import (
    conserved_quantities,
    cyclic_names,
    short_lagrangian,
    structure_facts,
    total_energy,
)
from lagrange_cli.mechanics.symbols.convert import decimal_literals
from lagrange_cli.mechanics.symbols.inputs import controllers_of, inputs_of
from lagrange_cli.mechanics.symbols.values import (
    DECIMAL_DIGITS,
    decimal,
    evaluated,
    nearest_double,
    stated_values,
)
from lagrange_cli.mechanics.system import (
    CartesianName,
    InitialState,
    Parameter,
    ReplacedChart,
    System,
)
from lagrange_cli.scene.checks.table import constraints, latex_names, stating
from lagrange_cli.scene.language.expression import Equation
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.units import Units, units
from lagrange_cli.stages import announce

#: Relative agreement of two residuals that are the same equation.
_SAME = mpmath.mpf(10) ** -12


def assemble(derivation: Uncertified, evidence: Evidence) -> Equations:
    """Equations of motion with facts, initial state, warnings and remarks.

    Their textbook form is written when it is asked for: most of what it costs would be in vain
    where the equations are only simulated or printed as code.

    Raises
    ------
    InputError
        Located: an initial state that contradicts the constraints.
    InternalError
        The energy is not that of the Lagrangian.
    """
    announce("finding what is conserved")
    energy = total_energy(derivation, evidence)
    whole_energy = (
        sp.Add(*energy, evaluate=False) if derivation.tree is not None else plain_sum(energy)
    )
    conserved = conserved_quantities(derivation, evidence, energy, whole_energy)
    structure = structure_facts(derivation)
    announce("finding the initial state")
    with evaluating_inputs(derivation.reduced):
        chart = replaced_chart(derivation)
        initial = with_states(derivation.reduced, starting_state(derivation, chart))
    certify_energy(evidence, whole_energy)
    system = _system(derivation, whole_energy, initial, chart)
    known = Derivation(
        account=derivation.reduced.account,
        certificate=evidence.certificate,
        facts=structure,
        cyclic=cyclic_names(derivation, evidence),
        conserved=conserved,
        textbook=cache(partial(_textbook, derivation, evidence, energy, conserved)),
        suggested=tuple(possible_start(derivation.reduced).items()) if initial is None else (),
        start=written_start(derivation.reduced, initial),
        warnings=tuple(_warnings(derivation, initial, structure.unused_parameters)),
        remarks=_remarks(derivation, initial),
        sources=_sources(derivation, evidence, system.forcing, whole_energy),
    )
    return Equations(system, known, _presentation(derivation, chart, system.particles))


def _system(
    derivation: Uncertified,
    energy: sp.Expr,
    initial: InitialState | None,
    chart: ReplacedChart | None,
) -> System:
    """Return all that code and integration are made from."""
    reduced = derivation.reduced
    return System(
        t=reduced.names.t,
        parameters=tuple(_parameters(reduced)),
        coordinates=reduced.coordinates,
        inputs=tuple(inputs_of(reduced.names)),
        states=reduced.states,
        controllers=tuple(
            controllers_of(
                reduced.scene, reduced.values.number, lambda e: reduced.resolve(reduced.convert(e))
            )
        ),
        functions=reduced.scene.functions,
        particles=tuple(element_motions(derivation)),
        cartesian_names=tuple(_cartesian_names(derivation)),
        kinetic=derivation.kinetic,
        potential=derivation.potential,
        lagrangian=derivation.lagrangian,
        dissipation=derivation.dissipation,
        forces=derivation.forces,
        mass_matrix=derivation.mass_matrix,
        forcing=derivation.forcing_sums,
        energy=energy,
        initial=initial,
        simulate=simulation_defaults(reduced.scene, reduced.values),
        closures=derivation.closures,
        contacts=derivation.contacts,
        outputs=tuple(_outputs(reduced)),
        positive=tuple(reduced.positive),
        chart=chart,
    )


def _presentation(
    derivation: Uncertified, chart: ReplacedChart | None, particles: Sequence[ElementMotion]
) -> Presentation:
    """Return the names, letters and units of the scene, and the sources of its picture."""
    reduced = derivation.reduced
    scene = reduced.scene
    return Presentation(
        name=scene.name,
        title=scene.title,
        description=scene.description,
        file=scene.file,
        digest=scene.digest,
        abbreviations=tuple(_abbreviations(reduced)),
        sizes=tuple((size.name, size.value) for size in scene.sizes),
        families=scene.families,
        literals=decimal_literals(scene.expressions()),
        sums=derivation.sums,
        stated_values=tuple(stated_values(scene, reduced.names.convert)),
        latex=dict(_latex(derivation)),
        indices=dict(_indices(derivation)),
        units=_units(derivation, chart),
        depiction=_depiction(reduced, particles),
    )


def _sources(
    derivation: Uncertified, evidence: Evidence, forcing: tuple[sp.Expr, ...], energy: sp.Expr
) -> DerivationSources | None:
    """The sources of the derivation, with a state at which it was certified."""
    if not evidence.states:
        return None
    reduced = derivation.reduced
    positional = raw_terms(reduced).positional
    entries = [e for row in derivation.mass for e in row.values()] if derivation.collected else []
    terms = sum(map(len, [*entries, *derivation.forcing]))
    return DerivationSources(
        plain_sum((derivation.extra, *(negative(reduced.resolve(u)) for u in positional))),
        forcing,
        terms if derivation.collected else None,
        evidence.states[0],
        evidence.residuals,
        energy,
        evidence.energy[0],
        derivation.tree,
    )


def _depiction(reduced: Reduced, particles: Sequence[ElementMotion]) -> Depiction | None:
    """The points, links, constraints and potentials of the scene, for a picture of it."""
    scene, names = reduced.scene, reduced.names
    if len(names.bodies) > MOST_BODIES:
        return None
    points = [
        PlacedPoint(
            point.name,
            (x.name, y.name, z.name),
            (reduced.resolved[x], reduced.resolved[y], reduced.resolved[z]),
            point.latex,
            point.on,
        )
        for point, (x, y, z) in zip(scene.points, names.point_symbols, strict=True)
    ]
    links = [BodyLink(k.kind, k.ends, reduced.convert(k.size)) for k in scene.links]
    rates = {s for c in reduced.coordinates for s in (c.v, c.a)}
    stated = [
        StatedRelation(e.constraint, e.phi)
        for e in reduced.chart.geometry.elimination.stated
        if not (e.integral or e.one_sided)
    ]
    gaps = [StatedRelation(u.name, gap_over_names(names, u), True) for u in scene.unilateral]
    potentials = [(term.name, reduced.convert(term.expression)) for term in scene.potentials]
    return Depiction(
        tuple(body_outlines(reduced, particles)),
        tuple(points),
        tuple(links),
        tuple(r for r in (*stated, *gaps) if r.expression.free_symbols.isdisjoint(rates)),
        tuple((name, v) for name, v in potentials if v.free_symbols.isdisjoint(rates)),
    )


def _remarks(derivation: Uncertified, initial: InitialState | None) -> tuple[str, ...]:
    remarks = list(derivation.reduced.remarks)
    if initial is not None and initial.projected:
        remarks.append(
            f"initial values were changed by up to {initial.projected:.2g}"
            " to satisfy the constraints"
        )
    remarks += degrees_remarks(derivation.reduced)
    if not derivation.collected:
        remarks.append("products of sums are left unexpanded: they exceed the budget of terms")
    return tuple(remarks)


def _warnings(
    derivation: Uncertified, initial: InitialState | None, unused: tuple[str, ...]
) -> Iterator[Problem]:
    yield from derivation.reduced.warnings
    yield from _unused_warnings(derivation.reduced.scene, unused)
    yield from filter(None, [rank_deficiency_warning(derivation, initial)])
    yield from jump_warnings(derivation.reduced)
    yield from idle_potential_warnings(derivation.reduced)


def _unused_warnings(scene: Scene, unused: tuple[str, ...]) -> tuple[Problem, ...]:
    """One warning for all of them, at the first."""
    if not unused:
        return ()
    mark = next(p.mark for p in scene.parameters if p.name == unused[0])
    listed = ", ".join(f"'{name}'" for name in unused)
    message = f"parameter {listed} is" if len(unused) == 1 else f"parameters {listed} are"
    return (Problem(f"{message} never used", mark, rule="unused-parameter", severity="warning"),)


def _parameters(reduced: Reduced) -> Iterator[Parameter]:
    starts = {parameter: coordinate for coordinate, parameter in reduced.scene.starts}
    for p in reduced.scene.parameters:
        value = reduced.values.exact.get(p.name)
        yield Parameter(
            name=p.name,
            symbol=reduced.names.parameters[p.name],
            value=None if value is None else nearest_double(value),
            decimal="" if value is None else _decimal(value),
            positive=p.positive,
            unit=p.unit,
            description=p.description,
            latex=p.latex,
            start_of=starts.get(p.name),
            exact=value,
        )


def _decimal(value: sp.Expr) -> str:
    with mpmath.workdps(2 * DECIMAL_DIGITS):
        return decimal(evaluated(value, 2 * DECIMAL_DIGITS))


def _cartesian_names(derivation: Uncertified) -> Iterator[CartesianName]:
    """Every raw symbol that is not a coordinate, with its rate."""
    reduced = derivation.reduced
    coordinates = {c.q for c in reduced.coordinates}
    for symbol, position in reduced.resolved.items():
        if symbol in coordinates:
            continue
        velocity = derivation.velocity.get(symbol)
        if velocity is None:
            velocity = reduced.rate(position)
        yield CartesianName(symbol.name, derivation.position.get(symbol, position), velocity)


def _latex(derivation: Uncertified) -> Iterator[tuple[str, str]]:
    """LaTeX by the names that formulas hold."""
    scene = derivation.reduced.scene
    # Constraints that are eliminated have multipliers among the constraint forces.
    for constraint in constraints(scene):
        shown = constraint.notation.multiplier_text()
        if shown is not None:
            yield f"lambda_{constraint.name}", shown
    yield from ((name, latex) for name, latex, _ in latex_names(scene))
    for closure in derivation.pushing:
        known = stating(scene, closure.name)
        shown = known and known[0].notation.multiplier_text(known[1])
        if shown:
            yield closure.multiplier.name, shown


def _indices(derivation: Uncertified) -> Iterator[tuple[str, str]]:
    """LaTeX of the names of closures and gaps below a letter."""
    for closure in derivation.pushing:
        known = stating(derivation.reduced.scene, closure.name)
        shown = known and known[0].notation.index_text(known[1])
        if shown:
            yield closure.name, shown


def _units(derivation: Uncertified, chart: ReplacedChart | None) -> Units:
    """Return the units of everything that a trajectory has a column of."""
    reduced = derivation.reduced
    coordinates = (*reduced.coordinates, *(() if chart is None else chart.coordinates))
    angles = {c.name for c in coordinates if c.is_angle}
    names = [c.name for c in coordinates] + [symbol.name for symbol in reduced.resolved]
    names += [output.name for output in reduced.scene.outputs]
    names += [state.name for state in reduced.scene.states]
    names += [u.name for c in reduced.scene.controllers for u in c.held_inputs]
    return units(reduced.scene, angles, names)


def _abbreviations(reduced: Reduced) -> Iterator[tuple[str, sp.Expr]]:
    for name, expression in reduced.names.abbreviations():
        yield name, reduced.resolve(reduced.convert(expression))


def _outputs(reduced: Reduced) -> Iterator[tuple[str, sp.Expr]]:
    for term in reduced.scene.outputs:
        yield term.name, reduced.resolve(reduced.convert(term.expression))


# The textbook form.


def _textbook(
    derivation: Uncertified,
    evidence: Evidence,
    energy: tuple[sp.Expr, ...],
    conserved: tuple[Conserved, ...],
) -> TextbookForm:
    """The textbook form of the equations, L without constants, and the balance of the energy.

    Raises
    ------
    InputError
        Expressions are nested too deeply to be written, or are not real at the states.
    InternalError
        It is not the one that was derived.
    """
    announce("writing the equations")
    reduced = derivation.reduced
    if derivation.tree is not None:
        raise unwritten_chain(reduced.scene)
    with explained(reduced.scene):
        return _certified_textbook(derivation, evidence, energy, conserved)


def _certified_textbook(
    derivation: Uncertified,
    evidence: Evidence,
    energy: tuple[sp.Expr, ...],
    conserved: tuple[Conserved, ...],
) -> TextbookForm:
    reduced = derivation.reduced
    momenta = {c.coordinate: c.expression for c in conserved if c.coordinate is not None}
    shown = as_rates(derivation, _shown(derivation, evidence), momenta)
    certify_shown(evidence, shown)
    certify_rates(evidence, reduced, shown)
    short = short_lagrangian(derivation)
    if short is not None:
        certify_lagrangian(evidence, derivation, short)
    is_kept = any(c.kind != "momentum" for c in conserved)
    balance = None if is_kept else energy_balance(derivation, evidence, energy)
    euler = euler_form(derivation)
    if euler is not None:
        certify_euler(evidence, derivation, euler)
    return TextbookForm(shown, short, balance, euler)


def _shown(derivation: Uncertified, evidence: Evidence) -> tuple[ShownEquation, ...]:
    expected = derivation.reduced.scene.expect.equations

    def asked(residual: sp.Expr) -> bool:
        return any(_same(derivation.reduced, evidence, residual, e) for e in expected or ())

    pairs = zip(evidence.cyclic, evidence.forced, strict=True)
    conserving = [cyclic and not forced for cyclic, forced in pairs]
    decimals = [value for value, _ in decimal_literals(derivation.reduced.scene.expressions())]
    return shown_equations(derivation, conserving, asked if expected else None, decimals)


def _same(reduced: Reduced, evidence: Evidence, residual: sp.Expr, equation: Equation) -> bool:
    """Tell whether an equation of ``expect`` is this residual up to a number."""
    try:
        sides = [
            reduced.resolve(reduced.names.convert(side, reduced.rate))
            for side in (equation.left, equation.right)
        ]
    except InputError:
        return False  # reported by ``check``, where it belongs
    asked = sides[0] - sides[1]
    ratios = []
    with mpmath.workdps(working_digits(evidence.certificate.digits)):
        for state in evidence.states[:3]:
            try:
                ours, theirs = evaluate([residual, asked], state)
            except (DomainError, KeyError):
                return False
            if not theirs:
                return False
            ratios.append(ours / theirs)
        return all(abs(r - ratios[0]) <= _SAME * abs(ratios[0]) for r in ratios)
