"""Listings of what there is: the formats of code and documents, the results that are kept."""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.cache import MAX_CACHE_BYTES, Cache, Removed
from lagrange_cli.emit.base import Emitter, FormatList
from lagrange_cli.report.contents.numbers import decimal
from lagrange_cli.report.inlines import Listed, Plain, Text, say
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import (
    Column,
    Document,
    Labelled,
    Paragraph,
    Section,
    section,
    sections,
    table_of,
)
from lagrange_cli.report.values.check import CACHE, CacheView


@contents_of.register
def format_document(listed: FormatList) -> Document:
    """Return each format with the files that it writes, and its title."""
    columns: tuple[Column[Emitter], ...] = (
        Column(say("format"), lambda emitter: emitter.name),
        Column(say("files"), lambda emitter: ", ".join(f"NAME{e}" for e in emitter.extensions)),
        Column(say("content"), lambda emitter: Plain(emitter.title)),
    )
    shown = table_of(listed.emitters.values(), *columns, prose=say("content"))
    return Document("formats", "what emit writes", "", sections(section("", shown)))


json_of.register(CacheView, CACHE.write)


@contents_of.register
def cache_document(view: CacheView) -> Document:
    """Return the folder of a cache and what it holds, or what was removed from it."""
    if view.removed is not None:
        written = section("", _removed(view.removed))
    else:
        shown = CACHE.write(view)
        written = _held(view.cache, shown["entries"], shown["bytes"])
    return Document("cache", "the results that are kept", "", sections(written))


def _removed(removed: Removed) -> Paragraph:
    files = say.counted(removed.files, "{count} file", "{count} files")
    said = say("removed {files}, {size}", files=files, size=_size(removed.size))
    return Paragraph(said, "heading")


def _held(cache: Cache, entries: Mapping[str, int], size: int) -> Section | None:
    reason = say("Nothing is kept: {reason}", reason=Plain(cache.reason or ""))
    numbers = say(
        "{answers} answers, {compiled} compiled",
        answers=entries["answers"],
        compiled=entries["compiled"],
    )
    most = say("{size} of at most {largest}", size=_size(size), largest=_size(MAX_CACHE_BYTES))
    rows = (
        (say("Folder"), Plain(cache.folder or "")),
        (say("Entries"), numbers),
        (say("Size"), most),
    )
    return section(
        "",
        Paragraph(reason, "heading") if cache.reason is not None else None,
        Labelled(rows) if cache.folder is not None else None,
    )


def _size(count: int) -> Text:
    """Write a number of bytes, rounded."""
    for unit, size in (("MiB", 2**20), ("KiB", 2**10)):
        if count >= size:
            return Listed((decimal(count / size, ".1f"), unit), between=" ")
    return say.counted(count, "{count} byte", "{count} bytes")
