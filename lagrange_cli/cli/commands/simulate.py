"""``lagrange simulate``: a trajectory, with the accuracy it has."""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from lagrange_cli.api import SimulationOptions
from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.api.simulations import SimulationRequest
from lagrange_cli.cli import options
from lagrange_cli.cli.guard import checkpoint_files, guard
from lagrange_cli.cli.requests import ensemble, sections
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.cli.terminal.interrupts import Interrupts, OverdueError, noted_interrupts, within
from lagrange_cli.cli.terminal.output import print_report
from lagrange_cli.errors import AccuracyError, InputError, Problem
from lagrange_cli.files import check_writable, ending_of, sole_writer
from lagrange_cli.report.formats import spoken
from lagrange_cli.report.values.simulation import Simulated
from lagrange_cli.stages import Listener, heard_by

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lagrange_cli.api import Checkpoint, Formulation, Model, Trajectory
    from lagrange_cli.report.formats import ReportForm

#: A plain number.
_DECIMAL = re.compile(r"[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]{1,3})?", re.ASCII)

#: Least seconds of the budget that remain for the motion, if deriving has not spent them all.
_LEAST_BUDGET = 1e-3

#: Endings of files of one motion, and of ensembles alone.
_FILES, _FILES_OF_MEMBERS = (".csv", ".npz"), (".parquet", ".zarr")

#: Endings of films, and of the page that moves.
_FILMS = (".svg", ".gif", ".mp4", ".html")

#: Columns beyond the state that files can have.
FILE_COLUMNS = ("energy", "positions", "forces", "momenta", "conserved")

#: Those of them that are outputs of the model.
OUTPUT_COLUMNS = ("momenta", "conserved")


def _names(ctx: click.Context, option: click.Parameter, value: str | None) -> tuple[str, ...]:
    """Split names with commas between them."""
    names = [] if value is None else [part.strip() for part in value.split(",")]
    if not all(names):
        raise click.BadParameter("a name is missing: theta,m is two of them", ctx, option)
    return tuple(dict.fromkeys(names))


def _further_columns(
    ctx: click.Context, option: click.Parameter, value: str | None
) -> tuple[str, ...]:
    """Split names of further columns, with commas between them."""
    if value is None:
        return ()
    names = tuple(dict.fromkeys(part.strip() for part in value.split(",")))
    for name in names:
        if name not in FILE_COLUMNS:
            known = ", ".join(FILE_COLUMNS)
            raise click.BadParameter(f"'{name}' is not one of {known}", ctx, option)
    return names


