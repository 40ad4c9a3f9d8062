"""T, V and L, and forces that no potential has, by virtual work."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.step_values import rate_symbol
from lagrange_cli.notation.labels import has_kinetic_energy
from lagrange_cli.report.contents.sentences import is_generalized_potential
from lagrange_cli.report.contents.steps import turnings
from lagrange_cli.report.contents.steps.writer import (
    PLACE,
    POSITION,
    StepsWriter,
    is_own_coordinate,
    sum_of,
    turning_of,
    work,
    work_in_coordinates,
)
from lagrange_cli.report.inlines import (
    WORK,
    Plain,
    below,
    named,
    partial,
    say,
    square,
    symbol,
    times,
    virtual,
)
from lagrange_cli.report.tree import Formula, Law, Part, Section, Title, formulas, section

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.step_values import BodySteps, ForceSteps, TermSteps
    from lagrange_cli.report.inlines import Label


def kinetic_energy(writer: StepsWriter) -> Section | None:
    """v² of every particle and body, then T; of bodies by König's theorem."""
    steps = writer.steps
    squares = [row for body in steps.bodies if (row := _square(writer, body))]
    is_whole = len(steps.kinetic) == 1 and not steps.bodies
    rows = [*squares, *(_term(writer, term) for term in steps.kinetic if not is_whole)]
    turning = [turning_of(body).energy for body in writer.turning]
    written = [
        *map(_half_square, steps.bodies),
        *turning,
        *(term.written for term in steps.kinetic),
    ]
    heading = say("Kinetic energy")
    if not has_kinetic_energy(writer.equations):
        heading = say("Lagrangian without potential")
    whole = writer.row(writer.labels["T"], sympy.Add(*written), writer.equations.system.kinetic)
    moments = formulas(turnings.moments(writer))
    return section(
        heading, *_koenig(writer), moments, formulas(rows), formulas([whole], result=True)
    )


def _koenig(writer: StepsWriter) -> Iterator[Part]:
    """Say what the energy of a body is, where one turns."""
    if writer.turning:
        yield say(
            "By König's theorem the energy of a body is that of its mass at the centre of mass,"
            " and that of its turning about it."
        )


def _half_square(body: BodySteps) -> Expr:
    """½ m ṙ² over the rates of Cartesian names."""
    if body.mass is None:
        return sympy.Integer(0)
    rates = [
        part.velocity if is_own_coordinate(part) else rate_symbol(part.name)
        for part in body.components
        if part.velocity != 0
    ]
    squares = sympy.Add(*(rate**2 for rate in rates))
    return sympy.Mul(sympy.Rational(1, 2), body.mass, squares, evaluate=False)


def _square(writer: StepsWriter, body: BodySteps) -> Formula | None:
    if body.square is None or body.square == 0:
        return None
    rates = [writer.cartesian(part.name, 1) for part in body.components if part.velocity != 0]
    plain = all(part.velocity.is_Symbol or part.velocity == 0 for part in body.components)
    return None if plain else writer.row(sum_of(map(square, rates)), body.square)


def _term(writer: StepsWriter, term: TermSteps) -> Formula:
    return writer.row(named(term.name), term.written, term.resolved)


def potential_energy(writer: StepsWriter) -> Section | None:
    """Each potential over the names that the scene has for it and over the coordinates, then V."""
    heading = say("Potential energy")
    if is_generalized_potential(writer.equations):
        heading = say("Generalized potential")
    terms, potential = writer.steps.potentials, writer.equations.system.potential
    is_whole = len(terms) == 1
    rows = [] if is_whole else [_term(writer, term) for term in terms]
    written = [term.written for term in terms if is_whole]
    whole = writer.row(writer.potential, *written, potential)
    return section(heading, formulas(rows), formulas([whole], result=True))


def lagrangian(writer: StepsWriter) -> Section | None:
    """L = T − V in full, as all later lines follow from it; then what of it changes no equation."""
    idle, short = None, writer.equations.derivation.short_lagrangian
    if short is not None:
        idle = say(
            "{terms} in {lagrangian} holds no coordinate and no velocity: it changes no equation"
            " of motion.",
            terms=writer.formula(short.left_out),
            lagrangian=writer.labels["L"],
        )
    return section(say("Lagrangian"), formulas([lagrangian_row(writer)], result=True), idle)


def lagrangian_row(writer: StepsWriter) -> Formula:
    """``L = T - V = ...``, in full."""
    row = writer.sum_row(writer.labels["L"], writer.equations.system.lagrangian)
    return replace(row, middle=writer.labels["T"] + " - " + writer.potential)


def dissipation(writer: StepsWriter) -> Section | None:
    """Return the dissipation function D, where there is one."""
    if writer.equations.system.dissipation == 0:
        return None
    row = writer.row(writer.labels["D"], writer.equations.system.dissipation)
    return section(say("Dissipation function"), formulas([row], result=True))


