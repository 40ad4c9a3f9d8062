"""``lagrange stress``: a scene at its extremes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import click

from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.cli import engines, options
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_report

if TYPE_CHECKING:
    from lagrange_cli.api import Formulation
    from lagrange_cli.report.formats import ReportForm


def _axes() -> Iterable[str]:
    from lagrange_cli.api.studies import stress_axes

    return stress_axes()


@click.command(cls=Command)
@options.scene
@click.option(
    "--axes",
    cls=options.naming("Axes, with commas between them: {}.  [default: all]", _axes),
    callback=options.comma_separated,
    metavar="LIST",
)
@options.end_time
@options.number(
    "--accuracy",
    "EPS",
    "Accuracy that each point is asked for, as by simulate.  [default: the scene's, or 1e-6]",
)
@options.number(
    "--budget",
    "SECONDS",
    "Stop the run of a point after this time; those of its reference have twice as much.",
    5.0,
)
@options.formulation(None, "the scene's, or auto")
@options.jobs("Points")
@engines.on("Run points")
@options.parameters
@options.initial
@options.report_path
@options.report_form
@options.common
@click.pass_context
def stress(
    ctx: click.Context,
    /,
    scene: str,
    axes: tuple[str, ...] | None,
    until: str | None,
    accuracy: float | None,
    budget: float,
    formulation: Formulation | None,
    jobs: int | None,
    scheduler: str | None,
    parameters: dict[str, str],
    initial: dict[str, str],
    output: str | None,
    form: ReportForm,
) -> None:
    """Push the parameters and the start of SCENE, a YAML file or - for standard input, to
    extremes, and compare every result with a reference."""
    session = ctx.ensure_object(Session)
    times = {} if until is None else {"until": until}
    asked = RememberedScene(
        session, read_source(scene), parameters, initial, times, formulation=formulation
    )
    guard(asked, {"-o": output})
    with (
        engines.cluster(session, scheduler, jobs) as cluster,
        session.progress("stressing") as move,
    ):
        outcomes = asked.stress(
            axes=axes,
            accuracy=accuracy,
            budget=budget,
            jobs=jobs or session.defaults.jobs or options.cores(),
            cluster=cluster,
            progress=move,
        )
    print_report(outcomes, form, output)
    ctx.exit(1 if outcomes.counts["wrong"] else 0)
