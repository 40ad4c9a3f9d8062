"""Reading what a scene takes from columns of files: recorded inputs, and tables."""

from __future__ import annotations

import ntpath
import os
from collections.abc import Mapping as AbstractMapping
from collections.abc import Sequence as AbstractSequence
from typing import TypeVar, get_args

from lagrange_cli.files import (
    FileColumn,
    Interpolation,
    Outside,
    Recording,
    Table,
    TableInterpolation,
    read_table,
)
from lagrange_cli.scene.language.problems import shown, suggestion
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode

_Choice = TypeVar("_Choice", bound=str)

#: The keys of a recorded input.
RECORDED = ("file", "column", "interpolation")

#: The keys of a table; the first three are required.
TABLE = ("of", "file", "column", "interpolation", "outside", "latex")


def read_recorded(node: Mapping, what: str, reading: Reading) -> Recording | None:
    """Read the recording that an input names; its file is read when values are needed."""
    fields = reading.fields(node, what, RECORDED, required=("file", "column"))
    column = _column(fields, what, reading)
    known: tuple[Interpolation, ...] = get_args(Interpolation)
    interpolation = _choice(fields, "interpolation", known, "linear", what, reading)
    if column is None or interpolation is None:
        return None
    place = column.file, column.folder, column.column, column.mark, column.column_mark
    return Recording(*place, interpolation)


def read_table_of(
    fields: AbstractMapping[str, SourceNode], arguments: int, what: str, reading: Reading
) -> Table | None:
    """Read the table that a function names, with its file."""
    column = _column(fields, what, reading)
    ways: tuple[TableInterpolation, ...] = get_args(TableInterpolation)
    interpolation = _choice(fields, "interpolation", ways, "monotone", what, reading)
    ends: tuple[Outside, ...] = get_args(Outside)
    outside = _choice(fields, "outside", ends, "end", what, reading)
    if column is None or interpolation is None or outside is None:
        return None
    with reading.problems.collect():
        return read_table(column, arguments, interpolation, outside)
    return None


def _column(
    fields: AbstractMapping[str, SourceNode], what: str, reading: Reading
) -> FileColumn | None:
    """Read the names of a file and of its column."""
    file = _file(fields["file"], what, reading) if "file" in fields else None
    column = reading.text(fields["column"], f"'column' of {what}") if "column" in fields else None
    if file is None or column is None:
        return None
    folder, marks = os.path.dirname(reading.file), (fields["file"].mark, fields["column"].mark)
    return FileColumn(file, folder, column.strip(), *marks)


def _file(node: SourceNode, what: str, reading: Reading) -> str | None:
    text = reading.text(node, f"'file' of {what}")
    if text is None:
        return None
    if not text.strip():
        reading.expected("the name of a file", f"'file' of {what}", node)
        return None
    if os.path.isabs(text) or ntpath.splitdrive(text)[0]:
        reading.problems.add(
            f"'file' of {what} is not relative to the folder of the scene",
            node.mark,
            hint="files that a scene names are beside it or in folders below",
            rule="recording",
        )
        return None
    return text


def _choice(
    fields: AbstractMapping[str, SourceNode],
    key: str,
    known: AbstractSequence[_Choice],
    default: _Choice,
    what: str,
    reading: Reading,
) -> _Choice | None:
    """Read one of several words; the default where the key is absent."""
    if key not in fields:
        return default
    node = fields[key]
    for name in known:
        if isinstance(node, Scalar) and node.text == name:
            return name
    text = node.text if isinstance(node, Scalar) else ""
    hint = suggestion(text, known, f"known are {', '.join(known)}")
    if text:
        message = f"unknown {key} {shown(text)} of {what}"
        reading.problems.add(message, node.mark, hint=hint, rule="unknown-name")
    else:
        reading.expected(f"{'an' if key[0] in 'aeiou' else 'a'} {key}", what, node, hint)
    return None
