"""``lagrange analyze``: equilibria, stability, linear systems, modes."""

from __future__ import annotations

import base64
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lagrange_cli.cli import options
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.models import SceneRequest, answer_of, derivation_of_scene
from lagrange_cli.cli.remembered import Answer, read_source, remembered
from lagrange_cli.cli.reports.analyze import ENDINGS, FORMATS, analysis_json, npz_of
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.output import Command, deliver, page_encoding
from lagrange_cli.emit.base import completed
from lagrange_cli.emit.document_options import ANALYZED
from lagrange_cli.files import write_file
from lagrange_cli.notation.page import USUAL_WIDTH, Page

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation
    from lagrange_cli.api.analyzed import Analyzed


@click.command(
    cls=Command, short_help="Symmetries, equilibria and their stability, linear system, modes."
)
@options.scene
@click.option(
    "--symmetries",
    is_flag=True,
    help="Displacements linear in the coordinates that change nothing, and what they conserve."
    "  [default: all parts that can be found]",
)
@click.option(
    "--equilibria",
    is_flag=True,
    help="Configurations of rest, and their stability.  [default: as before]",
)
@click.option(
    "--linearization",
    is_flag=True,
    help="M, C, K at an equilibrium, and A, B, C, D of first order.  [default: as before]",
)
@click.option(
    "--modes",
    is_flag=True,
    help="Frequencies and shapes; poles where there is damping.  [default: as before]",
)
@click.option(
    "--lyapunov",
    type=float,
    metavar="UNTIL",
    help="Lyapunov exponents of the motion until this time.  [default: none]",
)
@click.option(
    "--along",
    type=float,
    metavar="UNTIL",
    help="A(t), B(t), C(t), D(t) along the motion until this time, in place of those at an "
    "equilibrium.  [default: none]",
)
@click.option(
    "--response",
    callback=options.frequencies,
    metavar="FROM..TO",
    help="Frequency responses of outputs to inputs between two angular frequencies, with largest "
    "gains; alone unless other parts are named.  [default: none]",
)
@options.number(
    "--accuracy",
    "EPS",
    "With --along: largest error of the motion and of the matrices, as a part of their scales.  "
    "[default: 1e-6]",
)
@click.option(
    "--samples",
    type=int,
    metavar="N",
    help="With --along: number of samples.  [default: the scene's, or 501]",
)
@click.option(
    "--steady",
    is_flag=True,
    help="Steady motions in place of equilibria: cyclic coordinates turn, the others rest."
    "  [default: off]",
)
@options.at
@options.plot(
    "With --modes: draw the shapes of the modes; with --response: its Bode diagram; both as .svg,"
    " .pdf or .png, by matplotlib. With --branches: draw the bifurcation diagram, also as .pgf, or"
    " as .tex for pgfplots.",
    "tex",
)
@options.file(
    "--animate",
    "With --modes: draw the modes moving, as .svg, or as .gif by matplotlib.  [default: none]",
    callback=options.writable_as(".svg", ".gif"),
)
@click.option(
    "--branches",
    callback=options.value_range,
    metavar="NAME=FROM..TO",
    help="Branches of equilibria as a parameter varies, with folds, branch points, flutter and the"
    " stability of each part.  [default: none]",
)
@options.plot(
    "With --branches: draw root loci, the poles along each branch in the complex plane.",
    "tex",
    name="--loci",
)
@click.option(
    "--format",
    "format_",
    type=click.Choice(list(FORMATS)),
    default="text",
    show_default=True,
    help="What to write.",
)
@options.of_formats(ANALYZED)
@click.option("--ascii", "ascii_only", is_flag=True, help="Text in plain ASCII.  [default: off]")
@options.parameters
@options.json_flag("The same as --format json.")
@options.analysis_path
@options.common
@click.pass_context
def analyze(
    ctx: click.Context,
    /,
    scene: str,
    symmetries: bool,
    equilibria: bool,
    linearization: bool,
    modes: bool,
    lyapunov: float | None,
    along: float | None,
    response: tuple[float, float] | None,
    accuracy: float | None,
    samples: int | None,
    steady: bool,
    at: dict[str, str],
    plot: str | None,
    animate: str | None,
    branches: tuple[str, str, str] | None,
    loci: str | None,
    format_: str,
    ascii_only: bool,
    parameters: dict[str, str],
    as_json: bool,
    output: str | None,
    **chosen: str | bool | None,
) -> None:
    """Analyze the equations of motion of SCENE, a YAML file or - for standard input."""
    session: Session = ctx.obj
    source = read_source(scene)
    outputs = {"-o": output, "--plot": plot, "--animate": animate, "--loci": loci}
    guard(source, parameters, outputs)
    if loci is not None and branches is None:
        raise click.UsageError("--loci draws poles along branches; add --branches NAME=FROM..TO")
    bode, plot = (None, plot)
    if response is not None:
        bode, plot = _bode(plot, others=modes or branches is not None, steady=steady), None
    pictured = modes or response is not None
    diagram, plot = _told_apart(plot, modes=modes, others=pictured, branches=branches is not None)
    _require_modes({"--plot": plot, "--animate": animate}, modes=modes, steady=steady)
    asked = {
        "symmetries": symmetries,
        "equilibria": equilibria,
        "linearization": linearization and along is None,
        "modes": modes,
    }
    parts = [part for part, wanted in asked.items() if wanted]
    ending = "" if output is None else Path(output).suffix.lower()
    as_report, as_arrays = ending in (".json", ".npz"), ending == ".npz"
    others = parts or branches is not None
    if as_arrays and others and not linearization and along is None and response is None:
        raise click.UsageError("an .npz file holds the linear system; add --linearization")
    motions = lyapunov is not None or along is not None
    _require_used(along, accuracy, samples, at, alone=motions and not (parts or steady or branches))
    drawn = {"diagram": diagram, "loci": loci}
    pictures = {k: Path(f).suffix.lower().lstrip(".") for k, f in drawn.items() if f is not None}
    format_ = "json" if as_json else format_
    written_with = {name: value for name, value in chosen.items() if value is not None}
    completed(format_, ANALYZED[format_], written_with)
    if output is not None and ending not in (".json", ".npz", ENDINGS[format_]):
        message = f"'{output}' does not end in .json, .npz or {ENDINGS[format_]}"
        raise click.BadParameter(f"{message}, as --format {format_} asks", param_hint="'-o'")
    # Files are in UTF-8; terminals may show less.
    encoding = page_encoding() if output is None or as_report else "utf-8"
    request = SceneRequest(source, parameters)

    def work() -> Answer:
        derivation = derivation_of_scene(session, request)
        alone = not (parts or steady or branches) and bool(motions or response)
        analysis = _analyzed(
            derivation, None if alone else parts, at, steady=steady, branches=branches
        )
        if lyapunov is not None:
            with session.progress("following neighbouring motions") as move:
                found = derivation.lyapunov(until=lyapunov, progress=move)
            analysis = replace(analysis, exponents=found.summary)
        if along is not None:
            wanted = 1e-6 if accuracy is None else accuracy
            beside = derivation.linearize(until=along, accuracy=wanted, samples=samples)
            analysis = replace(analysis, along=beside.summary)
        if response is not None:
            found_response = derivation.frequency_response(*response, at=at)
            analysis = replace(analysis, response=found_response)
        written = FORMATS[format_](analysis, written_with, ascii_only, encoding)
        shown = written.to_json() if isinstance(written, Page) else written
        answer = {"report": analysis.report(), "shown": shown}
        for name, ending in pictures.items():
            drawing = analysis.drawn(ending, loci=name == "loci")
            answer[name] = base64.b64encode(drawing).decode()
        recorded = any(u.recording is not None for u in derivation.equations.inputs)
        return answer_of(derivation, answer, lasting=not (motions and recorded))

    motion = lyapunov, along, accuracy, samples, response
    asked_of = parts, motion, steady, list(at.items()), list(parameters.items()), branches, pictures
    question = (*asked_of, format_, sorted(written_with.items()), ascii_only, encoding)
    value = remembered(session, "analyze", source, question, work)
    report = value["report"]
    if as_report:
        assert output is not None
        write_file(output, npz_of(_with_matrices(report)) if as_arrays else analysis_json(report))
    shown = value["shown"]
    content = shown if isinstance(shown, str) else Page.from_json(shown)
    if plot is not None or animate is not None:
        _draw_modes(session, request, plot, animate, at)
    for name, path in drawn.items():
        if path is not None:
            write_file(path, base64.b64decode(value[name]))
    if bode is not None and response is not None:
        derivation = derivation_of_scene(session, request)
        derivation.plot_response(bode, derivation.frequency_response(*response, at=at))
    deliver(content, format_, None if as_report else output, width=USUAL_WIDTH)
    if along is not None and report["along"]["status"] != "ok":
        ctx.exit(1)


