"""HTML: a whole page with formulas in MathML, without scripts and without other files.

The markup is that of XML too, so that any reader of either takes it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, assert_never

from lagrange_cli.latex_allowlist import with_formulas
from lagrange_cli.notation.layout import Piece, break_lines, width
from lagrange_cli.notation.printers.mathml import (
    MathmlPrinter,
    mathml,
    mathml_name,
    mathml_number,
    mathml_of_latex,
    mathml_row,
    mathml_scripted,
    mathml_signs,
    mathml_space,
    mathml_table,
    mathml_text,
    mathml_unit,
)
from lagrange_cli.notation.symbols import printable, text_prose
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.pictures.sketch.svg import emit_svg
from lagrange_cli.report import tree
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.letters import Letters
from lagrange_cli.report.phrases.language import Language
from lagrange_cli.report.ranges import grouped_ranges
from lagrange_cli.report.writers.rows import FILLED, FormulaRow, RowSetter
from lagrange_cli.report.writers.terminal.letters import UnicodeLetters

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.forms import Range

_PRINTER = MathmlPrinter()


class HtmlLetters(Letters):
    """Letters of mathematics in MathML, and of words in HTML."""

    cross_product = "<mo>×</mo>"
    dot_product = "<mo>⋅</mo>"
    virtual_work = "<mrow><mi>δ</mi><mi>W</mi></mrow>"
    comma = f"<mo>,</mo>{mathml_space(1)}"
    imaginary = '<mi mathvariant="normal">i</mi>'
    minus = MathmlPrinter.negation

    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return mathml_name(name, order, latex or self.override(name))

    def vector(self, letter: str, order: int = 0) -> str:
        return mathml_scripted(self.bold(letter, order), "<mi>i</mi>")

    def bold(self, letter: str, order: int = 0) -> str:
        known = rf"\boldsymbol{{\{letter}}}" if len(letter) > 1 else rf"\mathbf{{{letter}}}"
        dots = ["", r"\dot", r"\ddot"][order]
        return mathml_of_latex(f"{dots}{{{known}}}" if order else known)

    def matrix(self, rows: Sequence[Sequence[str]]) -> str:
        cells = [list(map(mathml_signs, row)) for row in rows]
        return _PRINTER.fenced(mathml_table(cells, ["center"] * len(cells[0])))

    def room(self, node: DisplayNode) -> float:
        return width(_PRINTER.pieces(node))

    def partial(self, symbol: str, by: str) -> str:
        return _ratio(f"<mi>∂</mi>{symbol}", f"<mi>∂</mi>{by}")

    def bracket(self, first: str, second: str) -> str:
        return mathml_row(f"<mo>{{</mo>{mathml_signs(f'{first}, {second}')}<mo>}}</mo>")

    def rate(self, symbol: str) -> str:
        return _PRINTER.ddt + mathml_space(0.167) + symbol

    def differential(self, symbol: str) -> str:
        upright = '<mi mathvariant="normal">d</mi>'
        return _ratio(upright + symbol, f"{upright}<mi>t</mi>")

    def virtual(self, symbol: str) -> str:
        return mathml_row(mathml_signs(f"<mi>δ</mi>{symbol}"))

    def square(self, symbol: str) -> str:
        return _PRINTER.superscript(mathml_row(mathml_signs(symbol)), "<mn>2</mn>")

    def routhian(self) -> str:
        return mathml_of_latex(r"\mathcal{R}")

    def size(self, symbol: str) -> str:
        return _PRINTER.magnitude(mathml_signs(symbol))

    def below(self, letter: str, index: str) -> str:
        return mathml_scripted(mathml_row(mathml_signs(letter)), mathml_signs(index))

    def total(self, index: str, body: str) -> str:
        return _PRINTER.big_sum(index, "") + body

    def times(self, first: str, second: str) -> str:
        return f"{first}{_PRINTER.thin}{second}"

    def at_least(self, symbol: str) -> str:
        return f"{symbol} ≥ 0"

    def named(self, name: str) -> str:
        return mathml_text(name)

    def upright(self, phrase: str) -> str:
        return f"<mtext>{phrase}</mtext>"

    def ranges(self, ranges: Sequence[Range]) -> str:
        spans = (
            mathml_signs(f"{', '.join(letters)} = {first}, …, {last}")
            for letters, first, last in grouped_ranges(ranges)
        )
        return f"<mo>,</mo>{mathml_space(0.333)}".join(spans)

    def formula(self, node: DisplayNode) -> str:
        return _PRINTER.inline(node)

    def number(self, value: float) -> str:
        return mathml_number(f"{value:.0e}") if value else "<mn>0</mn>"

    def digits(self, text: str) -> str:
        sign = self.minus if text.startswith("-") else ""
        return sign + mathml_number(text.removeprefix("-"))

    def inline(self, formula: str) -> str:
        return mathml(mathml_signs(formula))

    def words(self, text: str) -> str:
        return escape(printable(text), quote=False)

    def prose(self, text: str) -> str:
        return with_formulas(text, self.words, lambda formula: mathml(mathml_of_latex(formula)))

    def typed(self, text: str) -> str:
        return f"<code>{self.words(text)}</code>"

    def unit(self, text: str) -> str:
        return mathml(mathml_unit(text)) if text.strip() else ""


def _ratio(above: str, below: str) -> str:
    return _PRINTER.ratio(mathml_signs(above), mathml_signs(below))


@dataclass(frozen=True)
class HtmlSetter(RowSetter):
    """Writes sections in HTML.

    Attributes
    ----------
    equations
        What the sketch is of.
    ids
        Part of the document → how many of its sections have an identifier.
    counts
        Part of the document → how many of its formulas have a number.
    """

    equations: Equations | None = None
    ids: dict[str, int] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)

    colon = f"<mo>:</mo>{mathml_space(1)}"
    wide = mathml_space(1)
    at_least = "≥"
    at_most = "≤"
    complementary = "⊥"

    @cached_property
    def printer(self) -> MathmlPrinter:
        return _PRINTER

    def room(self, formula: str) -> float:
        return self.printer.columns(mathml_signs(formula))

    def section(self, section: tree.Section) -> Iterator[str]:
        """Yield the lines of a section, its heading first."""
        count = self.ids[section.name] = self.ids.get(section.name, 0) + 1
        number = f"-{count}" if count > 1 else ""
        yield f'<section id="{section.name}{number}">' if section.name else "<section>"
        if heading := self.text(section.heading):
            yield f"<h2>{heading}</h2>"
        for block in self.fitted(section):
            yield from self._block(block, section.name)
        yield "</section>"

    def _block(self, block: tree.PlainBlock, part: str) -> Iterator[str]:
        match block:
            case tree.Paragraph(text):
                yield f"<p>{self.text(text)}</p>"
            case tree.Title(text):
                yield f'<p class="subject">{self.text(text)}</p>'
            case tree.Law(text):
                yield _display([[line] for line in self._law(self.text(text))], ("left",), "law")
            case tree.Formulas(_, result):
                yield self._numbered(self.rows(block), part if result else "")
            case tree.Table():
                yield from self._table(block)
            case tree.Bullets(items, counted):
                yield "<ol>" if counted else "<ul>"
                yield from (f"<li>{self.text(item)}</li>" for item in items)
                yield "</ol>" if counted else "</ul>"
            case tree.Labelled(rows):
                yield "<dl>"
                yield from (f"<dt>{self.text(a)}</dt><dd>{self.text(b)}</dd>" for a, b in rows)
                yield "</dl>"
            case tree.Verbatim(lines):
                yield f"<pre>{escape(chr(10).join(lines), quote=False)}</pre>"
            case tree.Picture():
                assert self.equations is not None
                (sketch,) = emit_svg(self.equations, {}).values()
                yield f"<figure>\n{sketch}</figure>"
            case _:
                assert_never(block)

    def _law(self, text: str) -> Iterator[str]:
        """Yield the lines of a general formula."""
        pieces = list(self._pieces(text))
        for line in break_lines(pieces, FILLED * self.columns, FILLED * self.columns):
            yield mathml_signs(line.text)

    def _pieces(self, text: str) -> Iterator[Piece]:
        first, *others = text.split(" + ")
        yield Piece(first, self.room(first))
        for part in others:
            yield Piece(part, self.room(part) + 3, " + ", "+ ", 0)

    def _numbered(self, rows: Sequence[FormulaRow], part: str) -> str:
        """Return formulas below each other, aligned after their labels.

        ``part``: that of the document whose results they are, which have numbers; empty for none.
        """
        available = self.available([row.label for row in rows])
        cells: list[list[str]] = []
        for row in rows:
            first, *others = break_lines(row.pieces, available, available - 4, step=2)
            cells.append([mathml_signs(row.label), mathml_signs(first.text), ""])
            for line in others:
                indent = mathml_space(1.5 + 0.8 * line.level)
                cells.append(["", indent + mathml_signs(line.text), ""])
            if part and row.ends:
                cells[-1][-1] = self._number(part)
        if part:
            return _display(cells, ("right", "left", "right"), "results")
        return _display([row[:2] for row in cells], ("right", "left"), "working")

    def _number(self, part: str) -> str:
        number = self.counts[part] = self.counts.get(part, 0) + 1
        return f'<mtext id="eq-{part}-{number}">({sum(self.counts.values())})</mtext>'

    def _table(self, table: tree.Table) -> Iterator[str]:
        names = dict.fromkeys(table.numeric, "number") | {table.prose: "prose"}
        kinds = [f' class="{names[head]}"' if head in names else "" for head in table.heads]
        heads = zip(kinds, map(self.text, table.heads), strict=True)
        yield '<div class="table"><table>'
        shown = "".join(f'<th scope="col"{kind}>{head}</th>' for kind, head in heads)
        yield f"<thead><tr>{shown}</tr></thead>"
        yield "<tbody>"
        for row in table.rows:
            cells = zip(kinds, map(self.text, row), strict=True)
            yield f"<tr>{''.join(f'<td{kind}>{cell}</td>' for kind, cell in cells)}</tr>"
        yield "</tbody>"
        yield "</table></div>"


def _display(rows: Sequence[Sequence[str]], sides: Sequence[str], kind: str) -> str:
    """Return a table of formulas on lines of its own, which scrolls where it is too wide."""
    shown = mathml(mathml_table(rows, sides), block=True)
    return f'<div class="display {kind}">{shown}</div>'


STYLE = """\
:root { color-scheme: light dark; --ink: #1b1b1b; --paper: #fff; --line: #999; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e4e4; --paper: #17181b; --line: #777; }
  figure svg { filter: invert(0.9); }
}
body {
  margin: 0 auto; padding: 1rem 1rem 4rem; max-width: 43rem;
  color: var(--ink); background: var(--paper);
  font: 1rem/1.55 "Latin Modern Roman", "STIX Two Text", Georgia, Cambria, serif;
}
h1 { font-size: 1.7rem; font-weight: normal; line-height: 1.2; text-align: center; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 0.6rem; }
p, ul, dl, .display, .table { margin: 0.6rem 0; }
.subject { margin-top: 1.2rem; font-style: italic; }
.display, .table { overflow-x: auto; overflow-y: hidden; }
.display { padding-left: 2rem; }
.display math { width: fit-content; }
math { font-family: "Latin Modern Math", "STIX Two Math", "Cambria Math", math; }
mover[accent="true"] > mo:nth-child(2) { transform: translateY(-0.2ex); }
.display > math > mtable > mtr > mtd { padding: 0.3em 0; }
.results > math, .results > math > mtable { width: 100%; }
.results > math > mtable > mtr > mtd:nth-child(2) { width: 100%; }
.results > math > mtable > mtr > mtd:nth-child(3) { padding-left: 1.5em; }
table { border-collapse: collapse; border: solid var(--line); border-width: 1px 0; }
.table { position: relative; left: 50%; transform: translateX(-50%); }
.table { width: max-content; min-width: 100%; max-width: calc(100vw - 2rem); }
th { text-align: left; border-bottom: 1px solid var(--line); }
.number { text-align: right; }
dt { font-weight: bold; }
pre { overflow-x: auto; line-height: 1.2; }
th, td { padding: 0.15rem 1.2rem 0.15rem 0; vertical-align: baseline; }
td:not(.prose) { white-space: nowrap; }
figure { margin: 1rem 0; text-align: center; }
figure svg { max-width: 100%; height: auto; }
@media (max-width: 43rem) {
  .display { padding-left: 0; font-size: 0.9rem; }
}
@page { margin: 20mm; }
@media print {
  body { max-width: none; padding: 0; font-size: 11pt; }
  h1, h2, .subject, .law { break-after: avoid; }
  .display, .table { overflow: visible; }
  .table { left: 0; transform: none; max-width: none; font-size: 9pt; }
  tr, mtr, figure { break-inside: avoid; }
}
"""


def report_html(document: tree.Document, say: Language) -> str:
    """Return a whole page."""
    # The title of a window is text without formulas.
    title = text_prose(Lettering(UnicodeLetters(), say).text(document.title or document.name))
    head = _head(_setter(document, say).lettering.letters.words(title), say.code)
    lines = [*head, "<body>", "<main>", body_html(document, say), "</main>", "</body>", "</html>"]
    return "\n".join(lines) + "\n"


def body_html(document: tree.Document, say: Language) -> str:
    """Return what a page holds, as part of another page."""
    setter = _setter(document, say)
    title, description = setter.text(document.title), setter.text(document.description)
    lines = [
        *([f"<h1>{title}</h1>"] if title else []),
        *([f"<p>{description}</p>"] if description else []),
        *(line for section in document.sections for line in setter.section(section)),
    ]
    return "\n".join(lines)


def _setter(document: tree.Document, say: Language) -> HtmlSetter:
    lettering = Lettering(HtmlLetters(document.equations), say)
    return HtmlSetter(lettering, equations=document.equations)


def _head(title: str, code: str) -> Iterator[str]:
    yield "<!DOCTYPE html>"
    yield f'<html xmlns="http://www.w3.org/1999/xhtml" lang="{code}" xml:lang="{code}">'
    yield "<head>"
    yield '<meta charset="utf-8"/>'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1"/>'
    yield '<meta name="generator" content="lagrange"/>'
    yield f"<title>{title}</title>"
    yield f"<style>\n{STYLE}</style>"
    yield "</head>"
