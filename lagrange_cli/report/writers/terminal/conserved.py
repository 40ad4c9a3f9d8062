"""Sections on conserved quantities, and on the rate of an energy that is not conserved."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from lagrange_cli.analysis.symmetries.angular_momentum import angular_momentum_axis
from lagrange_cli.analysis.symmetries.conserved_quantities import energy_loss, energy_sum
from lagrange_cli.analysis.symmetries.starting_values import conserved_at_start
from lagrange_cli.errors import escape_controls
from lagrange_cli.mechanics.families.forms import FamilyRow
from lagrange_cli.notation.labels import quantity_labels
from lagrange_cli.notation.layout import Piece, added, columns, joined
from lagrange_cli.notation.page import Block, Row, formula, words
from lagrange_cli.report.contents.sentences import (
    conserved_reason,
    energy_is_sum,
    energy_letter,
    loss_line,
    none_conserved_line,
    only_between_impacts,
    sum_line,
    undecided,
)
from lagrange_cli.report.inlines import Label, symbol
from lagrange_cli.report.writers.terminal.writer import TextWriter

if TYPE_CHECKING:
    from lagrange_cli.mechanics.findings import Conserved


def conserved(writer: TextWriter) -> list[Row | Block]:
    if not writer.equations.system.coordinates:
        return []
    conserved = writer.equations.derivation.conserved
    rows = [
        conserved_family(writer, one)
        if isinstance(one, FamilyRow)
        else conserved_row(writer, conserved[one])
        for one in writer.with_families("momenta", len(conserved))
    ]
    heading, searched = writer.say("Conserved"), writer.say("among cyclic momenta and energy")
    lines: list[Row | Block] = [Row(heading, " ", words(searched), "heading")]
    if rows:
        lines.append(Block(tuple(rows), "asides"))
    else:
        none = writer.prose(none_conserved_line(writer.equations))
        lines = [Row(heading, "   ", none, "heading")]
    names = [
        "E" if n == "energy" else writer.printer.symbol(n) for n in undecided(writer.equations)
    ]
    note = words(writer.say("not decided: {names}", names=", ".join(names)))
    doubts = [Row("", "  ", note)] if names else []
    return [*lines, *_at_start(writer), *doubts]


def _at_start(writer: TextWriter) -> Iterator[Row]:
    """Yield the line on conserved quantities at a start that is written in parameters."""
    values = [
        f"{name_of(writer, quantity).partition(' = ')[0]} = {joined(writer.pieces(value))}"
        for quantity, value in conserved_at_start(writer.equations)
    ]
    if values:
        yield Row("", "  ", words(writer.say("At the start {values}.", values=", ".join(values))))


def energy(writer: TextWriter) -> list[Row | Block]:
    """Return the section on an energy that is not conserved: reason, rate, T + V beside h."""
    say, when = writer.say, ""
    rows: list[Row | Block] = [*_balance(writer), *_lost(writer), *_sum(writer)]
    if writer.equations.derivation.balance is not None and only_between_impacts(writer.equations):
        when = say(" between impacts")
    return [Row(say("Energy"), when, role="heading"), *rows] if rows else []


def _lost(writer: TextWriter) -> Iterator[Row]:
    """Yield the line that says why the energy is not conserved."""
    loss = energy_loss(writer.equations)
    if loss is not None:
        label = symbol(quantity_labels(writer.equations)["L"])
        why = writer.text(loss_line(loss, label))
        yield Row("", "  ", words(writer.say("not conserved: {reason}", reason=why)))


def _sum(writer: TextWriter) -> Iterator[Row | Block]:
    """Yield T + V as a formula over Jacobi's integral where the two differ."""
    total = energy_sum(writer.equations)
    if total is None:
        return
    labels = quantity_labels(writer.equations)
    name, shown = f"{labels['T']} + {labels['V']}", writer.pieces(total.difference)
    whole = [Piece(labels["h"], columns(labels["h"])), *added(shown)]
    yield formula(f"  {name}", " = ", whole, aside=writer.text(sum_line(writer.equations, total)))
    if total.rate is not None:
        yield writer.formula(f"  d({name})/dt", total.rate)


def _balance(writer: TextWriter) -> list[Row]:
    """Return the rate of the energy where that is not conserved."""
    balance = writer.equations.derivation.balance
    if balance is None:
        return []
    labels = quantity_labels(writer.equations)
    label = labels["E" if balance.kind == "energy" else "h"]
    rows = []
    if energy_is_sum(writer.equations, balance):
        rows.append(Row(f"  {label}", f" = {labels['T']} + {labels['V']}", role="name"))
    else:
        rows.append(writer.total(f"  {label}", balance.parts or (writer.equations.system.energy,)))
    if balance.is_dissipation:
        return [*rows, Row(f"  d{label}/dt", f" = -2 {labels['D']}", role="name")]
    return [*rows, writer.total(f"  d{label}/dt", (balance.rate,))]


def conserved_row(writer: TextWriter, quantity: Conserved) -> Row:
    name, equals, total = name_of(writer, quantity).partition(" = ")
    if equals:
        reason = escape_controls(reason_of(writer, quantity))
        return Row(f"  {name}", equals + total, role="name", aside=reason)
    parts = quantity.parts or (quantity.expression,)
    return writer.total(f"  {name}", parts, reason_of(writer, quantity))


def conserved_family(writer: TextWriter, row: FamilyRow) -> Row:
    """Return the momenta of a family."""
    assert writer.over_letters is not None
    one = writer.equations.derivation.conserved[row.covers[0]]
    reason = reason_of(writer, one, symbol(row.name))
    shown = writer.ranged(writer.tree(writer.over_letters.whole(row)), row)
    label = f"  {writer.printer.symbol(f'p_{row.name}')}"
    return formula(label, " = ", shown, aside=escape_controls(reason))


def name_of(writer: TextWriter, quantity: Conserved) -> str:
    labels = quantity_labels(writer.equations)
    if quantity.kind == "momentum":
        return writer.printer.symbol(quantity.name)
    if energy_is_sum(writer.equations, quantity):
        return f"{labels['E']} = {labels['T']} + {labels['V']}"
    return labels[energy_letter(quantity)]


def reason_of(writer: TextWriter, quantity: Conserved, subject: Label | None = None) -> str:
    """Say why a quantity is conserved; ``subject`` stands for the coordinates of a family."""
    if subject is None:
        subject = symbol(quantity.coordinate or quantity_labels(writer.equations)["L"])
    reason = writer.text(conserved_reason(writer.equations, quantity, subject))
    axis = angular_momentum_axis(writer.equations, quantity)
    if axis is None:
        return reason
    return f"{reason}; {writer.say('angular momentum about the {axis} axis', axis=axis)}"