def _require_used(
    along: float | None,
    accuracy: float | None,
    samples: int | None,
    at: dict[str, str],
    *,
    alone: bool,
) -> None:
    """Refuse options that nothing would read.

    ``alone``: only motions are asked about.
    """
    for option, value in (("--accuracy", accuracy), ("--samples", samples)):
        if value is not None and along is None:
            raise click.UsageError(f"{option} is for --along")
    if at and alone:
        raise click.UsageError("--at is for parts at an equilibrium; a motion begins at 'initial'")


def _bode(plot: str | None, *, others: bool, steady: bool) -> str | None:
    """Return the file of a Bode diagram; None for none."""
    if steady:
        raise click.UsageError("--response is at rest, not of steady motions")
    if plot is not None and others:
        message = "--plot draws the response, the modes or the branches; ask for one at a time"
        raise click.UsageError(message)
    if plot is not None and Path(plot).suffix.lower() == ".tex":
        raise click.UsageError("--plot draws a response as .svg, .pdf or .png")
    return plot


def _told_apart(
    plot: str | None, *, modes: bool, others: bool, branches: bool
) -> tuple[str | None, str | None]:
    """Return the file of a bifurcation diagram, and that of modes and other pictures."""
    if plot is None:
        return None, None
    if others and branches:
        message = "--plot draws one picture; ask for --branches alone, or without them"
        raise click.UsageError(message)
    if not branches and modes and Path(plot).suffix.lower() == ".tex":
        raise click.UsageError("--plot draws modes as .svg, .pdf or .png")
    return (plot, None) if branches else (None, plot)


