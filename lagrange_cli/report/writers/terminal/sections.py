"""Sections of a board as rows of text, in Unicode or plain ASCII."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from unicodedata import combining

from lagrange_cli.errors import escape_controls
from lagrange_cli.notation.layout import Piece, columns, deeper, suffixed
from lagrange_cli.notation.page import USUAL_WIDTH, Page, Row, formula, page, words
from lagrange_cli.notation.page import Block as PageBlock
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.symbols import text_prose
from lagrange_cli.report import tree
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.phrases.language import Language
from lagrange_cli.report.tables import TableColumn, labelled, sentence_row, table
from lagrange_cli.report.writers.fitting import Fitting
from lagrange_cli.report.writers.terminal.letters import AsciiLetters, UnicodeLetters

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Columns before paragraphs, and before laws and labels.
_WORDS_INDENT, _FORMULA_INDENT = 2, 4

#: Labels that are longer are not aligned with the others.
_LONGEST_LABEL = 24


def report_page(document: tree.Document, say: Language, *, ascii: bool = False) -> Page:
    """Return a document as a page, its sections set apart."""
    printer = ScenePrinter() if ascii else UnicodePrinter()
    letters = AsciiLetters() if ascii else UnicodeLetters()
    writer = SectionRows(Lettering(letters, say.in_ascii() if ascii else say), printer)
    title = tree.Section("", (tree.Paragraph(document.title, "heading"),) if document.title else ())
    return page(map(writer.section, (title, *document.sections)), ascii=ascii)


@dataclass(frozen=True)
class SectionRows:
    """Writes sections of a tree as rows.

    Attributes
    ----------
    lettering
        Letters and language.
    printer
        Prints expressions.
    margin
        Columns before formulas.
    """

    lettering: Lettering
    printer: OneLinePrinter
    margin: int = _FORMULA_INDENT

    def section(self, section: tree.Section) -> list[Row | PageBlock]:
        """Return the rows of a section, its heading first; formulas are indented."""
        heading = self.lettering.text(section.heading)
        if not heading:
            return [row for block in section.blocks for row in self._block(block)]
        rows: list[Row | PageBlock] = [Row(heading, role="heading")]
        for block in section.blocks:
            # Labels below a heading are no headings.
            if isinstance(block, tree.Labelled):
                pairs = (map(self.lettering.text, pair) for pair in block.rows)
                rows += labelled(*((label, text) for label, text in pairs), indent=_WORDS_INDENT)
            else:
                rows += self._block(block)
        return rows

    def _block(self, block: tree.Block) -> Sequence[Row | PageBlock]:
        text = self.lettering.text
        match block:
            case tree.Formulas(rows):
                return self._aligned(list(self.fitting.each(rows)))
            case tree.Paragraph(shown, role) if role:
                return [sentence_row(text(shown), role)]
            case tree.Paragraph(shown) | tree.Title(shown):
                return [Row("", " " * min(self.margin, _WORDS_INDENT), words(text(shown)))]
            case tree.Law(shown):
                return [Row("", " " * _FORMULA_INDENT, words(text(shown)))]
            case tree.Table():
                return self._table(block)
            case tree.Bullets(items, counted):
                signs = (f"{k}." if counted else "-" for k, _ in enumerate(items, 1))
                return [
                    Row("", f"  {sign} ", words(text(item)))
                    for sign, item in zip(signs, items, strict=True)
                ]
            case tree.Labelled(pairs):
                return self._labelled([(text(label), text(shown)) for label, shown in pairs])
            case tree.Statements(statements):
                return self._statements(statements)
            case tree.Packed():
                return [self._packed(block)]
            case tree.Verbatim(lines):
                return [Row("", line) for line in lines]
            case tree.Picture():
                return []
            case tree.Passage() | tree.Cases() | tree.Matrices():
                return [row for one in self.fitting.blocks([block]) for row in self._block(one)]

    @property
    def fitting(self) -> Fitting:
        """Return what chooses the forms of blocks that fit a line."""
        return Fitting(self.lettering, USUAL_WIDTH)

    def _labelled(self, pairs: Sequence[tuple[str, str]]) -> list[Row]:
        return labelled(*pairs)

    def _statements(self, rows: Sequence[tree.StatementRow]) -> list[Row]:
        """Return equations behind their names, broken before signs, and the remarks on them."""
        names = [self.lettering.text(row.name) for row in rows]
        return [
            Row(f"  {name}", lead, tuple(self._statement(row)), "name")
            for name, lead, row in zip(names, leads_after(names), rows, strict=True)
        ]

    def _statement(self, row: tree.StatementRow) -> Iterator[Piece]:
        text = self.lettering.text
        shown = [(text(equation), text(spans)) for equation, spans in row.equations]
        for number, (equation, spans) in enumerate(shown):
            end = "" if number == len(shown) - 1 else ","
            pieces = list(equation_pieces(equation + ("," if spans else end)))
            yield from pieces if number else without_separator(pieces)
            if spans:
                yield Piece(spans + end, columns(spans + end) + 1, " ", "  ", 0)
        yield from remark_pieces(text(row.remark))

    def _packed(self, block: tree.Packed) -> PageBlock:
        text = self.lettering.text
        *items, last = map(text, block.items)
        head = Row(
            text(block.heading), "   ", words([f"{item}," for item in items] + [last]), "heading"
        )
        return PageBlock((head, *map(self._short, block.rows)), "packed")

    def _short(self, row: tree.Formula) -> Row:
        """Return a label and what it equals, as short as it can be."""
        bodies = [self.printer.pieces(self.lettering.node(node)) for node in row.chain]
        label, spans = self.lettering.text(row.label), self.lettering.text(row.ranges)
        return formula(f"  {label}", " = ", self._ranged(bodies[0], spans), "")

    def _ranged(self, pieces: list[Piece], spans: str) -> list[Piece]:
        """Return a formula with the values of its indices behind it."""
        if not spans:
            return pieces
        return [*suffixed(pieces, ",", 1), Piece(spans, columns(spans) + 1, " ", "", 0)]

    def _table(self, block: tree.Table) -> list[Row]:
        """Return a table whose columns are as wide as their cells; sentences stand last."""
        text, prose = self.lettering.text, block.prose or None
        order = sorted(range(len(block.heads)), key=lambda k: block.heads[k] == prose)
        heads = [block.heads[k] for k in order]
        columns = [
            TableColumn(text(head), least=block.digits, align=">")
            if head in block.numeric
            else TableColumn(text(head))
            for head in heads
        ]
        return table(columns, [[text(row[k]) for k in order] for row in block.rows])

    def _aligned(self, rows: Sequence[tree.Formula]) -> Sequence[Row | PageBlock]:
        """Return rows with their first signs of equality below each other."""
        widths = [columns(self.lettering.text(row.label)) for row in rows]
        aligned = max((w for w in widths if w <= _LONGEST_LABEL), default=0)
        indents = [self.margin + (max(0, aligned - width) if width else 0) for width in widths]
        return [self._row(row, " " * n) for row, n in zip(rows, indents, strict=True)]

    def _row(self, row: tree.Formula, indent: str) -> Row:
        """A label and what it equals one after the other; a line ends at signs of equality."""
        bodies = [self.printer.pieces(self.lettering.node(node)) for node in row.chain]
        label, name, middle = map(self.lettering.text, (row.label, row.name, row.middle))
        if not label:
            shown = suffixed(bodies[0], " = 0", 4)
            if name:
                return formula(f"{indent}{name}", "   ", shown)
            return formula("", indent, shown, "")
        pieces = equated(bodies)
        if middle:
            pieces = [*equated([[Piece(middle, columns(middle))]]), *pieces]
        # Signs of equality stand below each other, one column after the label's last letter.
        label = indent + label
        place = max(k for k, c in enumerate(label) if not combining(c))
        first = pieces[0]
        width = first.width + columns(label[place:])
        text = f"{label[place:]} = {first.text}"
        pieces[0] = replace(first, text=text, width=width, separator="")
        return formula("", label[:place], pieces, "")


@dataclass(frozen=True)
class TerseRows(SectionRows):
    """Writes sections as tersely as a terminal has them.

    Names of formulas stand before them, remarks behind them; a general formula stands in place of
    the expression that it equals.
    """

    margin: int = 2

    def section(self, section: tree.Section) -> list[Row | PageBlock]:
        text = self.lettering.text
        if section.margin is not None:
            rows = SectionRows(self.lettering, self.printer, section.margin)
            return rows.section(section)
        if section.terse is None:
            whole = replace(self, margin=0)
            return [row for block in section.blocks for row in whole._block(block)]
        *items, last = map(text, section.lead or ("",))
        # One text is broken between words, several between each other.
        lead = words([f"{item}," for item in items] + [last]) if items else words(last)
        heading = Row(
            text(section.terse or section.heading), section.gap if lead else "", lead, "heading"
        )
        return [heading, *(row for block in section.blocks for row in self._block(block))]

    def _aligned(self, rows: Sequence[tree.Formula]) -> list[Row | PageBlock]:
        names = [self.lettering.text(row.name) for row in rows]
        shown: list[Row | PageBlock] = []
        before = ""
        for row, name, lead in zip(rows, names, leads_after(names), strict=True):
            opening = " " * columns(name) if name == before else name
            shown.append(self._terse(row, opening, lead if name else ""))
            before = name
        if self.margin and any(row.aside for row in rows) and not any(names):
            return [PageBlock(tuple(row for row in shown if isinstance(row, Row)), "asides")]
        return shown

    def _labelled(self, pairs: Sequence[tuple[str, str]]) -> list[Row]:
        leads = leads_after([label for label, _ in pairs])
        return [
            Row(label, lead, words(text), "heading")
            for (label, text), lead in zip(pairs, leads, strict=True)
        ]

    def _terse(self, row: tree.Formula, name: str, lead: str) -> Row:
        text = self.lettering.text
        bodies = [self.printer.pieces(self.lettering.node(node)) for node in row.chain]
        label, middle, aside = map(text, (row.label, row.middle, row.aside))
        if row.brief:
            label, _, middle = text(row.brief).partition(" = ")
        begin = f"{' ' * self.margin}{name}{lead}"
        if not label:
            ends = f" {self.printer.at_least} 0" if row.multiplier else " = 0"
            left = bodies[0] if len(bodies) == 2 else suffixed(bodies[0], ends, columns(ends))
            right = equated(bodies[1:])
            pieces = self._ranged([*left, *right], text(row.ranges))
            return named_row(begin, "", pieces, aside)
        body = bodies[0] if bodies and not middle else list(words(middle))
        equals, shown = " = " if body else "", self._ranged(body, text(row.ranges))
        if not name:
            return named_row(begin + label, equals, shown, aside)
        return named_row(begin, label + equals, shown, aside)


def named_row(begin: str, lead: str, pieces: Sequence[Piece], aside: str) -> Row:
    """Return a row whose beginning has the look of a name, without the blanks behind it."""
    name = begin.rstrip()
    return formula(name, begin[len(name) :] + lead, pieces, aside=aside)


def equated(sides: Sequence[list[Piece]]) -> list[Piece]:
    """Return sides of a formula with a sign of equality before each, at which a line may end."""
    pieces = []
    for first, *others in (deeper(side, 2) for side in sides):
        head = replace(first, separator=" = ", lead="= ", depth=0, width=first.width + 3)
        pieces += [head, *others]
    return pieces


def leads_after(names: Sequence[str]) -> list[str]:
    """Return blanks after names, up to the column after the longest one."""
    width = max(map(columns, names), default=0)
    return [" " * (width - columns(name) + 3) for name in names]


def equation_pieces(text: str) -> Iterator[Piece]:
    """Break an equation as the scene has it before signs, where it does not fit on a line."""
    depth = 0
    for index, part in enumerate(re.split(r" (?=[-+=<>]=? )", text)):
        lead, level = ("  ", 1 + depth) if index else ("", 0)
        yield Piece(part, columns(part) + 1, " ", lead, level)
        depth += part.count("(") - part.count(")")


def remark_pieces(remark: str) -> Sequence[Piece]:
    """Return a remark in parentheses, broken between words where it does not fit on a line."""
    if not remark:
        return ()
    first, *others = words(f"({remark})")
    opening = replace(first, width=first.width + 2, separator="   ", lead="  ")
    return [opening, *(replace(p, lead="   ") for p in deeper(others))]


def without_separator(pieces: Iterable[Piece]) -> list[Piece]:
    """Return pieces of which the first one follows its lead at once."""
    first, *others = pieces
    return [replace(first, separator="", width=first.width - len(first.separator)), *others]


def title_row(equations: Equations, *, ascii: bool) -> Row:
    """Return the name and the title of the scene, whose formulas are in plain letters."""
    name, title = escape_controls(equations.presentation.name), equations.presentation.title
    if not title:
        return Row(name, role="heading")
    return Row(name, ": ", words(escape_controls(title if ascii else text_prose(title))), "heading")
