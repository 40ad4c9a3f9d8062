"""What the commands share: how much to say, and how problems reach the terminal."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import click

from lagrange_cli.errors import InputError, Problem, escape_controls, render

__all__ = ["INTERRUPTED", "TERMINATED", "Session", "report_error"]

#: Exit codes of what a signal ended, as shells report them.
INTERRUPTED = 128 + signal.SIGINT
TERMINATED = 128 + signal.SIGTERM


def _show(problem: Problem, colour: str) -> None:
    """Write a problem to stderr; its first line is coloured on a terminal."""
    first, *rest = render(problem).splitlines()
    click.echo(click.style(first, fg=colour), err=True)
    for line in rest:
        click.echo(line, err=True)


def report_error(problem: Problem) -> None:
    """Write one error to stderr."""
    _show(problem, "red")


@dataclass
class Session:
    """Options that every subcommand takes.

    ``verbosity`` is −1 with ``-q``, 1 or more with ``-v``.
    """

    verbosity: int = 0
    strict: bool = False
    traceback: bool = False

    def warn(self, warnings: Iterable[Problem]) -> None:
        """Write warnings to stderr, or refuse them with ``--strict``.

        Raises
        ------
        InputError
            There are warnings and ``--strict`` was given.
        """
        found = tuple(warnings)
        if found and self.strict:
            raise InputError(*found, Problem("--strict: warnings are refused", rule="strict"))
        if self.verbosity >= 0:
            for problem in found:
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
    def progress(self, label: str) -> Iterator[Callable[[float], None]]:
        """Yield what takes the fraction done and moves a progress bar on stderr.

        The bar is hidden where stderr is no terminal, and with ``-q``.
        """
        hidden = self.verbosity < 0 or sys.stderr is None or not sys.stderr.isatty()
        with click.progressbar(length=1000, label=label, file=sys.stderr, hidden=hidden) as bar:
            yield lambda fraction: bar.update(round(1000 * fraction) - bar.pos)
