"""Measure speed against accuracy: methods × tolerances on one scene and one machine.

Every run is made once to learn its error, then repeatedly, in turn with all others, with everything
warm and no garbage collected, to learn its seconds. Its error is the largest distance of any
coordinate or velocity, relative to its scale, at any sample, from a :mod:`reference <.reference>`
that is computed before.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, Problem, StoppedError
from lagrange_cli.simulate.accuracy.method_selection import coarse_result
from lagrange_cli.simulate.checkpoint.progress import Deadline, Watch
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import AUTO, SimulationOptions
from lagrange_cli.simulate.request import Request, method_of, require_fit, resolve
from lagrange_cli.simulate.runs.start_checks import require_a_start
from lagrange_cli.simulate.simulation import problem_of
from lagrange_cli.simulate.system.functions import RightHandSide, right_hand_side
from lagrange_cli.studies.reference import Reference, no_time, reference
from lagrange_cli.studies.tradeoff.pareto import cheapest, cost_ratio, pareto
from lagrange_cli.studies.tradeoff.runs import (
    ACCURACIES,
    RESOLVED,
    Bench,
    WorkPrecisionPoint,
    has_stagnated,
    ladder,
)

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache

#: Seconds that each run of the reference may take, in budgets of a run; set by hand.
_PATIENCE = 30.0

#: Largest error on a front, relative to scales: beyond, a run shows nothing of the motion.
_NOTHING = 1.0


@dataclass(frozen=True)
class Recommendation:
    """The run to take for an accuracy."""

    accuracy: float
    point: WorkPrecisionPoint


@dataclass(frozen=True)
class CostRatios:
    """Costs of a run of ``auto`` relative to the cheapest runs; None if there is none as good.

    Attributes
    ----------
    point
        The run of ``auto``.
    seconds, evaluations
        Relative to the cheapest run that is as accurate as this one turned out.
    seconds_needed, evaluations_needed
        Relative to the cheapest run with the accuracy that was asked for.
    """

    point: WorkPrecisionPoint
    seconds: float | None = None
    evaluations: float | None = None
    seconds_needed: float | None = None
    evaluations_needed: float | None = None


@dataclass(frozen=True)
class Trade:
    """Speed against accuracy of one scene.

    Attributes
    ----------
    name
        Name of the scene.
    until
        Time of the last sample.
    samples
        Number of samples.
    formulation
        Minimal or multiplier form.
    implementation
        The code that ran, in words.
    stiff
        True if the coarse run found the system stiff.
    reference
        The solution that errors are measured from.
    points
        Runs of methods.
    automatic
        Runs of ``auto``.
    left_out
        Method that cannot run here → the reason.
    repeat
        Number of times that each run was timed.
    budget
        Seconds after which a run was given up.
    """

    name: str
    until: float
    samples: int
    formulation: str
    implementation: str
    stiff: bool
    reference: Reference
    points: tuple[WorkPrecisionPoint, ...]
    automatic: tuple[CostRatios, ...]
    left_out: dict[str, str]
    repeat: int
    budget: float

    @property
    def recommended(self) -> tuple[Recommendation, ...]:
        """The fastest run for each accuracy that one reaches, the reference's error added."""
        recommendations = []
        for accuracy in ACCURACIES:
            most = accuracy - self.reference.error
            good = [p for p in self.points if p.distance <= most]
            best = cheapest(good, lambda p: p.median, lambda p: p.evaluations)
            if best is not None:
                recommendations.append(Recommendation(accuracy, best))
        return tuple(recommendations)


def trade(
    model: Model,
    *,
    methods: Sequence[str] | None = None,
    repeat: int = 5,
    until: float | None = None,
    budget: float = 1.0,
    progress: Callable[[float], None] | None = None,
    functions: RightHandSide | None = None,
    cache: Cache | None = None,
) -> Trade:
    """Measure seconds, right-hand sides and drift against error.

    Parameters
    ----------
    methods
        Names of :data:`~lagrange_cli.simulate.integrators.INTEGRATORS`, and ``auto``; by
        default all that can run here.
    repeat
        Number of times that each run is timed.
    until
        Time of the last sample; by default the scene's.
    budget
        Seconds after which a run is given up, and with it finer ones of its method.
    progress
        Called with a fraction from 0 to 1 that never falls.

    Raises
    ------
    InputError
        A method is unknown or cannot run here; the scene cannot be simulated.
    AccuracyError
        There is no reference that is accurate enough.
    """
    options = SimulationOptions(until=until, method="DOP853", rtol=1e-6, budget=budget)
    request = resolve(model, options)
    chosen, left_out = _fitting(model, methods)
    stages = _Stages(progress)
    functions = functions or right_hand_side(model, cache)
    bench = _bench(model, functions, request, budget, stages.part(0.2))
    with np.errstate(all="ignore"):
        points = _explored(bench, chosen, stages.part(0.5))
        timed = timed_points(bench, points, repeat, stages.part(1.0))
    compared = _with_fronts([p for p in timed if p.setting.method != AUTO])
    automatic = [p for p in timed if p.setting.method == AUTO]
    return Trade(
        name=model.name,
        until=bench.problem.until,
        samples=len(bench.problem.times),
        formulation=model.formulation,
        implementation=functions.implementation,
        stiff=bench.coarse.stiff,
        reference=bench.reference,
        points=tuple(compared),
        automatic=tuple(_cost_ratios(p, compared, bench.reference) for p in automatic),
        left_out=left_out,
        repeat=repeat,
        budget=budget,
    )


