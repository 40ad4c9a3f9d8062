"""``lagrange cache``: the results kept from earlier runs."""

from __future__ import annotations

import click

from lagrange_cli.api import Cache, Removed
from lagrange_cli.cli import options
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.report.contents.listings import CACHE_FORMATS, file_count


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
    print_text(CACHE_FORMATS[format_](opened, removed), format_)
