"""Typst: a complete document, or the equations of motion alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import TYPE_CHECKING

from lagrange_cli.notation.layout import width
from lagrange_cli.notation.printers.typst import (
    TypstPrinter,
    typst_name,
    typst_number,
    typst_prose,
    typst_scripted,
    typst_string,
    typst_text,
    typst_unit,
)
from lagrange_cli.notation.symbols import printable
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.letters import Letters
from lagrange_cli.report.phrases.language import Language
from lagrange_cli.report.ranges import typst_ranges
from lagrange_cli.report.writers.typst.typesetter import Typesetter

if TYPE_CHECKING:
    from lagrange_cli.mechanics.families.forms import Range
    from lagrange_cli.report.tree import Document, Section

_PRINTER = TypstPrinter()


class TypstLetters(Letters):
    """Letters of mathematics in Typst."""

    cross_product = " times "
    dot_product = " dot.op "
    virtual_work = "delta W"
    comma = ", quad "
    at_least_sign = ">="
    at_most_sign = "<="
    imaginary = "upright(i)"

    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return typst_name(name, order, latex or self.override(name))

    def vector(self, letter: str, order: int = 0) -> str:
        bold = f"upright(bold({letter}))"
        dots = ["", "dot", "dot.double"][order]
        return f"{dots}({bold})_i" if order else f"{bold}_i"

    def bold(self, letter: str, order: int = 0) -> str:
        dots = ["", "dot", "dot.double"][order]
        known = f"upright(bold({letter}))"
        return f"{dots}({known})" if order else known

    def matrix(self, rows: Sequence[Sequence[str]]) -> str:
        cells = "; ".join(", ".join(row) for row in rows)
        return f"mat({cells})"

    def room(self, node: DisplayNode) -> float:
        return width(_PRINTER.pieces(node))

    def partial(self, symbol: str, by: str) -> str:
        return f"frac(partial {symbol}, partial {by})"

    def bracket(self, first: str, second: str) -> str:
        return f"{{{first}, {second}}}"

    def rate(self, symbol: str) -> str:
        return f"{_PRINTER.ddt} {symbol}"

    def differential(self, symbol: str) -> str:
        return f"frac(upright(d) {symbol}, upright(d) t)"

    def virtual(self, symbol: str) -> str:
        return f"delta {symbol}"

    def square(self, symbol: str) -> str:
        return f"{symbol}^2"

    def routhian(self) -> str:
        return "cal(R)"

    def size(self, symbol: str) -> str:
        return f"abs({symbol})"

    def below(self, letter: str, index: str) -> str:
        return typst_scripted(letter, "_", index)

    def total(self, index: str, body: str) -> str:
        return f"sum_{index} {body}"

    def times(self, first: str, second: str) -> str:
        return f"{first} thin {second}"

    def at_least(self, symbol: str) -> str:
        return f"{symbol} >= 0"

    def named(self, name: str) -> str:
        return typst_string(name)

    def typed(self, text: str) -> str:
        return f"#raw({typst_string(text)})"

    def upright(self, phrase: str) -> str:
        return typst_string(phrase)

    def ranges(self, ranges: Sequence[Range]) -> str:
        return typst_ranges(ranges)

    def formula(self, node: DisplayNode) -> str:
        return _PRINTER.inline(node)

    def number(self, value: float) -> str:
        return typst_number(f"{value:.0e}") if value else "0"

    def inline(self, formula: str) -> str:
        return f"${formula}$"

    def words(self, text: str) -> str:
        return typst_text(text)

    def prose(self, text: str) -> str:
        return typst_prose(text)

    def unit(self, text: str) -> str:
        return self.inline(typst_unit(text)) if text.strip() else ""

    def digits(self, text: str) -> str:
        sign = "-" if text.startswith("-") else ""
        return sign + typst_number(text.removeprefix("-"))


_PREAMBLE = """#set page(paper: "a4", margin: 25mm, numbering: "1")
#set text(font: "New Computer Modern", size: 11pt)
#set par(justify: true)
#set math.equation(number-align: end + bottom)
#show math.equation.where(block: true): set align(start)
#let numbered(body) = { set math.equation(numbering: "(1)"); body }
#let long(body) = { show math.equation: set block(breakable: true); body }
"""


def report_typst(document: Document, say: Language) -> str:
    """Return a document that Typst compiles by itself."""
    setter = Typesetter(Lettering(TypstLetters(document.equations), say), stem=document.name)
    blocks = [_opening(document, setter), *_body(document.sections, setter)]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _body(sections: Sequence[Section], setter: Typesetter) -> Iterator[list[str]]:
    """Typeset sections; the certificate stays on a page with the end of what stands before it."""
    for section, follower in zip_longest(sections, sections[1:]):
        if follower is None or follower.name != "certificate" or not section.blocks:
            yield setter.section(section)
        else:
            *before, last = section.blocks
            begun = setter.section(replace(section, blocks=tuple(before)))
            ended = setter.blocks(replace(section, blocks=(last,)))
            yield [*begun, "#block(sticky: true)[", *ended, "]"]


def _opening(document: Document, setter: Typesetter) -> list[str]:
    lines = [
        f"// {printable(document.name)}: {document.about}, written by lagrange",
        f'{_PREAMBLE}#set text(lang: "{setter.lettering.say.code}")\n',
    ]
    if document.title:
        lines.append(f"#align(center, text(size: 17pt)[{setter.text(document.title)}])")
    if document.description:
        lines += ["", setter.text(document.description)]
    return lines
