"""Speed against accuracy, measured: methods × tolerances on one scene and one machine.

Every run is made once to learn its error, then again and again, all in turn, with everything
warm and no garbage collected, to learn its seconds. Its error is the largest, over the samples,
of any coordinate or velocity over its scale, from a :mod:`reference <.reference>` that is
computed before.
"""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from lagrange_cli.errors import InputError
from lagrange_cli.simulate.accuracy import Measured, integrate_to_accuracy
from lagrange_cli.simulate.along import along
from lagrange_cli.simulate.chosen import control_of, measured_run
from lagrange_cli.simulate.conservation import energy_drift
from lagrange_cli.simulate.disproof import energies, energy_is_conserved
from lagrange_cli.simulate.front import behind, cheapest, pareto
from lagrange_cli.simulate.integrators import INTEGRATORS, Integrator
from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.outcome import status
from lagrange_cli.simulate.pilot import Pilot, pilot
from lagrange_cli.simulate.problem import InitialValueProblem
from lagrange_cli.simulate.reference import (
    Motion,
    Reference,
    errors,
    motion_of,
    no_time,
    reference,
)
from lagrange_cli.simulate.request import AUTO, Request, method_of, require_fit, resolve
from lagrange_cli.simulate.right_hand_side import RightHandSide, right_hand_side
from lagrange_cli.simulate.run import Run
from lagrange_cli.simulate.simulation import problem_of
from lagrange_cli.simulate.starting import require_a_start
from lagrange_cli.simulate.watch import StoppedError, Watch

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache

__all__ = ["ACCURACIES", "Behind", "Point", "Recommendation", "Setting", "Trade", "trade"]

#: What is recommended for.
ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12)

#: Tolerances of adaptive methods: powers of ten.
COARSEST, FINEST = 3, 15

#: Most steps that a method of fixed step is tried with.
MOST_STEPS_TRIED = 30

#: Errors below the reference's times this are not told from it.
RESOLVED = 3.0

#: Runs in a row that are no better than one before, by this factor, are the last ones.
STAGNANT, BETTER = 2, 0.5

#: Evaluations of the coarse run per step that a method of fixed step begins with.
PER_STEP = 16

#: Seconds that each run of the reference may take, in budgets of a run.
PATIENCE = 30.0

#: More steps than any run makes: it is known to end.
UNLIMITED = 2**62

Outcome = Literal["ok", "given_up", "failed"]


@dataclass(frozen=True)
class Setting:
    """What is run: a method with its tolerance or step, or ``auto`` with its accuracy."""

    method: str
    rtol: float | None = None
    step: float | None = None
    accuracy: float | None = None


@dataclass(frozen=True)
class Point:
    """One setting and what came of it.

    ``error``: largest error over the samples, None where the run did not end; it is
    ``resolved`` where it can be told from the reference's own. ``seconds`` of each repetition.
    ``outcome``: ``given_up`` after the budget, ``failed`` for a ``reason``. ``chosen``:
    the method that ``auto`` took. ``drift``: of the energy, None where none is conserved.
    """

    setting: Setting
    outcome: Outcome
    reason: str
    error: float | None
    resolved: bool
    steps: int
    evaluations: int
    drift: float | None
    seconds: tuple[float, ...] = ()
    chosen: str | None = None
    pareto: bool = False
    pareto_evaluations: bool = False

    @property
    def median(self) -> float:
        return statistics.median(self.seconds) if self.seconds else math.inf

    @property
    def quartiles(self) -> tuple[float, float]:
        """The first and the third."""
        if len(self.seconds) < 2:
            return self.median, self.median
        first, _, third = statistics.quantiles(self.seconds, n=4, method="inclusive")
        return first, third


@dataclass(frozen=True)
class Recommendation:
    """The run to take for an accuracy."""

    accuracy: float
    point: Point