def generalized_forces(writer: StepsWriter) -> Section | None:
    """Virtual work of each force."""
    if not writer.steps.forces:
        return None
    return section(
        say("Generalized forces"),
        say("The virtual work of the forces defines them:"),
        *_virtual_work(writer),
        *(block for force in writer.steps.forces for block in _force(writer, force)),
        *_several(writer),
        *_torques(writer),
    )


def _virtual_work(writer: StepsWriter) -> Iterator[Part]:
    """δW = Σ F·δr + Σ M·δφ = Σ Q δq, as far as there are forces on particles and torques."""
    by_coordinates, forces = work_in_coordinates(symbol("Q_j")), writer.steps.forces
    works: list[Label] = []
    slopes: list[Label] = []
    if any(_acts_on_body(writer, force) and not force.is_torque for force in forces):
        works.append(work(writer.applied, virtual(POSITION)))
        slopes.append(work(writer.applied, partial(POSITION, PLACE)))
    if any(force.is_torque for force in forces):
        works.append(work(writer.torque, virtual(writer.small_turn)))
        slopes.append(work(writer.torque, writer.spin_slope))
    if not works:
        yield Law(WORK + " = " + by_coordinates)
        return
    yield Law(WORK + " = " + sum_of(works) + " = " + by_coordinates)
    yield Law(symbol("Q_j") + " = " + sum_of(slopes))


def _acts_on_body(writer: StepsWriter, force: ForceSteps) -> bool:
    return any(body.name == force.on for body in writer.steps.bodies)


def _force(writer: StepsWriter, force: ForceSteps) -> Iterator[Part]:
    if force.is_torque:
        yield from _torque(writer, force)
        return
    on_body = _acts_on_body(writer, force)
    on = Plain(force.on) if on_body else writer.cartesian(force.on)
    yield Title(say("The force {name} on {place}:", name=Plain(force.name), place=on))
    parts = {p.name: dict(p.partials) for b in writer.steps.bodies for p in b.components}
    rows = []
    if on_body:
        rows += [writer.row(writer.force(n), e) for n, e in force.components]
    for q, value in force.generalized:
        row = writer.row(below("Q", writer.variable(q)), value)
        if on_body:
            products = [
                times(writer.force(n), partial(writer.cartesian(n), writer.variable(q)))
                for n, _ in force.components
                if q in parts[n]
            ]
            row = replace(row, middle=sum_of(products))
        rows.append(row)
    if rows:
        yield formulas(rows)
    if not force.generalized:
        yield say("It does no virtual work.")


def _torque(writer: StepsWriter, force: ForceSteps) -> Iterator[Part]:
    names = {"name": Plain(force.name), "place": Plain(force.on)}
    yield Title(say("The torque {name} on {place}:", **names))
    body = next((body for body in writer.turning if body.name == force.on), None)
    if body is None or not force.generalized:
        yield say("It does no virtual work.")
        return
    slopes = {c.axis: dict(c.partials) for c in turning_of(body).components}
    torques = {axis: writer.along_spin(writer.torque_letter, body.name, axis) for axis in slopes}
    rows = [writer.row(torques[axis], e) for axis, e in force.components]
    for q, value in force.generalized:
        products = [
            times(torques[axis], partial(writer.spin(body, axis), writer.speed(q)))
            for axis, _ in force.components
            if q in slopes[axis]
        ]
        row = writer.row(below("Q", writer.variable(q)), value)
        rows.append(replace(row, middle=sum_of(products)))
    yield formulas(rows)


def _several(writer: StepsWriter) -> Iterator[Part]:
    """Return sums of generalized forces where several act on a coordinate."""
    shares: dict[Symbol, list[Expr]] = {}
    for force in writer.steps.forces:
        for q, value in force.generalized:
            shares.setdefault(q, []).append(value)
    rows = [
        writer.row(below("Q", writer.coordinate(c)), sympy.Add(*shares[c.q]))
        for c in writer.equations.system.coordinates
        if len(shares.get(c.q, ())) > 1
    ]
    if rows:
        yield Title(say("Together:"))
        yield formulas(rows)


def _torques(writer: StepsWriter) -> Iterator[Part]:
    """Say which generalized forces have the dimension of work: those on angles."""
    dimensions = writer.equations.presentation.units.dimensions
    acted_on = {q for force in writer.steps.forces for q, _ in force.generalized}
    for c in writer.equations.system.coordinates:
        if c.q in acted_on and dimensions.get(c.name) == "rad":
            angle = writer.coordinate(c)
            force = below("Q", angle)
            yield say("{force} is a torque: {q} is an angle.", force=force, q=angle)
