"""Listings of what there is: the formats of code and documents, the results that are kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.cache import Cache, Removed
from lagrange_cli.errors import escape_controls
from lagrange_cli.notation.page import Page, Row, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, sentence_row, table
from lagrange_cli.report.values.check import cache_report

if TYPE_CHECKING:
    from lagrange_cli.emit.base import Emitter

#: Name, files, title.
_FORMATS = (TableColumn(before=""), TableColumn("", 0), TableColumn())


def listed_formats(emitters: Mapping[str, Emitter]) -> Page:
    """One format a line: its name, the files it writes, its title."""
    rows = [
        [name, ", ".join("NAME" + e for e in emitter.extensions), emitter.title]
        for name, emitter in emitters.items()
    ]
    return page([table(_FORMATS, rows, heading=False)])


def _cache_text(cache: Cache, removed: Removed | None) -> Page:
    """Write the report for a person."""
    if removed is not None:
        return page([[Row("", f"removed {file_count(removed.files)}, {_size(removed.size)}")]])
    report = cache_report(cache, removed)
    rows = []
    if report["reason"] is not None:
        rows.append(sentence_row(escape_controls(f"Nothing is kept: {report['reason']}")))
    if report["folder"] is not None:
        entries, size = report["entries"], report["bytes"]
        folder_rows = [
            ("Folder", escape_controls(report["folder"])),
            ("Entries", f"{entries['answers']} answers, {entries['compiled']} compiled"),
            ("Size", f"{_size(size)} of at most {_size(report['largest'])}"),
        ]
        rows += labelled(*folder_rows, width=7)
    return page([rows])


def _size(count: int) -> str:
    """Write a number of bytes, rounded."""
    for unit, size in (("MiB", 2**20), ("KiB", 2**10)):
        if count >= size:
            return f"{count / size:.1f} {unit}"
    return f"{count} bytes"


def file_count(count: int) -> str:
    """Return ``1 file`` or ``2 files``."""
    return "1 file" if count == 1 else f"{count} files"


#: Name of a format → what writes it.
CACHE_FORMATS: Mapping[str, Callable[[Cache, Removed | None], str | Page]] = {
    "text": _cache_text,
    "json": lambda cache, removed: json_text(cache_report(cache, removed), ascii=True),
}
