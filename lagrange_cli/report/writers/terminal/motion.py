"""The section of the equations of motion, or of accelerations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.errors import escape_controls
from lagrange_cli.mechanics.dynamics.accelerations import (
    differentiated,
    explicit_form,
    forcing_with_reactions,
)
from lagrange_cli.mechanics.families.forms import FamilyRow
from lagrange_cli.notation.build import display_row, display_terms
from lagrange_cli.notation.labels import quantity_labels
from lagrange_cli.notation.layout import Piece, joined, suffixed
from lagrange_cli.notation.page import Row, formula, words
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.report.contents.sentences import divisor_and_factor, explicit_line
from lagrange_cli.report.writers.terminal.writer import TextWriter, heading_row, leads_after

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm
    from lagrange_cli.mechanics.equations import ShownEquation


def motion(writer: TextWriter) -> list[Row]:
    rows = []
    for one in writer.with_families("motion", len(writer.equations.derivation.shown)):
        shown = one.shown if isinstance(one, FamilyRow) else writer.equations.derivation.shown[one]
        left = suffixed(left_side(writer, shown, one), " = 0", 4)
        divisor, factor = divisor_and_factor(shown)
        aside = ""
        if divisor is not None:
            aside = writer.say(
                "(divided by {factor})", factor=joined(divisor_pieces(writer, divisor, one))
            )
        elif factor is not None:
            aside = writer.say(
                "(multiplied by {factor})", factor=joined(divisor_pieces(writer, factor, one))
            )
        rows.append((shown.coordinate, writer.ranged(left, one), aside))
    names = [writer.printer.symbol(name) for name, _, _ in rows]
    leads = leads_after(names)
    lines = [
        formula(f"  {name}", lead, pieces, aside=aside)
        for name, lead, (_, pieces, aside) in zip(names, leads, rows, strict=True)
    ]
    return [heading_row(writer.say("Equations of motion")), *(lines or [still(writer)])]


def still(writer: TextWriter) -> Row:
    return Row("", "  ", words(writer.say("none: nothing can move")))


def left_side(writer: TextWriter, shown: ShownEquation, one: int | FamilyRow) -> list[Piece]:
    """Return the left side of an equation, over accelerations where a scene is to read it."""
    names = writer.words
    if isinstance(one, FamilyRow) and writer.over_letters is not None:
        names = writer.over_letters.words_of(one)
    is_read_back = isinstance(writer.printer, ScenePrinter)
    return writer.tree((display_terms if is_read_back else display_row)(shown, names))


def divisor_pieces(writer: TextWriter, expression: Expr, one: int | FamilyRow) -> list[Piece]:
    """Return the factor that an equation was divided by, or multiplied with."""
    if isinstance(one, FamilyRow) and writer.over_letters is not None:
        return writer.tree(writer.over_letters.part(one, expression))
    return writer.pieces(expression)


def accelerations(writer: TextWriter, heading: str = "") -> list[Row]:
    explicit = explicit_form(writer.equations)
    heading = heading or writer.say("Equations of motion")
    if not writer.equations.system.coordinates:
        return [heading_row(heading), still(writer)]
    sentence = writer.text(explicit_line(writer.equations, explicit))
    rows = [Row(heading, ", ", words(sentence[0].lower() + sentence[1:]), "heading")]
    solved = zip(writer.equations.system.coordinates, explicit.accelerations, strict=True)
    known = [(c.name, value) for c, value in solved if value is not None]
    rows += [
        formula(f"  {writer.printer.symbol(name, 2)}", " = ", right)
        for name, right in writer.listed(known)
    ]
    for closure, value in zip(writer.equations.system.closures, explicit.multipliers, strict=True):
        if value is not None:
            rows.append(writer.formula(f"  {joined(writer.pieces(closure.multiplier))}", value))
    return rows + coupled(writer, explicit)


def coupled(writer: TextWriter, explicit: ExplicitForm) -> list[Row]:
    """M and f of the accelerations that are not solved for, and what closures say of them."""
    coordinates, open_rows = writer.equations.system.coordinates, explicit.coupled
    if not open_rows:
        return []
    names = [writer.printer.symbol(c.name) for c in coordinates]
    unknowns = ", ".join(writer.printer.symbol(coordinates[i].name, 2) for i in open_rows)
    labels = quantity_labels(writer.equations)
    mass, forcing = labels["M"], labels["f"]
    rows = [
        Row(
            "",
            f"  {mass} (",
            words(
                writer.say(
                    "{unknowns}) = {forcing} with", unknowns=unknowns, forcing=forcing
                ).split(" ")
            ),
        )
    ]
    for i in open_rows:
        for j in open_rows:
            entry = writer.equations.system.mass_matrix[i][j]
            if j >= i and entry != 0:
                rows.append(writer.formula(f"  {mass}[{names[i]}, {names[j]}]", entry))
    right = forcing_with_reactions(writer.equations)
    rows += [writer.formula(f"  {forcing}[{names[i]}]", right[i]) for i in open_rows]
    for closure, value in zip(writer.equations.system.closures, explicit.multipliers, strict=True):
        if value is None:
            row = display_row(differentiated(writer.equations, closure), writer.words)
            left = suffixed(writer.printer.pieces(row), " = 0", 4)
            rows.append(formula(f"  {escape_controls(closure.name)}", "   ", left))
    return rows
