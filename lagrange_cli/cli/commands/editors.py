"""``lagrange schema`` and ``lagrange lsp``, for editors.

The first prints the JSON Schema of the scene language, or of reports; the second serves an editor.
"""

from __future__ import annotations

import importlib.util

import click

from lagrange_cli.api import REPORTS, report_schema, scene_schema
from lagrange_cli.cli import options
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.cli.terminal.streams import results
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import write_file
from lagrange_cli.report.tables import json_text


@click.command(cls=Command)
@click.option(
    "--report",
    type=click.Choice(list(REPORTS)),
    metavar="NAME",
    help=f"The schema of what --json writes: {', '.join(REPORTS)}.  [default: scenes]",
)
@options.file(
    "-o --output",
    "Write it to this .json file.  [default: print it]",
    callback=options.writable_as(".json"),
)
@options.traceback
def schema(report: str | None, output: str | None) -> None:
    """Print the JSON Schema of the scene language, by which editors complete and check scenes.

    A first line '# yaml-language-server: $schema=scene.schema.json' in a scene
    tells editors where it is. With --report print the JSON Schema of what a command writes
    with --json, by which other programs read and check it.
    """
    value = scene_schema() if report is None else report_schema(report)
    text = json_text(value)
    if output is None:
        print_text(text, "json")
    else:
        write_file(output, text)


@click.command(cls=Command)
@options.traceback
def lsp() -> None:
    """Serve an editor over standard streams, by the language server protocol.

    Editors start it by themselves; docs/editors.md says how each is told to.
    """
    if importlib.util.find_spec("pygls") is None:
        hint = "pip install 'lagrange-cli[lsp]'"
        raise InputError(Problem("the language server needs pygls", hint=hint, rule="extra"))
    from lagrange_cli.editors.server import serve

    stream = results()
    if stream is None:
        raise InputError(Problem("standard output is closed", rule="stream"))
    serve(stream.buffer)
