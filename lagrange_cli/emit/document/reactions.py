"""Constraint forces and multipliers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.emit.constraint_wording import multiplier_label
from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.force_wording import force_notes, force_rows, forces_line, reaction_rows
from lagrange_cli.emit.steps.sections import Formula, Section, Words, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.reaction_values import ConstraintForces


def constraint_forces(writer: DocumentWriter) -> Section | None:
    """The forces on the particles; None where they were not asked for."""
    forces, say = writer.equations.constraint_forces, writer.say
    if forces is None:
        return None
    rows = list(_rows(writer, forces))
    notes = [writer.letters.words(note) for note in force_notes(forces, say)]
    return section(
        say("Constraint forces"),
        Words(say("{text}.", text=writer.letters.words(forces_line(say)))),
        formulas(rows, result=True) if rows else Words(say("There are none.")),
        *(Words(say("{text}.", text=f"{note[0].upper()}{note[1:]}")) for note in notes),
    )


def _rows(writer: DocumentWriter, forces: ConstraintForces) -> Iterator[Formula]:
    letters, say = writer.letters, writer.say
    for body, components in force_rows(forces):
        for label, expression in components:
            symbol = letters.size(letters.symbol("f")) if label == "|f|" else letters.symbol(label)
            yield replace(writer.row(symbol, expression), name=letters.named(body))
    for name, multiplier, sizes in reaction_rows(writer.equations, forces):
        shown = letters.named(name)
        if multiplier is not None:
            symbol = letters.symbol(multiplier_label(writer.equations, name))
            yield replace(writer.row(symbol, multiplier), name=shown)
        for bodies, size in sizes:
            on = letters.named(say("on {place}", place=bodies))
            yield replace(writer.row(on, size), name=shown)
