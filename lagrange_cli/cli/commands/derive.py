"""``lagrange derive``: the derivation as text, a document or JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeAlias

import click

from lagrange_cli.cli import options
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.models import SceneRequest, answer_of, derivation_of_scene
from lagrange_cli.cli.remembered import Answer, read_source, remembered
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.cli.terminal.output import can_encode, deliver, page_encoding
from lagrange_cli.emit.base import completed
from lagrange_cli.emit.document_options import FORMS
from lagrange_cli.emit.registry import DERIVED
from lagrange_cli.notation.page import USUAL_WIDTH, Page
from lagrange_cli.report.tables import json_text
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation
    from lagrange_cli.mechanics.step_values import Way
    from lagrange_cli.scene.conditions import Formulation


#: Option of a format → its value.
Options: TypeAlias = Mapping[str, str | bool]


def _text(
    derivation: Derivation, form: str, chosen: Options, ascii_only: bool, encoding: str
) -> Page:
    """The derivation as text, in ASCII where the encoding has no more."""
    from lagrange_cli.emit.text import derivation_page

    equations = derivation.equations
    written = derivation_page(equations, form=form, ascii=ascii_only, options=chosen)
    if ascii_only or can_encode(written.text(), encoding):
        return written
    return derivation_page(equations, form=form, ascii=True, options=chosen)


def _json(
    derivation: Derivation, form: str, chosen: Options, _ascii_only: bool, _encoding: str
) -> str:
    """The derivation as JSON."""
    return json_text(derivation.report(form=form, latex=bool(chosen.get("latex"))))


def _document(to: str) -> Callable[[Derivation, str, Options, bool, str], str]:
    """The derivation in a format of ``emit``."""

    def written(
        derivation: Derivation, form: str, chosen: Options, _ascii_only: bool, _encoding: str
    ) -> str:
        (text,) = derivation.emit(to, form=form, **chosen).values()
        return text

    return written


#: Name of a format → what writes it, in a form of the equations, with options of the format, in
#: plain ASCII or in what an encoding has.
FORMATS: Mapping[str, Callable[[Derivation, str, Options, bool, str], str | Page]] = {
    "text": _text,
    "latex": _document("latex"),
    "markdown": _document("markdown"),
    "typst": _document("typst"),
    "json": _json,
}


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
@click.option(
    "--format",
    "format_",
    type=click.Choice(list(FORMATS)),
    default="text",
    show_default=True,
    metavar="FORMAT",
    help=f"The format: {', '.join(FORMATS)}.",
)
@options.json_flag("The same as --format json.")
@click.option("--ascii", "ascii_only", is_flag=True, help="Text in plain ASCII.")
@options.plot(
    "With --form routhian: draw the effective potential, as .pdf, .svg, .png, .pgf or .tex.",
    "tex",
)
@heading("Documents")
@options.of_formats(DERIVED)
@options.common
@click.pass_obj
def derive(
    session: Session,
    /,
    scene: str,
    format_: str,
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
    source = read_source(scene)
    guard(source, parameters, {"-o": output, "--plot": plot})
    if plot is not None and form != "routhian":
        raise click.UsageError("--plot draws an effective potential: --form routhian has one")
    if brackets and form != "hamiltonian":
        raise click.UsageError("--bracket is of Hamilton's equations: --form hamiltonian")
    format_ = "json" if as_json else format_
    # Files are in UTF-8; terminals may show less.
    encoding = "utf-8" if output is not None else page_encoding()

    written_with = {name: value for name, value in chosen.items() if value is not None}
    completed(format_, DERIVED[format_], written_with)
    forces = forces or options.asks_for_forces(written_with)

    formulation: Formulation = "multiplier" if form == "multiplier" else "auto"
    way = options.way_of(steps, by)
    form = "lagrange" if form == "multiplier" else form

    request = SceneRequest(source, parameters, forces=forces, formulation=formulation, steps=way)

    def work() -> Answer:
        derivation = derivation_of_scene(session, request, digits)
        derivation = derivation.with_brackets(*brackets)
        announce("writing the derivation")
        written = FORMATS[format_](derivation, form, written_with, ascii_only, encoding)
        return answer_of(derivation, written.to_json() if isinstance(written, Page) else written)

    question = brackets, format_, form, formulation, forces, way, digits, ascii_only, encoding
    asked = (*question, list(parameters.items()), sorted(written_with.items()))
    result = remembered(session, "derive", source, asked, work)
    if plot is not None:
        turning_points = derivation_of_scene(session, request, digits).plot_effective_potential(
            plot
        )
        session.remark(turning_points)
    # A page is kept as it was before its lines were broken: windows differ in width.
    content = result if isinstance(result, str) else Page.from_json(result)
    deliver(content, format_, output, width=USUAL_WIDTH)
