"""Reading inputs whose values are in a file: ``{file: CSV, column: NAME, interpolation: ...}``."""

from __future__ import annotations

import ntpath
import os
from typing import get_args

from lagrange_cli.files import Interpolation, Recording
from lagrange_cli.scene.language.problems import shown, suggestion
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode

#: The keys of such an input.
RECORDED = ("file", "column", "interpolation")

_DEFAULT: Interpolation = "linear"


def read_recorded(node: Mapping, what: str, reading: Reading) -> Recording | None:
    """The recording that an input names; the file itself is read when its values are needed."""
    fields = reading.fields(node, what, RECORDED, required=("file", "column"))
    file = _file(fields["file"], what, reading) if "file" in fields else None
    column = reading.text(fields["column"], f"'column' of {what}") if "column" in fields else None
    interpolation: Interpolation | None = _DEFAULT
    if "interpolation" in fields:
        interpolation = _interpolation(fields["interpolation"], what, reading)
    if file is None or column is None or interpolation is None:
        return None
    return Recording(
        file,
        os.path.dirname(reading.file),
        column.strip(),
        interpolation,
        fields["file"].mark,
        fields["column"].mark,
    )


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


def _interpolation(node: SourceNode, what: str, reading: Reading) -> Interpolation | None:
    known: tuple[Interpolation, ...] = get_args(Interpolation)
    for name in known:
        if isinstance(node, Scalar) and node.text == name:
            return name
    text = node.text if isinstance(node, Scalar) else ""
    hint = suggestion(text, known, f"known are {', '.join(known)}")
    message = f"unknown interpolation {shown(text)} of {what}"
    if text:
        reading.problems.add(message, node.mark, hint=hint, rule="unknown-name")
    else:
        reading.expected("an interpolation", what, node, hint)
    return None
