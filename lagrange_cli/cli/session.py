"""The session of a command: how much it says, and how problems reach the terminal."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import click

from lagrange_cli.api.workspace import Workspace
from lagrange_cli.cli.terminal.appearance import is_terminal, wants_colour
from lagrange_cli.cli.terminal.progress import ProgressBar, shown_stage
from lagrange_cli.errors import InputError, Problem, escape_controls, render
from lagrange_cli.stages import Listener, heard_by

if TYPE_CHECKING:
    from lagrange_cli.cli.defaults import Defaults

#: Exit code that shells report for a process that Ctrl-C ended.
INTERRUPTED = 128 + signal.SIGINT


def _show(problem: Problem, colour: str) -> None:
    """Write a problem to stderr; its first line is coloured on a terminal."""
    first, *further = render(problem).splitlines()
    is_coloured = wants_colour(sys.stderr)
    click.echo(click.style(first, fg=colour), err=True, color=is_coloured)
    for line in further:
        click.echo(line, err=True)


def report_error(problem: Problem) -> None:
    """Write one error to stderr."""
    _show(problem, "red")


@dataclass
class Session(Workspace):
    """The options that every subcommand takes, and what it tells on stderr.

    Attributes
    ----------
    verbosity
        −1 with ``-q``, 1 with ``-v``, else 0.
    strict
        True if warnings are refused.
    traceback
        True if tracebacks are shown with errors.
    stage
        Phrase for the work that was announced last.
    """

    verbosity: int = 0
    strict: bool = False
    traceback: bool = False
    stage: str = "beginning"

    @cached_property
    def defaults(self) -> Defaults:
        """The defaults of options that hold in the working directory; refuses wrong ones."""
        from lagrange_cli.cli.defaults import read_defaults

        return read_defaults()

    def tell(self, warnings: Iterable[Problem], remarks: Iterable[str]) -> None:
        """Write warnings and remarks to stderr; see :meth:`warn` and :meth:`remark`."""
        self.warn(warnings)
        for remark in remarks:
            self.remark(remark)

    def warn(self, warnings: Iterable[Problem]) -> None:
        """Write warnings to stderr, or refuse them with ``--strict``.

        Raises
        ------
        InputError
            There are warnings and ``--strict`` was given.
        """
        problems = tuple(warnings)
        if problems and self.strict:
            raise InputError(*problems, Problem("--strict: warnings are refused", rule="strict"))
        if self.verbosity >= 0:
            for problem in problems:
                _show(problem, "yellow")

    def remark(self, text: str) -> None:
        """Write a remark to stderr unless ``-q`` was given."""
        if self.verbosity >= 0:
            click.echo(escape_controls(text), err=True)

    def detail(self, text: str) -> None:
        """Write a detail to stderr if ``-v`` was given."""
        if self.verbosity > 0:
            click.echo(escape_controls(text), err=True)

    @contextmanager
    def stages(self) -> Iterator[None]:
        """Note the stages of the work done here; show them on a terminal."""
        shown = is_terminal(sys.stderr) and self.verbosity >= 0
        with shown_stage(sys.stderr) if shown else nullcontext() as show:

            def note(stage: str) -> None:
                self.stage = stage or self.stage
                if show is not None:
                    show(stage)

            with heard_by(Listener(hears=note)):
                yield

    @contextmanager
    def progress(self, label: str) -> Iterator[ProgressBar]:
        """Yield a progress bar on stderr, to be called with the fraction done.

        It is hidden unless stderr is a terminal, and with ``-q``; with ``-v`` lines take its place.
        """
        shown = is_terminal(sys.stderr) and self.verbosity >= 0
        if not shown:
            # Click's bar could be hidden, but takes 1 ms to import.
            yield ProgressBar(None, self.detail if self.verbosity > 0 else None)
            return
        with click.progressbar(
            length=1000, label=label, file=sys.stderr, item_show_func=lambda item: item
        ) as bar:
            yield ProgressBar(bar)
