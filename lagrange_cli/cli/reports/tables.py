"""Tables of all reports: columns of text, and lines with a label."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class TableColumn:
    """One column of a table.

    Attributes
    ----------
    heading
        The text above it.
    width
        Fewest characters; None for those of its longest cell.
    align
        ``<`` for words, ``>`` for numbers.
    before
        The text between it and the column on its left.
    """

    heading: str = ""
    width: int | None = None
    align: Literal["<", ">"] = "<"
    before: str = "  "

    def fitted(self, cells: Iterable[str]) -> int:
        """Return the width for cells of this column."""
        return max(map(len, cells), default=0) if self.width is None else self.width


def table(
    columns: Sequence[TableColumn], rows: Sequence[Sequence[str]], *, heading: bool = True
) -> list[str]:
    """Write rows under each other, without blanks at their ends.

    Parameters
    ----------
    columns
        From the left; the first one's ``before`` is the indentation.
    rows
        Texts of cells; a row may end early, and its last cell be wider than the column.
    heading
        True if the first line has the columns' headings.
    """
    lines = [[column.heading for column in columns], *rows] if heading else rows
    widths = [c.fitted(row[k] for row in lines if k < len(row)) for k, c in enumerate(columns)]
    return [_line(columns, widths, row) for row in lines]


def _line(columns: Sequence[TableColumn], widths: Sequence[int], row: Sequence[str]) -> str:
    cells = zip(columns, widths, row, strict=False)
    return "".join(f"{c.before}{cell:{c.align}{width}}" for c, width, cell in cells).rstrip()


def labelled(*rows: tuple[str, str], width: int = 9) -> list[str]:
    """Write ``label  text`` a line, the texts under each other if labels fit the width."""
    return [f"{label:<{width}}  {text}" for label, text in rows]