@click.command(cls=Command)
@options.scene
@heading("Run")
@options.end_time
@click.option(
    "--from", "start", metavar="T", help="Start time, likewise.  [default: the scene's, or 0]"
)
@options.number(
    "--accuracy",
    "EPS",
    "Largest error of the motion, as a part of its scales.  [default: the scene's, or 1e-6]",
)
@click.option(
    "--method",
    cls=options.naming(
        "Integration method: auto, {}.  [default: the scene's, or auto]", options.integrators
    ),
    metavar="NAME",
)
@options.number("--rtol", "X", "Relative tolerance of a step.  [default: the scene's]")
@options.number("--atol", "X", "Absolute tolerance.  [default: rtol/100 of each scale]")
@options.number(
    "--step",
    "H",
    "Step of methods of fixed step; time between samples.  [default: the scene's]",
)
@click.option(
    "--samples",
    type=int,
    metavar="N",
    help="Number of samples.  [default: the scene's, or 501]",
)
@options.number("--budget", "SECONDS", "Stop after this time and keep what is done.")
@options.formulation(None, "the scene's, or auto")
@heading("Start and parameters")
@options.initial
@options.parameters
@heading("Output")
@click.option(
    "--with",
    "columns",
    callback=_further_columns,
    metavar="NAMES",
    help="Further columns, with commas between them: energy, forces, momenta, conserved, "
    "positions.",
)
@click.option(
    "--sensitivity",
    callback=_names,
    metavar="NAMES",
    help="Derivatives by starts and parameters, as theta,m.",
)
@options.file(
    "-o --output",
    "Write the samples, as .csv or .npz; of many runs as .npz, .parquet or .zarr.",
    callback=options.writable_as(*_FILES, *_FILES_OF_MEMBERS),
)
@click.option(
    "--section",
    metavar="CONDITION",
    help="Points of a Poincaré section, as 'x=0, dot(x)>0'.",
)
@options.report_form
@heading("Pictures")
@options.plot("Draw the motion, as .pdf, .svg, .png, .pgf or .tex.", "tex")
@click.option(
    "--plot-of",
    metavar="CURVES",
    help="Draw these curves, as 'z:x, dot(theta):theta'.",
)
@options.file(
    "--animate",
    "Film the motion, as .svg, .gif, .mp4 or .html.",
    callback=options.writable_as(*_FILMS),
)
@options.number("--speed", "X", "Units of time a second.  [default: 1, or a film of 10 s]")
@ensemble.ensemble_options
@heading("Interruptions")
@options.file(
    "--checkpoint",
    "Write the state of the run now and then and at a stop.",
    callback=options.not_empty,
)
@click.option(
    "--resume",
    is_flag=False,
    flag_value="",
    metavar="[FILE]",
    help="Go on from FILE of --checkpoint, or with the runs of -o.",
)
@options.common
@click.pass_context
def simulate(
    ctx: click.Context,
    /,
    scene: str,
    until: str | None,
    start: str | None,
    formulation: Formulation | None,
    parameters: dict[str, str],
    initial: dict[str, str],
    columns: tuple[str, ...],
    sensitivity: tuple[str, ...],
    output: str | None,
    plot: str | None,
    plot_of: str | None,
    animate: str | None,
    speed: float | None,
    section: str | None,
    form: ReportForm,
    checkpoint: str | None,
    resume: str | None,
    member_file: str | None,
    **chosen: Any,
) -> None:
    """Integrate SCENE, a YAML file or - for standard input, and report its end."""
    session, started = ctx.ensure_object(Session), perf_counter()
    times = {k: v for k, v in (("until", until), ("start", start)) if v is not None}
    if until is not None and _DECIMAL.fullmatch(until):
        # A plain number changes nothing of the model, so that one from before can be used.
        chosen["until"] = float(times.pop("until"))
    asked_scene = RememberedScene(
        session, read_source(scene), parameters, initial, times, formulation=formulation
    )
    state = checkpoint if resume is None else resume
    outputs = {"-o": output, "--plot": plot, "--animate": animate, **checkpoint_files(state)}
    guard(asked_scene, outputs, {"the ensemble": member_file})
    about_members = {name: chosen.pop(name) for name in ensemble.MEMBER_OPTIONS}
    # A section has a picture of its own, beside which a map is refused.
    drawn = plot if section is None or about_members["map_names"] else None
    members = ensemble.member_choice(
        member_file=member_file, resume=resume, checkpoint=checkpoint, plot=drawn, **about_members
    )
    one = members is None or section is not None
    if one and output is not None and ending_of(output) in _FILES_OF_MEMBERS:
        raise click.UsageError(f"-o: '{output}' does not end in {' or '.join(_FILES)}")
    if members is not None and sensitivity:
        raise click.UsageError("--sensitivity is of one motion, not of an ensemble")
    forces, extra = "forces" in columns, tuple(n for n in OUTPUT_COLUMNS if n in columns)
    if extra and (members is not None or sensitivity):
        other_run = "--sensitivity" if sensitivity else "an ensemble"
        raise click.UsageError(f"--with {extra[0]} is of one motion, without {other_run}")
    asked_scene = replace(asked_scene, forces=forces, sensitivity=sensitivity, extra=extra)
    if plot_of is not None and plot is None:
        raise click.UsageError("--plot-of needs --plot FILE")
    if animate is not None and (section is not None or members is not None):
        raise click.UsageError("--animate shows one motion")
    if speed is not None and animate is None:
        raise click.UsageError("--speed needs --animate FILE")
    files = columns, output, plot, plot_of
    usual = session.defaults.accuracy
    asked = SimulationRequest(
        asked_scene, SimulationOptions(**chosen, usual_accuracy=usual), *files
    )
    if section is not None:
        sections.require_fit(asked, members, resume, checkpoint)
        ctx.exit(sections.find_section(session, section, members, asked, form))
    if members is not None:
        with sole_writer(output):
            ctx.exit(ensemble.simulate_ensemble(session, members, asked, form))
    with asked_scene.compilations_ahead():
        state_file = _checkpoint(checkpoint, resume)
        film = None if animate is None else _Film(animate, speed)
        ctx.exit(_simulate_one(session, asked, state_file, started, form, film))


@dataclass(frozen=True)
class _Film:
    """File of a film of the motion, and the units of time in a second of it, if given."""

    path: str
    speed: float | None


