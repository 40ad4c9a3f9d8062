"""Sections of a board as rows of text, in Unicode or plain ASCII."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from unicodedata import combining

from lagrange_cli.notation.layout import Piece, columns, deeper, suffixed
from lagrange_cli.notation.page import Row, formula, words
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.report.contents.steps.board import Sections
from lagrange_cli.report.tree import Block, Formula, Formulas, Law, Section, Title, Words
from lagrange_cli.report.writers.letters import AsciiLetters, Letters, UnicodeLetters

#: Columns before paragraphs, and before laws and labels.
_WORDS_INDENT, _FORMULA_INDENT = 2, 4

#: Labels that are longer are not aligned with the others.
_LONGEST_LABEL = 24


def text_letters(*, ascii: bool, lowered: bool = False) -> Letters:
    """Return letters of a terminal; indices stand below the line if they are ``lowered``."""
    return AsciiLetters() if ascii else UnicodeLetters(lowered=lowered)


def section_writers(
    sections: Sections, printer: OneLinePrinter
) -> Iterator[tuple[str, Callable[[], list[Row]]]]:
    """Yield the parts of each section with a function that writes its rows, the heading first."""
    return ((parts, partial(_written, write, printer)) for parts, write in sections)


def _written(write: Callable[[], Section | None], printer: OneLinePrinter) -> list[Row]:
    section = write()
    return [] if section is None else section_rows(section, printer)


def section_rows(
    section: Section, printer: OneLinePrinter, indent: int = _FORMULA_INDENT
) -> list[Row]:
    """Return the rows of a section, its heading first; formulas are indented."""
    body = [row for block in section.blocks for row in _rows(block, printer, indent)]
    return [Row(section.heading, role="heading"), *body]


def _rows(block: Block, printer: OneLinePrinter, margin: int) -> list[Row]:
    if isinstance(block, Formulas):
        return _aligned(block.rows, printer, margin)
    assert isinstance(block, Words | Title | Law)
    indent = _FORMULA_INDENT if isinstance(block, Law) else _WORDS_INDENT
    return [Row("", " " * indent, words(block.text))]


def _aligned(rows: Iterable[Formula], printer: OneLinePrinter, margin: int) -> list[Row]:
    """Return rows with their first signs of equality below each other."""
    rows = list(rows)
    widths = [columns(row.label) for row in rows if row.label]
    aligned = max((w for w in widths if w <= _LONGEST_LABEL), default=0)
    shown = []
    for row in rows:
        indent = margin + (max(0, aligned - columns(row.label)) if row.label else 0)
        shown.append(_row(row, " " * indent, printer))
    return shown


def _row(row: Formula, indent: str, printer: OneLinePrinter) -> Row:
    """A label and what it equals one after the other; lines go on at signs of equality first."""
    bodies = [printer.pieces(node) for node in row.chain]
    if not row.label:
        name = f"{indent}{row.name}" if row.name else ""
        lead = "   " if row.name else indent
        return formula(name, lead, suffixed(bodies[0], " = 0", 4), "name" if name else "")
    pieces = [piece for body in bodies for piece in _equal(body)]
    if row.middle:
        pieces = [*_equal([Piece(row.middle, columns(row.middle))]), *pieces]
    # Signs of equality stand below each other, one column after the label's last letter.
    label = indent + row.label
    place = max(k for k, c in enumerate(label) if not combining(c))
    first = pieces[0]
    width = first.width + columns(label[place:])
    pieces[0] = replace(first, text=f"{label[place:]} = {first.text}", width=width, separator="")
    return formula("", label[:place], pieces, "")


def _equal(body: list[Piece]) -> list[Piece]:
    """Return the pieces behind a sign of equality, before which a line may end."""
    first, *others = deeper(body, 2)
    head = replace(first, separator=" = ", lead="= ", depth=0, width=first.width + 3)
    return [head, *others]
