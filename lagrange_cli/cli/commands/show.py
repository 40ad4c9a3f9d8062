"""``lagrange show``: an HTML page on which the system moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.cli import options
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.files import write_file
from lagrange_cli.report.phrases.language import LANGUAGES

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation


@click.command(cls=Command)
@options.scene
@heading("Motion")
@options.parameters
@options.initial
@options.end_time
@heading("Output")
@options.file(
    "-o --output", "Write this file of HTML.", callback=options.writable_as(".html", ".htm")
)
@click.option(
    "--language",
    type=click.Choice(LANGUAGES),
    default="en",
    show_default=True,
    metavar="|".join(LANGUAGES),
    help="Language of the words.",
)
@options.common
@click.pass_obj
def show(
    session: Session,
    /,
    scene: str,
    parameters: dict[str, str],
    initial: dict[str, str],
    until: str | None,
    output: str | None,
    language: str,
) -> None:
    """Write a page on which SCENE, a YAML file or - for standard input, moves.

    One file of HTML, which loads nothing: open it in a browser. It integrates the certified
    equations, says how far it is from the simulated motion, and has sliders for parameters and
    starts."""
    if output is None:
        raise click.UsageError("name the file of the page, as in -o page.html")
    times = {} if until is None else {"until": until}
    asked = RememberedScene(session, read_source(scene), parameters, initial, times)
    guard(asked, {"-o": output})

    def page(derivation: Derivation) -> str:
        return derivation.page(language=language)

    text = asked.answer("show", [language], "making the page", page, reads_recordings=True)
    write_file(output, text.encode("utf-8"))
    session.remark(f"wrote {output}")
