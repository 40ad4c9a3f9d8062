"""Options that several subcommands share."""

from __future__ import annotations

import functools
import importlib.util
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

import click

from lagrange_cli.cli.session import Session
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import check_writable

#: Names of formulations.
FORMULATIONS = ("auto", "minimal", "multiplier")

_Command = TypeVar("_Command", bound=Callable[..., Any])


def naming(wording: str, names: Callable[[], Iterable[str]]) -> type[click.Option]:
    """A class of options whose help names what a registry has, imported only for that.

    ``wording`` has ``{}`` in their place.
    """

    class Naming(click.Option):
        def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
            self.help = wording.format(", ".join(names()))
            return super().get_help_record(ctx)

    return Naming


def integrators() -> Iterable[str]:
    """Names of the integration methods."""
    from lagrange_cli.simulate.integrators import INTEGRATORS

    return INTEGRATORS


def _assignments(
    ctx: click.Context, option: click.Parameter, values: tuple[str, ...]
) -> dict[str, str]:
    """Split ``NAME=VALUE`` texts; the values stay texts for the scene reader."""
    found: dict[str, str] = {}
    for text in values:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise click.BadParameter(f"'{text}' is not of the form NAME=VALUE", ctx, option)
        if name in found:
            raise click.BadParameter(f"'{name}' is given twice", ctx, option)
        found[name] = value
    return found


def scene(function: _Command) -> _Command:
    """The argument SCENE, a path or ``-``."""
    return click.argument("scene", type=click.Path(allow_dash=True))(function)


def parameters(function: _Command) -> _Command:
    """``-p NAME=VALUE``, as often as needed."""
    return click.option(
        "-p",
        "--parameter",
        "parameters",
        multiple=True,
        callback=_assignments,
        metavar="NAME=VALUE",
        help="Set a parameter or a size; repeatable.  [default: the scene's values]",
    )(function)


def initial(function: _Command) -> _Command:
    """``-i NAME=VALUE``, as often as needed."""
    return click.option(
        "-i",
        "--initial",
        "initial",
        multiple=True,
        callback=_assignments,
        metavar="NAME=VALUE",
        help="Set an initial value, of NAME or 'dot(NAME)'; repeatable.  "
        "[default: the scene's values]",
    )(function)


def formulation(default: str | None, said: str) -> Callable[[_Command], _Command]:
    """``--formulation minimal|multiplier|auto``."""
    return click.option(
        "--formulation",
        type=click.Choice(FORMULATIONS),
        default=default,
        help="Few coordinates, or Cartesian names with the constraints beside them and a "
        f"multiplier each; auto chooses.  [default: {said}]",
    )


def not_empty(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse an empty path, as an unset shell variable leaves it."""
    if value == "":
        raise click.BadParameter("the path is empty", ctx, option)
    return value


def writable(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse a file in no place to write before the work."""
    path = not_empty(ctx, option, value)
    if path is not None:
        check_writable(path)
    return path


def _plottable(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Name the missing extra or folder before the work."""
    if value is not None and importlib.util.find_spec("matplotlib") is None:
        raise InputError(
            Problem("plots need matplotlib", hint="pip install 'lagrange-cli[plot]'", rule="extra")
        )
    if value is not None:
        from lagrange_cli.simulate.results.plot import require_program

        require_program(Path(value).suffix.lower().lstrip("."))
    return writable(ctx, option, value)


def plot(said: str) -> Callable[[_Command], _Command]:
    """``--plot FILE``."""
    return click.option(
        "--plot",
        type=click.Path(),
        callback=_plottable,
        metavar="FILE",
        help=f"{said}; needs matplotlib.  [default: none]",
    )


def end_time(function: _Command) -> _Command:
    """``--until T``."""
    return click.option(
        "--until", metavar="T", help="End time, a number or expression.  [default: the scene's]"
    )(function)


def jobs(what: str) -> Callable[[_Command], _Command]:
    """``-j N``."""
    return click.option(
        "-j",
        "--jobs",
        type=click.IntRange(1, 4096),
        metavar="N",
        help=f"{what} at a time.  [default: the number of cores]",
    )


def cores() -> int:
    """How many cores this process may use."""
    import os

    of_process = getattr(os, "sched_getaffinity", None)
    return len(of_process(0)) if of_process else os.cpu_count() or 1


def comma_separated(
    ctx: click.Context, option: click.Parameter, value: str | None
) -> tuple[str, ...] | None:
    """Names as they are given, with commas between them."""
    if value is None:
        return None
    names = tuple(name.strip() for name in value.split(","))
    if not all(names):
        raise click.BadParameter(f"'{value}' is not names with commas between them", ctx, option)
    return names


def _report(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse a file that is no JSON, or in no place to write, before the work."""
    if value is None:
        return None
    if Path(value).suffix.lower() != ".json":
        raise click.BadParameter(f"'{value}' does not end in .json", ctx, option)
    check_writable(value)
    return value


def report_path(function: _Command) -> _Command:
    """``-o FILE.json``."""
    return click.option(
        "-o",
        "--output",
        type=click.Path(),
        callback=_report,
        metavar="FILE",
        help="Write the report, as .json.  [default: none]",
    )(function)


def output_file(help: str) -> Callable[[_Command], _Command]:
    """``-o FILE``."""
    return _output(help, writable)


def output_folder(help: str) -> Callable[[_Command], _Command]:
    """``-o FOLDER``."""
    return _output(help, not_empty)


def _output(help: str, callback: Callable[..., str | None]) -> Callable[[_Command], _Command]:
    return click.option(
        "-o", "--output", type=click.Path(), callback=callback, metavar="PATH", help=help
    )


def json_flag(help: str) -> Callable[[_Command], _Command]:
    """``--json``."""
    return click.option("--json", "as_json", is_flag=True, help=f"{help}  [default: off]")


def _quiet(ctx: click.Context, option: click.Parameter, value: bool) -> None:
    if value:
        ctx.ensure_object(Session).verbosity = -1


def _verbose(ctx: click.Context, option: click.Parameter, value: bool) -> None:
    if value:
        ctx.ensure_object(Session).verbosity = 1


def _strict(ctx: click.Context, option: click.Parameter, value: bool) -> None:
    ctx.ensure_object(Session).strict = value


def _traceback(ctx: click.Context, option: click.Parameter, value: bool) -> None:
    ctx.ensure_object(Session).traceback = value


#: Names, callback and help of the flags that every subcommand that reads a scene takes.
_COMMON = (
    (("--strict",), _strict, "Refuse what would be a warning."),
    (("-q", "--quiet"), _quiet, "No warnings and remarks."),
    (("-v", "--verbose"), _verbose, "More remarks: what was done and how long it took."),
    (("--traceback",), _traceback, "Show the program's traceback with an error."),
)


def _flag(
    names: tuple[str, ...], callback: Callable[..., None], help: str
) -> Callable[[_Command], _Command]:
    """A flag that is kept in the :class:`Session`."""
    return click.option(
        *names,
        is_flag=True,
        expose_value=False,
        is_eager=True,
        callback=callback,
        help=f"{help}  [default: off]",
    )


#: ``--traceback``, for commands that read no scene.
traceback = _flag(*_COMMON[-1])


def common(function: _Command) -> _Command:
    """The flags of every subcommand that reads a scene."""
    flags = [_flag(*declared) for declared in _COMMON]
    return functools.reduce(lambda decorated, flag: flag(decorated), flags[::-1], function)
