"""Particles, parameters, and what drives the system."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from lagrange_cli.emit.initial_state import exact_value
from lagrange_cli.mechanics.elements.motion import ElementMotion, QuaternionParts
from lagrange_cli.notation.vocabulary import latex_overrides
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.families import sizes_line
from lagrange_cli.report.contents.sentences import recorded_line, table_line
from lagrange_cli.report.inlines import (
    Inline,
    Listed,
    Plain,
    Prose,
    Text,
    Unit,
    Written,
    group,
    in_parentheses,
    joined,
    numeral,
    ranges,
    say,
    symbol,
    value,
)
from lagrange_cli.report.tree import Block, Paragraph, Section, Table, formulas, section

#: Operations of a value over other parameters that stands in a table: in a column of numbers.
_MOST_OPERATIONS = 6

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sympy import Expr

    from lagrange_cli.mechanics.elements.motion import Turning
    from lagrange_cli.mechanics.system import Parameter


def system(writer: DocumentWriter) -> Section | None:
    """Return particles and bodies with their masses, and the parameters with their values."""
    particles = [p for p in writer.equations.system.particles if p.turning is None]
    bodies = [p for p in writer.equations.system.particles if p.turning is not None]
    sizes = "" if writer.families is None else sizes_line(writer.families)
    sentences: list[Written] = []
    if particles:
        listed = Listed(tuple(_particles(writer, particles)), between="; ")
        one, many = "Particle: {listed}.", "Particles: {listed}."
        sentences.append(say.counted(len(particles), one, many, listed=listed))
    if bodies:
        listed = Listed(tuple(_body(writer, body) for body in bodies), between="; ")
        one, many = "Rigid body: {listed}.", "Rigid bodies: {listed}."
        sentences.append(say.counted(len(bodies), one, many, listed=listed))
    if sizes:
        sentences.append(say("Here {sizes}.", sizes=Inline(sizes)))
    return section(say("System"), writer.paragraph(*sentences), _parameters(writer))


def _particles(writer: DocumentWriter, particles: Sequence[ElementMotion]) -> Iterator[Written]:
    """Return the particles; those that are alike but for their indices as one."""
    families = writer.families
    if families is None:
        yield from (_particle(writer, p) for p in particles)
        return
    # No name of a scene holds a line break.
    texts = ["\n".join((p.name, *p.components)) for p in particles]
    for text in families.texts(texts):
        alike = [particles[k] for k in text.covers]
        if not text.ranges or len({p.mass for p in alike}) > 1:
            yield from (_particle(writer, p) for p in alike)
            continue
        name, x, y, z = text.text.split("\n")
        shown = _particle(writer, replace(alike[0], name=name, components=(x, y, z)))
        yield say("{names} for {ranges}", names=shown, ranges=Inline(ranges(text.ranges)))


def _particle(writer: DocumentWriter, particle: ElementMotion) -> Written:
    return say(
        "{name} of mass {mass} at {place}",
        name=_particle_name(particle),
        mass=writer.inline(particle.mass),
        place=Inline(group(joined(", ", map(symbol, particle.components)))),
    )


def _body(writer: DocumentWriter, body: ElementMotion) -> Written:
    """Return a body with its mass, its inertia about the centre of mass, and its turns."""
    turning = body.turning
    assert turning is not None
    shown = say(
        "{name} of mass {mass} with the centre of mass at {place}",
        name=_particle_name(body),
        mass=writer.inline(body.mass),
        place=Inline(group(joined(", ", map(symbol, body.components)))),
    )
    parts: list[Written] = [shown, _inertia(writer, turning)]
    turns = tuple(_turn(writer, turn) for turn in turning.turns)
    if turns and turning.on is None:
        parts.append(say("turned by {turns}", turns=Listed(turns)))
    elif turns:
        on = Plain(turning.on or "")
        parts.append(say("turned against {on} by {turns}", on=on, turns=Listed(turns)))
    elif turning.on is not None:
        parts.append(say("fixed on {on}", on=Plain(turning.on)))
    return Listed(tuple(parts))


def _inertia(writer: DocumentWriter, turning: Turning) -> Written:
    entries = turning.inertia
    moments = entries[0::4]
    shown = Listed(tuple(map(writer.inline, moments)))
    products = (entries[1], entries[2], entries[5])
    if any(product != 0 for product in products):
        return say(
            "moments of inertia {moments} and products {products} of xy, xz, yz",
            moments=shown,
            products=Listed(tuple(map(writer.inline, products))),
        )
    present = [moment for moment in moments if moment != 0]
    if len(present) == 1 and sum(spin != 0 for spin in turning.spin) == 1:
        return say("moment of inertia {moment}", moment=writer.inline(present[0]))
    return say("moments of inertia {moments}", moments=shown)


def _turn(
    writer: DocumentWriter, turn: tuple[str | tuple[Expr, ...], Expr] | QuaternionParts
) -> Written:
    if isinstance(turn, QuaternionParts):
        parts = Listed(tuple(map(writer.inline, turn.parts)))
        return say("the quaternion ({parts})", parts=parts)
    axis, angle = turn
    if isinstance(axis, str):
        return say("{angle} about {axis}", angle=writer.inline(angle), axis=Inline(symbol(axis)))
    direction = Listed(tuple(map(writer.inline, axis)))
    return say("{angle} about ({axis})", angle=writer.inline(angle), axis=direction)


def _particle_name(particle: ElementMotion) -> Written:
    name = Plain(particle.name)
    if particle.latex is None:
        return name
    return in_parentheses(name, Inline(symbol(particle.name, 0, particle.latex)))


def _parameters(writer: DocumentWriter) -> Table | Paragraph | None:
    """Return a table of the parameters; a sentence where nothing is known but their letters."""
    literals = dict(writer.equations.presentation.literals)
    stated = {
        name: writer.formula(expression)
        for name, expression in writer.equations.presentation.stated_values
        if expression.count_ops() <= _MOST_OPERATIONS
    }
    rows: list[tuple[Text, ...]] = []
    for p in writer.equations.system.parameters:
        number: Text = ""
        exact = exact_value(p)
        if exact is not None:
            number = writer.inline(exact)
        elif p.value is not None and p.name in stated:
            number = Inline(stated[p.name] + " = " + numeral(p.value))
        elif p.value is not None:
            number = Inline(value(p.value, literals.get(Fraction(repr(p.value)))))
        letter = Inline(symbol(p.name, 0, p.latex))
        rows.append((letter, _meaning(writer, p), number, Unit(p.unit) if p.unit else ""))
    heads = (say("Parameter"), say("Meaning"), say("Value"), say("Unit"))
    if not rows:
        return None
    table = Table(heads, tuple(rows), prose=heads[1]).without_empty_columns()
    if len(table.heads) > 1:
        return table
    listed = Listed(tuple(letter for letter, *_ in rows))
    one, many = "Parameter: {listed}.", "Parameters: {listed}."
    return Paragraph(say.counted(len(rows), one, many, listed=listed))


def _meaning(writer: DocumentWriter, parameter: Parameter) -> Text:
    if parameter.start_of is None:
        return Prose(parameter.description) if parameter.description else ""
    latex = latex_overrides(writer.equations).get(parameter.start_of)
    coordinate = Inline(symbol(parameter.start_of, 0, latex))
    return say("{coordinate} at the start", coordinate=coordinate)


def inputs(writer: DocumentWriter) -> Section | None:
    """Given functions of time, as formulas or in words."""
    blocks: list[Block] = [
        Paragraph(
            say(
                "{name}: {value}",
                name=Inline(symbol(u.name)),
                value=say("{text}.", text=recorded_line(u.recording)),
            )
        )
        for u in writer.equations.system.inputs
        if u.recording is not None and not u.order
    ]
    sampled = {name for c in writer.equations.system.controllers for name, _ in c.held_inputs}
    expressions = [
        (u.name, u.expression)
        for u in writer.equations.system.inputs
        if u.recording is None and not u.order and u.name not in sampled
    ]
    return _named(writer, say("Inputs"), expressions, blocks)


def tables(writer: DocumentWriter) -> Section | None:
    """Functions that files give, in words."""
    blocks: list[Block] = [
        Paragraph(
            say(
                "{name}: {value}",
                name=Inline(symbol(f.name, 0, f.latex)),
                value=say("{text}.", text=table_line(f.table)),
            )
        )
        for f in writer.equations.system.functions
        if f.table is not None
    ]
    return section(say("Tables"), *blocks)


def outputs(writer: DocumentWriter) -> Section | None:
    """Return expressions that the scene asks for."""
    return _named(writer, say("Outputs"), writer.equations.system.outputs, [])


def _named(
    writer: DocumentWriter,
    heading: Text,
    entries: Iterable[tuple[str, Expr | None]],
    blocks: list[Block],
) -> Section | None:
    rows = [writer.row(symbol(name), e) for name, e in entries if e is not None]
    return section(heading, formulas(rows), *blocks)
