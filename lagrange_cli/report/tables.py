"""Tables of reports and their JSON text."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from lagrange_cli.notation.page import Role, Row, words


@dataclass(frozen=True, slots=True)
class TableColumn:
    """One column of a table.

    Attributes
    ----------
    heading
        The text above it.
    least
        Fewest characters beside those of its longest cell.
    align
        ``<`` for words, ``>`` for numbers.
    """

    heading: str = ""
    least: int = 0
    align: Literal["<", ">"] = "<"


def table(columns: Sequence[TableColumn], rows: Sequence[Sequence[str]]) -> list[Row]:
    """Write rows under each other; the last cell of each is broken where it does not fit.

    Parameters
    ----------
    columns
        From the left.
    rows
        Texts of cells.
    """
    names = [column.heading for column in columns]
    cells = zip(names, *rows, strict=True)
    widths = [max(c.least, *map(len, column)) for c, column in zip(columns, cells, strict=True)]
    whole = "".join(_cells(columns, widths, names)).rstrip()
    return [Row(whole, role="heading"), *(_row(columns, widths, row) for row in rows)]


def _cells(columns: Sequence[TableColumn], widths: Sequence[int], row: Sequence[str]) -> list[str]:
    cells = zip(columns, widths, row, strict=True)
    return [f"  {cell:{c.align}{width}}" for c, width, cell in cells]


def _row(columns: Sequence[TableColumn], widths: Sequence[int], row: Sequence[str]) -> Row:
    first, *others = _cells(columns, widths, row)
    name = first.rstrip()
    if not others:
        return Row(name, role="name")
    *middle, last = others
    lead = first[len(name) :] + "".join(middle)
    blanks = len(last) - len(last.lstrip())
    return Row(name, lead + last[:blanks], words(last[blanks:]), "name")


def labelled(*rows: tuple[str, str], indent: int = 0) -> list[Row]:
    """Write ``label  text`` a line, the texts under each other; labels are names if indented."""
    width = max(len(label) for label, _ in rows) + 2
    role: Role = "name" if indent else "heading"
    return [
        Row(" " * indent + label, " " * (width - len(label)), words(text), role)
        for label, text in rows
    ]


def sentence_row(text: str, role: Role = "") -> Row:
    """Write a sentence, whose first word has a role."""
    first, _, remainder = text.partition(" ")
    body = remainder.lstrip()
    return Row(first, " " * (len(text) - len(first) - len(body)), words(body), role)


def json_text(value: Any, *, ascii: bool = False) -> str:
    """Write a report as JSON, indented, with a final newline.

    Parameters
    ----------
    value
        A JSON value; numbers that are not finite are written as null, since JSON has none.
    ascii
        Escape all other characters, as in paths, whose bytes may be no text.
    """
    return json.dumps(_finite(value), indent=2, ensure_ascii=ascii, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    """Replace numbers that are not finite by null."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
