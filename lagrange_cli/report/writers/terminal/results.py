"""Sections of results as rows of text: terse, with verdicts and tables in columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from lagrange_cli.notation.layout import Piece, columns, deeper, prefixed, suffixed
from lagrange_cli.notation.page import USUAL_WIDTH, Role, Row, words
from lagrange_cli.notation.page import Block as PageBlock
from lagrange_cli.report.inlines import Expression, Text, bold, say
from lagrange_cli.report.tree import (
    Block,
    Case,
    Cases,
    Formula,
    Labelled,
    Law,
    Matrices,
    Matrix,
    Paragraph,
    Passage,
    Section,
    Table,
)
from lagrange_cli.report.writers.fitting import MOST_ENTRIES, too_large
from lagrange_cli.report.writers.terminal.sections import TerseRows, equated, named_row

#: Lines that a matrix of numbers has at the most.
_MOST_LINES = 40

#: Columns that numbers of a matrix take beside its letter.
_MATRIX_ROOM = USUAL_WIDTH - 20


@dataclass(frozen=True)
class ResultRows(TerseRows):
    """Writes sections of results: the first paragraph beside the heading, all sides of formulas."""

    def section(self, section: Section) -> list[Row | PageBlock]:
        """Return the rows of a section, its heading first."""
        first, *others = section.blocks or (None,)
        if section.lead or not isinstance(first, Paragraph | Passage):
            return super().section(section)
        heading = self.lettering.text(section.terse or section.heading)
        rows = [row for block in others for row in self._block(block)] if others else []
        return [Row(heading, "   ", self._sentence(first), "heading"), *rows]

    def _block(self, block: Block) -> Sequence[Row | PageBlock]:
        match block:
            case Law(text):
                return [Row("", " " * self.margin, words(self.lettering.text(text)))]
            case Passage():
                return [Row("", " " * self.margin, self._sentence(block))]
            case Labelled(rows):
                return [self._term(name, text) for name, text in rows]
            case Cases(cases):
                return [self._cases(cases)]
            case Matrices(matrices):
                return [row for matrix in matrices for row in self._matrix(matrix)]
            case _:
                return super()._block(block)

    def _terse(self, row: Formula, name: str, lead: str) -> Row:
        if row.brief:
            return super()._terse(row, name, lead)
        label = " " * self.margin + self.lettering.text(row.label)
        return named_row(label, " = ", self._right(row), self.lettering.text(row.aside))

    def _right(self, row: Formula) -> list[Piece]:
        """Return what stands behind the first sign of equality of a formula."""
        text = self.lettering.text
        general = (
            f"({', '.join(map(text, row.components))})" if row.components else text(row.middle)
        )
        if general or not row.chain:
            return list(words(general))
        first, *others = (self.printer.pieces(self.lettering.node(node)) for node in row.chain)
        return [*(deeper(first, 2) if others else first), *equated(others)]

    # -- words ------------------------------------------------------------------------

    def _sentence(self, block: Paragraph | Passage) -> tuple[Piece, ...]:
        if isinstance(block, Paragraph):
            return words(self.lettering.text(block.text))
        before, after = (words(self.lettering.text(t)) for t in (block.before, block.after))
        return (*before, *_spaced(self._place(block.place)), *_spaced(after))

    def _term(self, name: Text, text: Text) -> Row:
        label = self.lettering.text(name)
        whole = self.lettering.text(say("{name}: {value}", name=label, value=text))
        lead, blank, shown = whole.removeprefix(label).partition(": ")
        return Row(" " * self.margin + label, lead + blank, words(shown), "name")

    # -- configurations ---------------------------------------------------------------

    def _place(self, place: Sequence[Formula]) -> list[Piece]:
        """Return formulas with commas between them."""
        pieces: list[Piece] = []
        for row in place:
            label, right = self.lettering.text(row.label), self._right(row)
            shown = [Piece(label, columns(label))]
            if right:
                shown = prefixed(right, f"{label} = ", columns(label) + 3)
            pieces = [*suffixed(pieces, ",", 1), *_spaced(shown)] if pieces else shown
        return pieces

    def _cases(self, cases: Sequence[Case]) -> PageBlock:
        """Return configurations below each other, the reason of each verdict behind it."""
        text = self.lettering.text
        names = [" " * self.margin + text(case.verdict) for case in cases]
        width = max(map(columns, names))
        rows = []
        for name, case in zip(names, cases, strict=True):
            pieces = self._place(case.place)
            if case.condition:
                where = say("where {conditions}", conditions=case.condition)
                pieces += _spaced(words(text(where)))
            lead = " " * (width - columns(name) + 3 * bool(case.verdict))
            rows.append(Row(name, lead, tuple(pieces), "name", 2, text(case.reason)))
        return PageBlock(tuple(rows), "asides")

    # -- tables and matrices ----------------------------------------------------------

    def _table(self, block: Table) -> list[Row]:
        """Return a table in columns; prose stands below its row where some do not fit a line.

        Rows that are too wide without prose are broken between cells.
        """
        lines = [list(map(self.lettering.text, row)) for row in (block.heads, *block.rows)]
        widths = [max(map(columns, column)) + 2 for column in zip(*lines, strict=True)]
        has_prose = bool(block.prose) and block.heads[-1] == block.prose
        below = [""] * len(lines)
        if sum(widths) <= USUAL_WIDTH:
            return super()._table(block)
        if has_prose:
            below, widths = ["", *(line[-1] for line in lines[1:])], widths[:-1]
        rows = []
        for number, (line, text) in enumerate(zip(lines, below, strict=True)):
            cells = [f"{cell:{w - 1}}" for cell, w in zip(line, widths, strict=False)]
            role: Role = "name" if number else "heading"
            rows.append(Row(" " * self.margin + cells[0], " ", words(cells[1:]), role, 2))
            if text:
                rows.append(Row("", " " * (self.margin + widths[0] + 2), words(text)))
        return rows

    def _matrix(self, matrix: Matrix) -> Iterator[Row]:
        """Yield the entries of a closed form that are not 0, or all of them in numbers."""
        label, values, closed = bold(matrix.letter), matrix.values, matrix.closed
        entries = self.fitting.entries(matrix) if closed else []
        if not values:
            yield self._terse(Formula(label, (), middle=bold("0")), "", "")
        elif len(values) == len(values[0]) == 1:
            sides = tuple(cells[0][0] for cells in (closed, values) if cells)
            yield self._terse(Formula(label, sides), "", "")
        elif 0 < len(entries) <= MOST_ENTRIES:
            yield from (self._terse(row, "", "") for row in entries)
        else:
            yield from self._numbers(matrix)

    def _numbers(self, matrix: Matrix) -> Iterator[Row]:
        """Yield columns of numbers, as many beside each other as fit a line."""
        text = self.lettering.text
        cells = [[text(Expression(cell)) for cell in row] for row in matrix.values]
        groups = list(_groups([max(map(len, column)) for column in zip(*cells, strict=True)]))
        if len(groups) * len(cells) > _MOST_LINES:
            yield Row("", " " * self.margin, words(text(too_large(matrix))))
            return
        for start, widths in groups:
            label = " " * self.margin + text(bold(matrix.letter))
            if len(groups) > 1:
                label += f"[1..{len(cells)},{start + 1}..{start + len(widths)}]"
            for number, row in enumerate(cells):
                parts = zip(row[start:], widths, strict=False)
                line = "  ".join(f"{cell:>{width}}" for cell, width in parts)
                blank = " " * (columns(label) + 3)
                yield Row("", blank + line) if number else Row(label, f" = {line}", role="name")


def _groups(widths: Sequence[int]) -> Iterator[tuple[int, Sequence[int]]]:
    """Yield the first of the columns that fit a line together, and their widths."""
    start = 0
    for end in range(1, len(widths) + 1):
        wider = widths[start : end + 1]
        if end == len(widths) or sum(wider) + 2 * len(wider) > _MATRIX_ROOM:
            yield start, widths[start:end]
            start = end


def _spaced(pieces: Sequence[Piece]) -> list[Piece]:
    """Return pieces with a blank before them, at which a line may be broken."""
    head, *others = pieces
    return [Piece(head.text, columns(head.text) + 1, " ", "", 0), *others]
