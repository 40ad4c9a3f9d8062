"""Speed against accuracy, measured: methods × tolerances on one scene and one machine.

Every run is made once to learn its error, then again and again, all in turn, with everything
warm and no garbage collected, to learn its seconds. Its error is the largest, over the samples,
of any coordinate or velocity over its scale, from a :mod:`reference <.reference>` that is
computed before.
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
from lagrange_cli.simulate.accuracy.method_selection import CoarseResult, coarse_result
from lagrange_cli.simulate.checkpoint.progress import Deadline, Watch
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.request import (
    AUTO,
    Request,
    SimulationOptions,
    method_of,
    require_fit,
    resolve,
)
from lagrange_cli.simulate.runs.problem import InitialValueProblem
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

#: Seconds that each run of the reference may take, in budgets of a run.
_PATIENCE = 30.0

#: Errors of more than this are of no motion: nothing is cheaper than that.
_NOTHING = 1.0


@dataclass(frozen=True)
class Recommendation:
    """The run to take for an accuracy."""

    accuracy: float
    point: WorkPrecisionPoint


@dataclass(frozen=True)
class CostRatios:
    """Costs of ``auto`` relative to the cheapest runs that are as good; None if unknown.

    ``seconds`` and ``evaluations``: of the cheapest run that is as good as it turned out;
    ``seconds_needed`` and ``evaluations_needed``: of the cheapest with the accuracy asked for.
    """

    point: WorkPrecisionPoint
    seconds: float | None = None
    evaluations: float | None = None
    seconds_needed: float | None = None
    evaluations_needed: float | None = None


@dataclass(frozen=True)
class Trade:
    """Speed against accuracy of one scene.

    ``points`` are the runs of methods, ``automatic`` those of ``auto``; ``left_out`` maps
    methods that cannot run here to the reason.
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
        """The fastest run for each accuracy that one reaches, reference's error included."""
        found = []
        for accuracy in ACCURACIES:
            most = accuracy - self.reference.error
            good = [p for p in self.points if p.distance <= most]
            best = cheapest(good, lambda p: p.median, lambda p: p.evaluations)
            if best is not None:
                found.append(Recommendation(accuracy, best))
        return tuple(found)


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
        How often each run is timed.
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
    functions = functions or right_hand_side(model, cache)
    problem = _problem(model, request, functions)
    stages = _Stages(progress)
    with np.errstate(all="ignore"):
        found = _pilot(problem, budget)
        known = reference(problem, found, _PATIENCE * budget, stages.part(0.2))
        bench = Bench(model, functions, problem, request, found, known, budget)
        points = _explored(bench, chosen, stages.part(0.5))
        timed = timed_points(bench, points, repeat, stages.part(1.0))
    own = _with_fronts([p for p in timed if p.setting.method != AUTO])
    return Trade(
        name=model.name,
        until=problem.until,
        samples=len(problem.times),
        formulation=model.formulation,
        implementation=functions.implementation,
        stiff=found.stiff,
        reference=known,
        points=tuple(own),
        automatic=tuple(_cost_ratios(p, own, known) for p in timed if p.setting.method == AUTO),
        left_out=left_out,
        repeat=repeat,
        budget=budget,
    )


def _problem(model: Model, request: Request, functions: RightHandSide) -> InitialValueProblem:
    """Make the problem that methods integrate, if they can."""
    problem = problem_of(model, request, functions)
    if functions.drive is not None:
        functions.drive.require(problem.start, problem.until)
    require_a_start(model, problem)
    return problem


def _fitting(model: Model, methods: Sequence[str] | None) -> tuple[list[str], dict[str, str]]:
    """Methods that can run here, and the reasons why the others cannot.

    Raises
    ------
    InputError
        One that was asked for is unknown or cannot.
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
    """One progress from 0 to 1 made of the progress of parts."""

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


def _pilot(problem: InitialValueProblem, budget: float) -> CoarseResult:
    try:
        return coarse_result(problem, 1e-9, Watch(deadline=Deadline.after(_PATIENCE * budget)))
    except StoppedError:
        raise no_time() from None


# Which runs.


def _explored(
    bench: Bench, methods: Sequence[str], progress: Callable[[float], None]
) -> list[WorkPrecisionPoint]:
    """Every method from coarse to fine, as far as it gets better and within the budget."""
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
    """Nothing is collected meanwhile."""
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
    """The same points with seconds: all runs in turn, and again."""
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
    """The points that no other one beats, marked."""
    of = [p.distance if p.distance <= _NOTHING else math.inf for p in points]
    fast = pareto([(error, p.median) for error, p in zip(of, points, strict=True)])
    few = pareto([(error, float(p.evaluations)) for error, p in zip(of, points, strict=True)])
    return [
        replace(p, pareto=f, pareto_evaluations=w)
        for p, f, w in zip(points, fast, few, strict=True)
    ]


def _cost_ratios(
    point: WorkPrecisionPoint, points: Sequence[WorkPrecisionPoint], known: Reference
) -> CostRatios:
    """A run of ``auto`` beside the cheapest that are as good, as far as errors are resolved."""
    if point.error is None or point.setting.accuracy is None:
        return CostRatios(point)
    seconds = [(p.distance, p.median) for p in points]
    evaluations = [(p.distance, float(p.evaluations)) for p in points]
    own, asked = max(point.error, RESOLVED * known.error), point.setting.accuracy - known.error
    return CostRatios(
        point,
        cost_ratio(own, point.median, seconds),
        cost_ratio(own, point.evaluations, evaluations),
        cost_ratio(asked, point.median, seconds),
        cost_ratio(asked, point.evaluations, evaluations),
    )
