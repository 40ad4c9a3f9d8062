"""``lagrange cache``: what is kept from earlier runs."""

from __future__ import annotations

import json
from typing import Any

import click

from lagrange_cli.cache import LARGEST, Cache, Removed
from lagrange_cli.cli import options
from lagrange_cli.cli.output import Command, print_text
from lagrange_cli.cli.session import Session
from lagrange_cli.errors import InputError, Problem, escape_controls

__all__ = ["cache"]

#: The endings of files by what they hold.
KINDS = {"answers": (".json",), "compiled": (".so", ".db")}


def _report(cache: Cache) -> dict[str, Any]:
    entries = cache.entries()
    return {
        "folder": cache.folder,
        "usable": cache.reason is None,
        "reason": cache.reason,
        "entries": {kind: sum(e.suffix in s for e in entries) for kind, s in KINDS.items()},
        "bytes": sum(entry.size for entry in entries),
        "largest": LARGEST,
    }


def _text(report: dict[str, Any]) -> str:
    lines = []
    if report["reason"] is not None:
        lines.append(f"Nothing is kept: {report['reason']}")
    if report["folder"] is not None:
        entries, size = report["entries"], report["bytes"]
        lines.append(f"Folder   {report['folder']}")
        lines.append(f"Entries  {entries['answers']} answers, {entries['compiled']} compiled")
        lines.append(f"Size     {_size(size)} of at most {_size(report['largest'])}")
    return "\n".join(map(escape_controls, lines))


def _size(count: int) -> str:
    """A number of bytes, short."""
    for unit, size in (("MiB", 2**20), ("KiB", 2**10)):
        if count >= size:
            return f"{count / size:.1f} {unit}"
    return f"{count} bytes"


def _files(count: int) -> str:
    return "1 file" if count == 1 else f"{count} files"


def _cleared(cache: Cache) -> Removed:
    """Empty the cache, or say what stands in the way."""
    if cache.folder is None:
        raise InputError(Problem(f"there is no cache to clear: {cache.reason}", rule="cache"))
    before = {entry.name for entry in cache.entries()}
    removed = cache.clear()
    left = sum(entry.name in before for entry in cache.entries())
    if left:
        raise InputError(
            Problem(f"{_files(left)} in '{cache.folder}' cannot be removed", rule="cache")
        )
    return removed


@click.command(cls=Command, short_help="What is kept from earlier runs, and how to clear it.")
@click.option("--clear", is_flag=True, help="Remove all that is kept.  [default: off]")
@options.json_flag("Report as JSON.")
@options.traceback
@click.pass_obj
def cache(session: Session, clear: bool, as_json: bool) -> None:
    """Show what is kept from earlier runs, so that the same need not be worked out again.

    It is kept in $XDG_CACHE_HOME/lagrange, else in ~/.cache/lagrange. The
    environment variable LAGRANGE_CACHE=off turns the cache off.
    """
    kept = session.cache
    removed = _cleared(kept) if clear else None
    if as_json:
        report = _report(kept)
        if removed is not None:
            report["removed"] = {"files": removed.files, "bytes": removed.size}
        print_text(json.dumps(report, indent=2) + "\n")
    elif removed is not None:
        print_text(f"removed {_files(removed.files)}, {_size(removed.size)}")
    else:
        print_text(_text(_report(kept)))
