"""``lagrange tradeoff``: speed against accuracy, measured on this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.cli import options
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_report

if TYPE_CHECKING:
    from lagrange_cli.api import Formulation
    from lagrange_cli.report.formats import ReportForm


@click.command(cls=Command)
@options.scene
@click.option(
    "--methods",
    cls=options.naming(
        "Methods, with commas between them: auto, {}.  [default: all that run here but slow ones]",
        options.integrators,
    ),
    callback=options.comma_separated,
    metavar="LIST",
)
@click.option(
    "--repeat",
    type=click.IntRange(1, 1000),
    default=20,
    show_default=True,
    metavar="N",
    help="Number of times that short runs are timed; long ones are timed once.",
)
@options.end_time
@options.number(
    "--budget", "SECONDS", "Give a run up after this time, and finer ones of its method.", 1.0
)
@options.formulation(None, "the scene's, or auto")
@options.parameters
@options.initial
@options.report_path
@options.plot(
    "Draw seconds and right-hand sides over the error, as .pdf, .svg, .png, .pgf or .tex.", "tex"
)
@options.report_form
@options.common
@click.pass_context
def tradeoff(
    ctx: click.Context,
    /,
    scene: str,
    methods: tuple[str, ...] | None,
    repeat: int,
    until: str | None,
    budget: float,
    formulation: Formulation | None,
    parameters: dict[str, str],
    initial: dict[str, str],
    output: str | None,
    plot: str | None,
    form: ReportForm,
) -> None:
    """Run SCENE, a YAML file or - for standard input, with methods × tolerances, and compare
    their errors with what they cost."""
    session = ctx.ensure_object(Session)
    times = {} if until is None else {"until": until}
    asked = RememberedScene(
        session, read_source(scene), parameters, initial, times, formulation=formulation
    )
    guard(asked, {"-o": output, "--plot": plot})
    model = asked.model()
    with session.progress("measuring") as move:
        measured = asked.tradeoff(
            model, methods=methods, repeat=repeat, budget=budget, progress=move
        )
    session.explain_code()
    print_report(measured, form, output)
    if plot is not None:
        measured.plot(plot)
