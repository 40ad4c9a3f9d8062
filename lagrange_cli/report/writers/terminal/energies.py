"""Sections on energies, forces, inputs and outputs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.mechanics.families.forms import Form
from lagrange_cli.notation.labels import quantity_labels
from lagrange_cli.notation.layout import Piece, added
from lagrange_cli.notation.page import USUAL_WIDTH, Block, Row, formula
from lagrange_cli.report.contents.sentences import (
    is_generalized_potential,
    recorded_line,
    without_line,
)
from lagrange_cli.report.writers.terminal.writer import TextWriter, heading_row, with_asides

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.system import Input


def energies(writer: TextWriter) -> list[Row]:
    labels = quantity_labels(writer.equations)
    potential = "U" if is_generalized_potential(writer.equations) else "V"
    families = writer.families
    forms: tuple[Form | None, ...] = (None, None, None)
    if families is not None:
        forms = families.kinetic, families.potential, families.dissipation
    rows = [
        energy_row(writer, labels["T"], writer.equations.system.kinetic, forms[0]),
        energy_row(writer, labels[potential], writer.equations.system.potential, forms[1]),
    ]
    short = writer.equations.derivation.short_lagrangian
    if short is not None:
        pieces = writer.pieces(short.expression)
        if any(forms) or sum(p.width for p in pieces) > 2 * USUAL_WIDTH:
            difference = [Piece(f"{labels['T']} - {labels[potential]}", 5)]
            pieces = [*difference, *added(writer.pieces(-short.left_out))]
        remark = f"({writer.text(without_line(writer.equations) or '')})"
        rows.append(formula(labels["L"], " = ", pieces, aside=remark))
    if writer.equations.system.dissipation != 0:
        rows.append(energy_row(writer, labels["D"], writer.equations.system.dissipation, forms[2]))
    return rows


def energy_row(writer: TextWriter, label: str, energy: Expr, form: Form | None) -> Row:
    """Return an energy, with sums over indices where it has such a form."""
    if form is None or writer.over_letters is None:
        return writer.formula(label, energy)
    return formula(label, " = ", writer.tree(writer.over_letters.form(form)))


def forces(writer: TextWriter) -> list[Row | Block]:
    rows = [
        writer.formula(
            f"  Q_{writer.printer.symbol(c.name)}",
            q,
            writer.say("{name} on {place}", name=force.name, place=force.on),
        )
        for force in writer.equations.system.forces
        for c, q in zip(writer.equations.system.coordinates, force.generalized, strict=True)
        if q != 0
    ]
    return with_asides(writer.say("Generalized forces"), rows)


def inputs(writer: TextWriter) -> list[Row]:
    rows = [input_row(writer, source) for source in writer.equations.system.inputs]
    return [heading_row(writer.say("Inputs")), *rows] if rows else []


def input_row(writer: TextWriter, source: Input) -> Row:
    """Write an input: its expression, or in words where its values are recorded."""
    label = f"  {writer.printer.symbol(source.name)}"
    if source.recording is None:
        return writer.formula(label, source.expression)
    return Row(label, ": ", writer.prose(recorded_line(source.recording)), "name")


def outputs(writer: TextWriter) -> list[Row]:
    rows = [
        writer.formula(f"  {writer.printer.symbol(n)}", e)
        for n, e in writer.equations.system.outputs
    ]
    return [heading_row(writer.say("Outputs")), *rows] if rows else []
