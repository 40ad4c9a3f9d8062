"""Recordings: values over time in a CSV file beside a scene.

The first row names the columns; ``t`` is the time. Cells are separated by commas and
decimals written with a point. Mistakes are reported at their place in the file.
"""

from __future__ import annotations

import os
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Literal

from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.files.identity import stamp_of
from lagrange_cli.files.reading import read_regular
from lagrange_cli.files.rows import LONGEST_QUOTED, CsvRows, decoded, quoted_cell

#: The rule that problems of recordings bear.
_RULE = "recording"

#: The column of times.
_TIME = "t"

Interpolation = Literal["previous", "linear", "cubic"]

#: Rows that each interpolation needs.
INTERPOLATIONS: dict[Interpolation, int] = {"linear": 2, "cubic": 2, "previous": 1}

_BETWEEN: dict[Interpolation, str] = {
    "linear": "linear between rows",
    "cubic": "a cubic spline through the rows",
    "previous": "each row until the next",
}

#: Columns that a message names.
_MOST_NAMED = 20
#: Columns among which a name is looked for that is close to a missing one.
_MOST_COMPARED = 1000


@dataclass(frozen=True, slots=True)
class FileColumn:
    """A column of a CSV file that a scene names.

    Attributes
    ----------
    file
        Name of the file in the scene, relative to ``folder``.
    folder
        The scene's folder.
    column
        Heading of the column with the values.
    mark, column_mark
        Places of ``file`` and ``column`` in the scene.
    """

    file: str
    folder: str
    column: str
    mark: Mark
    column_mark: Mark

    @property
    def path(self) -> str:
        """Path of the file, as messages name it."""
        return os.path.join(self.folder, self.file)

    @property
    def stamp(self) -> tuple[int, ...]:
        """Numbers that usually change when the file does; none if it is missing."""
        carried = _carried.get()
        if carried is not None and self in carried:
            return carried[self].stamp
        return stamp_of(self.path)


@dataclass(frozen=True, slots=True)
class Recording(FileColumn):
    """A recorded input as a scene declares it: a column of a file, and its interpolation.

    Attributes
    ----------
    interpolation
        The interpolation between two rows.
    """

    interpolation: Interpolation

    @property
    def described(self) -> str:
        """Description of column, file and interpolation in words."""
        return f"column {self.column} of {self.file}, {_BETWEEN[self.interpolation]}"


@dataclass(frozen=True, slots=True)
class Recorded:
    """Times, strictly increasing, and the value at each time; all are finite."""

    times: tuple[float, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class CarriedFile:
    """The file of a recording as it was read where a run began, for processes that run elsewhere.

    Attributes
    ----------
    content
        Its bytes; empty if it was refused.
    refusal
        The refusal to read it; None if it was read.
    """

    content: bytes
    refusal: InputError | None = None

    @property
    def stamp(self) -> tuple[int, ...]:
        """Numbers that usually change when the contents do."""
        return len(self.content), zlib.crc32(self.content)


#: Contents that stand for the files of recordings in this context; None to read files.
_carried: ContextVar[Mapping[FileColumn, CarriedFile] | None] = ContextVar("carried", default=None)


def carried_files(columns: Iterable[FileColumn]) -> dict[FileColumn, CarriedFile]:
    """Read the files of recordings, or find why they cannot be read, to carry them elsewhere."""
    files: dict[FileColumn, CarriedFile] = {}
    for recording in columns:
        try:
            files[recording] = CarriedFile(read_recorded_file(recording))
        except InputError as refusal:
            files[recording] = CarriedFile(b"", refusal)
    return files


@contextmanager
def reading_carried(files: Mapping[FileColumn, CarriedFile]) -> Iterator[None]:
    """Read no recordings from this machine's folders but these contents of them."""
    token = _carried.set(files)
    try:
        yield
    finally:
        _carried.reset(token)


def read_recording(recording: Recording) -> Recorded:
    """Read the times and values of a recording.

    Raises
    ------
    InputError
        Located in the scene: the file lies outside its folder, cannot be read, or has no
        such column. Located in the file: anything that is wrong with its rows.
    """
    lines = decoded(read_recorded_file(recording), recording.path, _RULE)
    rows = CsvRows(lines, recording.path, _RULE)
    header = _header(rows, recording)
    time, value = header.index(_TIME), header.index(recording.column)
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


def read_recorded_file(recording: FileColumn) -> bytes:
    """Read the file of a recording; refuses it as :func:`read_recording`, but for its rows."""
    carried = _carried.get()
    if carried is not None:
        return _content(carried, recording)
    return read_regular(_inside(recording), recording.mark, "a recording")


def _content(carried: Mapping[FileColumn, CarriedFile], recording: FileColumn) -> bytes:
    """Return what was carried of a file; refuses it as where it was read."""
    if recording not in carried:
        raise _in_scene(f"'{recording.file}' was not sent along with the scene", recording.mark)
    file = carried[recording]
    if file.refusal is not None:
        raise file.refusal
    return file.content


def _inside(recording: FileColumn) -> str:
    """Return the file's real path.

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
    return InputError(Problem(message, mark, hint, _RULE))


def _header(rows: CsvRows, recording: Recording) -> list[str]:
    """Read the names of the columns; require time and the recording's column once each."""
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
    if _TIME not in header:
        raise rows.refused(
            "no column is named 't', which is the time",
            f"columns are {_named(header)}; a first row names them",
        )
    if recording.column not in header:
        raise _in_scene(
            f"'{recording.path}' has no column {quoted_cell(recording.column)}",
            recording.column_mark,
            nearest(recording.column, header[:_MOST_COMPARED]) or f"columns are {_named(header)}",
        )
    for name in (_TIME, recording.column):
        if header.count(name) > 1:
            again = header.index(name, header.index(name) + 1)
            raise rows.refused(f"two columns are named {quoted_cell(name)}", "", rows.place(again))
    return header


def _short(recording: Recording) -> str:
    return recording.column[:LONGEST_QUOTED]


def _named(header: Sequence[str]) -> str:
    more = ", ..." if len(header) > _MOST_NAMED else ""
    return ", ".join(quoted_cell(name) for name in header[:_MOST_NAMED]) + more


def _wrong_length(row: Sequence[str], header: Sequence[str]) -> tuple[str, str]:
    cells = f"{len(row)} cell{'s' * (len(row) != 1)}"
    hint = "decimals are written with a point, cells separated by commas"
    return f"{cells} in this row, {len(header)} in the first one", hint


def _require_rows(count: int, recording: Recording, rows: CsvRows) -> None:
    needed = INTERPOLATIONS[recording.interpolation]
    if count < needed:
        raise rows.refused(
            f"{count} row{'s' * (count != 1)} of numbers:"
            f" interpolation '{recording.interpolation}' needs {needed}"
        )
