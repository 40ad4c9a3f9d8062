"""Sections on conserved quantities with their reasons, and on an energy that is not conserved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.analysis.symmetries.conserved_quantities import energy_loss, energy_sum
from lagrange_cli.mechanics.families.forms import FamilyRow
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
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
from lagrange_cli.report.contents.steps.writer import angular_momentum_sentence, start_sentence
from lagrange_cli.report.tree import Block, Formula, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.findings import Conserved


@dataclass(frozen=True)
class Further:
    """A conserved quantity beside cyclic momenta and energy.

    Attributes
    ----------
    symbol
        Its letter.
    reason
        Why it is conserved, a phrase in the letters of the format.
    row
        What it is.
    """

    symbol: str
    reason: str
    row: Formula


def conserved(
    writer: DocumentWriter, further: Sequence[Further] = (), searched: str = ""
) -> Section | None:
    """Return conserved quantities, each with its reason.

    Parameters
    ----------
    writer
        Equations, letters and language.
    further
        Those beside cyclic momenta and energy.
    searched
        What they were looked for among, if that is more than cyclic momenta and energy.
    """
    equations, say, letters = writer.equations, writer.say, writer.letters
    if not equations.system.coordinates:
        return None
    heading = say("Conserved quantities")
    names = ", ".join(letters.inline(_named(writer, name)) for name in undecided(equations))
    doubts = writer.paragraph(say("Of {names} this is not decided.", names=names) if names else "")
    if not equations.derivation.conserved and not further:
        none = f"{say('none')} {searched}" if searched else none_conserved_line(equations, say)
        text = none if none.endswith(".") else say("{text}.", text=none)
        return section(heading, Paragraph(text[:1].upper() + text[1:]), doubts)
    searched = searched or say("among cyclic momenta and energy")
    sentences, rows = [], []
    for one in writer.with_families("momenta", len(equations.derivation.conserved)):
        quantity = equations.derivation.conserved[
            one.covers[0] if isinstance(one, FamilyRow) else one
        ]
        symbol, subject = _symbol(writer, quantity), _subject(writer, quantity)
        if isinstance(one, FamilyRow):
            subject = letters.symbol(one.name)
            symbol = letters.below("p", subject)
            rows.append(writer.family_row(symbol, one))
        else:
            rows.append(_row(writer, quantity))
        sentences.append(
            say(
                "{reason}, so {symbol} is conserved",
                reason=_reason(writer, quantity, subject),
                symbol=letters.inline(symbol),
            )
        )
    for extra in further:
        rows.append(extra.row)
        symbol = letters.inline(extra.symbol)
        sentences.append(
            say("{reason}, so {symbol} is conserved", reason=extra.reason, symbol=symbol)
        )
    listed = say("{name}: {value}", name=searched, value="; ".join(sentences))
    return section(
        heading,
        Paragraph(say("{text}:", text=listed[:1].upper() + listed[1:])),
        formulas(rows, result=True),
        *(
            angular_momentum_sentence(writer, quantity, _symbol(writer, quantity))
            for quantity in equations.derivation.conserved
        ),
        start_sentence(writer, lambda quantity: _symbol(writer, quantity)),
        doubts,
    )


def balance(writer: DocumentWriter) -> Section | None:
    """Return the section on an energy that is not conserved: reason, rate, T + V beside h."""
    blocks = [*_balance(writer), *_lost(writer), *_sum(writer)]
    return section(writer.say("Energy"), *blocks)


def _lost(writer: DocumentWriter) -> Iterator[Block]:
    """Yield the sentence that says why the energy is not conserved."""
    loss, say, letters = energy_loss(writer.equations), writer.say, writer.letters
    if loss is None:
        return
    whole, time = letters.inline(writer.lettered_labels["L"]), letters.inline("t")
    why = loss_line(loss, whole, time, say, letters.words)
    yield Paragraph(say("It is not conserved: {reason}.", reason=why))


def _sum(writer: DocumentWriter) -> Iterator[Block]:
    """Yield T + V as a formula over Jacobi's integral where the two differ."""
    energy, say, labels = energy_sum(writer.equations), writer.say, writer.lettered_labels
    if energy is None:
        return
    name, jacobi = f"{labels['T']} + {labels['V']}", labels["h"]
    sentence = say(
        "{name}: {value}",
        name=writer.letters.inline(name),
        value=sum_line(writer.equations, energy, say),
    )
    rows = [writer.row(f"{name} - {jacobi}", energy.difference)]
    if energy.rate is not None:
        whole = writer.letters.group(name)
        rows.append(writer.row(writer.letters.differential(whole), energy.rate))
    yield Paragraph(say("{text}:", text=sentence))
    yield formulas(rows, result=True)


def _balance(writer: DocumentWriter) -> Iterator[Block]:
    """Return the rate of the energy where that is not conserved."""
    equations, say, letters, labels = (
        writer.equations,
        writer.say,
        writer.letters,
        writer.lettered_labels,
    )
    change = equations.derivation.balance
    if change is None:
        return
    label = labels["E" if change.kind == "energy" else "h"]
    whole = label
    if energy_is_sum(equations, change):
        whole += f" = {labels['T']} + {labels['V']}"
    sentence = say(
        "Along a motion {energy} changes at the given rate", energy=letters.inline(label)
    )
    if only_between_impacts(equations):
        sentence += say(" between impacts")
    rate = letters.differential(label)
    if change.is_dissipation:
        rate += f" = -2 {labels['D']}"
    yield Paragraph(say("{text}:", text=sentence))
    yield formulas(
        [
            writer.total(whole, change.parts or (equations.system.energy,)),
            writer.total(rate, (change.rate,)),
        ],
        result=True,
    )


def _named(writer: DocumentWriter, name: str) -> str:
    """Return the symbol of ``energy`` or of a momentum ``p_NAME``."""
    return writer.lettered_labels["E"] if name == "energy" else writer.letters.symbol(name)


def _subject(writer: DocumentWriter, quantity: Conserved) -> str:
    """Return the coordinate that a momentum is conserved for, or L."""
    named = {c.name: writer.lettered_coordinate(c) for c in writer.equations.system.coordinates}
    return named.get(quantity.coordinate or "", writer.lettered_labels["L"])


def _reason(writer: DocumentWriter, quantity: Conserved, subject: str) -> str:
    """Return a reason with the quantities it names as formulas."""
    shown, time = writer.letters.inline(subject), writer.letters.inline("t")
    return conserved_reason(writer.equations, quantity, shown, time, writer.say)


def _symbol(writer: DocumentWriter, quantity: Conserved) -> str:
    if quantity.kind != "momentum":
        return writer.lettered_labels[energy_letter(quantity)]
    for coordinate in writer.equations.system.coordinates:
        if coordinate.name == quantity.coordinate:
            return writer.letters.below("p", writer.lettered_coordinate(coordinate))
    return writer.letters.symbol(quantity.name)


def _row(writer: DocumentWriter, quantity: Conserved) -> Formula:
    label = _symbol(writer, quantity)
    if energy_is_sum(writer.equations, quantity):
        label += f" = {writer.lettered_labels['T']} + {writer.lettered_labels['V']}"
    return writer.total(label, quantity.parts or (quantity.expression,))
