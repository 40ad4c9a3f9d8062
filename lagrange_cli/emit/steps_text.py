"""Sections of a board as lines of text, in Unicode or plain ASCII."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from lagrange_cli.emit.steps.letters import AsciiLetters, Letters, UnicodeLetters
from lagrange_cli.emit.steps.sections import Block, Formula, Formulas, Law, Section
from lagrange_cli.emit.text_lines import TEXT_WIDTH, hung, listed
from lagrange_cli.notation.layout import joined, suffixed
from lagrange_cli.notation.one_line import OneLinePrinter, columns

#: Columns before paragraphs, and before laws and labels.
_WORDS_INDENT, _FORMULA_INDENT = 2, 4

#: Labels that are longer are not aligned with the others.
_LONGEST_LABEL = 24


def text_letters(*, ascii: bool) -> Letters:
    return AsciiLetters() if ascii else UnicodeLetters()


def section_blocks(sections: Iterable[Section], printer: OneLinePrinter) -> Iterator[list[str]]:
    """The lines of each section, its heading first."""
    for section in sections:
        body = [line for block in section.blocks for line in _block(block, printer)]
        yield [section.heading, *body]


def _block(block: Block, printer: OneLinePrinter) -> list[str]:
    if isinstance(block, Formulas):
        return _aligned(block.rows, printer)
    if isinstance(block, Law):
        return [" " * _FORMULA_INDENT + block.text]
    return listed(" " * _WORDS_INDENT, block.text.split())


def _aligned(rows: Iterable[Formula], printer: OneLinePrinter) -> list[str]:
    """Rows with their first signs of equality below each other."""
    rows = list(rows)
    widths = [columns(row.label) for row in rows if row.label]
    aligned = max((w for w in widths if w <= _LONGEST_LABEL), default=0)
    lines: list[str] = []
    for row in rows:
        indent = _FORMULA_INDENT + (max(0, aligned - columns(row.label)) if row.label else 0)
        lines += _row(row, " " * indent, printer)
    return lines


def _row(row: Formula, indent: str, printer: OneLinePrinter) -> list[str]:
    bodies = [printer.pieces(node) for node in row.chain]
    if not row.label:
        return hung(indent, suffixed(bodies[0], " = 0", 4))
    opening = f"{indent}{row.label}"
    lines = [opening + (f" = {row.middle}" if row.middle else "")]
    for body in bodies:
        whole = f" = {joined(body)}"
        if columns(lines[-1] + whole) <= TEXT_WIDTH:
            lines[-1] += whole
        elif lines == [opening]:
            lines = hung(f"{opening} = ", body)
        else:
            lines += hung(f"{' ' * columns(opening)} = ", body)
    return lines
