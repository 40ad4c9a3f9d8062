"""``lagrange emit``: code, a document or a sketch in a format of the registry."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from lagrange_cli.api.formats import EMITTERS, Emitter, FormatList
from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.cli import options
from lagrange_cli.cli.format_options import of_formats
from lagrange_cli.cli.guard import guard, guard_folder
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.cli.terminal.output import print_report, print_text
from lagrange_cli.files import write_files
from lagrange_cli.report.formats import ReportForm

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation, Formulation, Way


def _list(ctx: click.Context, option: click.Parameter, value: bool) -> None:
    """Print the formats and stop."""
    if not value or ctx.resilient_parsing:
        return
    print_report(FormatList(EMITTERS), ReportForm())
    ctx.exit()


@dataclass(frozen=True)
class _Target:
    """Destination of files: a folder, with their own names or a given one, or standard output.

    Attributes
    ----------
    folder
        The folder, None for standard output.
    name
        Name of the one file, None for the names of the format.
    """

    folder: str | None
    name: str | None = None

    @classmethod
    def of(cls, output: str | None, format_: Emitter, scene: str) -> _Target:
        """Read the path of ``-o``: a folder, a file of the format by its ending, or ``-``.

        Raises
        ------
        click.UsageError
            The format writes several files, or one that is no text to be printed.
        """
        output = None if output == "-" else output
        if output is None:
            if not format_.single_file:
                _refuse_several(format_, scene, "out/")
            return cls(None)
        if not output.endswith(format_.extensions) or os.path.isdir(output):
            return cls(output)
        folder, name = os.path.split(output)
        if len(format_.extensions) > 1:
            _refuse_several(format_, scene, folder or ".")
        return cls(folder or ".", name)

    def guard(self, asked: RememberedScene, format_: Emitter) -> None:
        """Refuse to replace what the command reads."""
        if self.name is not None and self.folder is not None:
            guard(asked, {"-o": os.path.join(self.folder, self.name)})
        elif self.folder is not None:
            guard_folder(self.folder, asked, format_)

    def named(self, files: Mapping[str, bytes]) -> Mapping[str, bytes]:
        """Return the files under the name that is given, if one is."""
        if self.name is None:
            return files
        (content,) = files.values()
        return {self.name: content}


def _refuse_several(chosen: Emitter, scene: str, folder: str) -> None:
    names = " and ".join("NAME" + extension for extension in chosen.extensions)
    command = f"lagrange emit {shlex.quote(scene)} --to {chosen.name} -o {shlex.quote(folder)}"
    raise click.UsageError(
        f"format '{chosen.name}' writes {names}: name a folder for them, as in\n  {command}"
    )


@click.command(cls=Command)
@options.scene
@heading("Output")
@click.option(
    "--to",
    "to",
    type=click.Choice(list(EMITTERS)),
    required=True,
    show_default=True,
    metavar="FORMAT",
    help=f"The format: {', '.join(EMITTERS)}.",
)
@click.option(
    "--list",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_list,
    help="List the formats, say what each is, and stop.",
)
@options.file(
    "-o --output",
    "Write into this folder, or this file if it ends as one of the format."
    "  [default: standard output, for formats of one file]",
    callback=options.not_empty,
    metavar="PATH",
)
@heading("Derivation")
@options.parameters
@options.formulation("auto", "auto")
@options.steps
@heading("Documents, and the style of Python")
@of_formats({name: format_.options for name, format_ in EMITTERS.items()}, {"real": "Code"})
@options.common
@click.pass_obj
def emit(
    session: Session,
    /,
    scene: str,
    to: str,
    steps: bool,
    by: Way | None,
    formulation: Formulation,
    parameters: dict[str, str],
    output: str | None,
    **chosen: str | bool | None,
) -> None:
    """Write the equations of SCENE, a YAML file or - for standard input, as code or a document.

    TikZ and SVG are sketches of the system at its start."""
    format_ = EMITTERS[to]
    target = _Target.of(output, format_, scene)
    way = options.way_of(steps, by, chosen)
    if way is not None and not format_.shows_steps:
        shown = " and ".join(name for name, format_ in EMITTERS.items() if format_.shows_steps)
        raise click.UsageError(f"format '{to}' has no steps; --steps is for {shown}")
    given_options = {name: value for name, value in chosen.items() if value is not None}
    format_options = session.defaults.for_documents(format_.options, given_options)
    format_.complete(format_options)
    forces = options.asks_for_forces(format_options)
    asked = RememberedScene(
        session,
        read_source(scene),
        parameters,
        forces=forces,
        formulation=formulation,
        steps=way,
        steps_optional=options.steps_are_optional(steps, by, chosen),
    )
    target.guard(asked, format_)

    def emitted(derivation: Derivation) -> Any:
        name = derivation.equations.presentation.name
        return {"name": name, "files": derivation.emit(to, **format_options)}

    question, stage = (to, sorted(format_options.items())), f"writing {format_.title}"
    answer = asked.answer("emit", question, stage, emitted, reads_recordings=True)
    if target.folder is None:
        print_text("".join(answer["files"].values()))
        return
    package = format_.package(answer["name"], answer["files"])
    for path in write_files(target.folder, target.named(package.files)):
        session.remark(f"wrote {path}")
    renamed = [] if target.name is not None else format_.renamed(answer["name"])
    session.tell((), [*renamed, *package.remarks])
