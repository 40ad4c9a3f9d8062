"""Sections of a board as rows of text, in Unicode or plain ASCII."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from unicodedata import combining

from lagrange_cli.notation.layout import Piece, columns, deeper, suffixed
from lagrange_cli.notation.page import Row, formula, words
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.report.contents.steps.board import Sections
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.tables import TableColumn, labelled, table
from lagrange_cli.report.tree import (
    Block,
    Bullets,
    Formula,
    Formulas,
    Labelled,
    Law,
    Paragraph,
    Picture,
    Section,
    Table,
    Title,
    Verbatim,
)

#: Columns before paragraphs, and before laws and labels.
_WORDS_INDENT, _FORMULA_INDENT = 2, 4

#: Labels that are longer are not aligned with the others.
_LONGEST_LABEL = 24


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

    def each(self, sections: Sections) -> Iterator[tuple[str, Callable[[], list[Row]]]]:
        """Yield the parts of each section with a function that writes its rows."""
        return ((parts, partial(self._written, write)) for parts, write in sections)

    def _written(self, write: Callable[[], Section | None]) -> list[Row]:
        section = write()
        return [] if section is None else self.section(section)

    def section(self, section: Section) -> list[Row]:
        """Return the rows of a section, its heading first; formulas are indented."""
        body = [row for block in section.blocks for row in self._block(block)]
        return [Row(self.lettering.text(section.heading), role="heading"), *body]

    def _block(self, block: Block) -> list[Row]:
        text = self.lettering.text
        match block:
            case Formulas(rows):
                return self._aligned(rows)
            case Paragraph(shown) | Title(shown):
                return [Row("", " " * _WORDS_INDENT, words(text(shown)))]
            case Law(shown):
                return [Row("", " " * _FORMULA_INDENT, words(text(shown)))]
            case Table():
                return self._table(block)
            case Bullets(items):
                return [Row("", "  - ", words(text(item))) for item in items]
            case Labelled(pairs):
                return labelled(*((text(label), text(shown)) for label, shown in pairs))
            case Verbatim(lines):
                return [Row("", line) for line in lines]
            case Picture():
                return []

    def _table(self, block: Table) -> list[Row]:
        """Return a table whose columns are as wide as their cells."""
        text = self.lettering.text
        columns = [
            TableColumn(text(head), align=">" if head in block.numeric else "<")
            for head in block.heads
        ]
        return table(columns, [list(map(text, row)) for row in block.rows])

    def _aligned(self, rows: Sequence[Formula]) -> list[Row]:
        """Return rows with their first signs of equality below each other."""
        widths = [columns(self.lettering.text(row.label)) for row in rows]
        aligned = max((w for w in widths if w <= _LONGEST_LABEL), default=0)
        indents = [self.margin + (max(0, aligned - width) if width else 0) for width in widths]
        return [self._row(row, " " * n) for row, n in zip(rows, indents, strict=True)]

    def _row(self, row: Formula, indent: str) -> Row:
        """A label and what it equals one after the other; a line ends at signs of equality."""
        bodies = [self.printer.pieces(self.lettering.node(node)) for node in row.chain]
        label, name, middle = map(self.lettering.text, (row.label, row.name, row.middle))
        if not label:
            shown = suffixed(bodies[0], " = 0", 4)
            if name:
                return formula(f"{indent}{name}", "   ", shown)
            return formula("", indent, shown, "")
        pieces = [piece for body in bodies for piece in _equal(body)]
        if middle:
            pieces = [*_equal([Piece(middle, columns(middle))]), *pieces]
        # Signs of equality stand below each other, one column after the label's last letter.
        label = indent + label
        place = max(k for k, c in enumerate(label) if not combining(c))
        first = pieces[0]
        width = first.width + columns(label[place:])
        text = f"{label[place:]} = {first.text}"
        pieces[0] = replace(first, text=text, width=width, separator="")
        return formula("", label[:place], pieces, "")


def _equal(body: list[Piece]) -> list[Piece]:
    """Return the pieces behind a sign of equality, before which a line may end."""
    first, *others = deeper(body, 2)
    head = replace(first, separator=" = ", lead="= ", depth=0, width=first.width + 3)
    return [head, *others]
