"""Particles, parameters, and what drives the system."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from lagrange_cli.emit.initial_state import exact_value
from lagrange_cli.notation.vocabulary import latex_overrides
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.families import sizes_line
from lagrange_cli.report.contents.sentences import recorded_line
from lagrange_cli.report.tree import Block, Paragraph, Section, Table, formulas, section

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sympy import Expr

    from lagrange_cli.mechanics.system import Parameter, ParticleMotion
    from lagrange_cli.report.letters import Letters


def system(writer: DocumentWriter) -> Section | None:
    """Return the particles with their masses, and the parameters with their values."""
    say, particles = writer.say, writer.equations.system.particles
    listed = "; ".join(_particles(writer))
    sentence = say.counted(
        len(particles), "Particle: {listed}.", "Particles: {listed}.", listed=listed
    )
    sizes = "" if writer.families is None else sizes_line(writer.families)
    here = say("Here {sizes}.", sizes=writer.letters.inline(sizes)) if sizes else ""
    whole = writer.paragraph(sentence if particles else "", here)
    return section(say("System"), whole, _parameters(writer))


def _particles(writer: DocumentWriter) -> Iterator[str]:
    """Return the particles; those that are alike but for their indices as one."""
    families, particles = writer.families, writer.equations.system.particles
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
        ranges = writer.letters.inline(writer.letters.ranges(text.ranges))
        yield writer.say("{names} for {ranges}", names=shown, ranges=ranges)


def _particle(writer: DocumentWriter, particle: ParticleMotion) -> str:
    letters = writer.letters
    place = ", ".join(letters.symbol(c) for c in particle.components)
    return writer.say(
        "{name} of mass {mass} at {place}",
        name=_particle_name(letters, particle),
        mass=writer.lettered_inline(particle.mass),
        place=letters.inline(f"({place})"),
    )


def _particle_name(letters: Letters, particle: ParticleMotion) -> str:
    name = letters.words(particle.name)
    if particle.latex is None:
        return name
    return f"{name} ({letters.inline(letters.symbol(particle.name, 0, particle.latex))})"


def _parameters(writer: DocumentWriter) -> Table | Paragraph | None:
    """Return a table of the parameters; a sentence where nothing is known but their letters."""
    say, letters = writer.say, writer.letters
    literals = dict(writer.equations.presentation.literals)
    rows = []
    for p in writer.equations.system.parameters:
        value, exact = "", exact_value(p)
        if exact is not None:
            value = writer.lettered_inline(exact)
        elif p.value is not None:
            value = letters.inline(letters.value(p.value, literals.get(Fraction(repr(p.value)))))
        symbol = letters.inline(letters.symbol(p.name, 0, p.latex))
        rows.append((symbol, _meaning(writer, p), value, letters.unit(p.unit or "")))
    heads = (say("Parameter"), say("Meaning"), say("Value"), say("Unit"))
    if not rows:
        return None
    table = Table(heads, tuple(rows), prose=heads[1]).without_empty_columns()
    if len(table.heads) > 1:
        return table
    listed = ", ".join(symbol for symbol, *_ in rows)
    return Paragraph(
        say.counted(len(rows), "Parameter: {listed}.", "Parameters: {listed}.", listed=listed)
    )


def _meaning(writer: DocumentWriter, parameter: Parameter) -> str:
    letters = writer.letters
    if parameter.start_of is None:
        return letters.prose(parameter.description or "")
    latex = latex_overrides(writer.equations).get(parameter.start_of)
    symbol = letters.inline(letters.symbol(parameter.start_of, 0, latex))
    return writer.say("{coordinate} at the start", coordinate=symbol)


def inputs(writer: DocumentWriter) -> Section | None:
    """Given functions of time, as formulas or in words."""
    letters = writer.letters
    blocks: list[Block] = [
        Paragraph(
            writer.say(
                "{name}: {value}",
                name=letters.inline(letters.symbol(u.name)),
                value=f"{letters.words(recorded_line(u.recording, writer.say))}.",
            )
        )
        for u in writer.equations.system.inputs
        if u.recording is not None
    ]
    expressions = [
        (u.name, u.expression) for u in writer.equations.system.inputs if u.recording is None
    ]
    return _named(writer, writer.say("Inputs"), expressions, blocks)


def outputs(writer: DocumentWriter) -> Section | None:
    """Return expressions that the scene asks for."""
    return _named(writer, writer.say("Outputs"), writer.equations.system.outputs, [])


def _named(
    writer: DocumentWriter,
    heading: str,
    entries: Iterable[tuple[str, Expr | None]],
    blocks: list[Block],
) -> Section | None:
    rows = [writer.row(writer.letters.symbol(name), e) for name, e in entries if e is not None]
    return section(heading, formulas(rows), *blocks)
