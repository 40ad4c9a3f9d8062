"""Options that formats of documents and code declare, as those of commands."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lagrange_cli.cli.options import in_order
from lagrange_cli.cli.terminal.command import heading

if TYPE_CHECKING:
    from lagrange_cli.api.formats import Option

#: Letters of choices that stand in brackets after an option; longer ones follow its explanation.
_MOST_CHOICES = 12

_Command = TypeVar("_Command", bound=Callable[..., Any])


def of_formats(
    formats: Mapping[str, Sequence[Option]], headings: Mapping[str, str] | None = None
) -> Callable[[_Command], _Command]:
    """The options that formats declare, each once; their help says what it means in which.

    ``headings``: name of an option → the heading that stands above it.
    """
    declared: dict[str, list[tuple[str, Option]]] = {}
    for name, taken in formats.items():
        for option in taken:
            declared.setdefault(option.name, []).append((name, option))
    further = {name for name, uses in declared.items() if all(option.further for _, option in uses)}
    single = []
    for name in (name for name in declared if name not in further):
        single += [heading(headings[name])] if headings and name in headings else []
        single.append(_of_formats(name, declared[name]))
    asked = {name: declared[name] for name in declared if name in further}
    return in_order([*single, _with_further(asked)] if asked else single)


def _with_further(
    declared: Mapping[str, list[tuple[str, Option]]],
) -> Callable[[_Command], _Command]:
    """Make the Click option ``--with``, which asks for further parts, commas between them."""

    def chosen(ctx: click.Context, option: click.Parameter, value: str | None) -> None:
        for name in [] if value is None else [part.strip() for part in value.split(",")]:
            if name not in declared:
                known = ", ".join(declared)
                raise click.BadParameter(f"'{name}' is not one of {known}", ctx, option)
            ctx.params[name] = True

    meanings: list[str] = []
    first: dict[str, str] = {}
    for name, taken in declared.items():
        formats = ", ".join(format_ for format_, _ in taken)
        meanings.append(f"{name} ({first.get(formats, formats)}): {taken[0][1].help}")
        first.setdefault(formats, f"as {name}")
    several = "With commas between them: " if len(declared) > 1 else ""
    return click.option(
        "--with",
        "further",
        metavar="LIST" if several else next(iter(declared)),
        expose_value=False,
        callback=chosen,
        help=f"{several}{'; '.join(meanings)}.",
    )


def _of_formats(name: str, declared: list[tuple[str, Option]]) -> Callable[[_Command], _Command]:
    """Make the Click option of an option that one or more formats declare."""
    help = " ".join(_meanings(declared))
    first = declared[0][1]
    if first.is_flag:
        flag = f"--{name.replace('_', '-')}"
        return click.option(flag, name, is_flag=True, default=None, help=help)
    if first.metavar:
        return click.option(f"--{name}", name, metavar=first.metavar, help=help)
    choices = list(dict.fromkeys(c for _, option in declared for c in option.choices))
    metavar = name.upper() if _has_long_choices(first) else None
    return click.option(f"--{name}", name, type=click.Choice(choices), metavar=metavar, help=help)


def _has_long_choices(option: Option) -> bool:
    """Say whether the choices of an option stand in its text, since there is no room before it."""
    return not option.metavar and len("|".join(option.choices)) > _MOST_CHOICES


def _meanings(declared: list[tuple[str, Option]]) -> Iterator[str]:
    """Merge identical help texts of several formats, each after the names of its formats."""
    formats: dict[str, list[str]] = {}
    for format_, option in declared:
        listed = f": {', '.join(option.choices)}" if _has_long_choices(option) else ""
        default = "" if option.is_flag else f"  [default: {option.shown_default}]"
        formats.setdefault(f"{option.help}{listed}.{default}", []).append(format_)
    return (f"{', '.join(names)}: {text}" for text, names in formats.items())
