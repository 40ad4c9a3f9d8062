"""Runs in other coordinates past singular configurations of a scene's own.

There (at the pole of spherical angles) no accelerations follow from the equations, and close by
a motion may be stepped over it unseen: the angles are then not those of the motion. A run that
ends there, begins there, or changes sides there is made again in Cartesian coordinates with
multipliers, or by quaternions, from the start; the scene's coordinates are read off these
(:mod:`.former_coordinates`). Without such a form the result is cut off before that place.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.errors import InputError, Problem, SingularError
from lagrange_cli.phrases import Phrase, with_part
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.charts.continuation import (
    ContinuedCoordinates,
)
from lagrange_cli.simulate.charts.detection import (
    SingularPassage,
    first_passage,
    gimbal_lock,
    passage_of_run,
    singular_start,
)
from lagrange_cli.simulate.charts.former_coordinates import (
    first_not_positive,
    follow,
    former_columns,
    radians_moved,
)
from lagrange_cli.simulate.model.model import ChartSingularity, FormerChart, Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.results.outcome import Status
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.samples import RowSequence
from lagrange_cli.simulate.simulation import RunContext, integrate
from lagrange_cli.simulate.system.functions import KeptFunctions
from lagrange_cli.simulate.system.tables import Table

#: The turn that is regular everywhere.
_QUATERNION = "turn: {quaternion: [q0, q1, q2, q3]}"

#: Largest number of parts in all.
_FINEST = 2**17

#: Least number of parts of the time in which singular configurations are looked for.
WATCHED = 500

#: Parts of the time in which coordinates are continued close to them.
_FOLLOWED = 4000

#: Part of the accuracy of angles that quaternions have, of which angles lose a digit where the
#: second one is 0.1 rad away from gimbal lock.
_FOR_ANGLES = 1 / 30

#: Part of the samples between which angles turn by a radian at most.
_USUALLY = 0.9

#: An angle that usually turns by more from sample to sample is not known.
_UNCERTAIN = 2.0

#: Part of a budget for a run of which the coordinates are followed afterwards.
_RUNNING = 0.8


def simulate_in_charts(
    model: Model,
    options: SimulationOptions,
    with_multipliers: Callable[[], Model] | None,
    context: RunContext,
) -> Trajectory:
    """Simulate a model that has singular configurations, or coordinates that replaced others.

    As :func:`.charts.simulation.simulate_past_singularities`, where the parameters are described.
    """
    if model.chart is not None:
        return _with_chart(model, model.chart, options, _alone(context))
    started = time.perf_counter()
    looked: list[int] = []
    # Code that is compiled for the run also evaluates its singular factors afterwards.
    kept_functions = context.kept_functions or KeptFunctions(context.cache)
    context = replace(context, kept_functions=kept_functions)

    def look(times: RowSequence, states: RowSequence, result: Trajectory) -> None:
        looked.append(len(states))
        passage = first_passage(model, factors(), times, states, result.status, result.requested)
        _refuse_met(passage, times)

    def factors() -> Table:
        return context.functions_of(model, options.budget).singular

    try:
        request = context.resolved(model, options)
        by_quaternion = _by_quaternion(model, request, options, with_multipliers, context)
        if by_quaternion is not None:
            return by_quaternion
        every = _grid_of(request).every(WATCHED)
        first = integrate(model, request, context, every=every, look=look)
    except InputError as refusal:
        return _from_start(model, options, with_multipliers, context, refusal)
    if looked:
        return first
    passage = passage_of_run(model, factors(), first)
    if passage is None:
        return _thinned(first, every)
    left = _left(options.budget, time.perf_counter() - started)
    second = None
    if with_multipliers is not None and left != 0:
        again = replace(context, functions=None, progress=None, checkpoint=None, stream=None)
        options = replace(options, budget=left)
        second = _in_other(with_multipliers, passage.singularity, options, again)
    if second is not None and (second.status == "ok" or second.t[-1] > first.t[-1]):
        return _with_costs(second, [first])
    return _thinned(_cut(first, passage), every)


def _by_quaternion(
    model: Model,
    request: Request,
    options: SimulationOptions,
    with_multipliers: Callable[[], Model] | None,
    context: RunContext,
) -> Trajectory | None:
    """Simulate by quaternions what comes near a gimbal lock; None if nothing does, or they cannot.

    They cost no more, while angles may take minutes to lose their accuracy there.
    """
    singularity = None if with_multipliers is None else gimbal_lock(model, request, context)
    if with_multipliers is None or singularity is None:
        return None
    alone = replace(_alone(context), functions=None)
    return _in_other(with_multipliers, singularity, options, alone)


def _refuse_met(passage: SingularPassage | None, times: RowSequence) -> None:
    """Refuse more samples than memory holds of a motion past a singular configuration."""
    if passage is None:
        return
    raise InputError(
        Problem(
            f"the coordinates are singular where {passage.singularity.where}, which is met after"
            f" t = {times[passage.samples - 1]:.9g}",
            hint="with up to 100,000 samples the motion is followed past it",
            rule="singular-place",
        )
    )


def _alone(context: RunContext) -> RunContext:
    """Return the context of a run in memory whose coordinates are read off positions."""
    if context.checkpoint is not None:
        raise InputError(
            Problem(
                "a run cannot be interrupted and go on whose coordinates are read off positions",
                hint="without --checkpoint, Ctrl-C keeps what is done",
                rule="resume",
            )
        )
    return replace(context, stream=None)


def _left(budget: float | None, seconds: float) -> float | None:
    """Return the seconds that are left of a budget, 0 if it is used up; None without budget."""
    return None if budget is None else max(budget - seconds, 0.0)


def _from_start(
    model: Model,
    options: SimulationOptions,
    with_multipliers: Callable[[], Model] | None,
    context: RunContext,
    refusal: InputError,
) -> Trajectory:
    """Simulate in other coordinates a motion that begins at a singular configuration."""
    problem = refusal.problems[0]
    singularity = singular_start(model) if isinstance(refusal, SingularError) else None
    if singularity is None:
        raise refusal
    second = None
    if with_multipliers is not None:
        alone = replace(_alone(context), functions=None)
        second = _in_other(with_multipliers, singularity, options, alone)
    if second is None:
        hints = [f"the coordinates are singular where {singularity.where}", problem.hint]
        hints += [f"{_QUATERNION} has no such place"] if singularity.is_of_turns else []
        raise type(refusal)(replace(problem, hint="\n".join(hints))) from refusal
    return second


def _cut(run: Trajectory, passage: SingularPassage) -> Trajectory:
    """Cut a run before a singular configuration that it passed."""
    where, last = passage.singularity.where, f"{run.t[passage.samples - 1]:.9g}"
    if passage.singularity.is_of_turns:
        said = Phrase(
            "the coordinates are singular where {where}, which is met after t = {last};"
            " {turn} has no such place",
            where=where,
            last=last,
            turn=_QUATERNION,
        )
    else:
        said = Phrase(
            "the coordinates are singular where {where}, which is met after t = {last}; {option}"
            " goes on where it has no such place",
            where=where,
            last=last,
            option="--formulation multiplier",
        )
    if not passage.passed:
        reason = Phrase("{text}; {reason}", text=run.reason, reason=said)
        return replace(run, reason=reason)
    return _until(run, passage.samples, said, "accuracy_not_reached")


def _sliced(columns: Mapping[str, Array], numbers: NDArray[np.intp]) -> dict[str, Array]:
    return {name: values[numbers] for name, values in columns.items()}


# Times between samples.


class _SampleGrid(NamedTuple):
    """Times between samples that are asked for, and steps of fixed size in each (0: adaptive)."""

    intervals: int
    steps: int

    def finer(self, every: int, wanted: int) -> int:
        """Return a multiple of ``every`` that makes as many parts as wanted, if steps are free."""
        return every if self.steps else every * -(-self.every(wanted) // every)

    def every(self, wanted: int) -> int:
        """Return the parts of each interval that make so many in all, or as many as possible."""
        parts = max(1, -(-min(wanted, _FINEST) // self.intervals))
        if not self.steps:
            return parts
        most = min(parts, self.steps)
        possible = (k for k in range(most, self.steps + 1) if self.steps % k == 0)
        return next(possible)


def _grid_of(request: Request) -> _SampleGrid:
    """Return the grid of the times that are asked for."""
    steps = (
        0 if request.step is None else round((request.times[1] - request.times[0]) / request.step)
    )
    return _SampleGrid(len(request.times) - 1, steps)


# The same motion in other coordinates.


def _in_other(
    with_multipliers: Callable[[], Model],
    singularity: ChartSingularity,
    options: SimulationOptions,
    context: RunContext,
) -> Trajectory | None:
    """Simulate with multipliers; None if that form has the same coordinates."""
    try:
        model = with_multipliers()
    except InputError:
        return None
    lost = set(singularity.lost) & set(model.coordinates)
    if model.chart is None or (lost and not singularity.ends):
        return None
    run = _with_chart(model, model.chart, options, context)
    said = Phrase(
        "in {form} form: the coordinates are singular where {where}",
        form=model.formulation,
        where=singularity.where,
    )
    return replace(run, remarks=(said, *run.remarks))


def _with_chart(
    model: Model, chart: FormerChart, options: SimulationOptions, context: RunContext
) -> Trajectory:
    """Simulate, with columns of the coordinates that have been replaced as well."""
    there = {*model.coordinates, *model.cartesian, *model.outputs}
    gone = [name for name in chart.coordinates if name not in there]
    request = context.resolved(model, options)
    if not gone:
        return integrate(model, request, context)
    run, continued, every = _run_and_followed(model, chart, request, context)
    former = former_columns(chart, gone, continued, run)
    run = _thinned(replace(run, columns=former | dict(run.columns)), every)
    if not continued.lost:
        return run
    return replace(run, remarks=(*run.remarks, _choice(gone, continued.lost[0][0])))


def _run_and_followed(
    model: Model, chart: FormerChart, request: Request, context: RunContext
) -> tuple[Trajectory, ContinuedCoordinates, int]:
    """Run with as many samples as former coordinates need; return it, these, and the stride."""
    started, spent, grid = time.perf_counter(), 0.0, _grid_of(request)
    every, before = grid.every(WATCHED), list[Trajectory]()
    deadline = started + (request.budget or np.inf)
    if request.budget is not None:
        request = replace(request, budget=_RUNNING * request.budget)
    fine = grid.finer(every, _FOLLOWED)
    whole = _integrated(model, chart, request, context, fine)
    while True:
        run = _thinned(whole, fine // every)
        begun = time.perf_counter()
        continued = follow(model, chart, run, deadline)
        spent += time.perf_counter() - begun
        finer = grid.every(_wanted(chart, continued, run, grid.intervals * every))
        if every < finer <= fine:
            every = fine
            continue
        left = _left(request.budget, time.perf_counter() - started)
        if run.status == "stopped" or finer <= every or left == 0:
            break
        before.append(whole)
        every = fine = finer
        request, context = replace(request, budget=left), replace(context, progress=None)
        whole = _integrated(model, chart, request, context, every)
    run = _with_costs(_as_far_as(chart, continued, run, deadline), before)
    m = len(run.t)
    known = replace(
        continued, q=continued.q[:m], v=continued.v[:m], amplification=continued.amplification[:m]
    )
    return replace(run, seconds={**run.seconds, "follow": spent}), known, every


def _integrated(
    model: Model, chart: FormerChart, request: Request, context: RunContext, every: int
) -> Trajectory:
    """Integrate, if angles are to be read off quaternions to an accuracy that they have as well.

    Where that is out of reach the motion has the accuracy that is asked for, and some angles not.
    """
    accuracy = request.accuracy
    if accuracy is not None and chart.turns:
        with suppress(InputError):
            finer = replace(request, accuracy=_FOR_ANGLES * accuracy)
            run = integrate(model, finer, context, every=every)
            if run.status != "accuracy_not_reached":
                return replace(run, requested=accuracy)
    return integrate(model, request, context, every=every)


def _wanted(
    chart: FormerChart, continued: ContinuedCoordinates, run: Trajectory, intervals: int
) -> int:
    """Return the number of intervals in which coordinates can be followed, after a trial."""
    passes = continued.lost or continued.unknown is not None
    wanted = _FOLLOWED if passes and run.status == "ok" else WATCHED
    most = float(np.quantile(radians_moved(chart, continued, run), _USUALLY))
    if len(continued.v) < len(run.t) and continued.unknown is None:
        most = max(most, 2.0)
    if most <= 1:
        return wanted
    doublings = math.ceil(math.log2(min(most, _FINEST)))
    return max(wanted, intervals << doublings)


def _as_far_as(
    chart: FormerChart, continued: ContinuedCoordinates, run: Trajectory, deadline: float
) -> Trajectory:
    """Cut a run behind the samples at which former coordinates have been found."""
    moves, m = radians_moved(chart, continued, run), len(continued.q)
    left = first_not_positive(chart, continued)
    if left is not None and left[0] <= m:
        m, name = left
        said = f"'{name}' is declared positive, and reaches 0 after t = {run.t[m - 1]:.9g}"
        return _until(run, m, said, "blow_up")
    if np.quantile(moves, _USUALLY) > _UNCERTAIN:
        m = max(1, int(np.argmax(moves > _UNCERTAIN)))
    if m == len(run.t):
        return run
    late = run.status == "stopped" or time.perf_counter() > deadline
    last, names = f"t = {run.t[m - 1]:.9g}", ", ".join(chart.coordinates)
    if continued.unknown is not None and m == len(continued.q):
        said = (
            f"{names} cannot be followed past t = {continued.unknown:.9g}: the motion passes"
            " closer to where they have no meaning than it is known"
        )
        return _until(run, m, said, "accuracy_not_reached")
    if late:
        return _until(run, m, f"stopped; what is kept ends at {last}", "stopped")
    said = f"{names} cannot be followed past {last}: the motion is too fast for {_FINEST} samples"
    return _until(run, m, said, "accuracy_not_reached")


def _with_costs(run: Trajectory, before: Sequence[Trajectory]) -> Trajectory:
    """Add the costs of runs that were replaced."""
    return replace(
        run,
        all_evaluations=run.all_evaluations + sum(replaced.all_evaluations for replaced in before),
        seconds={
            name: value + sum(replaced.seconds.get(name, 0.0) for replaced in before)
            for name, value in run.seconds.items()
        },
    )


def _until(run: Trajectory, samples: int, reason: str, status: Status) -> Trajectory:
    """Cut a run after its first samples, with the reason why there are no more."""
    cut = _sampled(run, np.arange(samples))
    return replace(cut, status=status, reason=reason)


def _sampled(run: Trajectory, numbers: NDArray[np.intp]) -> Trajectory:
    """Pick samples of a run by their numbers."""
    t = run.t[numbers]
    return replace(
        run,
        t=t,
        columns=_sliced(run.columns, numbers),
        energy=run.energy[numbers],
        multipliers=_sliced(run.multipliers, numbers),
        forces=_sliced(run.forces, numbers),
        holds_until=None if run.holds_until is None else float(t[-1]),
        exempt=tuple(x for x in run.exempt if x in t),
    )


def _thinned(run: Trajectory, every: int) -> Trajectory:
    """Pick the samples that were asked for; scales and estimates stay those of all."""
    if every == 1:
        return run
    picked = _sampled(run, np.arange(0, len(run.t), every))
    if picked.t[-1] == run.t[-1]:
        return picked
    last, reached = f"{picked.t[-1]:.9g}", f"{run.t[-1]:.9g}"
    return replace(picked, reason=with_part(run.reason, reached, last))


def _choice(names: list[str], t: float) -> str:
    return Phrase(
        "{names}: the motion passes t = {t} closer to where they have no meaning than it is known;"
        " from there on they are one choice of several for the position",
        names=", ".join(names),
        t=f"{t:.9g}",
    )
