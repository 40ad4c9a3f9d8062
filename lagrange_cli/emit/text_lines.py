"""Lines of a terminal: formulas broken where they are too long, items under each other."""

from __future__ import annotations

from collections.abc import Sequence

from lagrange_cli.notation.layout import Piece, break_lines
from lagrange_cli.notation.one_line import columns, solid

#: Columns of a line, where a formula can be broken.
TEXT_WIDTH = 100


def hung(opening: str, pieces: Sequence[Piece]) -> list[str]:
    """Pieces after an opening; further lines stand two columns deeper."""
    indent = columns(opening)
    first, *others = break_lines(pieces, TEXT_WIDTH - indent, TEXT_WIDTH - indent - 2, step=2)
    return [
        opening + first.text,
        *(" " * (indent + 2 + 2 * line.level) + line.text for line in others),
    ]


def listed(opening: str, items: Sequence[str]) -> list[str]:
    """Items with spaces between them; further lines stand under the first item."""
    pieces = [
        Piece(item, columns(item) + 1, " " if index else "", "", 0)
        for index, item in enumerate(items)
    ]
    indent = columns(opening)
    first, *others = break_lines(pieces or solid(""), TEXT_WIDTH - indent, TEXT_WIDTH - indent)
    lines = [opening + first.text, *(" " * indent + line.text for line in others)]
    return [line.rstrip() for line in lines]


def padded(text: str, width: int) -> str:
    """Text with spaces up to a width in columns."""
    return text + " " * (width - columns(text))