@dataclass(frozen=True)
class Behind:
    """How many times the front's seconds and evaluations ``auto`` takes, None where unknown."""

    point: Point
    seconds: float | None
    evaluations: float | None


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
    points: tuple[Point, ...]
    automatic: tuple[Behind, ...]
    left_out: dict[str, str]
    repeat: int
    budget: float

    @property
    def recommended(self) -> tuple[Recommendation, ...]:
        """The fastest run for each accuracy that one reaches, reference's error included."""
        found = []
        for accuracy in ACCURACIES:
            most = accuracy - self.reference.error
            good = [p for p in self.points if p.error is not None and p.error <= most]
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
    request = resolve(model, until, None, "DOP853", 1e-6, None, None, None, budget)
    chosen, left_out = _fitting(model, methods)
    if functions is None:
        functions = right_hand_side(model, cache)
    problem = problem_of(model, request, functions)
    if functions.drive is not None:
        functions.drive.require(problem.start, problem.until)
    require_a_start(model, problem)
    stages = _Stages(progress)
    with np.errstate(all="ignore"):
        found = _pilot(problem, budget)
        known = reference(problem, found, PATIENCE * budget, stages.part(0.2))
        bench = _Bench(model, functions, problem, request, found, known, budget)
        points = _explored(bench, chosen, stages.part(0.5))
        timed = _timed(bench, points, repeat, stages.part(1.0))
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
        automatic=tuple(_behind(p, own, known) for p in timed if p.setting.method == AUTO),
        left_out=left_out,
        repeat=repeat,
        budget=budget,
    )


def _fitting(model: Model, methods: Sequence[str] | None) -> tuple[list[str], dict[str, str]]:
    """Methods that can run here, and the reasons why the others cannot.

    Raises
    ------
    InputError
        One that was asked for is unknown or cannot.
    """
    if methods is not None:
        for name in methods:
            if name != AUTO:
                require_fit(model, method_of(name))
        return list(dict.fromkeys(methods)), {}
    fitting, left_out = [AUTO], {}
    for name, method in INTEGRATORS.items():
        try:
            require_fit(model, method)
            fitting.append(name)
        except InputError as refusal:
            left_out[name] = refusal.problems[0].message
    return fitting, left_out


class _Stages:
    """One progress from 0 to 1 made of the progress of parts."""

    def __init__(self, progress: Callable[[float], None] | None) -> None:
        self._progress, self._done, self._shown = progress, 0.0, 0.0

    def part(self, end: float) -> Callable[[float], None]:
        """What takes the fraction done of the part that ends there."""
        start, self._done = self._done, end

        def tell(fraction: float) -> None:
            self._shown = max(self._shown, start + (end - start) * fraction)
            if self._progress is not None:
                self._progress(self._shown)

        return tell


def _pilot(problem: InitialValueProblem, budget: float) -> Pilot:
    try:
        return pilot(problem, 1e-9, Watch(None, PATIENCE * budget))
    except StoppedError:
        raise no_time() from None


@dataclass(frozen=True)
class _Bench:
    """All that runs have in common."""

    model: Model
    functions: RightHandSide
    problem: InitialValueProblem
    request: Request
    found: Pilot
    reference: Reference
    budget: float

    def run(self, setting: Setting) -> Run:
        """A run at its start, exactly that of ``simulate --method``."""
        method = INTEGRATORS[setting.method]
        asked = replace(self.request, method=method, rtol=setting.rtol, step=setting.step)
        return Run(method, self.problem, control_of(self.problem, asked, self.found))

    def explore(self, setting: Setting) -> Point:
        """Run once, within the budget, and look at the error."""
        if setting.accuracy is not None:
            return self._explore_auto(setting, setting.accuracy)
        run = self.run(setting)  # which may import its method first
        deadline = time.perf_counter() + self.budget
        while run.go(len(self.problem.times)):
            if time.perf_counter() > deadline:
                return _unfinished(setting, "given_up", f"t = {run.t:.9g} reached", run)
        if run.failure is not None:
            return _unfinished(setting, "failed", run.failure.reason, run)
        return self._point(setting, measured_run(run, self.problem), motion_of(run))

    def _explore_auto(self, setting: Setting, accuracy: float) -> Point:
        try:
            measured = integrate_to_accuracy(self.problem, accuracy, Watch(None, self.budget))
        except InputError as refusal:
            reason = refusal.problems[0].message
            return Point(setting, "failed", reason, None, False, 0, 0, None)
        ended = status(self.problem, measured)
        if ended != "ok":
            outcome: Outcome = "given_up" if ended == "stopped" else "failed"
            reason = f"holds until t = {self.problem.times[len(measured.states) - 1]:.9g}"
            found = (None, False, measured.steps, measured.evaluations, None)
            return Point(setting, outcome, reason, *found)
        motion = Motion(measured.states, measured.switches, self.problem.until)
        return replace(self._point(setting, measured, motion), chosen=_taken(measured))

    def _point(self, setting: Setting, measured: Measured, motion: Motion) -> Point:
        ratios = errors(self.problem, self.reference.scales, self.reference.motion, motion)
        error = float(ratios[-1])
        if not math.isfinite(error):
            reason = "other contacts than the reference's"
            found = (None, False, measured.steps, measured.evaluations, None)
            return Point(setting, "failed", reason, *found)
        return Point(
            setting,
            "ok",
            "",
            error,
            error > RESOLVED * self.reference.error,
            measured.steps,
            measured.evaluations,
            self._drift(measured),
        )

    def _drift(self, measured: Measured) -> float | None:
        if not energy_is_conserved(self.model):
            return None
        times = self.problem.times
        seen = along(self.model, self.functions, times, measured)
        energy, kinetic = energies(seen, times, measured.states)
        return energy_drift(energy - seen.lost, kinetic)

    def seconds(self, setting: Setting) -> float:
        """How long a run takes that is known to end."""
        if setting.accuracy is not None:
            watch = Watch(None, None)
            return integrate_to_accuracy(self.problem, setting.accuracy, watch).run_seconds
        started = time.perf_counter()
        self.run(setting).advance(len(self.problem.times), UNLIMITED)
        return time.perf_counter() - started


