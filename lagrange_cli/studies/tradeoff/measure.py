"""Measure speed against accuracy: methods × tolerances on one scene and one machine.

Every run is made once to learn its error, the cheapest methods first, so that those which are far
behind are known before much is spent on them. Short runs are then made repeatedly, in turn with all
others, with everything warm and no garbage collected, to learn their seconds. The error is the
largest distance of any coordinate or velocity, relative to its scale, at any sample, from a
:mod:`reference <.reference>` that is computed before.
"""

from __future__ import annotations

import gc
import heapq
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, Problem, StoppedError
from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.accuracy.method_selection import coarse_result
from lagrange_cli.simulate.checkpoint.progress import Deadline, Watch
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.integrators.native.methods import COMPILED
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import AUTO, SimulationOptions, is_automatic
from lagrange_cli.simulate.request import Request, method_of, require_fit, resolve
from lagrange_cli.simulate.runs.problem import require_a_start
from lagrange_cli.simulate.simulation import problem_of
from lagrange_cli.simulate.system.functions import RightHandSide, right_hand_side
from lagrange_cli.studies.reference import Reference, no_time, reference
from lagrange_cli.studies.tradeoff.result import CostRatios, Trade, cost_ratio, pareto
from lagrange_cli.studies.tradeoff.runs import (
    ESTIMATE,
    FINE_ENOUGH,
    RESOLVED,
    Bench,
    WorkPrecisionPoint,
    has_stagnated,
    ladder,
)

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache

#: Seconds that each run of the reference may take, in budgets of a run: it has much finer
#: tolerances, in wider arithmetic. Not tuned.
_PATIENCE = 30.0

#: Times the seconds of another run that is no less accurate from which on a run is of no use.
_USELESS = 100.0

#: Useless runs in a row after which a method ends: a first one may have been slow by chance.
_USELESS_RUNS = 2

#: Seconds that repetitions of one run may take, and longest run that is repeated: so that some two
#: hundred runs are timed in ten seconds. Not tuned.
_TIMED = 0.05

#: Largest error on a front, relative to scales: beyond, a run shows nothing of the motion.
_NOTHING = 1.0


