"""Options that several subcommands share."""

from __future__ import annotations

import functools
import importlib.util
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import heading
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import check_writable, ending_of, is_address
from lagrange_cli.report.document_options import ENDINGS, EXERCISES, format_of
from lagrange_cli.report.formats import FORMATS, ReportForm
from lagrange_cli.report.phrases.language import LANGUAGES

if TYPE_CHECKING:
    from lagrange_cli.api import Way

#: Names of formulations.
FORMULATIONS = ("auto", "minimal", "multiplier")

_Command = TypeVar("_Command", bound=Callable[..., Any])


def naming(wording: str, names: Callable[[], Iterable[str]]) -> type[click.Option]:
    """Make a class of options whose help lists the names of a registry, imported only for that.

    ``wording`` has ``{}`` in their place.
    """

    class Naming(click.Option):
        def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
            self.help = wording.format(", ".join(names()))
            return super().get_help_record(ctx)

    return Naming


def integrators() -> Iterable[str]:
    """Return the names of the integration methods."""
    from lagrange_cli.api import methods

    return methods()


def _assignments(
    ctx: click.Context, option: click.Parameter, values: tuple[str, ...]
) -> dict[str, str]:
    """Split ``NAME=VALUE`` texts; the values stay texts for the scene reader."""
    assigned: dict[str, str] = {}
    for text in values:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise click.BadParameter(f"'{text}' is not of the form NAME=VALUE", ctx, option)
        if name in assigned:
            raise click.BadParameter(f"'{name}' is given twice", ctx, option)
        assigned[name] = value
    return assigned


def comma_separated(
    ctx: click.Context, option: click.Parameter, value: str | None
) -> tuple[str, ...] | None:
    """Split names with commas between them."""
    if value is None:
        return None
    names = tuple(name.strip() for name in value.split(","))
    if not all(names):
        raise click.BadParameter(f"'{value}' is not names with commas between them", ctx, option)
    return names