def _require_modes(pictures: dict[str, str | None], *, modes: bool, steady: bool) -> None:
    """Refuse pictures of modes where there are none."""
    for option, path in pictures.items():
        if path is not None and not modes:
            more = ", or --response FROM..TO" if option == "--plot" else ""
            raise click.UsageError(f"{option} draws the shapes of modes; add --modes{more}")
        if path is not None and steady:
            raise click.UsageError(f"{option} draws modes at rest, not those of steady motions")


def _draw_modes(
    session: Session,
    request: SceneRequest,
    plot: str | None,
    animate: str | None,
    at: dict[str, str],
) -> None:
    """Draw the modes, still and moving, and say what is not drawn."""
    derivation = derivation_of_scene(session, request)
    remarks = [] if plot is None else [derivation.plot_modes(plot, at=at)]
    remarks += [] if animate is None else [derivation.animate_modes(animate, at=at)]
    for remark in dict.fromkeys(filter(None, remarks)):
        session.remark(remark)


def _analyzed(
    derivation: Derivation,
    parts: list[str] | None,
    at: dict[str, str],
    *,
    steady: bool,
    branches: tuple[str, str, str] | None,
) -> Analyzed:
    """Return an analysis; of the equations alone if no parts are wanted."""
    from lagrange_cli.analysis.values import Analysis
    from lagrange_cli.api.analyzed import Analyzed

    if parts is None:
        return Analyzed.of(Analysis(derivation.equations))
    over = None if branches is None else {branches[0]: (branches[1], branches[2])}
    return derivation.analyze(*parts, at=at, steady=steady, branches=over)


def _with_matrices(report: dict[str, Any]) -> dict[str, Any]:
    """Return a report that has a linear system.

    Raises
    ------
    InputError
        It was left out.
    """
    if report["linearization"] is None and not report.keys() & {"along", "response"}:
        from lagrange_cli.errors import InputError, Problem

        reasons = [left["reason"] for left in report["left_out"]]
        raise InputError(Problem(f"there is no linear system: {reasons[0]}", rule="analyze"))
    return report
