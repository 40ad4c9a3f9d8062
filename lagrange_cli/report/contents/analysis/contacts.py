"""The section on forces of contacts, and on the places at which contacts are lost."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.notation.vocabulary import Vocabulary, latex_overrides, with_symbols
from lagrange_cli.report.contents.analysis.wording import inlined, sentence
from lagrange_cli.report.contents.forms.writer import with_momenta
from lagrange_cli.report.contents.numbers import phrased
from lagrange_cli.report.inlines import (
    Inline,
    Label,
    Sentence,
    Written,
    joined,
    numeral,
    opened,
    say,
)
from lagrange_cli.report.tree import Formula, Labelled, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.analysis.contacts.loss import ContactLoss, ContactLosses
    from lagrange_cli.analysis.contacts.zeros import Zero
    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.report.contents.derivation.writer import DocumentWriter


def with_results(analysis: Analysis, letters: Vocabulary) -> Vocabulary:
    """Add the symbols that an analysis brings in: momenta, constants of the start, outputs."""
    if analysis.steady is not None:
        letters = with_momenta(letters, analysis.steady.momenta)
    losses = analysis.contacts
    if losses is None:
        return letters
    latex = {f"{n}_0": f"{{{x}}}_0" for n, x in latex_overrides(analysis.equations).items()}
    symbols = (*(c.symbol for c in losses.constants), *losses.angles)
    return with_symbols(letters, [(s, s.name, latex.get(s.name)) for s in symbols])


def contacts_section(losses: ContactLosses | None, writer: DocumentWriter) -> Section | None:
    """Return forces of contacts, and where these vanish, if there are some."""
    if losses is None:
        return None
    rows = [
        Formula(writer.formula(loss.multiplier), (writer.tree(loss.force),))
        for loss in losses.contacts
    ]
    lost = [
        (Inline(writer.formula(loss.multiplier)), _lost(loss, losses, writer))
        for loss in losses.contacts
    ]
    scope = say("{text}:" if rows else "{text}.", text=opened(_scope(losses)))
    start = inlined(writer.formula(c.symbol) + " = " + numeral(c.value) for c in losses.constants)
    return section(
        say("Loss of contact"),
        Paragraph(scope),
        formulas(rows, result=True),
        Labelled(tuple(lost)) if lost else None,
        sentence(say("with {values} from the start", values=start)) if lost and start else None,
    )


def _scope(losses: ContactLosses) -> Sentence:
    if not losses.contacts:
        return say("no contact is closed at the start")
    if losses.are_all:
        return say("while the contacts that are closed at the start last")
    return say("while the contacts that are closed at the start last, and no other closes")


def _lost(loss: ContactLoss, losses: ContactLosses, writer: DocumentWriter) -> Sentence:
    """Say where one of some contacts is lost, without its name."""
    is_negative = loss.at_start is not None and loss.at_start < 0
    if is_negative and len(losses.contacts) > 1:
        return say("negative at the start: not all of these contacts last")
    if is_negative:
        return say("negative at the start: the contact is lost at once")
    if loss.reason:
        line = say("lost only where this is 0")
    elif loss.zeros:
        condition, *others = (_condition(zero, writer) for zero in loss.zeros)
        for alternative in others:
            condition = say("{first} or {second}", first=condition, second=alternative)
        line = say("lost only where {condition}", condition=condition)
    else:
        line = say("this vanishes nowhere")
    if loss.jumps:
        line = say("{text}, or where the force jumps", text=line)
    if not loss.reason:
        return line
    return say("{text}; {reason}", text=line, reason=phrased(loss.reason))


def _condition(zero: Zero, writer: DocumentWriter) -> Written:
    chain: list[Label] = [writer.formula(side) for side in (zero.left, zero.right)]
    if zero.number is not None and not zero.right.is_Rational:
        chain.append(numeral(zero.number))
    place = Inline(joined(" = ", chain))
    if zero.angle is None:
        return place
    angle = Inline(joined(" = ", (writer.formula(side) for side in zero.angle)))
    return say("{first}, that is {second}", first=place, second=angle)
