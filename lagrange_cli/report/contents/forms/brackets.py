"""The section on Poisson brackets."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.report.inlines import Inline, Label, Listed, bracket, partial, say, symbol
from lagrange_cli.report.tree import Block, Paragraph, Section, formulas

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sympy import Symbol

    from lagrange_cli.mechanics.findings import PoissonBracket, PoissonBrackets
    from lagrange_cli.report.contents.forms.writer import FormWriter


#: Name of Hamilton's function in brackets.
_H = "H"


def bracket_sections(writer: FormWriter) -> list[Section]:
    """Return the section on brackets, if any were asked for.

    ``writer``: with the names of momenta.
    """
    brackets = writer.equations.derivation.brackets
    if brackets is None:
        return []
    writer = writer.naming(quantity_names(brackets))
    rows = [writer.row(_label(writer, b), b.value) for b in brackets.brackets]
    blocks: list[Block] = [formulas(rows, result=True), *_rates(writer, brackets)]
    if brackets.quantities:
        named = [writer.row(writer.formula(q.symbol), q.expression) for q in brackets.quantities]
        blocks += [Paragraph(say("with")), formulas(named, result=True)]
    sentence = say.counted(
        brackets.certificate.points,
        "Compared at {count} state with numerical derivatives, to {digits} digits.",
        "Compared at {count} states with numerical derivatives, to {digits} digits.",
        digits=brackets.certificate.digits,
    )
    return [Section(say("Poisson brackets"), (*blocks, Paragraph(sentence)))]


def _label(writer: FormWriter, pair: PoissonBracket) -> Label:
    return bracket(writer.formula(pair.first), writer.formula(pair.second))


def _rates(writer: FormWriter, brackets: PoissonBrackets) -> Iterator[Block]:
    """Say what brackets with H say of conservation."""
    sentences = []
    for b in brackets.brackets:
        function = writer.formula(b.first)
        if b.conserved:
            rate = Inline(_label(writer, b) + " + " + partial(function, symbol("t")))
            conserved = "{function} is conserved: {rate} vanishes."
            sentences.append(say(conserved, function=Inline(function), rate=rate))
        elif b.conserved is False:
            sentences.append(say("{function} is not conserved.", function=Inline(function)))
        elif b.rate is None and getattr(b.second, "name", "") == f"{_H} ":
            open_rate = "{bracket} is not all of the rate: forces, constraints or inputs add to it."
            sentences.append(say(open_rate, bracket=Inline(_label(writer, b))))
    if sentences:
        yield Paragraph(Listed(tuple(dict.fromkeys(sentences)), " "))


def quantity_names(brackets: PoissonBrackets) -> dict[Symbol, str]:
    """Return symbols that stand for quantities, with their names."""
    symbols = {q.symbol: q.name for q in brackets.quantities}
    for b in brackets.brackets:
        free = b.first.free_symbols | b.second.free_symbols | b.value.free_symbols
        symbols |= {s: s.name.strip() for s in free if s.name.endswith(" ")}
    return symbols
