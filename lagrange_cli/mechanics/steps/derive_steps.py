"""The steps of a certified derivation: each part of it that a lecturer writes on a line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import sympy as sp

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.factor import scaled
from lagrange_cli.mechanics.certify.certificate import Evidence
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import Equations, ShownEquation
from lagrange_cli.mechanics.reactions.applied_forces import applied_forces
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.step_values import (
    CoordinateSteps,
    DerivationSteps,
    TermSteps,
    Way,
    rate_symbol,
)
from lagrange_cli.mechanics.steps.collected_steps import Collector
from lagrange_cli.mechanics.steps.kinematics import along_motion, body_steps
from lagrange_cli.mechanics.steps.steps_certificate import certify_steps
from lagrange_cli.mechanics.steps.virtual_work import force_steps, virtual_work
from lagrange_cli.mechanics.symbols.convert import total_derivative
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.model import Term

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
            "particles",
        ),
    )
    for count, most, noun in counts:
        if count > most:
            raise _too_large(reduced, f"{count} {noun}: at most {most} are written out")


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
        told = f"{count} terms in its mass matrix and forces: at most {MOST_TERMS} are written out"
        raise _too_large(derivation.reduced, told)


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
    collector = Collector.of(reduced)
    loads = applied_forces(derivation)
    applied = {s: -loads.of(s) for s in (*loads.positional, *loads.other)}
    bodies = body_steps(derivation, collector, applied)
    balances = virtual_work(derivation, collector, bodies, applied) if way == "dalembert" else ()
    steps = DerivationSteps(
        way=way,
        bodies=bodies,
        kinetic=_terms(reduced, reduced.scene.kinetic),
        potentials=_terms(reduced, reduced.scene.potentials),
        forces=force_steps(derivation, collector),
        coordinates=tuple(_coordinates(derivation, collector, equations)),
        balances=tuple(balances),
        in_coordinates=loads.unattached,
    )
    return certify_steps(derivation, evidence, equations, steps)


def _terms(reduced: Reduced, terms: Sequence[Term]) -> tuple[TermSteps, ...]:
    return tuple(_term(reduced, term.name, term.expression) for term in terms)


def _term(reduced: Reduced, name: str, expression: Expression) -> TermSteps:
    written = reduced.names.convert(expression, partial(_rate_over_names, reduced))
    return TermSteps(name, written, reduced.resolve(reduced.convert(expression)))


def _rate_over_names(reduced: Reduced, expression: sp.Expr) -> sp.Expr:
    """The total time derivative over rates of Cartesian names, which have symbols of their own."""
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
    momenta = {c.coordinate: c.expression for c in equations.conserved if c.kind == "momentum"}
    terms = sp.Add.make_args(derivation.lagrangian)
    for c, shown in zip(reduced.coordinates, equations.shown, strict=True):
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
    """A product whose number does not go into a sum."""
    number, product = coefficient.as_coeff_Mul(rational=True)
    scale, other = factor.as_coeff_Mul(rational=True)
    return scaled(number * scale, product * other)