def _taken(measured: Measured) -> str:
    return measured.method + (" in long doubles" if measured.wider else "")


def _unfinished(setting: Setting, outcome: Outcome, reason: str, run: Run) -> Point:
    return Point(setting, outcome, reason, None, False, run.steps, run.evaluations, None)


# Which runs.


def _explored(
    bench: _Bench, methods: Sequence[str], progress: Callable[[float], None]
) -> list[Point]:
    """Every method from coarse to fine, as far as it gets better and within the budget."""
    points: list[Point] = []
    for number, name in enumerate(methods):
        progress(number / len(methods))
        mine: list[Point] = []
        for setting in _ladder(bench, name):
            mine.append(bench.explore(setting))
            if name != AUTO and _at_the_end(mine):
                break
        points += mine
    progress(1.0)
    return points


def _ladder(bench: _Bench, name: str) -> Iterator[Setting]:
    """Settings of a method from coarse to fine."""
    if name == AUTO:
        return iter([Setting(AUTO, accuracy=eps) for eps in ACCURACIES])
    method = INTEGRATORS[name]
    if method.adaptive:
        powers = range(COARSEST, FINEST + 1)
        return iter([Setting(name, rtol=float(f"1e-{power}")) for power in powers])
    times = bench.problem.times
    first = bench.found.evaluations // (PER_STEP * (len(times) - 1))
    parts = _parts(max(first, 1), method)
    return (Setting(name, step=float(times[1] - times[0]) / part) for part in parts)


def _parts(first: int, method: type[Integrator]) -> list[int]:
    """Steps between two samples, so that each makes the error about ten times smaller."""
    factor = 10.0 ** (1.0 / method.order)
    return list(dict.fromkeys(round(first * factor**k) for k in range(MOST_STEPS_TRIED)))


def _at_the_end(points: Sequence[Point]) -> bool:
    """Whether finer runs of a method have nothing to add."""
    last = points[-1]
    if last.outcome == "given_up" or (last.outcome == "ok" and not last.resolved):
        return True
    found = [math.inf if p.error is None else p.error for p in points]
    before, latest = found[:-STAGNANT], found[-STAGNANT:]
    return bool(before) and min(latest) > BETTER * min(before)


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


def _timed(
    bench: _Bench, points: Sequence[Point], repeat: int, progress: Callable[[float], None]
) -> list[Point]:
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


def _with_fronts(points: Sequence[Point]) -> list[Point]:
    """The points that no other one beats, marked."""
    of = [math.inf if p.error is None else p.error for p in points]
    fast = pareto([(e, p.median) for e, p in zip(of, points, strict=True)])
    few = pareto([(e, float(p.evaluations)) for e, p in zip(of, points, strict=True)])
    return [
        replace(p, pareto=f, pareto_evaluations=w)
        for p, f, w in zip(points, fast, few, strict=True)
    ]


def _behind(point: Point, points: Sequence[Point], known: Reference) -> Behind:
    """A run of ``auto`` beside the cheapest that are as good, as far as errors are resolved."""
    if point.error is None:
        return Behind(point, None, None)
    ok = [(p, p.error) for p in points if p.error is not None]
    error = max(point.error, RESOLVED * known.error)
    return Behind(
        point,
        behind(error, point.median, [(e, p.median) for p, e in ok]),
        behind(error, point.evaluations, [(e, float(p.evaluations)) for p, e in ok]),
    )
