"""Positions of the particles, and what follows of them: velocities, accelerations, δr."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.step_values import rate_symbol
from lagrange_cli.report.contents.sentences import telling_definitions
from lagrange_cli.report.contents.steps.writer import StepsWriter, displacement, is_own_coordinate
from lagrange_cli.report.tree import Block, Formula, Law, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.step_values import BodySteps, ComponentSteps
    from lagrange_cli.mechanics.system import CartesianName


def positions(writer: StepsWriter) -> Section | None:
    """r(q, t) of every particle."""
    parts = [part for body in writer.steps.bodies for part in body.components]
    own_coordinates = dict.fromkeys(
        writer.cartesian(part.name) for part in parts if is_own_coordinate(part)
    )
    sentence = ""
    if own_coordinates:
        one, many = "{listed} is a coordinate itself.", "{listed} are coordinates themselves."
        sentence = writer.say.counted(
            len(own_coordinates), one, many, listed=writer.lettered_list(list(own_coordinates))
        )
    return section(
        writer.say("Positions"),
        writer.paragraph(sentence),
        *_by_body(writer, lambda part: [writer.row(writer.cartesian(part.name), part.position)]),
        *_by_constraints(
            writer, (writer.row(writer.cartesian(c.name), c.position) for c in _determined(writer))
        ),
    )


def _determined(writer: StepsWriter) -> list[CartesianName]:
    """Return names beside particles that constraints determine, as the angle of a wheel.

    Only those whose rates stand in kinetic energies.
    """
    rates = {s for term in writer.steps.kinetic for s in term.written.free_symbols}
    placed = {part.name for body in writer.steps.bodies for part in body.components}
    return [
        c
        for c in telling_definitions(writer.equations)
        if c.name not in placed and rate_symbol(c.name) in rates
    ]


def _by_constraints(writer: StepsWriter, rows: Iterable[Formula]) -> Iterator[Block]:
    """Yield the names beside particles that constraints determine, below the particles."""
    written = tuple(rows)
    if written:
        yield Paragraph(writer.say("By the constraints"))
        yield formulas(written)


def velocities(writer: StepsWriter) -> Section | None:
    """Return the chain rule: partial derivatives of each component, then their sum."""

    def rows(part: ComponentSteps) -> Iterable[Formula]:
        if part.velocity != 0:
            place = writer.cartesian(part.name)
            for symbol, slope in part.partials:
                yield writer.row(writer.letters.partial(place, writer.variable(symbol)), slope)
            yield writer.row(writer.cartesian(part.name, 1), part.velocity)

    blocks = list(_by_body(writer, rows))
    further = _by_constraints(
        writer, (writer.row(writer.cartesian(c.name, 1), c.velocity) for c in _determined(writer))
    )
    if not blocks:
        return section(writer.say("Velocities"), *further)
    letters = writer.letters
    chain = letters.times(
        letters.partial(letters.vector("r"), letters.symbol("q_k")), letters.symbol("q_k", 1)
    )
    law = f"{letters.vector('r', 1)} = {letters.total('k', chain)}"
    if _is_rheonomic(writer):
        law += f" + {letters.partial(letters.vector('r'), letters.symbol('t'))}"
    return section(
        writer.say("Velocities"),
        Paragraph(writer.say("By the chain rule")),
        Law(law),
        Paragraph(writer.say("Partial derivatives that are not written vanish.")),
        *blocks,
        *further,
    )


def accelerations(writer: StepsWriter) -> Section | None:
    """r̈ of every particle."""

    def rows(part: ComponentSteps) -> Iterable[Formula]:
        if part.velocity != 0:
            yield writer.row(writer.cartesian(part.name, 2), part.acceleration)

    blocks = list(_by_body(writer, rows))
    if not blocks:
        return None
    paragraph = Paragraph(writer.say("The velocities are differentiated by time once more."))
    return section(writer.say("Accelerations"), paragraph, *blocks)


def displacements(writer: StepsWriter) -> Section | None:
    """Virtual displacements δr = Σ ∂r/∂q δq, at fixed time."""
    letters = writer.letters
    moved = {c.q: displacement(c) for c in writer.equations.system.coordinates}

    def rows(part: ComponentSteps) -> Iterable[Formula]:
        terms = [slope * moved[s] for s, slope in part.partials if s in moved]
        if terms:
            yield writer.row(letters.virtual(writer.cartesian(part.name)), sympy.Add(*terms))

    chain = letters.times(
        letters.partial(letters.vector("r"), letters.symbol("q_j")),
        letters.virtual(letters.symbol("q_j")),
    )
    blocks = list(_by_body(writer, rows))
    if not blocks:
        return None
    return section(
        writer.say("Virtual displacements"),
        Paragraph(writer.say("Coordinates are displaced at a fixed time:")),
        Law(f"{letters.virtual(letters.vector('r'))} = {letters.total('j', chain)}"),
        *blocks,
    )


def _is_rheonomic(writer: StepsWriter) -> bool:
    t = writer.equations.system.t
    parts = (part for body in writer.steps.bodies for part in body.components)
    return any(s == t for part in parts for s, _ in part.partials)


def _by_body(
    writer: StepsWriter, rows: Callable[[ComponentSteps], Iterable[Formula]]
) -> Iterator[Block]:
    """Return the rows of all components of each body, below its name where there are several."""
    for body in writer.steps.bodies:
        written = tuple(_of_body(body, rows))
        if written:
            if len(writer.steps.bodies) > 1:
                yield writer.title(body.name)
            yield formulas(written)


def _of_body(
    body: BodySteps, rows: Callable[[ComponentSteps], Iterable[Formula]]
) -> Iterator[Formula]:
    for part in body.components:
        if not is_own_coordinate(part):
            yield from rows(part)
