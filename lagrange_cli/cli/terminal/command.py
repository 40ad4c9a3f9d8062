"""The class of subcommands: help in groups of options, output of packages kept apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import click

from lagrange_cli.cli.terminal.streams import results_apart

_Decorated = TypeVar("_Decorated", bound=Callable[..., Any])

#: Columns of the longest option whose explanation stands beside it. Longer ones have a line of
#: their own, so that explanations have two thirds of a line of 80 columns.
_WIDEST_OPTION = 26

#: Last line of the help of each subcommand.
_EPILOG = "Options without a default are off. docs/command-line.md tells more of each."


class Heading(click.Option):
    """The title of a group of options in help. It stands among parameters, and is none itself.

    Parameters
    ----------
    title
        Text of the line above the options of the group.
    """

    def __init__(self, param_decls: Sequence[str] | None = None, *, title: str) -> None:
        super().__init__(["--heading"], expose_value=False, hidden=True)
        self.title = title


def heading(title: str) -> Callable[[_Decorated], _Decorated]:
    """Begin a group of the options that are declared below, up to the next heading."""
    return click.option(cls=Heading, title=title)


class Command(click.Command):
    """A subcommand whose help has a group of options under each :class:`Heading`.

    While it works, whatever packages print goes to standard error.
    """

    def __init__(self, name: str | None, *, params: Sequence[click.Parameter], **others: Any):
        declared = [p for p in params if not isinstance(p, Heading)]
        super().__init__(name, params=declared, epilog=_EPILOG, **others)
        self._groups: list[tuple[str, list[click.Parameter]]] = [("Options", [])]
        for parameter in params:
            if isinstance(parameter, Heading):
                self._groups.append((parameter.title, []))
            else:
                self._groups[-1][1].append(parameter)

    def invoke(self, ctx: click.Context) -> Any:
        with results_apart():
            return super().invoke(ctx)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write each group of options under its title; ``--help`` ends the last one."""
        own_help = self.get_help_option(ctx)
        for title, parameters in self._groups:
            shown = [p for p in parameters if isinstance(p, click.Option)]
            if own_help is not None and title == self._groups[-1][0]:
                shown.append(own_help)
            records = [record for p in shown if (record := p.get_help_record(ctx)) is not None]
            if records:
                with formatter.section(title):
                    formatter.write_dl(records, col_max=_WIDEST_OPTION)
