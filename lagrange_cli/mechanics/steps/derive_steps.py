"""The steps of a certified derivation: each part of it that a lecturer writes on a line.

Every particle has positions, velocities by the chain rule, and accelerations; forces give
generalized forces by virtual work. Sums are multiplied out and like terms gathered, as on a board.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import sympy as sp

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.factor import scaled
from lagrange_cli.mechanics.certify.certificate import Evidence
from lagrange_cli.mechanics.dynamics.euler_form import lone_quaternion
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.elements.motion import Turning
from lagrange_cli.mechanics.equations import Equations, ShownEquation
from lagrange_cli.mechanics.reactions.applied_forces import applied_forces
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.step_values import (
    BodySteps,
    ComponentSteps,
    CoordinateSteps,
    DerivationSteps,
    ForceSteps,
    TermSteps,
    VirtualWork,
    Way,
    rate_symbol,
)
from lagrange_cli.mechanics.steps.collector import Collector, along_motion
from lagrange_cli.mechanics.steps.steps_certificate import certify_steps
from lagrange_cli.mechanics.steps.turning_steps import (
    torque_components,
    turning_steps,
)
from lagrange_cli.mechanics.steps.virtual_work import Displacements, virtual_work
from lagrange_cli.mechanics.symbols.convert import total_derivative
from lagrange_cli.scene.bodies import bodies_of, rotation_term
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.model import Scene, Term

#: Most coordinates, and most particles, of a scene whose steps are written: some ten pages.
MOST_COORDINATES = 12
MOST_PARTICLES = 12

#: Most terms of mass matrix and forcing of a scene whose steps are written.
MOST_TERMS = 200


def require_few_coordinates(reduced: Reduced) -> None:
    """Refuse the steps of a large system before it is derived.

    Raises
    ------
    InputError
        It has more coordinates or particles than a reader follows line by line.
    """
    counts = (
        (len(reduced.coordinates), MOST_COORDINATES, "coordinates"),
        (
            len(reduced.masses),
            MOST_PARTICLES,
            "bodies" if bodies_of(reduced.scene) else "particles",
        ),
    )
    for count, most, noun in counts:
        if count > most:
            raise _too_large(reduced, f"{count} {noun}: at most {most} are written out")


def require_displacements(scene: Scene, way: Way) -> None:
    """Refuse virtual displacements of quaternions that do not alone turn a body in space.

    Raises
    ------
    InputError
        The small turns of such a quaternion are not those of the angular velocity of a body.
    """
    in_space = (body for body in bodies_of(scene) if body.on is None)
    parts = {e.node for body in in_space for e in lone_quaternion(body)}
    for constraint in scene.constraints if way != "lagrange" else ():
        joint = constraint.joint
        if joint is not None and any(e.node not in parts for e in joint.quaternions):
            problem = Problem(
                f"the quaternion of '{joint.parts[0]}' is not the only turn of a body in space",
                constraint.mark,
                hint="write the steps by Lagrange's equations: virtual displacements are small"
                " turns of such bodies alone",
                rule="unsupported",
            )
            raise InputError(problem)


def require_few_terms(derivation: Uncertified) -> None:
    """Refuse the steps of long equations.

    Raises
    ------
    InputError
        Mass matrix and forcing have more terms than a reader follows line by line.
    """
    rows = [entry for row in derivation.mass for entry in row.values()]
    count = sum(map(len, [*rows, *derivation.forcing]))
    if count > MOST_TERMS or not derivation.collected:
        reason = (
            f"{count} terms in its mass matrix and forces: at most {MOST_TERMS} are written out"
        )
        raise _too_large(derivation.reduced, reason)


def _too_large(reduced: Reduced, reason: str) -> InputError:
    scene = reduced.scene
    hint = "derive it without --steps"
    if scene.sizes:
        hint += f", or make the scene smaller with -p {scene.sizes[0].name}=2"
    problem = Problem(
        f"the steps of this derivation are too long to be read: it has {reason}",
        Mark(scene.file, 1, 1),
        hint=hint,
        rule="steps-too-long",
    )
    return InputError(problem)


def derive_steps(
    derivation: Uncertified, evidence: Evidence, equations: Equations, way: Way
) -> DerivationSteps:
    """The steps that lead to certified equations.

    Raises
    ------
    InternalError
        One of the lines disagrees with the derivation.
    """
    reduced = derivation.reduced
    collector = Collector.from_scene(reduced)
    loads = applied_forces(derivation, of_turning=False)
    applied = {s: -loads.along(s) for s in (*loads.positional, *loads.dynamic)}
    bodies = body_steps(derivation, collector, applied, equations)
    balances = list[VirtualWork]()
    if way != "lagrange":
        displacements = Displacements(reduced, collector)
        bodies = tuple(map(displacements.of_body, bodies))
        balances += virtual_work(derivation, displacements, bodies, applied)
    steps = DerivationSteps(
        way=way,
        bodies=bodies,
        kinetic=_terms(reduced, _declared_kinetic(reduced)),
        potentials=_terms(reduced, reduced.scene.potentials),
        forces=force_steps(derivation, collector, bodies),
        coordinates=tuple(_coordinates(derivation, collector, equations)),
        balances=tuple(balances),
        in_coordinates=loads.unattached,
    )
    return certify_steps(derivation, evidence, equations, steps, loads.attached)


def _declared_kinetic(reduced: Reduced) -> list[Term]:
    """Terms of the scene, without the energies of the turning of bodies."""
    of_bodies = {rotation_term(body.name) for body in bodies_of(reduced.scene)}
    return [term for term in reduced.scene.kinetic if term.name not in of_bodies]


def _terms(reduced: Reduced, terms: Sequence[Term]) -> tuple[TermSteps, ...]:
    return tuple(_term(reduced, term.name, term.expression) for term in terms)


def _term(reduced: Reduced, name: str, expression: Expression) -> TermSteps:
    written = reduced.names.convert(expression, partial(_rate_over_names, reduced))
    return TermSteps(name, written, reduced.resolve(reduced.convert(expression)))


def _rate_over_names(reduced: Reduced, expression: sp.Expr) -> sp.Expr:
    """Total time derivative over the rates of Cartesian names, which have their own symbols."""
    moving = [(s, rate) for s, (_, rate) in reduced.motion.items() if expression.has(s)]
    named = sorted(
        expression.free_symbols & reduced.resolved.keys() - reduced.motion.keys(), key=str
    )
    named_rates = [(s, rate_symbol(s.name)) for s in named]
    return total_derivative(expression, reduced.names.t, [*moving, *named_rates])


def _coordinates(
    derivation: Uncertified, collector: Collector, equations: Equations
) -> Iterator[CoordinateSteps]:
    reduced = derivation.reduced
    momenta = {
        c.coordinate: c.expression for c in equations.derivation.conserved if c.kind == "momentum"
    }
    terms = sp.Add.make_args(derivation.lagrangian)
    for c, shown in zip(reduced.coordinates, equations.derivation.shown, strict=True):
        slopes = {s: sp.Add(*(derivative(e, s) for e in terms)) for s in (c.q, c.v)}
        momentum = momenta.get(c.name, collector.collected(slopes[c.v]))
        yield CoordinateSteps(
            momentum=momentum,
            momentum_rate=collector.collected(along_motion(reduced, momentum)),
            slope=collector.collected(slopes[c.q]),
            drag=collector.collected(derivative(derivation.dissipation, c.v)),
            terms=_undivided(shown),
        )


def _undivided(shown: ShownEquation) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
    """The terms of an equation before its common factor was divided out."""
    if shown.divided_by == 1:
        return shown.terms
    return tuple((_multiplied(c, shown.divided_by), f) for c, f in shown.terms)


def _multiplied(coefficient: sp.Expr, factor: sp.Expr) -> sp.Expr:
    """Multiply a coefficient by a factor without distributing numbers over a sum."""
    number, product = coefficient.as_coeff_Mul(rational=True)
    scale, cofactor = factor.as_coeff_Mul(rational=True)
    return scaled(number * scale, product * cofactor)


_ZERO = sp.Integer(0)


def body_steps(
    derivation: Uncertified,
    collector: Collector,
    applied: Mapping[sp.Symbol, sp.Expr],
    equations: Equations,
) -> tuple[BodySteps, ...]:
    """Steps of all particles and bodies, and of the points that forces act on.

    ``applied``: raw symbol → applied force along it.
    """
    turnings = {
        motion.name: motion.turning
        for motion in equations.system.particles
        if motion.turning is not None
    }
    return tuple(_bodies(derivation, collector, dict(applied), turnings))


def _bodies(
    derivation: Uncertified,
    collector: Collector,
    pending: dict[sp.Symbol, sp.Expr],
    turnings: Mapping[str, Turning],
) -> Iterator[BodySteps]:
    reduced = derivation.reduced
    names = reduced.names
    pulled = {force.on for force in derivation.forces}
    rigid = {body.name: body for body in bodies_of(reduced.scene)}
    masses = [*reduced.masses, *(None for _ in names.point_symbols)]
    for body, symbols, mass in zip(names.bodies, names.body_symbols, masses, strict=True):
        if mass is None and body.name not in pulled and pending.keys().isdisjoint(symbols):
            continue
        x, y, z = (_component(reduced, collector, s, pending.pop(s, _ZERO)) for s in symbols)
        square = None
        if mass is not None:
            square = collector.collected(x.velocity**2 + y.velocity**2 + z.velocity**2)
        turning = None
        if body.name in rigid:
            torques = [f for f in derivation.forces if f.is_torque and f.on == body.name]
            turning = turning_steps(
                reduced, rigid[body.name], turnings[body.name], torques, collector.collected
            )
        yield BodySteps(body.name, mass, (x, y, z), square, turning)


def _component(
    reduced: Reduced, collector: Collector, symbol: sp.Symbol, force: sp.Expr
) -> ComponentSteps:
    position, t = reduced.resolved[symbol], reduced.names.t
    partials = [
        (s, collector.collected(derivative(position, s)))
        for s in (*(c.q for c in reduced.coordinates), t)
    ]
    nonzero = tuple((s, slope) for s, slope in partials if slope != 0)
    rates = {c.q: c.v for c in reduced.coordinates}
    velocity = collector.collected(sp.Add(*(slope * rates.get(s, 1) for s, slope in nonzero)))
    return ComponentSteps(
        name=symbol.name,
        position=position,
        partials=nonzero,
        velocity=velocity,
        acceleration=collector.collected(along_motion(reduced, velocity)),
        force=collector.collected(force),
    )


def force_steps(
    derivation: Uncertified, collector: Collector, bodies: Sequence[BodySteps]
) -> tuple[ForceSteps, ...]:
    """The virtual work of each force of the scene."""
    names = derivation.reduced.names
    turnings = {body.name: body.turning for body in bodies}
    placed = dict(zip((b.name for b in names.bodies), names.body_symbols, strict=True))
    coordinates = [c.q for c in derivation.reduced.coordinates]
    steps = []
    for force in derivation.forces:
        along, pushes = [force.on], list(force.components)
        if force.is_torque:
            turning = turnings[force.on]
            pairs = list(torque_components(turning, force)) if turning else []
            along = [axis for axis, _ in pairs]
            pushes = [collector.collected(torque) for _, torque in pairs]
        elif len(force.components) == 3:
            along = [s.name for s in placed[force.on]]
        generalized = zip(coordinates, map(collector.collected, force.generalized), strict=True)
        steps.append(
            ForceSteps(
                force.name,
                force.on,
                tuple((n, e) for n, e in zip(along, pushes, strict=True) if e != 0),
                tuple((q, work) for q, work in generalized if work != 0),
                force.is_torque,
            )
        )
    return tuple(steps)
