"""``lagrange cache``: the results kept from earlier runs."""

from __future__ import annotations

import click

from lagrange_cli.api import Cache, Removed
from lagrange_cli.cli import options
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_report
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.report.formats import ReportForm
from lagrange_cli.report.values.check import CacheView


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
        number = removed.failures
        files = "1 file" if number == 1 else f"{number} files"
        stuck = f"{files} in '{cache.folder}' cannot be removed"
        raise InputError(Problem(stuck, rule="cache"))
    return removed


@click.command(cls=Command)
@click.option("--clear", is_flag=True, help="Remove all that is kept.")
@options.report_form
@options.traceback
@click.pass_obj
def cache(session: Session, clear: bool, form: ReportForm) -> None:
    """Show, or remove, the results kept from earlier runs, which answer the same question again.

    They are kept in $XDG_CACHE_HOME/lagrange, else in ~/.cache/lagrange. The
    environment variable LAGRANGE_CACHE=off turns the cache off.
    """
    opened = session.cache
    removed = _cleared(opened) if clear else None
    print_report(CacheView(opened, opened.entries(), removed), form)
