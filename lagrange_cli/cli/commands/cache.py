"""``lagrange cache``: the results kept from earlier runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import click

from lagrange_cli.api import MAX_CACHE_BYTES, Cache, Removed
from lagrange_cli.cli import options
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.errors import InputError, Problem, escape_controls
from lagrange_cli.report import Page, Row, page
from lagrange_cli.report.tables import json_text, labelled, sentence_row


def _cleared(cache: Cache) -> Removed:
    """Empty the cache.

    Raises
    ------
    InputError
        There is no cache, or a file cannot be removed.
    """
    if cache.folder is None:
        raise InputError(Problem(f"there is no cache to clear: {cache.reason}", rule="cache"))
    removed = cache.clear()
    if removed.failures:
        stuck = f"{file_count(removed.failures)} in '{cache.folder}' cannot be removed"
        raise InputError(Problem(stuck, rule="cache"))
    return removed


@click.command(cls=Command)
@click.option("--clear", is_flag=True, help="Remove all that is kept.")
@options.json_flag("Report as JSON.")
@options.traceback
@click.pass_obj
def cache(session: Session, clear: bool, as_json: bool) -> None:
    """Show, or remove, the results kept from earlier runs, which answer the same question again.

    They are kept in $XDG_CACHE_HOME/lagrange, else in ~/.cache/lagrange. The
    environment variable LAGRANGE_CACHE=off turns the cache off.
    """
    opened = session.cache
    removed = _cleared(opened) if clear else None
    format_ = "json" if as_json else "text"
    print_text(FORMATS[format_](opened, removed), format_)


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
FORMATS: Mapping[str, Callable[[Cache, Removed | None], str | Page]] = {
    "text": _text,
    "json": lambda cache, removed: json_text(_summary(cache, removed), ascii=True),
}
