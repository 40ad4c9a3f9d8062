"""Forces of contacts, and the places at which contacts are lost, for text and documents."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.notation.layout import Piece, columns, joined
from lagrange_cli.notation.page import Block, Row, formula, words
from lagrange_cli.notation.vocabulary import Vocabulary, latex_overrides, with_symbols
from lagrange_cli.report.contents.forms.writer import with_momenta

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.contacts.loss import ContactLoss, ContactLosses
    from lagrange_cli.analysis.contacts.zeros import Zero
    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.report.phrases.language import Language


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


@dataclass(frozen=True)
class LossLines:
    """Says where contacts are lost.

    Attributes
    ----------
    say
        The language.
    shown, number
        Write an expression and a number within a formula.
    inline
        Writes a formula within a sentence.
    reason
        Says a phrase of the analysis.
    """

    say: Language
    shown: Callable[[Expr], str]
    number: Callable[[float], str]
    inline: Callable[[str], str]
    reason: Callable[[str], str]

    def scope(self, losses: ContactLosses) -> str:
        if not losses.contacts:
            return self.say("no contact is closed at the start")
        if losses.are_all:
            return self.say("while the contacts that are closed at the start last")
        return self.say("while the contacts that are closed at the start last, and no other closes")

    def lost(self, loss: ContactLoss, losses: ContactLosses) -> str:
        """Say where one of some contacts is lost, without its name."""
        say = self.say
        is_negative = loss.at_start is not None and loss.at_start < 0
        if is_negative and len(losses.contacts) > 1:
            return say("negative at the start: not all of these contacts last")
        if is_negative:
            return say("negative at the start: the contact is lost at once")
        if loss.reason:
            line = say("lost only where this is 0")
        elif loss.zeros:
            line = self._condition(loss.zeros[0])
            for zero in loss.zeros[1:]:
                line = say("{first} or {second}", first=line, second=self._condition(zero))
            line = say("lost only where {condition}", condition=line)
        else:
            line = say("this vanishes nowhere")
        if loss.jumps:
            line = say("{text}, or where the force jumps", text=line)
        if not loss.reason:
            return line
        return say("{text}; {reason}", text=line, reason=self.reason(loss.reason))

    def _condition(self, zero: Zero) -> str:
        chain = [self.shown(zero.left), self.shown(zero.right)]
        if zero.number is not None and not zero.right.is_Rational:
            chain.append(self.number(zero.number))
        place = self.inline(" = ".join(chain))
        if zero.angle is None:
            return place
        angle = self.inline(" = ".join(map(self.shown, zero.angle)))
        return self.say("{first}, that is {second}", first=place, second=angle)

    def constants(self, losses: ContactLosses) -> Iterator[str]:
        """Yield the sentence on constants of the start, if there are some."""
        values = ", ".join(
            self.inline(f"{self.shown(c.symbol)} = {self.number(c.value)}")
            for c in losses.constants
        )
        if values:
            yield self.say("with {values} from the start", values=values)


def contact_rows(
    losses: ContactLosses | None,
    say: Language,
    pieces: Callable[[Expr], list[Piece]],
    reason: Callable[[str], str],
) -> list[Row | Block]:
    """Write forces of contacts as text, and where these vanish, if there are some."""
    if losses is None:
        return []
    lines = LossLines(say, lambda e: joined(pieces(e)), "{:.6g}".format, str, reason)
    rows = [Row(say("Loss of contact"), "   ", words(lines.scope(losses)), "heading")]
    for loss in losses.contacts:
        label = f"  {lines.shown(loss.multiplier)}"
        rows.append(formula(label, " = ", pieces(loss.force)))
        rows.append(Row("", " " * (columns(label) + 3), words(lines.lost(loss, losses))))
    return [*rows, *(Row("", "  ", words(line)) for line in lines.constants(losses))]
