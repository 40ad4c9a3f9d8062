"""T, V and L, and forces that no potential has, by virtual work."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.step_values import rate_symbol
from lagrange_cli.notation.labels import has_kinetic_energy
from lagrange_cli.report.contents.sentences import is_generalized_potential
from lagrange_cli.report.contents.steps.writer import StepsWriter, is_own_coordinate, sum_of
from lagrange_cli.report.tree import (
    Block,
    Formula,
    Law,
    Paragraph,
    Section,
    Title,
    formulas,
    section,
)

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.step_values import BodySteps, ForceSteps, TermSteps


def kinetic_energy(writer: StepsWriter) -> Section | None:
    """v² of every particle, then T."""
    steps = writer.steps
    squares = [row for body in steps.bodies if (row := _square(writer, body))]
    is_whole = len(steps.kinetic) == 1 and not steps.bodies
    rows = [*squares, *(_term(writer, term) for term in steps.kinetic if not is_whole)]
    written = [*map(_half_square, steps.bodies), *(term.written for term in steps.kinetic)]
    say, equations = writer.say, writer.equations
    free = say("Lagrangian without potential")
    return section(
        say("Kinetic energy") if has_kinetic_energy(equations) else free,
        formulas(rows),
        formulas(
            [
                writer.row(
                    writer.lettered_labels["T"],
                    sympy.Add(*written),
                    writer.equations.system.kinetic,
                )
            ],
            result=True,
        ),
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
    square = sympy.Add(*(rate**2 for rate in rates))
    return sympy.Mul(sympy.Rational(1, 2), body.mass, square, evaluate=False)


def _square(writer: StepsWriter, body: BodySteps) -> Formula | None:
    if body.square is None or body.square == 0:
        return None
    rates = [writer.cartesian(part.name, 1) for part in body.components if part.velocity != 0]
    label = sum_of(map(writer.letters.square, rates))
    row = writer.row(label, body.square)
    plain = all(part.velocity.is_Symbol or part.velocity == 0 for part in body.components)
    return None if plain else row


def _term(writer: StepsWriter, term: TermSteps) -> Formula:
    return writer.row(writer.letters.named(term.name), term.written, term.resolved)


def potential_energy(writer: StepsWriter) -> Section | None:
    """Each potential over the names that the scene has for it and over the coordinates, then V."""
    velocity_dependent = is_generalized_potential(writer.equations)
    heading = writer.say("Potential energy")
    if velocity_dependent:
        heading = writer.say("Generalized potential")
    label = writer.lettered_labels["U" if velocity_dependent else "V"]
    terms, potential = writer.steps.potentials, writer.equations.system.potential
    if len(terms) == 1:
        whole = writer.row(label, terms[0].written, potential)
        return section(heading, formulas([whole], result=True))
    return section(
        heading,
        formulas(_term(writer, term) for term in terms),
        formulas([writer.row(label, potential)], result=True),
    )


def lagrangian(writer: StepsWriter) -> Section | None:
    """L = T − V in full, as all later lines follow from it; then what of it changes no equation."""
    idle, short = "", writer.equations.derivation.short_lagrangian
    if short is not None:
        idle = writer.say(
            "{terms} in {lagrangian} holds no coordinate and no velocity: it changes no equation"
            " of motion.",
            terms=writer.lettered_inline(short.left_out),
            lagrangian=writer.letters.inline(writer.lettered_labels["L"]),
        )
    rows = formulas([lagrangian_row(writer)], result=True)
    return section(writer.say("Lagrangian"), rows, writer.paragraph(idle))


def lagrangian_row(writer: StepsWriter) -> Formula:
    """``L = T - V = ...``, in full."""
    labels = writer.lettered_labels
    potential = labels["U" if is_generalized_potential(writer.equations) else "V"]
    row = writer.sum_row(labels["L"], writer.equations.system.lagrangian)
    return replace(row, middle=f"{labels['T']} - {potential}")


def dissipation(writer: StepsWriter) -> Section | None:
    """Return the dissipation function D, where there is one."""
    if writer.equations.system.dissipation == 0:
        return None
    row = writer.row(writer.lettered_labels["D"], writer.equations.system.dissipation)
    return section(writer.say("Dissipation function"), formulas([row], result=True))


def generalized_forces(writer: StepsWriter) -> Section | None:
    """Virtual work of each force."""
    if not writer.steps.forces:
        return None
    return section(
        writer.say("Generalized forces"),
        Paragraph(writer.say("The virtual work of the forces defines them:")),
        *_virtual_work(writer),
        *(block for force in writer.steps.forces for block in _force(writer, force)),
        *_several(writer),
        *_torques(writer),
    )


def _virtual_work(writer: StepsWriter) -> Iterator[Block]:
    """δW = Σ F·δr = Σ Q δq, as far as there are forces on particles."""
    letters = writer.letters
    displaced, place = letters.virtual(letters.symbol("q_j")), letters.symbol("q_j")
    work = letters.total("j", letters.times(letters.symbol("Q_j"), displaced))
    product = f"{letters.vector(writer.force_letter)}{letters.dot_product}"
    if not any(_acts_on_body(writer, force) for force in writer.steps.forces):
        yield Law(f"{letters.virtual_work} = {work}")
        return
    by_place = letters.total("i", product + letters.virtual(letters.vector("r")))
    yield Law(f"{letters.virtual_work} = {by_place} = {work}")
    by_slope = letters.total("i", product + letters.partial(letters.vector("r"), place))
    yield Law(f"{letters.symbol('Q_j')} = {by_slope}")


def _acts_on_body(writer: StepsWriter, force: ForceSteps) -> bool:
    return any(body.name == force.on for body in writer.steps.bodies)


def _force(writer: StepsWriter, force: ForceSteps) -> Iterator[Block]:
    letters = writer.letters
    on_body = _acts_on_body(writer, force)
    on = letters.words(force.on) if on_body else letters.inline(writer.cartesian(force.on))
    name = letters.words(force.name)
    yield Title(writer.say("The force {name} on {place}:", name=name, place=on))
    parts = {p.name: dict(p.partials) for b in writer.steps.bodies for p in b.components}
    names = {c.q: c for c in writer.equations.system.coordinates}
    rows = []
    if on_body:
        rows += [writer.row(writer.force(n), e) for n, e in force.components]
    for q, value in force.generalized:
        row = writer.row(letters.below("Q", writer.lettered_coordinate(names[q])), value)
        if on_body:
            products = [
                letters.times(
                    writer.force(n), letters.partial(writer.cartesian(n), writer.variable(q))
                )
                for n, _ in force.components
                if q in parts[n]
            ]
            row = replace(row, middle=sum_of(products))
        rows.append(row)
    if rows:
        yield formulas(rows)
    if not force.generalized:
        yield Paragraph(writer.say("It does no virtual work."))


def _several(writer: StepsWriter) -> Iterator[Block]:
    """Return sums of generalized forces where several act on a coordinate."""
    shares: dict[Symbol, list[Expr]] = {}
    for force in writer.steps.forces:
        for q, value in force.generalized:
            shares.setdefault(q, []).append(value)
    rows = [
        writer.row(
            writer.letters.below("Q", writer.lettered_coordinate(c)), sympy.Add(*shares[c.q])
        )
        for c in writer.equations.system.coordinates
        if len(shares.get(c.q, ())) > 1
    ]
    if rows:
        yield Title(writer.say("Together:"))
        yield formulas(rows)


def _torques(writer: StepsWriter) -> Iterator[Block]:
    """Say which generalized forces have the dimension of work: those on angles."""
    letters, dimensions = writer.letters, writer.equations.presentation.units.dimensions
    acted_on = {q for force in writer.steps.forces for q, _ in force.generalized}
    for c in writer.equations.system.coordinates:
        if c.q in acted_on and dimensions.get(c.name) == "rad":
            angle = writer.lettered_coordinate(c)
            force, q = letters.inline(letters.below("Q", angle)), letters.inline(angle)
            yield Paragraph(writer.say("{force} is a torque: {q} is an angle.", force=force, q=q))
