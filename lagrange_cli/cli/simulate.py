"""``lagrange simulate``: a trajectory, with the accuracy it has."""

from __future__ import annotations

import math
import re
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from lagrange_cli.cli import ensemble, options
from lagrange_cli.cli.guard import checkpoint_files, guard
from lagrange_cli.cli.models import model_of_scene
from lagrange_cli.cli.remembered import SceneSource, read_source
from lagrange_cli.cli.reports.simulate import FORMATS, Simulated
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.deadline import OverdueError, within
from lagrange_cli.cli.terminal.interrupts import Interrupts, noted_interrupts
from lagrange_cli.cli.terminal.output import Command, print_text
from lagrange_cli.errors import AccuracyError, InputError, Problem
from lagrange_cli.files import Named, check_writable, sole_writer
from lagrange_cli.stages import Listener, heard_by

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.request import SimulationOptions

#: A plain number.
_DECIMAL = re.compile(r"[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]{1,3})?", re.ASCII)

#: Seconds of the budget that are left to the motion where deriving has just not spent them all.
_LEAST_BUDGET = 1e-3

_ENDINGS = (".csv", ".npz")

#: Columns beyond the state that files can have.
FILE_COLUMNS = ("energy", "positions", "forces")


def _ending(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse a trajectory file of an unknown kind, or in no place to write, before the work."""
    if value is None:
        return None
    if Path(value).suffix.lower() not in _ENDINGS:
        raise click.BadParameter(f"'{value}' does not end in {' or '.join(_ENDINGS)}", ctx, option)
    check_writable(value)
    return value


def _extra(ctx: click.Context, option: click.Parameter, value: str | None) -> tuple[str, ...]:
    """Names of further columns, as they are given with commas between them."""
    names = tuple(dict.fromkeys(part.strip() for part in (value or "").split(",")))
    unknown = [name for name in names if name not in FILE_COLUMNS]
    if value is not None and unknown:
        raise click.BadParameter(
            f"'{unknown[0]}' is not one of {', '.join(FILE_COLUMNS)}", ctx, option
        )
    return names if value is not None else ()


@click.command(cls=Command, short_help="A trajectory to the accuracy that you state.")
@options.scene
@options.end_time
@click.option(
    "--from", "start", metavar="T", help="Start time, likewise.  [default: the scene's, or 0]"
)
@click.option(
    "--accuracy",
    type=float,
    metavar="EPS",
    help="Largest error of any coordinate or velocity at any sample, as a part of its scale.  "
    "[default: the scene's, or 1e-6]",
)
@click.option(
    "--method",
    cls=options.naming(
        "Integration method: auto, {}.  [default: the scene's, or auto]", options.integrators
    ),
    metavar="NAME",
)
@click.option(
    "--rtol",
    type=float,
    metavar="X",
    help="Relative tolerance of a step, with --method.  [default: the scene's]",
)
@click.option(
    "--atol",
    type=float,
    metavar="X",
    help="Absolute tolerance of a step, with --method.  [default: rtol/100 of each scale]",
)
@click.option(
    "--step",
    type=float,
    metavar="H",
    help="Time between samples; the step of methods of fixed step.  [default: the scene's]",
)
@click.option(
    "--samples",
    type=int,
    metavar="N",
    help="Number of samples, both ends included.  [default: the scene's, or 501]",
)
@click.option(
    "--budget",
    type=float,
    metavar="SECONDS",
    help="Stop after this time and keep what is done.  [default: none]",
)
@options.formulation(None, "the scene's, or auto")
@options.parameters
@options.initial
@click.option(
    "--with",
    "columns",
    callback=_extra,
    metavar="NAMES",
    help="Further columns of the file, their last values shown: energy; forces, those of "
    "constraints and their multipliers; positions, which are there anyway. With commas between "
    "them.  [default: none]",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(),
    callback=_ending,
    metavar="FILE",
    help="Write the samples, as .csv or .npz.  [default: none]",
)
@options.plot("Draw coordinates, velocities and energy over time")
@click.option(
    "--checkpoint",
    type=click.Path(),
    callback=options.not_empty,
    metavar="FILE",
    help="Write the state of the run now and then, and when it is stopped, for --resume FILE.  "
    "[default: none]",
)
@ensemble.ensemble_options
@options.json_flag("Report as JSON.")
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
    output: str | None,
    plot: str | None,
    as_json: bool,
    checkpoint: str | None,
    resume: str | None,
    member_file: str | None,
    vary: tuple[str, ...],
    jobs: int | None,
    **chosen: Any,
) -> None:
    """Integrate SCENE, a YAML file or - for standard input, and report its end."""
    session = ctx.ensure_object(Session)
    started = perf_counter()
    times = {k: v for k, v in (("until", until), ("start", start)) if v is not None}
    if until is not None and _DECIMAL.fullmatch(until):
        # A plain number changes nothing of the model, which can be that of before.
        chosen["until"] = float(times.pop("until"))
    source = read_source(scene)
    state = checkpoint if resume is None else resume
    _guard(scene, source, parameters, {"-o": output, "--plot": plot}, state, member_file)
    many = ensemble.member_choice(member_file, vary, jobs, resume, checkpoint, plot)
    # What takes long to import comes after what is refused at once.
    from lagrange_cli.simulate.request import SimulationOptions

    wanted = SimulationOptions(**chosen)
    if many is not None:
        asked = (source, parameters, initial, times, formulation)
        members = ensemble.EnsembleRequest(many, *asked, columns, output, as_json, wanted)
        with _alone(output):
            ctx.exit(ensemble.simulate_ensemble(session, members))
    kept = _checkpoint(checkpoint, resume)
    model_in = partial(
        model_of_scene,
        session,
        source,
        parameters=parameters,
        initial=initial,
        times=times,
        forces="forces" in columns,
    )
    model = _model_within(session, wanted.budget, partial(model_in, formulation=formulation))
    derive_seconds = perf_counter() - started
    wanted = replace(wanted, budget=_left_of(wanted.budget, derive_seconds))
    from lagrange_cli.simulate.charts.simulation import multiplier_form

    other = multiplier_form(model, formulation, partial(model_in, formulation="multiplier"))
    with _alone(None if kept is None else kept.path):
        files = output, columns, plot is not None
        trajectory, interrupt = _integrated(session, model, other, wanted, files, kept)
        if output is not None and trajectory.written is None:
            trajectory.write(output, columns)
        report = Simulated(model, trajectory, columns, derive_seconds)
        format_ = "json" if as_json else "text"
        print_text(FORMATS[format_](report), format_)
        if plot is not None:
            trajectory.plot(plot)
        if kept is not None and trajectory.status != "stopped":
            kept.remove()
    for remark in _remarks(trajectory, model, kept):
        session.remark(remark)
    ended = trajectory.status == "stopped" and interrupt.asked
    ctx.exit(interrupt.exit_code if ended else trajectory.exit_code)


def _model_within(session: Session, budget: float | None, model_of: Callable[[], Model]) -> Model:
    """The model of a scene, derived within the budget in seconds.

    Raises
    ------
    AccuracyError
        The budget is spent before there is anything to integrate.
    """
    limited = budget is not None and math.isfinite(budget) and budget > 0
    try:
        with within(budget if limited else None):
            return model_of()
    except OverdueError:
        says = f"the budget of {budget:g} s was spent on the equations of motion: {session.stage}"
        hint = "nothing was simulated; equations are kept once they are derived"
        raise AccuracyError(Problem(says, hint=hint, rule="budget")) from None


def _left_of(budget: float | None, seconds: float) -> float | None:
    """What deriving has left of a budget; one that is no positive number is refused later."""
    if budget is None or not budget > 0:
        return budget
    return max(budget - seconds, _LEAST_BUDGET)


@contextmanager
def _alone(output: str | None) -> Iterator[None]:
    """Refuse to work where another process makes the same output; None: there is none."""
    with nullcontext() if output is None else sole_writer(output):
        yield


def _guard(
    scene: str,
    source: SceneSource,
    parameters: Mapping[str, str],
    outputs: Mapping[str, str | None],
    state: str | None,
    member_file: str | None,
) -> None:
    """Refuse outputs that would replace what is read, before any work; ``state`` is written."""
    reads = [] if member_file is None else [Named("the ensemble", member_file)]
    files = checkpoint_files(state) if state else {}
    guard(scene, source, parameters, {**outputs, **files}, reads)


def _integrated(
    session: Session,
    model: Model,
    other: Callable[[], Model] | None,
    wanted: SimulationOptions,
    files: tuple[str | None, tuple[str, ...], bool],
    checkpoint: Checkpoint | None,
) -> tuple[Trajectory, Interrupts]:
    """The motion, and the signal that may have ended it.

    Parameters
    ----------
    other
        Makes the model in other coordinates, where these may be left.
    files
        The output with its further columns, and whether there is to be a picture.
    """
    from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
    from lagrange_cli.simulate.results.streaming import Stream
    from lagrange_cli.simulate.results.trajectory import require_forces
    from lagrange_cli.simulate.simulation import RunContext

    if "forces" in files[1]:
        require_forces(model.name, [*model.multipliers, *model.forces])
    with session.progress("integrating") as progress, noted_interrupts() as interrupt:

        def stop() -> bool:
            return interrupt.asked

        context = RunContext(
            None, session.cache, Stream(*files), checkpoint, progress, progress.reached, stop
        )
        with heard_by(Listener(ends=stop)):
            trajectory = simulate_past_singularities(model, wanted, other, context)
    session.explain_code()
    session.detail(f"method: {trajectory.choice}")
    return trajectory, interrupt


def _checkpoint(path: str | None, resumed: str | None) -> Checkpoint | None:
    """Where the state of a run is written, and whether it goes on from there.

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
    from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint

    found = Checkpoint(path or resumed or "", resume=resumed is not None, lasting=True)
    check_writable(found.path)
    return found


def _remarks(trajectory: Trajectory, model: Model, checkpoint: Checkpoint | None) -> Iterator[str]:
    """What is said beside the result."""
    asked = model.defaults.accuracy
    if trajectory.requested is None and asked is not None:
        yield (
            f"the scene's accuracy {asked:g} is not promised: the options choose the method"
            " and its steps; without them it is"
        )
    yield from filter(None, (*trajectory.remarks, trajectory.reason))
    stopped = trajectory.status == "stopped"
    if stopped and checkpoint is not None and Path(checkpoint.path).exists():
        yield f"--resume {checkpoint.path} with the same options goes on from there"
