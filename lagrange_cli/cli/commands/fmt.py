"""``lagrange fmt``: scenes in the usual layout."""

from __future__ import annotations

from collections.abc import Iterator

import click

from lagrange_cli.cli import options
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import difference, print_text
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import read_bytes, write_file


def _changed(
    paths: list[str], refused: list[Problem], *, prints: bool
) -> Iterator[tuple[str, bytes, str]]:
    """Yield each scene whose layout is another: its path, and its text before and after.

    Parameters
    ----------
    refused
        Takes the problems of scenes that cannot be read.
    prints
        A scene on standard input is printed.
    """
    from lagrange_cli.api import laid_out

    for path in paths:
        try:
            data = read_bytes(path)
            text = laid_out(data, "<stdin>" if path == "-" else path)
        except InputError as error:
            refused += error.problems
            continue
        if path == "-" and prints:
            print_text(text)
        elif text.encode() != data:
            yield path, data, text


@click.command(cls=Command)
@click.argument(
    "paths", nargs=-1, required=True, type=click.Path(allow_dash=True), metavar="PATH..."
)
@click.option(
    "--check", "checks", is_flag=True, help="Write nothing; exit 1 if a layout is another."
)
@click.option("--diff", is_flag=True, help="Print what would change; implies --check.")
@options.excluded
@options.traceback
@click.pass_context
def fmt(
    ctx: click.Context, paths: tuple[str, ...], checks: bool, diff: bool, exclude: tuple[str, ...]
) -> None:
    """Write scenes in the usual layout: order of sections, indentation, spaces, quotes.

    PATH is a scene, a folder (searched for *.yaml and *.yml), or - for standard input, which is
    printed. Comments are kept, and a scene is written only if it means what it meant.
    """
    from lagrange_cli.api import Selection, scenes_in

    session = ctx.ensure_object(Session)
    scenes = Selection(excluded=exclude or session.defaults.exclude or ()).selected(
        scenes_in(paths), None
    )
    refused: list[Problem] = []
    changed = list(_changed(scenes, refused, prints=not (checks or diff)))
    for path, data, text in changed:
        if diff:
            print_text(difference(path, data, text.encode()))
        elif checks:
            session.remark(f"{path}: another layout")
        else:
            write_file(path, text)
            session.remark(f"{path}: written")
    if refused:
        raise InputError(*refused)
    ctx.exit(1 if changed and (checks or diff) else 0)
