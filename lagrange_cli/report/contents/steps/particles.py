"""Positions of the particles, and what follows of them: velocities, accelerations, δr."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.step_values import rate_symbol
from lagrange_cli.report.contents.sentences import telling_definitions
from lagrange_cli.report.contents.steps import turnings
from lagrange_cli.report.contents.steps.writer import (
    DISPLACED,
    PLACE,
    POSITION,
    StepsWriter,
    by_body,
    is_own_coordinate,
)
from lagrange_cli.report.inlines import (
    enumerated,
    partial,
    say,
    symbol,
    times,
    total,
    vector,
    virtual,
)
from lagrange_cli.report.tree import Formula, Law, Part, Section, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.step_values import ComponentSteps
    from lagrange_cli.mechanics.system import CartesianName


def positions(writer: StepsWriter) -> Section | None:
    """r(q, t) of every particle."""
    parts = [part for body in writer.steps.bodies for part in body.components]
    own_names = list(dict.fromkeys(writer.cartesian(p.name) for p in parts if is_own_coordinate(p)))
    one, many = "{listed} is a coordinate itself.", "{listed} are coordinates themselves."
    return section(
        say("Positions"),
        say.counted(len(own_names), one, many, listed=enumerated(own_names)) if own_names else None,
        *_by_body(writer, lambda part: [writer.row(writer.cartesian(part.name), part.position)]),
        *_by_constraints(
            writer.row(writer.cartesian(c.name), c.position) for c in _determined(writer)
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


def _by_constraints(rows: Iterable[Formula]) -> Iterator[Part]:
    """Yield the names beside particles that constraints determine, below the particles."""
    written = tuple(rows)
    if written:
        yield say("By the constraints")
        yield formulas(written)


def velocities(writer: StepsWriter) -> Section | None:
    """Return the chain rule: partial derivatives of each component, then their sum."""

    def rows(part: ComponentSteps) -> Iterable[Formula]:
        if part.velocity != 0:
            place = writer.cartesian(part.name)
            for variable, slope in part.partials:
                yield writer.row(partial(place, writer.variable(variable)), slope)
            yield writer.row(writer.cartesian(part.name, 1), part.velocity)

    blocks = list(_by_body(writer, rows))
    further = _by_constraints(
        writer.row(writer.cartesian(c.name, 1), c.velocity) for c in _determined(writer)
    )
    if not blocks:
        return section(say("Velocities"), *further)
    chain = times(partial(POSITION, symbol("q_k")), symbol("q_k", 1))
    law = vector("r", 1) + " = " + total("k", chain)
    if _is_rheonomic(writer):
        law += " + " + partial(POSITION, symbol("t"))
    return section(
        say("Velocities"),
        say("By the chain rule"),
        Law(law),
        say("Partial derivatives that are not written vanish."),
        *blocks,
        *further,
    )


def accelerations(writer: StepsWriter) -> Section | None:
    """r̈ of every particle, and ω̇ of bodies."""

    def rows(part: ComponentSteps) -> Iterable[Formula]:
        if part.velocity != 0:
            yield writer.row(writer.cartesian(part.name, 2), part.acceleration)

    blocks = [*_by_body(writer, rows), *turnings.angular_accelerations(writer)]
    if not blocks:
        return None
    sentence = say("The velocities are differentiated by time once more.")
    return section(say("Accelerations"), sentence, *blocks)


def displacements(writer: StepsWriter) -> Section | None:
    """Virtual displacements δr = Σ ∂r/∂q δq, at fixed time."""

    def rows(part: ComponentSteps) -> Iterable[Formula]:
        terms = [slope * symbol for symbol, slope in part.slopes]
        if terms:
            yield writer.row(virtual(writer.cartesian(part.name)), sympy.Add(*terms))

    blocks, turns = list(_by_body(writer, rows)), list(turnings.virtual_turns(writer))
    if not (blocks or writer.turning):
        return None
    chain = times(partial(POSITION, PLACE), DISPLACED)
    return section(
        say("Virtual displacements"),
        *turnings.displaced_quaternions(writer),
        say("Coordinates are displaced at a fixed time:") if blocks or turns else None,
        Law(virtual(POSITION) + " = " + total("j", chain)) if blocks else None,
        *blocks,
        *turns,
    )


def _is_rheonomic(writer: StepsWriter) -> bool:
    t = writer.equations.system.t
    parts = (part for body in writer.steps.bodies for part in body.components)
    return any(s == t for part in parts for s, _ in part.partials)


def _by_body(
    writer: StepsWriter, rows: Callable[[ComponentSteps], Iterable[Formula]]
) -> Iterator[Part]:
    """Return the rows of components of each body that are no coordinates themselves."""
    return by_body(
        writer,
        lambda body: (row for p in body.components if not is_own_coordinate(p) for row in rows(p)),
    )
