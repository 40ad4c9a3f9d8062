"""``lagrange show``: an HTML page on which the system moves."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NoReturn

import click

from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.cli import options
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.errors import InputError, LagrangeError, Problem, render
from lagrange_cli.files import stamp_of, write_file
from lagrange_cli.report.phrases.language import LANGUAGES

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation


#: Seconds between two looks at the files that are watched.
_LOOKED_AFTER = 0.3


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
    "--watch",
    is_flag=True,
    help="Serve the page on this machine, and show it anew when the scene is saved; Ctrl-C ends.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    show_default="any that is free",
    metavar="N",
    help="With --watch: the port.",
)
@click.option(
    "--language",
    type=click.Choice(LANGUAGES),
    metavar="|".join(LANGUAGES),
    help="Language of the words.  [default: en]",
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
    watch: bool,
    port: int,
    language: str | None,
) -> None:
    """Write a page on which SCENE, a YAML file or - for standard input, moves.

    One file of HTML, which loads nothing: open it in a browser. It integrates the certified
    equations, says how far it is from the simulated motion, and has sliders for parameters and
    starts."""
    if port and not watch:
        raise click.UsageError("--port is the port of --watch")
    if watch and (output is not None or scene == "-"):
        raise click.UsageError("--watch serves the page of a file: without -o, and not of -")
    if output is None and not watch:
        raise click.UsageError("name the file of the page, as in -o page.html, or --watch it")
    words = language or session.defaults.language or "en"
    times = {} if until is None else {"until": until}

    def page(derivation: Derivation) -> str:
        return derivation.page(language=words)

    def written() -> str:
        asked = RememberedScene(session, read_source(scene), parameters, initial, times)
        guard(asked, {"-o": output})
        text: str = asked.answer("show", [words], "making the page", page, reads_recordings=True)
        return text

    if output is None:
        _watch(session, scene, written, port)
    write_file(output, written().encode("utf-8"))
    session.remark(f"wrote {output}")


def _watch(session: Session, scene: str, written: Callable[[], str], port: int) -> NoReturn:
    """Serve a page, and make it anew whenever the scene or a file that it reads is saved."""
    from lagrange_cli.api import PageServer, files_of, message_page

    try:
        server = PageServer(port)
    except OSError as error:
        hint = "without --port, one that is free is taken"
        raise InputError(
            Problem(f"port {port}: {error.strerror}", hint=hint, rule="usage")
        ) from None
    known: list[tuple[int, ...]] | None = None
    with server:
        server.show(message_page("The page is being made."))
        print_text(f"{server.address}\n")
        while True:
            stamps = [stamp_of(path) for path in files_of(scene)]
            if stamps != known:
                try:
                    server.show(written())
                except LagrangeError as error:
                    text = "\n".join(map(render, error.problems))
                    for line in text.splitlines():
                        session.remark(line)
                    server.show(message_page(text))
                known = stamps
            time.sleep(_LOOKED_AFTER)
