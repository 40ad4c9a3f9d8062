"""Settings of compared runs from coarse to fine, and their results."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from lagrange_cli.errors import InputError
from lagrange_cli.simulate.accuracy.controller import integrate_to_accuracy
from lagrange_cli.simulate.accuracy.measured import Measured
from lagrange_cli.simulate.accuracy.method_selection import CoarseResult
from lagrange_cli.simulate.accuracy.user_method import control_of, measured_run
from lagrange_cli.simulate.checkpoint.progress import Deadline, Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Integrator
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.request import AUTO, Request
from lagrange_cli.simulate.results.outcome import status
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Run
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.simulate.verification.contact_history import functions_along
from lagrange_cli.simulate.verification.disproof import energy_drift
from lagrange_cli.studies.reference import Motion, Reference, errors, motion_of

#: What ``auto`` is asked for, and runs are recommended for.
ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12)

#: Coarsest tolerance of adaptive methods, 10 to minus this.
_COARSEST = 3

#: Finest tolerance of adaptive methods, 10 to minus this.
_FINEST = 15

#: Most steps that a method of fixed step is tried with.
_MOST_STEPS_TRIED = 30

#: Errors below the reference's times this are not told from it.
RESOLVED = 3.0

#: So many runs in a row that are no better than one before are the last ones.
_STAGNANT = 3

#: Factor of errors by which a run is better.
_BETTER = 0.5

#: Error from which on nothing is known but that it is large.
_LARGE = 0.1

#: Evaluations of the coarse run per step that a method of fixed step begins with.
_PER_STEP = 16

#: Seconds that ``auto`` may take with its estimate, in budgets of a run.
_ESTIMATE = 5.0

#: More steps than any run makes: it is known to end.
_UNLIMITED = 2**62

_Outcome = Literal["ok", "given_up", "failed"]


@dataclass(frozen=True)
class Setting:
    """Setting of a run: a method with its tolerance or step, or ``auto`` with its accuracy."""

    method: str
    rtol: float | None = None
    step: float | None = None
    accuracy: float | None = None


@dataclass(frozen=True)
class WorkPrecisionPoint:
    """One setting and what came of it.

    ``error``: largest error over the samples, None where the run did not end; it is
    ``resolved`` where it can be told from the reference's own. ``seconds`` of each repetition.
    ``outcome``: ``given_up`` after the budget, ``failed`` for a ``reason``. ``chosen``:
    the method that ``auto`` took. ``drift``: of the energy, None where none is conserved.
    """

    setting: Setting
    outcome: _Outcome
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
    def distance(self) -> float:
        """The error, infinite where the run did not end."""
        return math.inf if self.error is None else self.error

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
class Bench:
    """All that runs have in common."""

    model: Model
    functions: RightHandSide
    problem: InitialValueProblem
    request: Request
    found: CoarseResult
    reference: Reference
    budget: float

    def run(self, setting: Setting) -> Run:
        """A run at its start, exactly that of ``simulate --method``."""
        method = INTEGRATORS[setting.method]
        asked = replace(self.request, method=method, rtol=setting.rtol, step=setting.step)
        return Run(method, self.problem, control_of(self.problem, asked, self.found))

    def explore(self, setting: Setting) -> WorkPrecisionPoint:
        """Run once, within the budget, and look at the error."""
        if setting.accuracy is not None:
            return self._explore_auto(setting, setting.accuracy)
        try:
            run = self.run(setting)  # which may import its method first
        except InputError as refusal:
            reason = refusal.problems[0].message
            return WorkPrecisionPoint(setting, "failed", reason, None, False, 0, 0, None)
        deadline = time.perf_counter() + self.budget
        while run.go(len(self.problem.times)):
            if time.perf_counter() > deadline:
                return _unfinished(setting, "given_up", f"t = {run.t:.9g} reached", run)
        if run.failure is not None:
            return _unfinished(setting, "failed", run.failure.reason, run)
        return self._point(setting, measured_run(run, self.problem), motion_of(run))

    def _explore_auto(self, setting: Setting, accuracy: float) -> WorkPrecisionPoint:
        started, limit = time.perf_counter(), _ESTIMATE * self.budget
        try:
            watch = Watch(deadline=Deadline.after(limit))
            measured = integrate_to_accuracy(self.problem, accuracy, watch)
        except InputError as refusal:
            reason = refusal.problems[0].message
            return WorkPrecisionPoint(setting, "failed", reason, None, False, 0, 0, None)
        if measured.stopped and time.perf_counter() - started < limit:
            raise KeyboardInterrupt
        ended = status(self.problem, measured)
        if ended != "ok":
            outcome: _Outcome = "given_up" if ended == "stopped" else "failed"
            last = float(self.problem.times[len(measured.states) - 1])
            reason = (
                f"t = {last:.9g} reached" if measured.stopped else f"holds until t = {last:.9g}"
            )
            counts = (None, False, measured.steps, measured.evaluations, None)
            return WorkPrecisionPoint(setting, outcome, reason, *counts)
        motion = Motion(measured.states[:], measured.switches, self.problem.until)
        return replace(self._point(setting, measured, motion), chosen=_taken(measured))

    def _point(self, setting: Setting, measured: Measured, motion: Motion) -> WorkPrecisionPoint:
        ratios = errors(self.problem, self.reference.scales, self.reference.motion, motion)
        error = float(ratios[-1])
        if not math.isfinite(error):
            reason = "other contacts than the reference's"
            counts = (None, False, measured.steps, measured.evaluations, None)
            return WorkPrecisionPoint(setting, "failed", reason, *counts)
        return WorkPrecisionPoint(
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
        seen = functions_along(self.model, self.functions, self.problem.start, measured)
        return energy_drift(self.model, seen, self.problem.times, measured.states)

    def seconds(self, setting: Setting) -> float:
        """Measure the seconds of a run that is known to end."""
        if setting.accuracy is not None:
            measured = integrate_to_accuracy(self.problem, setting.accuracy, Watch())
            if measured.stopped:
                raise KeyboardInterrupt
            return measured.run_seconds
        started = time.perf_counter()
        self.run(setting).advance(len(self.problem.times), _UNLIMITED)
        return time.perf_counter() - started


def _taken(measured: Measured) -> str:
    return measured.method + (" in long doubles" if measured.wider else "")


def _unfinished(setting: Setting, outcome: _Outcome, reason: str, run: Run) -> WorkPrecisionPoint:
    return WorkPrecisionPoint(
        setting, outcome, reason, None, False, run.steps, run.evaluations, None
    )


def ladder(bench: Bench, name: str) -> Iterator[Setting]:
    """Settings of a method from coarse to fine."""
    if name == AUTO:
        return iter([Setting(AUTO, accuracy=eps) for eps in ACCURACIES])
    method = INTEGRATORS[name]
    if method.adaptive:
        powers = range(_COARSEST, _FINEST + 1)
        return iter([Setting(name, rtol=float(f"1e-{power}")) for power in powers])
    times = bench.problem.times
    first = bench.found.evaluations // (_PER_STEP * (len(times) - 1))
    parts = _parts(max(first, 1), method)
    return (Setting(name, step=float(times[1] - times[0]) / part) for part in parts)


def _parts(first: int, method: type[Integrator]) -> list[int]:
    """Steps between two samples, so that each makes the error about ten times smaller."""
    factor = 10.0 ** (1.0 / method.order)
    return list(dict.fromkeys(round(first * factor**k) for k in range(_MOST_STEPS_TRIED)))


def has_stagnated(points: Sequence[WorkPrecisionPoint]) -> bool:
    """Tell if finer runs of a method have nothing to add."""
    last = points[-1]
    if last.outcome == "given_up" or (last.outcome == "ok" and not last.resolved):
        return True
    errors_of_runs = [p.distance if p.distance < _LARGE else math.inf for p in points]
    before, latest = errors_of_runs[:-_STAGNANT], errors_of_runs[-_STAGNANT:]
    return bool(before) and min(latest) > _BETTER * min(before)