def trade(
    model: Model,
    *,
    methods: Sequence[str] | None = None,
    repeat: int = 20,
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
        Names of integrators, and ``auto``; by default all that can run here and are not far behind.
    repeat
        Largest number of times that a run is timed; long ones are timed once.
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
    part = _Stages(progress).part
    bench = _bench(model, functions or right_hand_side(model, cache), request, budget, part(0.2))
    if methods is None and bench.functions.native and not bench.coarse.stiff:
        left_out |= _stepped_from_python(chosen)
        chosen = [name for name in chosen if name not in left_out]
    with np.errstate(all="ignore"), _no_garbage():
        points, behind = explored_points(bench, chosen, methods is not None, part(0.8))
        timed = timed_points(bench, points, repeat, part(1.0))
    compared = _with_fronts([p for p in timed if p.setting.method != AUTO])
    automatic = [p for p in timed if p.setting.method == AUTO]
    return Trade(
        name=model.name,
        until=bench.problem.until,
        samples=len(bench.problem.times),
        formulation=model.formulation,
        implementation=bench.functions.implementation,
        stiff=bench.coarse.stiff,
        reference=bench.reference,
        points=tuple(compared),
        automatic=tuple(_cost_ratios(p, compared, bench.reference) for p in automatic),
        left_out={**left_out, **behind},
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
    asked = [AUTO if is_automatic(name) else method_of(name).name for name in methods]
    for name in asked:
        if name in left_out:
            hint = f"--methods {','.join(fitting)}"
            raise InputError(Problem(left_out[name], hint=hint, rule="simulate"))
    return list(dict.fromkeys(asked)), {}


def _stepped_from_python(methods: Sequence[str]) -> dict[str, str]:
    """Return methods whose steps are not compiled → why they are not tried.

    They were on the front of no shipped scene whose equations were compiled, by seconds
    (``benchmarks/auto.py``).
    """
    slow = [name for name in methods if name != AUTO and name not in COMPILED]
    reason = Phrase(
        "{methods}: their steps are made from Python, too slowly beside compiled ones; they are"
        " tried where motion is stiff, and by {option}",
        methods=", ".join(slow),
        option="--methods",
    )
    return dict.fromkeys(slow, reason)


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


# The runs.


def explored_points(
    bench: Bench, methods: Sequence[str], wanted: bool, progress: Callable[[float], None]
) -> tuple[list[WorkPrecisionPoint], dict[str, str]]:
    """Run methods from coarse to fine, always the one whose last run took the least.

    So all that is cheaper is known when a run is judged.

    Parameters
    ----------
    wanted
        True if methods go on however far they are behind.

    Returns
    -------
    The points of each method in turn, and methods left out as far behind → the reason.
    """
    ladders = {name: ladder(bench, name) for name in methods}
    points: dict[str, list[WorkPrecisionPoint]] = {name: [] for name in methods}
    left_out: dict[str, str] = {}
    waiting = [(0.0, number, name) for number, name in enumerate(methods)]
    while waiting:
        progress(1 - sum(1 / (1 + len(points[name])) for _, _, name in waiting) / len(methods))
        _, number, name = heapq.heappop(waiting)
        setting = next(ladders[name], None)
        if setting is None:
            continue
        mine = points[name]
        mine.append(bench.explore(setting))
        if name != AUTO and has_stagnated(mine):
            continue
        reason = None if wanted or name == AUTO else _far_behind(mine, points)
        if reason is None:
            heapq.heappush(waiting, (mine[-1].spent, number, name))
        elif len(mine) == _USELESS_RUNS:
            left_out[name] = reason
            mine.clear()
    progress(1.0)
    return [point for mine in points.values() for point in mine], left_out


def _far_behind(
    mine: Sequence[WorkPrecisionPoint], points: Mapping[str, Sequence[WorkPrecisionPoint]]
) -> str | None:
    """Return in words how far the last runs of a method are behind; None if one is of use."""
    known = [p for name, run in points.items() if name != AUTO for p in run if p.seconds]
    for point in mine[-_USELESS_RUNS:]:
        as_good = [p for p in known if p.distance <= point.distance]
        best = min(as_good, key=lambda p: p.median, default=point)
        if len(mine) < _USELESS_RUNS or point.spent < _USELESS * best.median:
            return None
    return Phrase(
        "{method} takes {ratio} times the seconds of {best} for the same error",
        method=point.setting.method,
        ratio=f"{point.spent / best.median:.0f}",
        best=best.setting.method,
    )


# Their seconds.


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
    """Time all points in turn, up to ``repeat`` times each, long ones not again."""
    seconds: list[list[float]] = [[] for _ in points]
    turns = [_turns(point, repeat) for point in points]
    work, done = sum(n * p.spent for n, p in zip(turns, points, strict=True)), 0.0
    gc.collect()
    for turn in range(max(turns, default=0)):
        for point, times, of_point in zip(points, turns, seconds, strict=True):
            if turn < times:
                of_point.append(bench.seconds(point.setting))
                done += point.spent
                progress(done / work)
    progress(1.0)
    return [replace(p, seconds=tuple(s) or p.seconds) for p, s in zip(points, seconds, strict=True)]


def _turns(point: WorkPrecisionPoint, repeat: int) -> int:
    """Return how often a run is timed after its first time; 0 if that was long enough."""
    limit = _TIMED if point.setting.accuracy is None else ESTIMATE * _TIMED
    if point.outcome != "ok" or point.spent > limit:
        return 0
    return min(repeat, math.ceil(limit / point.spent))


# Fronts and ratios.


def _with_fronts(points: Sequence[WorkPrecisionPoint]) -> list[WorkPrecisionPoint]:
    """Mark the points that no other one beats; errors that are fine enough are equal."""
    errors = [max(p.distance, FINE_ENOUGH) for p in points]
    errors = [error if error <= _NOTHING else math.inf for error in errors]
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
    reached = max(point.error, RESOLVED * known.error, FINE_ENOUGH)
    needed = point.setting.accuracy - known.error
    return CostRatios(
        point,
        cost_ratio(reached, point.median, seconds),
        cost_ratio(reached, point.evaluations, evaluations),
        cost_ratio(needed, point.median, seconds),
        cost_ratio(needed, point.evaluations, evaluations),
    )
