"""Report of ``lagrange emit --list``: the formats that equations can be written in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.cli.reports.tables import TableColumn, table
from lagrange_cli.notation.page import Page, page

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
