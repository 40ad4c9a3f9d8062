"""Recordings: values over time in a CSV file beside a scene.

The first row names the columns; ``t`` is the time. Cells are separated by commas and
decimals written with a point. What is wrong is reported at its place in the file.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.files.reading import read_regular

__all__ = ["INTERPOLATIONS", "TIME", "Interpolation", "Recorded", "Recording", "read_recording"]

#: The column of times.
TIME = "t"

Interpolation = Literal["previous", "linear", "cubic"]

#: Rows that each interpolation needs.
INTERPOLATIONS: dict[Interpolation, int] = {"linear": 2, "cubic": 2, "previous": 1}

_BETWEEN: dict[Interpolation, str] = {
    "linear": "linear between rows",
    "cubic": "a cubic spline through the rows",
    "previous": "each row until the next",
}

_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,6})?", re.ASCII)
_NOT_FINITE = re.compile(r"[-+]?(nan|inf|infinity)", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+", re.ASCII)

#: A cell of a line; commas between quotation marks are part of it.
_CELL = re.compile(r'((?:[^,"]+|"[^"]*(?:"|$))*)(?:,|$)')

#: Columns that are named in a message, and among which a close name is looked for.
_MOST_NAMED, _MOST_COMPARED = 20, 1000
_LONGEST = 40


@dataclass(frozen=True, slots=True)
class Recording:
    """Where an input's values are: a column of a file, and what holds between its rows.

    ``file`` is the name that the scene gives, within ``folder``, the scene's own;
    ``mark`` and ``column_mark`` are the places in the scene of ``file`` and ``column``.
    """

    file: str
    folder: str
    column: str
    interpolation: Interpolation
    mark: Mark
    column_mark: Mark

    @property
    def described(self) -> str:
        """What the values are, in words."""
        return f"column {self.column} of {self.file}, {_BETWEEN[self.interpolation]}"

    @property
    def path(self) -> str:
        """The file as messages name it."""
        return os.path.join(self.folder, self.file)


@dataclass(frozen=True, slots=True)
class Recorded:
    """Times, strictly increasing, and the value at each; all finite."""

    times: tuple[float, ...]
    values: tuple[float, ...]


def read_recording(recording: Recording) -> Recorded:
    """The times and values of a recording.

    Raises
    ------
    InputError
        Located in the scene: the file lies outside its folder, cannot be read, or has no
        such column. Located in the file: anything that is wrong with its rows.
    """
    data = read_regular(_inside(recording), recording.mark, "a recording")
    lines = _decoded(data, recording.path)
    rows = _Rows(lines, recording.path)
    header = _header(rows, recording)
    time, value = header.index(TIME), header.index(recording.column)
    times: list[float] = []
    values: list[float] = []
    for row in rows:
        if len(row) != len(header):
            raise rows.refused(*_wrong_length(row, header))
        at = rows.number(row, time)
        if times and at <= times[-1]:
            raise rows.refused(
                f"time {row[time].strip()} is not after the one before, {times[-1]!r}",
                "rows are in order of time, each time once",
                rows.place(time),
            )
        times.append(at)
        values.append(rows.number(row, value))
    _require_rows(len(times), recording, rows)
    return Recorded(tuple(times), tuple(values))


def _inside(recording: Recording) -> str:
    """The file's real path.

    Raises
    ------
    InputError
        It is not inside the scene's folder.
    """
    if "\0" in recording.file:
        raise _in_scene("this is not the name of a file", recording.mark)
    folder = os.path.realpath(recording.folder or os.curdir)
    path = os.path.realpath(os.path.join(folder, recording.file))
    if os.path.commonpath([folder, path]) != folder:
        raise _in_scene(
            f"'{recording.file}' lies outside the folder of the scene",
            recording.mark,
            "files that a scene names are beside it or in folders below; a link is followed",
        )
    return path


def _in_scene(message: str, mark: Mark, hint: str = "") -> InputError:
    return InputError(Problem(message, mark, hint, "recording"))


def _decoded(data: bytes, path: str) -> list[str]:
    """The lines of a text, ends included."""
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        raise _in_scene("this is no text: it holds a zero byte", Mark(path, line, 1))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line = before.count(b"\n") + 1
        column = len(before[before.rfind(b"\n") + 1 :].decode("utf-8", "replace")) + 1
        raise _in_scene(
            f"byte 0x{data[error.start]:02x} is not part of a text in UTF-8",
            Mark(path, line, column),
            "save the file as UTF-8, or with letters A to Z in its header",
        ) from None
    return list(io.StringIO(text, newline=""))


class _Rows:
    """The rows of a file, empty ones left out, with the place of the last one."""

    def __init__(self, lines: Sequence[str], path: str) -> None:
        self._lines, self.path = lines, path
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
        """The place of a cell of the last row."""
        number = max(self._reader.line_num, 1)
        line = self._lines[number - 1].rstrip("\r\n") if self._lines else ""
        cells = _CELL.findall(line)
        if index >= len(cells):
            return Mark(self.path, number, 1, line)
        cell = cells[index]
        start = sum(map(len, cells[:index])) + index + len(cell) - len(cell.lstrip())
        return Mark(self.path, number, start + 1, line, max(1, len(cell.strip())))

    def refused(self, message: str, hint: str = "", mark: Mark | None = None) -> InputError:
        """What is wrong, at ``mark`` or else in the last row."""
        return _in_scene(message, mark or self.place(), hint)

    def number(self, row: Sequence[str], index: int) -> float:
        """The finite number in a cell."""
        text = row[index].strip()
        if _NUMBER.fullmatch(text):
            value = float(text)
            if math.isfinite(value):
                return value
            raise self.refused(
                f"{_shown(text)} is beyond the range of doubles", "", self.place(index)
            )
        found = _shown(text) if text else "nothing"
        hint = ""
        if _NOT_FINITE.fullmatch(text):
            hint = "leave out rows without a measurement"
        elif _DECIMAL_COMMA.fullmatch(text):
            hint = f"decimals are written with a point: {text.replace(',', '.')[:_LONGEST]}"
        raise self.refused(f"expected a finite number, found {found}", hint, self.place(index))


def _shown(text: str) -> str:
    return f"'{text}'" if len(text) <= _LONGEST else f"'{text[: _LONGEST - 3]}...'"


def _header(rows: _Rows, recording: Recording) -> list[str]:
    """The names of the columns, with those of time and of the recording among them once."""
    header = [name.strip() for name in next(iter(rows), [])]
    if not header:
        raise _in_scene(
            "this file is empty",
            Mark(recording.path, 1, 1),
            f"its first row is t,{_short(recording)}",
        )
    if len(header) == 1 and re.search(r"[;\t]", header[0]):
        raise rows.refused(
            "the names of the columns are not separated by commas",
            f"cells are separated by commas, and decimals have a point: t,{_short(recording)}",
        )
    if TIME not in header:
        raise rows.refused(
            "no column is named 't', which is the time",
            f"columns are {_named(header)}; a first row names them",
        )
    if recording.column not in header:
        raise _in_scene(
            f"'{recording.path}' has no column {_shown(recording.column)}",
            recording.column_mark,
            nearest(recording.column, header[:_MOST_COMPARED]) or f"columns are {_named(header)}",
        )
    for name in (TIME, recording.column):
        if header.count(name) > 1:
            again = header.index(name, header.index(name) + 1)
            raise rows.refused(f"two columns are named {_shown(name)}", "", rows.place(again))
    return header


def _short(recording: Recording) -> str:
    return recording.column[:_LONGEST]


def _named(header: Sequence[str]) -> str:
    more = ", ..." if len(header) > _MOST_NAMED else ""
    return ", ".join(_shown(name) for name in header[:_MOST_NAMED]) + more


def _wrong_length(row: Sequence[str], header: Sequence[str]) -> tuple[str, str]:
    cells = f"{len(row)} cell{'s' * (len(row) != 1)}"
    hint = "decimals are written with a point, cells separated by commas"
    return f"{cells} in this row, {len(header)} in the first one", hint


def _require_rows(count: int, recording: Recording, rows: _Rows) -> None:
    needed = INTERPOLATIONS[recording.interpolation]
    if count < needed:
        raise rows.refused(
            f"{count} row{'s' * (count != 1)} of numbers:"
            f" interpolation '{recording.interpolation}' needs {needed}"
        )
