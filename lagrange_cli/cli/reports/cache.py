"""Report of ``lagrange cache``: the entries kept from earlier runs, and those removed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from lagrange_cli.cache import MAX_CACHE_BYTES, Cache, Removed
from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.reports.tables import labelled, sentence_row
from lagrange_cli.errors import escape_controls
from lagrange_cli.notation.page import Page, Row, page

#: Kind of entry → the endings of its files.
_KINDS = {"answers": (".json",), "compiled": (".so", ".db")}


def _summary(cache: Cache, removed: Removed | None) -> dict[str, Any]:
    """Return what ``lagrange cache --json`` writes; ``removed`` is None without ``--clear``."""
    entries = cache.entries()
    report = {
        "folder": cache.folder,
        "usable": cache.reason is None,
        "reason": cache.reason,
        "entries": {kind: sum(e.suffix in s for e in entries) for kind, s in _KINDS.items()},
        "bytes": sum(entry.size for entry in entries),
        "largest": MAX_CACHE_BYTES,
    }
    if removed is not None:
        report["removed"] = {"files": removed.files, "bytes": removed.size}
    return report


def _text(cache: Cache, removed: Removed | None) -> Page:
    """Write the report for a person."""
    if removed is not None:
        return page([[Row("", f"removed {file_count(removed.files)}, {_size(removed.size)}")]])
    report = _summary(cache, removed)
    rows = []
    if report["reason"] is not None:
        rows.append(sentence_row(escape_controls(f"Nothing is kept: {report['reason']}")))
    if report["folder"] is not None:
        entries, size = report["entries"], report["bytes"]
        kept = [
            ("Folder", escape_controls(report["folder"])),
            ("Entries", f"{entries['answers']} answers, {entries['compiled']} compiled"),
            ("Size", f"{_size(size)} of at most {_size(report['largest'])}"),
        ]
        rows += labelled(*kept, width=7)
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
FORMATS: Mapping[str, Callable[[Cache, Removed | None], str | Page]] = {
    "text": _text,
    "json": lambda cache, removed: json_text(_summary(cache, removed), ascii=True),
}
