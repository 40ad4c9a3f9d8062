"""Rows of CSV files: cells with their places, at which mistakes are reported."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence

from lagrange_cli.errors import InputError, Mark, Problem

#: A decimal number.
DECIMAL_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,6})?", re.ASCII)
_NOT_FINITE = re.compile(r"[-+]?(nan|inf|infinity)", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+", re.ASCII)

#: A cell of a line; commas between quotation marks are part of it.
_CELL = re.compile(r'((?:[^,"]+|"[^"]*(?:"|$))*)(?:,|$)')

#: Characters of a text that a message shows.
LONGEST_QUOTED = 40


def decoded(data: bytes, path: str, rule: str) -> list[str]:
    """Decode a file into lines, line ends included.

    Raises
    ------
    InputError
        It bears ``rule`` and stands at the first byte that is no text.
    """
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        raise InputError(
            Problem("this is no text: it holds a zero byte", Mark(path, line, 1), rule=rule)
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line = before.count(b"\n") + 1
        column = len(before[before.rfind(b"\n") + 1 :].decode("utf-8", "replace")) + 1
        raise InputError(
            Problem(
                f"byte 0x{data[error.start]:02x} is not part of a text in UTF-8",
                Mark(path, line, column),
                "save the file as UTF-8, or with letters A to Z in its header",
                rule,
            )
        ) from None
    return list(io.StringIO(text, newline=""))


class CsvRows:
    """The rows of a CSV file, without empty ones; it knows the place of the last one read.

    Parameters
    ----------
    lines
        Lines of the file with their ends.
    path
        The file as messages name it.
    rule
        The rule that problems of its rows bear.
    """

    def __init__(self, lines: Sequence[str], path: str, rule: str) -> None:
        self._lines, self.path, self._rule = lines, path, rule
        self._reader = csv.reader(lines, strict=True)

    def __iter__(self) -> Iterator[list[str]]:
        while True:
            try:
                row = next(self._reader)
            except StopIteration:
                return
            except csv.Error as error:
                message = f"this row cannot be read: {error}"
                raise self.refused(message, "look at its quotation marks") from None
            if any(cell.strip() for cell in row):
                yield row

    def place(self, index: int = 0) -> Mark:
        """Return the place of a cell of the last row."""
        number = max(self._reader.line_num, 1)
        line = self._lines[number - 1].rstrip("\r\n") if self._lines else ""
        cells = _CELL.findall(line)
        if index >= len(cells):
            return Mark(self.path, number, 1, line)
        cell = cells[index]
        start = sum(map(len, cells[:index])) + index + len(cell) - len(cell.lstrip())
        return Mark(self.path, number, start + 1, line, max(1, len(cell.strip())))

    def refused(self, message: str, hint: str = "", mark: Mark | None = None) -> InputError:
        """Return the refusal of something at ``mark``, or else in the last row."""
        return InputError(Problem(message, mark or self.place(), hint, self._rule))

    def number(self, row: Sequence[str], index: int) -> float:
        """Read the finite number in a cell."""
        text = row[index].strip()
        if DECIMAL_NUMBER.fullmatch(text):
            value = float(text)
            if math.isfinite(value):
                return value
            raise self.refused(
                f"{quoted_cell(text)} is beyond the range of doubles", "", self.place(index)
            )
        shown = quoted_cell(text) if text else "nothing"
        hint = ""
        if _NOT_FINITE.fullmatch(text):
            hint = "leave out rows without a measurement"
        elif _DECIMAL_COMMA.fullmatch(text):
            hint = f"decimals are written with a point: {text.replace(',', '.')[:LONGEST_QUOTED]}"
        raise self.refused(f"expected a finite number, found {shown}", hint, self.place(index))


def quoted_cell(text: str) -> str:
    return f"'{text}'" if len(text) <= LONGEST_QUOTED else f"'{text[: LONGEST_QUOTED - 3]}...'"
