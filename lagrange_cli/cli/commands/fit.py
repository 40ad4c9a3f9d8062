"""``lagrange fit``: parameters and initial values from measurements."""

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


def _bounds(
    ctx: click.Context, option: click.Parameter, value: tuple[str, ...]
) -> dict[str, tuple[float, float]]:
    """Split ``NAME=LOW,HIGH`` texts."""
    bounds = {}
    for text in value:
        name, _, ends = (part.strip() for part in text.partition("="))
        try:
            lowest, highest = map(float, ends.split(","))
        except ValueError:
            message = f"'{text}' is not of the form NAME=LOW,HIGH with two numbers"
            raise click.BadParameter(message, ctx, option) from None
        if name in bounds:
            raise click.BadParameter(f"'{name}' is given twice", ctx, option)
        bounds[name] = lowest, highest
    return bounds


@click.command(cls=Command)
@options.scene
@click.argument("data", type=click.Path())
@click.option(
    "--free",
    required=True,
    callback=options.comma_separated,
    metavar="NAMES",
    help="Names to fit, with commas between them: parameters, and coordinates or 'dot(NAME)' for "
    "their starts. The fit begins at the scene's values.",
)
@click.option(
    "--bounds",
    multiple=True,
    callback=_bounds,
    metavar="NAME=LOW,HIGH",
    help="Lowest and highest value of NAME; repeatable.",
)
@click.option(
    "--starts",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="Begin N times: with the scene's values, and others within bounds or decades.  "
    "[default: until one start explains the measurements, or enough agree]",
)
@options.number("--accuracy", "EPS", "Accuracy that is promised of each motion.", 1e-8)
@options.formulation(None, "the scene's, or auto")
@options.parameters
@options.initial
@options.report_path
@options.plot(
    "Draw measurements, the fitted motion and what is left, as .pdf, .svg, .png, .pgf or .tex.",
    "tex",
)
@options.report_form
@options.common
@click.pass_context
def fit(
    ctx: click.Context,
    /,
    scene: str,
    data: str,
    free: tuple[str, ...],
    bounds: dict[str, tuple[float, float]],
    starts: int | None,
    accuracy: float,
    formulation: Formulation | None,
    parameters: dict[str, str],
    initial: dict[str, str],
    output: str | None,
    plot: str | None,
    form: ReportForm,
) -> int:
    """Fit SCENE, a YAML file or - for standard input, to the measurements in DATA, a CSV file.

    Its first row is t and names of columns that a trajectory has; beside a column NAME there may be
    one of standard deviations, sigma(NAME). Cells without a measurement are empty.
    """
    session = ctx.ensure_object(Session)
    asked = RememberedScene(
        session, read_source(scene), parameters, initial, formulation=formulation
    )
    guard(asked, {"-o": output, "--plot": plot}, {"the measurements": data})
    derivation = asked.derivation()
    with session.progress("fitting") as move:
        fitted = derivation.fit(
            data, free, bounds=bounds, starts=starts, accuracy=accuracy, progress=move
        )
    print_report(fitted, form, output)
    if plot is not None:
        fitted.plot(plot)
    return fitted.exit_code
