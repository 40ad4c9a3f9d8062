"""``lagrange config``: the defaults that hold here."""

from __future__ import annotations

import json

import click

from lagrange_cli.cli import options
from lagrange_cli.cli.defaults import KEYS
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.errors import escape_controls


@click.command(cls=Command)
@options.traceback
@click.pass_obj
def config(session: Session) -> None:
    """Print the defaults of options that hold here, as TOML, and the file that they come from.

    They are those of lagrange.toml, or of [tool.lagrange] of pyproject.toml, in the nearest folder
    upwards that has one.
    """
    defaults = session.defaults
    source = defaults.path or "no lagrange.toml, and no [tool.lagrange] of a pyproject.toml"
    values = {key: getattr(defaults, key) for key in KEYS}
    lines = [
        f"# {key}: not set" if value is None else f"{key} = {json.dumps(value, ensure_ascii=False)}"
        for key, value in values.items()
    ]
    print_text("".join(f"{escape_controls(line)}\n" for line in [f"# {source}", *lines]))
