"""Constraint forces and multipliers as a section of the LaTeX document."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from lagrange_cli.emit.constraint_wording import multiplier_label
from lagrange_cli.emit.force_wording import FORCES_LINE, force_notes, force_rows, reaction_rows
from lagrange_cli.emit.latex.typesetter import FormulaRow, Typesetter
from lagrange_cli.notation.latex_escape import latex_text
from lagrange_cli.notation.symbols import latex_name

if TYPE_CHECKING:
    from lagrange_cli.mechanics.reaction_values import ConstraintForces


def forces_section(setter: Typesetter) -> list[str]:
    """Lines of the section; none where the forces were not asked for."""
    forces = setter.equations.constraint_forces
    if forces is None:
        return []
    rows = list(_rows(setter, forces))
    lines = [r"\section*{Constraint forces}", f"{latex_text(FORCES_LINE)}."]
    lines += setter.align(rows) if rows else ["There are none."]
    notes = [latex_text(note) for note in force_notes(forces)]
    return [*lines, *(f"{note[0].upper()}{note[1:]}." for note in notes)]


def _rows(setter: Typesetter, forces: ConstraintForces) -> Iterator[FormulaRow]:
    for body, components in force_rows(forces):
        for label, expression in components:
            symbol = rf"|{latex_name('f')}|" if label == "|f|" else latex_name(label)
            yield setter.definition(rf"{_before(body)}{symbol}", expression)
    for name, multiplier, sizes in reaction_rows(setter.equations, forces):
        if multiplier is not None:
            symbol = latex_name(multiplier_label(setter.equations, name))
            yield setter.definition(rf"{_before(name)}{symbol}", multiplier)
        for bodies, size in sizes:
            yield setter.definition(rf"{_before(name)}\text{{on {latex_text(bodies)}}}", size)


def _before(name: str) -> str:
    return rf"\text{{{latex_text(name)}}}\colon\quad "
