"""The section on Poisson brackets."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
        named = [
            writer.row(writer.letters.formula(writer.tree(q.symbol)), q.expression)
            for q in brackets.quantities
        ]
        blocks += [Paragraph(writer.say("with")), formulas(named, result=True)]
    sentence = writer.say.counted(
        brackets.certificate.points,
        "Compared at {count} state with numerical derivatives, to {digits} digits.",
        "Compared at {count} states with numerical derivatives, to {digits} digits.",
        digits=brackets.certificate.digits,
    )
    return [Section(writer.say("Poisson brackets"), (*blocks, Paragraph(sentence)))]


def _label(writer: FormWriter, bracket: PoissonBracket) -> str:
    sides = (writer.letters.formula(writer.tree(e)) for e in (bracket.first, bracket.second))
    return writer.letters.bracket(*sides)


def _rates(writer: FormWriter, brackets: PoissonBrackets) -> Iterator[Block]:
    """Say what brackets with H say of conservation."""
    letters, time = writer.letters, writer.letters.symbol("t")
    sentences = []
    for b in brackets.brackets:
        function = letters.formula(writer.tree(b.first))
        said = {
            "function": letters.inline(function),
            "rate": letters.inline(f"{_label(writer, b)} + {letters.partial(function, time)}"),
        }
        if b.conserved:
            sentences.append(writer.say("{function} is conserved: {rate} vanishes.", **said))
        elif b.conserved is False:
            sentences.append(writer.say("{function} is not conserved.", **said))
        elif b.rate is None and getattr(b.second, "name", "") == f"{_H} ":
            bracket = letters.inline(_label(writer, b))
            open_rate = "{bracket} is not all of the rate: forces, constraints or inputs add to it."
            sentences.append(writer.say(open_rate, bracket=bracket))
    words = writer.paragraph(*dict.fromkeys(sentences))
    if words is not None:
        yield words


def quantity_names(brackets: PoissonBrackets) -> dict[Symbol, str]:
    """Return symbols that stand for quantities, with their names."""
    symbols = {q.symbol: q.name for q in brackets.quantities}
    for b in brackets.brackets:
        free = b.first.free_symbols | b.second.free_symbols | b.value.free_symbols
        symbols |= {s: s.name.strip() for s in free if s.name.endswith(" ")}
    return symbols
