"""``lagrange derive``: the derivation as text, a document or JSON."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from lagrange_cli.api.formats import DERIVED, FORMS, completed
from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.cli import options
from lagrange_cli.cli.format_options import of_formats
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.cli.terminal.output import deliver, page_encoding
from lagrange_cli.report import USUAL_WIDTH, Page

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation, Formulation, Way


@click.command(cls=Command)
@options.scene
@heading("Derivation")
@options.parameters
@click.option(
    "--form",
    type=click.Choice([*FORMS, "multiplier"]),
    default="lagrange",
    show_default=True,
    metavar="FORM",
    help=f"The form of the equations: {', '.join(FORMS)}, multiplier.",
)
@click.option(
    "--forces",
    is_flag=True,
    help="Constraint forces and multipliers too.",
)
@options.steps
@click.option(
    "--bracket",
    "brackets",
    multiple=True,
    metavar="'F, G'",
    help="With --form hamiltonian: a Poisson bracket, as 'L_x, L_y'; repeatable.",
)
@click.option(
    "--digits",
    type=click.IntRange(15, 1000),
    default=30,
    show_default=True,
    metavar="N",
    help="Decimal digits of the certificate.",
)
@heading("Output")
@options.file("-o --output", "Write to this file.  [default: standard output]", metavar="PATH")
@options.format_by_ending(DERIVED)
@options.json_flag("The same as --format json.")
@click.option("--ascii", "ascii_only", is_flag=True, help="Text in plain ASCII.")
@options.plot(
    "With --form routhian: draw the effective potential, as .pdf, .svg, .png, .pgf or .tex.",
    "tex",
)
@heading("Documents")
@of_formats(DERIVED)
@options.common
@click.pass_obj
def derive(
    session: Session,
    /,
    scene: str,
    format_: str | None,
    as_json: bool,
    form: str,
    forces: bool,
    steps: bool,
    by: Way | None,
    brackets: tuple[str, ...],
    digits: int,
    ascii_only: bool,
    plot: str | None,
    parameters: dict[str, str],
    output: str | None,
    **chosen: str | bool | None,
) -> None:
    """Derive the equations of motion of SCENE, a YAML file or - for standard input."""
    asked = RememberedScene(session, read_source(scene), parameters)
    guard(asked, {"-o": output, "--plot": plot})
    if plot is not None and form != "routhian":
        raise click.UsageError("--plot draws an effective potential: --form routhian has one")
    if brackets and form != "hamiltonian":
        raise click.UsageError("--bracket is of Hamilton's equations: --form hamiltonian")
    to = options.chosen_format(session, format_, output, as_json=as_json)
    # Files are in UTF-8; terminals may show less.
    encoding = "utf-8" if output is not None else page_encoding()

    given_options = {name: value for name, value in chosen.items() if value is not None}
    written_with = session.defaults.for_documents(DERIVED[to], given_options)
    completed(to, DERIVED[to], written_with)
    forces = forces or options.asks_for_forces(written_with)

    formulation: Formulation = "multiplier" if form == "multiplier" else "auto"
    way = options.way_of(steps, by, chosen)
    form = "lagrange" if form == "multiplier" else form

    asked = replace(
        asked,
        forces=forces,
        formulation=formulation,
        steps=way,
        steps_optional=options.steps_are_optional(steps, by, chosen),
    )

    def written(derivation: Derivation) -> Any:
        content = derivation.with_brackets(*brackets).written(
            to, form=form, ascii=ascii_only, encoding=encoding, **written_with
        )
        return content.to_json() if isinstance(content, Page) else content

    question = brackets, to, form, ascii_only, encoding, sorted(written_with.items())
    stage = "writing the derivation"
    result = asked.answer("derive", question, stage, written, digits=digits)
    if plot is not None:
        session.remark(asked.derivation(digits).plot_effective_potential(plot))
    # A page is kept as it was before its lines were broken: windows differ in width.
    content = result if isinstance(result, str) else Page.from_json(result)
    deliver(content, to, output, width=USUAL_WIDTH)
