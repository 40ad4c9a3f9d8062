"""``lagrange path``: paths of stationary action between two configurations at two times."""

from __future__ import annotations

import click

from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.cli import options
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import print_report
from lagrange_cli.report.document_options import ENDINGS, format_of
from lagrange_cli.report.formats import ReportForm


@click.command(cls=Command)
@options.scene
@click.option(
    "--from",
    "start",
    required=True,
    metavar="ENDS",
    help="Values of all coordinates and the time, with commas between them: 'x=0, t=0'. They are"
    " numbers or expressions over the parameters.",
)
@click.option("--to", "end", required=True, metavar="ENDS", help="The same later.")
@click.option(
    "--turns",
    type=int,
    default=0,
    show_default=True,
    metavar="N",
    help="Look also at ends whose angles differ by up to N whole turns.",
)
@click.option(
    "--starts",
    type=int,
    default=32,
    show_default=True,
    metavar="N",
    help="Number of paths that the search starts from, for each end.",
)
@options.number(
    "--accuracy",
    "EPS",
    "Largest error of any coordinate or velocity on a path, as a part of its scale.",
    1e-9,
)
@click.option(
    "--samples",
    type=int,
    default=101,
    show_default=True,
    metavar="N",
    help="Number of samples of each path, both ends included.",
)
@options.parameters
@options.file(
    "-o --output",
    f"Write the report as well, as {', '.join(ENDINGS.values())}, or the samples of all paths, as"
    " .csv.",
    callback=options.writable_as(*ENDINGS.values(), ".csv"),
)
@options.plot(
    "Draw the paths, variations beside the first, and the action over the size of variations, as"
    " .pdf, .svg, .png or .pgf, by matplotlib, or as .tex for pgfplots.",
    "tex",
)
@options.file(
    "--animate",
    "Write a film of the paths beside each other, as .svg, .gif (by matplotlib) or .mp4 (by"
    " ffmpeg, too).",
    callback=options.writable_as(".svg", ".gif", ".mp4"),
)
@options.report_form
@options.common
@click.pass_context
def path(
    ctx: click.Context,
    /,
    scene: str,
    start: str,
    end: str,
    turns: int,
    starts: int,
    accuracy: float,
    samples: int,
    parameters: dict[str, str],
    output: str | None,
    plot: str | None,
    animate: str | None,
    form: ReportForm,
) -> None:
    """Find the paths of SCENE, a YAML file or - for standard input, that make the action
    stationary between two configurations at two times, and certify them by simulation."""
    session = ctx.ensure_object(Session)
    asked = RememberedScene(session, read_source(scene), parameters, formulation="auto")
    guard(asked, {"-o": output, "--plot": plot, "--animate": animate})
    problem = asked.path_problem((start, "--from"), (end, "--to"))
    with session.progress("searching") as move:
        paths = asked.paths(
            problem,
            accuracy=accuracy,
            starts=starts,
            turns=turns,
            samples=samples,
            progress=move,
        )
    session.explain_code()
    report_file = None if format_of(output) is None else output
    if output is not None and report_file is None:
        paths.write(output)
    print_report(paths, form, report_file)
    if plot is not None:
        paths.plot(plot)
    if animate is not None and paths.solutions:
        asked.derivation().animate(animate, paths)
    ctx.exit(paths.exit_code)
