"""``lagrange schema``: JSON Schema of the scene language, for editors."""

from __future__ import annotations

import json

import click

from lagrange_cli.api import scene_schema
from lagrange_cli.cli import options
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.files import write_file


@click.command(cls=Command)
@options.file(
    "-o --output",
    "Write it to this .json file.  [default: print it]",
    callback=options.writable_as(".json"),
)
@options.traceback
def schema(output: str | None) -> None:
    """Print the JSON Schema of the scene language, by which editors complete and check scenes.

    A first line '# yaml-language-server: $schema=scene.schema.json' in a scene
    tells editors where it is.
    """
    text = json.dumps(scene_schema(), indent=2) + "\n"
    if output is None:
        print_text(text, "json")
    else:
        write_file(output, text)
