"""``lagrange new``: a commented scene to begin with."""

from __future__ import annotations

import os

import click

from lagrange_cli.api.starter import starter_scene
from lagrange_cli.cli import options
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import write_file


@click.command(cls=Command)
@click.argument("name")
@options.file("-o --output", "Write it to this .yaml file, - to print it.  [default: NAME.yaml]")
@options.traceback
def new(name: str, output: str | None) -> None:
    """Write a commented scene, NAME.yaml, that can be derived and simulated as it is."""
    text = starter_scene(name)
    path = output or f"{name}.yaml"
    if path == "-":
        print_text(text, "text")
        return
    if os.path.lexists(path):
        raise InputError(Problem(f"'{path}' is there already", hint="-o another.yaml", rule="new"))
    write_file(path, text)
    print_text(f"{path}: lagrange derive {path}\n", "text")