def not_empty(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse an empty path, as an unset shell variable leaves it."""
    if value == "":
        raise click.BadParameter("the path is empty", ctx, option)
    return value


def _writable(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse a file that cannot be written, before the work."""
    path = not_empty(ctx, option, value)
    if path is not None and not _is_store(path):
        check_writable(path)
    return path


def _is_store(path: str) -> bool:
    """Tell whether this is a store of many files that is there, or is on no disk."""
    return ending_of(path) == ".zarr" and (is_address(path) or os.path.isdir(path))


def writable_as(*endings: str) -> Callable[..., str | None]:
    """Make a callback that refuses files of other endings as well."""

    def checked(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
        if value is not None and ending_of(value) not in endings:
            message = f"'{value}' does not end in {' or '.join(endings)}"
            raise click.BadParameter(message, ctx, option)
        return _writable(ctx, option, value)

    return checked


def _plottable(*formats: str) -> Callable[..., str | None]:
    """Make a callback that names what is missing for a plot before the work.

    ``formats``: endings of files that are made without matplotlib.
    """

    def checked(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
        ending = "" if value is None else ending_of(value).lstrip(".")
        if value is not None and ending not in formats:
            if importlib.util.find_spec("matplotlib") is None:
                further = "; --plot FILE.tex needs none" if formats else ""
                hint = f"pip install 'lagrange-cli[plot]'{further}"
                raise InputError(Problem("plots need matplotlib", hint=hint, rule="extra"))
            from lagrange_cli.api.analysis import require_picture

            require_picture(ending)
        return _writable(ctx, option, value)

    return checked


def number(
    name: str, metavar: str, help: str, default: float | None = None
) -> Callable[[_Command], _Command]:
    """An option that takes a number."""
    shown = default is not None
    return click.option(
        name, type=float, default=default, show_default=shown, metavar=metavar, help=help
    )


def file(
    names: str,
    help: str,
    *,
    callback: Callable[..., str | None] | None = _writable,
    metavar: str = "FILE",
) -> Callable[[_Command], _Command]:
    """An option that takes a path, by default of a file to write; its names by blanks apart."""
    return click.option(
        *names.split(), type=click.Path(), callback=callback, metavar=metavar, help=help
    )


def _assignments_to(names: str, help: str) -> Callable[[_Command], _Command]:
    """An option that takes ``NAME=VALUE``, as often as needed."""
    return click.option(
        *names.split(), multiple=True, callback=_assignments, metavar="NAME=VALUE", help=help
    )


def formulation(default: str | None, said: str) -> Callable[[_Command], _Command]:
    """``--formulation minimal|multiplier|auto``."""
    return click.option(
        "--formulation",
        type=click.Choice(FORMULATIONS),
        default=default,
        metavar="FORM",
        help="minimal: few coordinates; multiplier: Cartesian names and a multiplier for each "
        f"constraint; auto chooses.  [default: {said}]",
    )


def plot(said: str, *formats: str, name: str = "--plot") -> Callable[[_Command], _Command]:
    """``--plot FILE``; ``formats`` are endings of files that are made without matplotlib."""
    return file(name, said, callback=_plottable(*formats))


def jobs(what: str) -> Callable[[_Command], _Command]:
    """``-j N``."""
    return click.option(
        "-j",
        "--jobs",
        type=click.IntRange(1, 4096),
        metavar="N",
        help=f"{what} at a time.  [default: the number of cores]",
    )


def way_of(steps: bool, by: Way | None, chosen: Mapping[str, str | bool | None]) -> Way | None:
    """Return the way of the steps that options, those of documents too, ask for; else None."""
    return by or ("lagrange" if steps or chosen.get("style") in EXERCISES else None)


def steps_are_optional(
    steps: bool, by: Way | None, chosen: Mapping[str, str | bool | None]
) -> bool:
    """Say whether steps are for the problem of an exercise alone, which can be without."""
    return by is None and not steps and chosen.get("style") == "exercise"


def cores() -> int:
    """Return the number of cores that this process may use."""
    import os

    of_process = getattr(os, "sched_getaffinity", None)
    return len(of_process(0)) if of_process else os.cpu_count() or 1


def in_order(
    options: Sequence[Callable[[_Command], _Command]],
) -> Callable[[_Command], _Command]:
    """Make one decorator of those of several options, in the order of the help text."""
    return lambda function: functools.reduce(lambda done, one: one(done), options[::-1], function)


def json_flag(help: str) -> Callable[[_Command], _Command]:
    """``--json``."""
    return click.option("--json", "as_json", is_flag=True, help=help)


def format_by_ending(formats: Iterable[str]) -> Callable[[_Command], _Command]:
    """``--format`` of what ``-o`` writes; see :func:`chosen_format`."""
    return click.option(
        "--format",
        "format_",
        type=click.Choice(list(formats)),
        metavar="FORMAT",
        help=f"{', '.join(formats)}.  [default: that of the ending of -o, or text]",
    )


def chosen_format(
    session: Session, written: str | None, output: str | None, *others: str, as_json: bool
) -> str:
    """Return the format that is asked for by its name, or by the ending of a file, or by default.

    ``others``: formats besides, which are the endings of their files.
    """
    ending = "" if output is None else ending_of(output).lstrip(".")
    by_ending = ending if ending in others else format_of(output)
    return "json" if as_json else written or by_ending or session.defaults.format or "text"


def reporting(*others: str, replaces: bool = False) -> Callable[[_Command], _Command]:
    """``--format``, ``--language`` and ``--json``, which the command takes as one ``form``.

    Parameters
    ----------
    others
        Names of formats that the command has besides.
    replaces
        True if ``-o`` writes a file in place of what is printed, whose ending may say the format.
    """
    names = [*FORMATS, *others]
    options = in_order(
        (
            format_by_ending(names)
            if replaces
            else click.option(
                "--format",
                "format_",
                type=click.Choice(names),
                metavar="FORMAT",
                help=f"{', '.join(names)}.  [default: text]",
            ),
            click.option(
                "--language",
                type=click.Choice(LANGUAGES),
                help="The language of the report.  [default: en]",
            ),
            json_flag("The same as --format json."),
        )
    )

    def decorated(function: _Command) -> _Command:
        @functools.wraps(function)
        def with_form(*args: Any, **values: Any) -> Any:
            output = values["output"] if replaces else None
            written, as_json = values.pop("format_"), values.pop("as_json")
            session = click.get_current_context().ensure_object(Session)
            to = chosen_format(session, written, output, *others, as_json=as_json)
            code = values.pop("language")
            if code is not None and to in ("json", *others):
                raise click.UsageError(f"--language: {to} is the same in every language")
            if code is None:
                code = session.defaults.language or "en"
            return function(*args, form=ReportForm(to, code), **values)

        return cast(_Command, options(with_form))

    return decorated


#: The formats of most reports.
report_form = reporting()


def _session_flag(
    names: str, attribute: str, value: int, help: str
) -> Callable[[_Command], _Command]:
    """A flag that gives an attribute of the :class:`Session` a value."""

    def note(ctx: click.Context, option: click.Parameter, is_set: bool) -> None:
        if is_set:
            setattr(ctx.ensure_object(Session), attribute, value)

    return click.option(
        *names.split(),
        is_flag=True,
        expose_value=False,
        is_eager=True,
        callback=note,
        help=help,
    )


def asks_for_forces(chosen: Mapping[str, str | bool]) -> bool:
    """Say whether the sections of a document that are asked for hold constraint forces."""
    return "forces" in str(chosen.get("sections", "")).replace(" ", "").split(",")


#: The argument SCENE, a path or ``-``.
scene = click.argument("scene", type=click.Path(allow_dash=True))

#: ``--until T``.
end_time = click.option(
    "--until", metavar="T", help="End time, as 10 or 20*pi.  [default: the scene's]"
)

#: ``-p NAME=VALUE``.
parameters = _assignments_to(
    "-p --parameter --input parameters",
    "Set a parameter, a size, or an input, as u='sin(t)'; repeatable.",
)

#: ``-i NAME=VALUE``.
initial = _assignments_to(
    "-i --initial initial",
    "Start value of NAME or 'dot(NAME)'; repeatable.",
)

#: ``--at NAME=VALUE``.
at = _assignments_to(
    "--at at",
    "Linearize at the equilibrium with this value of a coordinate, input or, with --steady, p_phi"
    " or 'dot(phi)'; repeatable.  [default: the stable one nearest to the start]",
)

#: ``--steps`` and ``--by WAY``; see :func:`way_of`.
steps = in_order(
    (
        click.option(
            "--steps",
            is_flag=True,
            help="Every step from positions to equations, as on a board.",
        ),
        click.option(
            "--by",
            type=click.Choice(["lagrange", "dalembert", "virtual-work"]),
            metavar="WAY",
            help="Steps by lagrange, dalembert (d'Alembert's principle) or virtual-work (to the"
            " equilibria); implies --steps."
            "  [default: lagrange]",
        ),
    )
)

#: ``-o FILE``, of reports.
report_path = file(
    "-o --output",
    f"Write the report as well, as {', '.join(ENDINGS.values())}.",
    callback=writable_as(*ENDINGS.values()),
)

#: ``--exclude GLOB``, of commands on folders.
excluded = click.option(
    "--exclude",
    multiple=True,
    metavar="GLOB",
    help="None whose path, or a name in it, matches; repeatable.",
)

#: ``--traceback``.
traceback = _session_flag(
    "--traceback", "traceback", True, "Show the program's traceback with an error."
)


def messages(quiet: str) -> Callable[[_Command], _Command]:
    """``--strict``, ``-q``, ``-v`` and ``--traceback``; ``quiet`` is the help of ``-q``."""
    return in_order(
        (
            heading("Messages"),
            _session_flag("--strict", "strict", True, "Refuse what would be a warning."),
            _session_flag("-q --quiet", "verbosity", -1, quiet),
            _session_flag(
                "-v --verbose", "verbosity", 1, "More remarks: what was done and how long it took."
            ),
            traceback,
        )
    )


#: The flags of every subcommand that reads a scene.
common = messages("No warnings and remarks.")