def _simulate_one(
    session: Session,
    asked: SimulationRequest,
    checkpoint: Checkpoint | None,
    started: float,
    form: ReportForm,
    film: _Film | None,
) -> int:
    """Simulate one motion and report it; return the exit code.

    ``started``: the moment on the clock when the command began.
    """
    model = _model_within(session, asked)
    derive_seconds = perf_counter() - started
    budget = _remaining(asked.options.budget, derive_seconds)
    asked = replace(asked, options=replace(asked.options, budget=budget))
    with sole_writer(None if checkpoint is None else checkpoint.path):
        trajectory, interrupt = _integrated(session, model, asked, checkpoint)
        if asked.output is not None and trajectory.written is None:
            trajectory.write(asked.output, asked.columns)
        report = Simulated(trajectory, model, asked.columns, derive_seconds)
        print_report(report, form)
        if asked.plot is not None:
            trajectory.plot(asked.plot, asked.plot_of)
        if film is not None:
            asked.scene.derivation().animate(film.path, trajectory, speed=film.speed)
        if checkpoint is not None and trajectory.status != "stopped":
            checkpoint.remove()
    for remark in _remarks(trajectory, model, checkpoint):
        session.remark(spoken(remark, form.language))
    ended = trajectory.status == "stopped" and interrupt.asked
    return interrupt.exit_code if ended else trajectory.exit_code


def _model_within(session: Session, asked: SimulationRequest) -> Model:
    """Return the model of a scene, derived within the budget.

    Raises
    ------
    AccuracyError
        The budget is spent before there is anything to integrate.
    """
    budget = asked.options.budget
    limited = budget is not None and math.isfinite(budget) and budget > 0
    try:
        with within(budget if limited else None):
            return asked.scene.model()
    except OverdueError:
        says = f"the budget of {budget:g} s was spent on the equations of motion: {session.stage}"
        hint = "nothing was simulated; equations are kept once they are derived"
        raise AccuracyError(Problem(says, hint=hint, rule="budget")) from None


def _remaining(budget: float | None, seconds: float) -> float | None:
    """Return the budget less the seconds spent; one that is not positive is refused later."""
    if budget is None or not budget > 0:
        return budget
    return max(budget - seconds, _LEAST_BUDGET)


def _integrated(
    session: Session, model: Model, asked: SimulationRequest, checkpoint: Checkpoint | None
) -> tuple[Trajectory, Interrupts]:
    """Integrate; return also the signal that may have ended it."""
    with session.progress("integrating") as progress, noted_interrupts() as interrupt:

        def stop() -> bool:
            return interrupt.asked

        with heard_by(Listener(ends=stop)):
            trajectory = asked.integrate(
                model,
                checkpoint=checkpoint,
                progress=progress,
                reached=progress.reached,
                stop=stop,
            )
    session.explain_code()
    session.detail(f"method: {trajectory.choice}")
    return trajectory, interrupt


def _checkpoint(path: str | None, resumed: str | None) -> Checkpoint | None:
    """Return where the state of a run is written and read; None for nowhere.

    Raises
    ------
    InputError
        The options contradict each other, or the file cannot be written.
    """
    if path is None and resumed is None:
        return None
    if resumed is not None and path not in (None, resumed):
        message = "--resume writes the state to the file that it goes on from"
        raise InputError(Problem(message, hint="leave out --checkpoint", rule="resume"))
    if resumed == "":
        message = "--resume needs the file of --checkpoint"
        raise InputError(Problem(message, hint="--resume run.checkpoint", rule="resume"))
    from lagrange_cli.api import Checkpoint

    checkpoint = Checkpoint(path or resumed or "", resume=resumed is not None, lasting=True)
    check_writable(checkpoint.path)
    return checkpoint


def _remarks(trajectory: Trajectory, model: Model, checkpoint: Checkpoint | None) -> Iterator[str]:
    """Yield what is said beside the result."""
    asked = model.defaults.accuracy
    if trajectory.requested is None and asked is not None:
        yield (
            f"the scene's accuracy {asked:g} is not promised: the options choose the method"
            " and its steps; without them it is"
        )
    yield from filter(None, (*trajectory.remarks, trajectory.reason))
    stopped = trajectory.status == "stopped"
    if stopped and checkpoint is not None and os.path.exists(checkpoint.path):
        yield f"--resume {checkpoint.path} with the same options goes on from there"
