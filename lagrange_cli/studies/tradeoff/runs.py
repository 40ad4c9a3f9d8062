"""The runs that are compared: their settings from coarse to fine, and their results."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from lagrange_cli.errors import InputError
from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.accuracy.controller import integrate_to_accuracy
from lagrange_cli.simulate.accuracy.measured import Measured
from lagrange_cli.simulate.accuracy.method_selection import CoarseResult
from lagrange_cli.simulate.accuracy.user_method import control_of, measured_run
from lagrange_cli.simulate.checkpoint.progress import Deadline, Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Integrator
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import AUTO
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.results.outcome import status
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Run
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.simulate.verification.contact_history import functions_along
from lagrange_cli.simulate.verification.disproof import energy_drift
from lagrange_cli.studies.reference import Motion, Reference, errors, motion_of

#: Accuracies that ``auto`` is asked for, and that runs are recommended for.
ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12)

#: Smallest error that is told from none, relative to scales: nothing smaller is asked of any run.
FINE_ENOUGH = ACCURACIES[-1] / 10

#: Coarsest tolerance of adaptive methods: 10 to minus this.
_COARSEST = 3

#: Finest tolerance of adaptive methods: 10 to minus this.
_FINEST = 15

#: Largest number of different steps that a method of fixed step is tried with.
_MOST_STEPS_TRIED = 30

#: Errors below this many of the reference's are not resolved: at three of them the true error is
#: from two to four.
RESOLVED = 3.0

#: Runs in a row that are no better than one before, after which a method ends: one or two may be so
#: by chance. Not tuned.
_STAGNANT = 3

#: Largest ratio of the errors of a better run and a worse one: smaller gains may be chance. Not
#: tuned.
_BETTER = 0.5

#: Error relative to scales from which on runs are not compared: it is only known to be large.
_LARGE = 0.1

#: Evaluations of the coarse run for each step that a method of fixed step begins with.
_PER_STEP = 16

#: Seconds that ``auto`` may take with its estimate, in those of a run.
ESTIMATE = 5.0

#: More steps than any run makes: it is known to end.
_UNLIMITED = 2**62

_Outcome = Literal["ok", "given_up", "failed"]


@dataclass(frozen=True)
class Setting:
    """Setting of a run: a method with its tolerance or step, or ``auto`` with its accuracy.

    Attributes
    ----------
    method
        Name of the method, or ``auto``.
    rtol
        Relative tolerance of an adaptive method, else None.
    step
        Step of a method of fixed step in units of time, else None.
    accuracy
        Accuracy that ``auto`` is asked for, else None.
    """

    method: str
    rtol: float | None = None
    step: float | None = None
    accuracy: float | None = None


@dataclass(frozen=True)
class WorkPrecisionPoint:
    """The result of one setting.

    Attributes
    ----------
    setting
        The setting.
    outcome
        ``ok``, ``given_up`` after the budget, or ``failed``.
    reason
        Reason why the run did not end; empty if it did.
    error
        Largest error at any sample, relative to scales; None if the run did not end.
    resolved
        True if the error can be told from the reference's own.
    steps, evaluations
        Number of steps and of right-hand sides that it took.
    drift
        Drift of the energy; None if no energy is conserved.
    seconds
        Seconds of each repetition by the wall clock.
    chosen
        Method that ``auto`` took; None for other runs.
    pareto, pareto_evaluations
        True if no other run is more accurate in as little time, or as few right-hand sides.
    spent
        Seconds of the first run, with the estimate of ``auto``.
    """

    setting: Setting
    outcome: _Outcome
    reason: str = ""
    error: float | None = None
    resolved: bool = False
    steps: int = 0
    evaluations: int = 0
    drift: float | None = None
    seconds: tuple[float, ...] = ()
    chosen: str | None = None
    pareto: bool = False
    pareto_evaluations: bool = False
    spent: float = 0.0

    @property
    def distance(self) -> float:
        """Return the error, infinite if the run did not end."""
        return math.inf if self.error is None else self.error

    @property
    def median(self) -> float:
        """Return the median of the seconds, infinite if the run was not timed."""
        return statistics.median(self.seconds) if self.seconds else math.inf

    @property
    def quartiles(self) -> tuple[float, float]:
        """Return the first and the third quartile of the seconds."""
        if len(self.seconds) < 2:
            return self.median, self.median
        first, _, third = statistics.quantiles(self.seconds, n=4, method="inclusive")
        return first, third


@dataclass(frozen=True)
class Bench:
    """Runs the settings of one scene, on one problem.

    Attributes
    ----------
    model
        Model of the scene.
    functions
        Its compiled or interpreted functions.
    problem
        The problem that methods integrate.
    request
        The options that runs of methods share.
    coarse
        Scales and steps from a coarse run.
    reference
        The solution that errors are measured from.
    budget
        Seconds after which a run is given up.
    """

    model: Model
    functions: RightHandSide
    problem: InitialValueProblem
    request: Request
    coarse: CoarseResult
    reference: Reference
    budget: float

    def run(self, setting: Setting) -> Run:
        """Make a run, not yet begun, exactly that of ``simulate --method``."""
        method = INTEGRATORS[setting.method]
        asked = replace(self.request, method=method, rtol=setting.rtol, step=setting.step)
        return Run(method, self.problem, control_of(self.problem, asked, self.coarse))

    def explore(self, setting: Setting) -> WorkPrecisionPoint:
        """Run once, within the budget, and measure the error."""
        started = time.perf_counter()
        try:
            if setting.accuracy is not None:
                point = self._explore_auto(setting, setting.accuracy)
            else:
                run = self.run(setting)  # which may import and compile its method first
                started = time.perf_counter()
                point = self._explore_run(setting, run, started)
        except InputError as refusal:
            point = WorkPrecisionPoint(setting, "failed", refusal.problems[0].message)
        return replace(point, spent=time.perf_counter() - started)

    def _explore_run(self, setting: Setting, run: Run, started: float) -> WorkPrecisionPoint:
        limit = started + self.budget
        while run.go(len(self.problem.times)) and time.perf_counter() <= limit:
            pass
        seconds = time.perf_counter() - started
        if run.failure is not None:
            return _unfinished(setting, "failed", run.failure.reason, run)
        if seconds > self.budget:
            return _unfinished(
                setting, "given_up", Phrase("t = {t} reached", t=f"{run.t:.9g}"), run
            )
        measured = replace(measured_run(run, self.problem), run_seconds=seconds)
        return self._point(setting, measured, motion_of(run))

    def _explore_auto(self, setting: Setting, accuracy: float) -> WorkPrecisionPoint:
        started, limit = time.perf_counter(), ESTIMATE * self.budget
        measured = integrate_to_accuracy(
            self.problem, accuracy, Watch(deadline=Deadline.after(limit))
        )
        if measured.stopped and time.perf_counter() - started < limit:
            raise KeyboardInterrupt
        ended = status(self.problem, measured)
        if ended != "ok":
            outcome: _Outcome = "given_up" if ended == "stopped" else "failed"
            last = f"{float(self.problem.times[len(measured.states) - 1]):.9g}"
            reached = Phrase("t = {t} reached", t=last)
            reason = reached if measured.stopped else Phrase("holds until t = {t}", t=last)
            return _unfinished(setting, outcome, reason, measured)
        motion = Motion(measured.states[:], measured.switches, self.problem.until)
        return replace(self._point(setting, measured, motion), chosen=_taken(measured))

    def _point(self, setting: Setting, measured: Measured, motion: Motion) -> WorkPrecisionPoint:
        ratios = errors(self.problem, self.reference.scales, self.reference.motion, motion)
        error = float(ratios[-1])
        if not math.isfinite(error):
            return _unfinished(setting, "failed", "other contacts than the reference's", measured)
        return WorkPrecisionPoint(
            setting,
            "ok",
            "",
            error,
            error > RESOLVED * self.reference.error,
            measured.steps,
            measured.evaluations,
            self._drift(measured),
            seconds=(measured.run_seconds,),
        )

    def _drift(self, measured: Measured) -> float | None:
        seen = functions_along(self.model, self.functions, self.problem.start, measured)
        measured_drift = energy_drift(self.model, seen, self.problem.times, measured.states)
        return None if measured_drift is None else measured_drift.drift

    def seconds(self, setting: Setting) -> float:
        """Measure the seconds of a run that is known to end."""
        if setting.accuracy is not None:
            measured = integrate_to_accuracy(self.problem, setting.accuracy, Watch())
            if measured.stopped:
                raise KeyboardInterrupt
            return measured.run_seconds
        run = self.run(setting)
        started = time.perf_counter()
        run.advance(len(self.problem.times), _UNLIMITED)
        return time.perf_counter() - started


def _taken(measured: Measured) -> str:
    wide = measured.arithmetic != "double"
    return measured.method + (f" in {measured.arithmetic}s" if wide else "")


def _unfinished(
    setting: Setting, outcome: _Outcome, reason: str, run: Run | Measured
) -> WorkPrecisionPoint:
    steps, evaluations = run.steps, run.evaluations
    return WorkPrecisionPoint(setting, outcome, reason, steps=steps, evaluations=evaluations)


def ladder(bench: Bench, name: str) -> Iterator[Setting]:
    """Return the settings of a method from coarse to fine."""
    if name == AUTO:
        return iter([Setting(AUTO, accuracy=eps) for eps in ACCURACIES])
    method = INTEGRATORS[name]
    if method.adaptive:
        powers = range(_COARSEST, _FINEST + 1)
        return iter([Setting(name, rtol=float(f"1e-{power}")) for power in powers])
    times = bench.problem.times
    first = bench.coarse.evaluations // (_PER_STEP * (len(times) - 1))
    parts = _parts(max(first, 1), method)
    return (Setting(name, step=float(times[1] - times[0]) / part) for part in parts)


def _parts(first: int, method: type[Integrator]) -> list[int]:
    """Return numbers of steps between two samples: each makes errors some ten times smaller."""
    factor = 10.0 ** (1.0 / method.order)
    return list(dict.fromkeys(round(first * factor**k) for k in range(_MOST_STEPS_TRIED)))


def has_stagnated(points: Sequence[WorkPrecisionPoint]) -> bool:
    """Decide whether finer runs of a method have nothing to add."""
    last = points[-1]
    if last.outcome == "given_up" or last.distance <= FINE_ENOUGH:
        return True
    if last.outcome == "ok" and not last.resolved:
        return True
    errors_of_runs = [p.distance if p.distance < _LARGE else math.inf for p in points]
    before, latest = errors_of_runs[:-_STAGNANT], errors_of_runs[-_STAGNANT:]
    return bool(before) and min(latest) > _BETTER * min(before)