def _bench(
    model: Model,
    functions: RightHandSide,
    request: Request,
    budget: float,
    progress: Callable[[float], None],
) -> Bench:
    """Make the problem that methods integrate, and its coarse run and reference."""
    problem = problem_of(model, request, functions)
    if functions.recorded_inputs is not None:
        functions.recorded_inputs.require(problem.start, problem.until)
    require_a_start(model, problem)
    patience = _PATIENCE * budget
    with np.errstate(all="ignore"):
        try:
            coarse = coarse_result(problem, 1e-9, Watch(deadline=Deadline.after(patience)))
        except StoppedError:
            raise no_time() from None
        known = reference(problem, coarse, patience, progress)
    return Bench(model, functions, problem, request, coarse, known, budget)


def _fitting(model: Model, methods: Sequence[str] | None) -> tuple[list[str], dict[str, str]]:
    """Return methods that can run here, and the reasons why others cannot.

    Raises
    ------
    InputError
        A method that was asked for is unknown or cannot run here.
    """
    fitting, left_out = [AUTO], {}
    for name, method in INTEGRATORS.items():
        try:
            require_fit(model, method)
            fitting.append(name)
        except InputError as refusal:
            left_out[name] = refusal.problems[0].message
    if methods is None:
        return fitting, left_out
    for name in methods:
        if name != AUTO and method_of(name).name in left_out:
            hint = f"--methods {','.join(fitting)}"
            raise InputError(Problem(left_out[name], hint=hint, rule="simulate"))
    return list(dict.fromkeys(methods)), {}


class _Stages:
    """Makes one progress from 0 to 1 of the progress of parts."""

    def __init__(self, progress: Callable[[float], None] | None) -> None:
        self._progress, self._done, self._shown = progress, 0.0, 0.0

    def part(self, end: float) -> Callable[[float], None]:
        """Return a receiver of the fraction done of the part that ends there."""
        start, self._done = self._done, end

        def tell(fraction: float) -> None:
            self._shown = max(self._shown, start + (end - start) * fraction)
            if self._progress is not None:
                self._progress(self._shown)

        return tell


# Which runs.


def _explored(
    bench: Bench, methods: Sequence[str], progress: Callable[[float], None]
) -> list[WorkPrecisionPoint]:
    """Run every method from coarse to fine, as long as it gets better and keeps the budget."""
    points: list[WorkPrecisionPoint] = []
    for number, name in enumerate(methods):
        progress(number / len(methods))
        mine: list[WorkPrecisionPoint] = []
        for setting in ladder(bench, name):
            mine.append(bench.explore(setting))
            if name != AUTO and has_stagnated(mine):
                break
        points += mine
    progress(1.0)
    return points


# How long they take.


@contextmanager
def _no_garbage() -> Iterator[None]:
    """Turn the garbage collector off meanwhile."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def timed_points(
    bench: Bench,
    points: Sequence[WorkPrecisionPoint],
    repeat: int,
    progress: Callable[[float], None],
) -> list[WorkPrecisionPoint]:
    """Measure the seconds of all points, ``repeat`` times each, in turn."""
    seconds: list[list[float]] = [[] for _ in points]
    with _no_garbage():
        for turn in range(repeat):
            gc.collect()
            for number, point in enumerate(points):
                if point.outcome == "ok":
                    seconds[number].append(bench.seconds(point.setting))
                progress((turn + (number + 1) / len(points)) / repeat)
    return [replace(p, seconds=tuple(s)) for p, s in zip(points, seconds, strict=True)]


# What they are worth.


def _with_fronts(points: Sequence[WorkPrecisionPoint]) -> list[WorkPrecisionPoint]:
    """Mark the points that no other one beats."""
    errors = [p.distance if p.distance <= _NOTHING else math.inf for p in points]
    fast = pareto([(error, p.median) for error, p in zip(errors, points, strict=True)])
    cheap = pareto([(error, float(p.evaluations)) for error, p in zip(errors, points, strict=True)])
    return [
        replace(p, pareto=on_time, pareto_evaluations=on_work)
        for p, on_time, on_work in zip(points, fast, cheap, strict=True)
    ]


def _cost_ratios(
    point: WorkPrecisionPoint, points: Sequence[WorkPrecisionPoint], known: Reference
) -> CostRatios:
    """Compare a run of ``auto`` with the cheapest as good ones, as far as errors are resolved."""
    if point.error is None or point.setting.accuracy is None:
        return CostRatios(point)
    seconds = [(p.distance, p.median) for p in points]
    evaluations = [(p.distance, float(p.evaluations)) for p in points]
    reached = max(point.error, RESOLVED * known.error)
    needed = point.setting.accuracy - known.error
    return CostRatios(
        point,
        cost_ratio(reached, point.median, seconds),
        cost_ratio(reached, point.evaluations, evaluations),
        cost_ratio(needed, point.median, seconds),
        cost_ratio(needed, point.evaluations, evaluations),
    )
