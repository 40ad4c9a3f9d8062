"""Sections on closure equations, contacts and constraint forces."""

from __future__ import annotations

from lagrange_cli.errors import escape_controls
from lagrange_cli.mechanics.families.forms import FamilyRow
from lagrange_cli.notation.labels import multiplier_label
from lagrange_cli.notation.layout import columns, joined, suffixed
from lagrange_cli.notation.page import Row, formula, words
from lagrange_cli.report.contents.forces import force_notes, force_rows, forces_line, reaction_rows
from lagrange_cli.report.contents.sentences import contacts_lines, multipliers_line
from lagrange_cli.report.writers.terminal.writer import TextWriter, heading_row, leads_after


def closures(writer: TextWriter) -> list[Row]:
    """Return the equations beside those of motion, and what their multipliers mean."""
    if not writer.equations.system.closures:
        return []
    closures = writer.equations.system.closures
    shown = []
    for one in writer.with_families("closures", len(closures)):
        if isinstance(one, FamilyRow) and writer.over_letters is not None:
            name, left = one.name, writer.tree(writer.over_letters.whole(one))
        elif isinstance(one, int):
            name, left = closures[one].name, writer.pieces(closures[one].expression)
        shown.append((escape_controls(name), writer.ranged(suffixed(left, " = 0", 4), one)))
    names = [name for name, _ in shown]
    rows = [
        formula(f"  {name}", lead, left)
        for (name, left), lead in zip(shown, leads_after(names), strict=True)
    ]
    note = Row("", "  ", writer.prose(multipliers_line(writer.equations)))
    return [heading_row(writer.say("Closure equations")), *rows, note]


def contacts(writer: TextWriter) -> list[Row]:
    """Return gaps and restitutions of one-sided constraints, and what their multipliers mean."""
    names = [escape_controls(c.name) for c in writer.equations.system.contacts]
    rows = [heading_row(writer.say("Contacts"))] if names else []
    for name, lead, contact in zip(
        names, leads_after(names), writer.equations.system.contacts, strict=True
    ):
        open_gap = f" {writer.printer.at_least} 0"
        left = suffixed(writer.pieces(contact.closure.expression), open_gap, columns(open_gap))
        value = joined(writer.pieces(contact.restitution))
        elasticity = writer.say("restitution {value}", value=value)
        rows.append(formula(f"  {name}", lead, left, aside=elasticity))
    return rows + [Row("", "  ", writer.prose(line)) for line in contacts_lines(writer.equations)]


def constraint_forces(writer: TextWriter) -> list[Row]:
    """Return forces on the particles, and what each constraint exerts, where asked for."""
    forces = writer.equations.derivation.constraint_forces
    if forces is None:
        return []
    groups = list(force_rows(forces))
    for name, multiplier, sizes in reaction_rows(writer.equations, forces):
        known = [] if multiplier is None else [(multiplier_name(writer, name), multiplier)]
        pushed = [(writer.say("force on {place}", place=on), e) for on, e in sizes]
        groups.append((name, known + pushed))
    names = [escape_controls(name) for name, _ in groups]
    is_empty = not (groups or forces.shared)
    meaning = writer.say("none") if is_empty else writer.text(forces_line())
    lines = [Row(writer.say("Constraint forces"), "   ", words(meaning), "heading")]
    for name, lead, (_, rows) in zip(names, leads_after(names), groups, strict=True):
        for index, (label, expression) in enumerate(rows):
            begin = (" " * columns(name) if index else name) + lead
            shown = writer.pieces(expression)
            opening = f"{escape_controls(label)} = "
            lines.append(
                formula(f"  {begin.rstrip()}", begin[len(begin.rstrip()) :] + opening, shown)
            )
    return lines + [Row("", "  ", writer.prose(n)) for n in force_notes(forces)]


def multiplier_name(writer: TextWriter, constraint: str) -> str:
    return writer.printer.symbol(multiplier_label(writer.equations, constraint))
