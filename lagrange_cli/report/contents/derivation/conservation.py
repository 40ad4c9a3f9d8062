"""Sections on conserved quantities with their reasons, and on an energy that is not conserved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from lagrange_cli.analysis.symmetries.angular_momentum import angular_momentum_axis
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
from lagrange_cli.report.inlines import (
    Inline,
    Label,
    Listed,
    Written,
    below,
    differential,
    group,
    opened,
    say,
    symbol,
)
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
        Why it is conserved.
    row
        What it is.
    """

    symbol: Label | str
    reason: Written | str
    row: Formula


def conserved(
    writer: DocumentWriter, further: Sequence[Further] = (), searched: Written | None = None
) -> Section | None:
    """Return conserved quantities, each with its reason.

    Parameters
    ----------
    writer
        Equations.
    further
        Those beside cyclic momenta and energy.
    searched
        What they were looked for among, if that is more than cyclic momenta and energy.
    """
    equations = writer.equations
    if not equations.system.coordinates:
        return None
    heading = say("Conserved quantities")
    names = Listed(tuple(Inline(_named(writer, name)) for name in undecided(equations)))
    doubts = Paragraph(say("Of {names} this is not decided.", names=names)) if names else None
    quantities, terse = equations.derivation.conserved, say("Conserved")
    if not quantities and not further:
        none = none_conserved_line(equations)
        if searched is not None:
            none = Listed((say("none"), searched), between=" ")
        is_sentence = searched is None and not names
        whole = none if is_sentence else opened(say("{text}.", text=none))
        shown = Paragraph(whole, only="document")
        return section(heading, shown, doubts, terse=terse, lead=(none,))
    rows, sentences = [], []
    for one in writer.with_families("momenta", len(quantities)):
        quantity = quantities[one.covers[0] if isinstance(one, FamilyRow) else one]
        letter, subject = _symbol(writer, quantity), _subject(writer, quantity)
        if isinstance(one, FamilyRow):
            subject = symbol(one.name)
            letter = below("p", subject)
            row = writer.family_row(letter, one)
        else:
            row = _row(writer, quantity)
        reason = conserved_reason(equations, quantity, subject)
        rows.append(replace(row, aside=_remark(writer, quantity, reason)))
        sentences.append(_because(reason, letter))
    rows += [extra.row for extra in further]
    sentences += [_because(extra.reason, extra.symbol) for extra in further]
    among = searched or say("among cyclic momenta and energy")
    listed = say("{name}: {value}", name=among, value=Listed(tuple(sentences), between="; "))
    return section(
        heading,
        Paragraph(say("{text}:", text=opened(listed)), only="document"),
        formulas(rows, result=True),
        *_axes(writer),
        start_sentence(writer, lambda quantity: _symbol(writer, quantity)),
        doubts,
        terse=terse,
        lead=(among,),
        gap=" ",
    )


def _axes(writer: DocumentWriter) -> Iterator[Paragraph]:
    """Say which momenta are angular momenta, a sentence each."""
    for quantity in writer.equations.derivation.conserved:
        sentence = angular_momentum_sentence(writer, quantity, _symbol(writer, quantity))
        if sentence is not None:
            yield replace(sentence, only="document")


def _remark(writer: DocumentWriter, quantity: Conserved, reason: Written) -> Written:
    """Add to a reason about which axis a momentum is the angular momentum, if it is proven."""
    axis = angular_momentum_axis(writer.equations, quantity)
    if axis is None:
        return reason
    remark = say("angular momentum about the {axis} axis", axis=axis)
    return Listed((reason, remark), between="; ")


def _because(reason: Written | str, letter: Label | str) -> Written:
    return say("{reason}, so {symbol} is conserved", reason=reason, symbol=Inline(letter))


def balance(writer: DocumentWriter) -> Section | None:
    """Return the section on an energy that is not conserved: reason, rate, T + V beside h."""
    blocks = [*_balance(writer), *_lost(writer), *_sum(writer)]
    change = writer.equations.derivation.balance
    when = () if change is None or not only_between_impacts(writer.equations) else (_WHEN,)
    return section(say("Energy"), *blocks, lead=when, gap="") if blocks else None


_WHEN = say(" between impacts")


def _lost(writer: DocumentWriter) -> Iterator[Block]:
    """Yield the sentence that says why the energy is not conserved."""
    loss = energy_loss(writer.equations)
    if loss is not None:
        why = loss_line(loss, writer.labels["L"])
        yield Paragraph(say("It is not conserved: {reason}.", reason=why))


def _sum(writer: DocumentWriter) -> Iterator[Block]:
    """Yield T + V as a formula over Jacobi's integral where the two differ."""
    energy, labels = energy_sum(writer.equations), writer.labels
    if energy is None:
        return
    name = labels["T"] + " + " + labels["V"]
    line = sum_line(writer.equations, energy)
    rows = [replace(writer.row(name + " - " + labels["h"], energy.difference), aside=line)]
    if energy.rate is not None:
        rows.append(writer.row(differential(group(name)), energy.rate))
    sentence = say("{name}: {value}", name=Inline(name), value=line)
    yield Paragraph(say("{text}:", text=sentence), only="document")
    yield formulas(rows, result=True)


def _balance(writer: DocumentWriter) -> Iterator[Block]:
    """Return the rate of the energy where that is not conserved."""
    equations, labels = writer.equations, writer.labels
    change = equations.derivation.balance
    if change is None:
        return
    label = labels["E" if change.kind == "energy" else "h"]
    energy = writer.total(label, change.parts or (equations.system.energy,))
    if energy_is_sum(equations, change):
        energy = _brief(energy, label + " = " + labels["T"] + " + " + labels["V"])
    rate = writer.total(differential(label), (change.rate,))
    if change.is_dissipation:
        rate = _brief(rate, differential(label) + " = -2 " + labels["D"])
    sentence: Written = say(
        "Along a motion {energy} changes at the given rate", energy=Inline(label)
    )
    if only_between_impacts(equations):
        sentence = Listed((sentence, _WHEN), between="")
    yield Paragraph(say("{text}:", text=sentence), only="document")
    yield formulas([energy, rate], result=True)


def _named(writer: DocumentWriter, name: str) -> Label:
    """Return the symbol of ``energy`` or of a momentum ``p_NAME``."""
    return writer.labels["E"] if name == "energy" else symbol(name)


def _subject(writer: DocumentWriter, quantity: Conserved) -> Label:
    """Return the coordinate that a momentum is conserved for, or L."""
    named = {c.name: writer.coordinate(c) for c in writer.equations.system.coordinates}
    return named.get(quantity.coordinate or "", writer.labels["L"])


def _symbol(writer: DocumentWriter, quantity: Conserved) -> Label:
    if quantity.kind != "momentum":
        return writer.labels[energy_letter(quantity)]
    for coordinate in writer.equations.system.coordinates:
        if coordinate.name == quantity.coordinate:
            return below("p", writer.coordinate(coordinate))
    return symbol(quantity.name)


def _row(writer: DocumentWriter, quantity: Conserved) -> Formula:
    row = writer.total(_symbol(writer, quantity), quantity.parts or (quantity.expression,))
    if energy_is_sum(writer.equations, quantity):
        labels = writer.labels
        return _brief(row, _symbol(writer, quantity) + " = " + labels["T"] + " + " + labels["V"])
    return row


def _brief(row: Formula, equality: Label) -> Formula:
    """Return a row that begins with an equality, all that a terminal has."""
    return replace(row, label=equality, brief=equality)
