"""Reference solutions, of much higher accuracy than the runs compared with them.

On machines with wider arithmetic than doubles the reference is DOP853's in that arithmetic, at
two tolerances: the distance of the two runs is the stated error. A run by another method in doubles
confirms that both solve the same problem. On other machines, and where that takes too long, two
methods in doubles are compared with each other, and the first with itself. In these companions
every given number and every operation is off by its rounding error, in different patterns, since
roundings that runs share would show in none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lagrange_cli.errors import AccuracyError, Problem, StoppedError
from lagrange_cli.simulate.accuracy.coarse_run import LEAST
from lagrange_cli.simulate.accuracy.event_agreement import event_agreement, first_zeno_time
from lagrange_cli.simulate.accuracy.method_selection import NOISE_PART, CoarseResult
from lagrange_cli.simulate.accuracy.tuning import SCHEDULE
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.progress import Deadline, RunProgress, Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.integrators.hybrid.contact_system import ModeChange
from lagrange_cli.simulate.integrators.right_hand_side import structured
from lagrange_cli.simulate.runs.problem import InitialValueProblem, running_scales, ulps
from lagrange_cli.simulate.runs.run import Failure, Run

#: Tolerances of the two runs in wider arithmetic, relative to scales: one at the rounding error of
#: long doubles, and one so far above it that steps differ. Not tuned.
_WIDER_TOLERANCES = (1e-19, 2e-18)

#: Is a method implicit? → its tolerance in doubles, relative to scales: the smallest useful ones.
_TOLERANCES = {False: SCHEDULE.smallest_explicit, True: SCHEDULE.smallest_implicit}

#: Factor of the distance of two runs that counts as error: more than all of it may be of one.
_WIDER = 2.0

#: The same of both companions in doubles: in one of ten motions chance brings the roundings of one
#: of them close to the run's. Set by 130 motions beside long doubles.
_DOUBLES = (2.0, 3.0)

#: Factor of the longest step of a companion.
_SHORTER = 0.9

#: Part of the budget that explicit runs have of stiff motion: most would spend all of it.
_EXPLICIT_PART = 0.1

#: Evaluations of the coarse run per step.
_PER_STEP = 12

#: Largest error of a useful reference, relative to scales: a tenth of the coarsest accuracy that
#: runs are compared at.
_WORST = 1e-4

#: Error that a reference has at the earlier end that a hint suggests: small enough for the finer
#: of the usual accuracies, 1e-6. Not tuned.
_SUGGESTED = 1e-8

#: Part of the way to a singularity after which it is near.
_CLEAR = 0.99

#: Largest distance of a run by another method in doubles, where rounding grows sooner.
_FARTHEST = 1e-2


class Motion(NamedTuple):
    """The motion that a run has computed.

    Attributes
    ----------
    states
        Coordinates and velocities at the samples that it reached, shape (samples, 2n).
    switches
        Changes of contacts, in order of time.
    t
        Time that it reached.
    """

    states: Array
    switches: tuple[ModeChange, ...]
    t: float


@dataclass(frozen=True)
class Reference:
    """The solution that errors are measured from.

    Attributes
    ----------
    motion
        Its samples and events.
    scales
        Scales of its coordinates and velocities, shape (2n,).
    method
        Its method in words, with the arithmetic or the method it was compared with.
    error
        Its own error relative to scales, as :func:`errors` counts.
    checked
        Another method that confirmed it in doubles; None if there was none.
    difference
        Distance of that method's run at the end, relative to scales; None if there was none.
    """

    motion: Motion
    scales: Array
    method: str
    error: float
    checked: str | None = None
    difference: float | None = None


def motion_of(run: Run) -> Motion:
    """Return the states, the events and the end of a run."""
    return Motion(run.states, tuple(run.switches), run.t)


def errors(problem: InitialValueProblem, scales: Array, first: Motion, second: Motion) -> Array:
    """Return the largest distance of two motions up to each sample, relative to scales.

    Differences of times of events count relative to the span. Velocities do not count at samples
    between the two times of a jump.

    Returns
    -------
    Shape (samples that both have,); infinite from the first event that is not in both.
    """
    common = min(len(first.states), len(second.states))
    times = problem.times[:common]
    ratios = np.abs(first.states[:common] - second.states[:common]) / scales
    ratios = np.where(np.isfinite(ratios), ratios, np.inf)
    if not (first.switches or second.switches):
        return np.asarray(np.maximum.accumulate(ratios.max(axis=1)))
    events = event_agreement([first.switches, second.switches], [first.t, second.t], (0.0, 1.0))
    ratios[events.exempt(times), problem.layout.velocities] = 0.0
    of_events = events.ratios(times, problem.span)
    return np.asarray(np.maximum(np.maximum.accumulate(ratios.max(axis=1)), of_events))


def reference(
    problem: InitialValueProblem,
    coarse: CoarseResult,
    budget: float,
    progress: Callable[[float], None] | None = None,
) -> Reference:
    """Compute a reference at the sample times.

    Parameters
    ----------
    coarse
        Scales, noise and steps from a coarse run.
    budget
        Seconds that each run may take.

    Raises
    ------
    AccuracyError
        There is none: the motion is chaotic and its runs part, or it ends, or the budget is
        too small.
    """
    makers = _Makers(problem, coarse, budget, progress)
    wide = makers.wider()
    doubles = makers.doubles(1 if wide else 2)
    if not wide:
        doubles += makers.again(doubles[:1])
    _require(problem, [run for run, _ in (*wide, *doubles)], makers, 1 if wide else 3)
    if not wide:
        (best, method), (second, second_method), (again, _) = doubles
        companions = [(_DOUBLES[0], second), (_DOUBLES[1], again)]
        return _compared(problem, best, companions, f"{method} against {second_method}")
    (best, method), (second, _) = wide
    sure = _compared(problem, best, [(_WIDER, second)], f"{method} in long doubles")
    if not doubles:
        return sure
    check, check_method = doubles[0]
    ratios = errors(problem, sure.scales, sure.motion, motion_of(check))
    _require_agreement(problem, ratios, _FARTHEST)
    return replace(sure, checked=check_method, difference=float(ratios[-1]))


#: A run that reached the end, and the name of its method.
_Ended = tuple[Run, str]


class _Makers:
    """Makes the runs of highest accuracy.

    Attributes
    ----------
    failures
        Failures of runs that did not reach the end.
    spent
        True if a run took longer than its budget.
    """

    def __init__(
        self,
        problem: InitialValueProblem,
        coarse: CoarseResult,
        budget: float,
        progress: Callable[[float], None] | None,
    ) -> None:
        self._problem, self._coarse = problem, coarse
        self._budget, self._progress = budget, progress
        self.failures: list[Failure] = []
        self.spent = False

    def wider(self) -> list[_Ended]:
        """Make two runs in wider arithmetic; none if there is no such, or they do not end."""
        wider = self._problem.wider()
        if wider is None:
            return []
        finer = self._coarse.finer(wider.epsilon / self._problem.epsilon)
        ended: list[_Ended] = []
        for tolerance in _WIDER_TOLERANCES:
            run = self._run("DOP853", wider, finer, tolerance)
            if run is None:
                return []
            ended.append((run, "DOP853"))
        return ended

    def doubles(self, number: int) -> list[_Ended]:
        """Make ``number`` runs in doubles by different methods, fewer if they do not end; the
        second is perturbed."""
        ended: list[_Ended] = []
        for name in self._methods():
            if len(ended) == number:
                break
            ended += self._in_doubles(name, len(ended))
        return ended

    def again(self, first: Sequence[_Ended]) -> list[_Ended]:
        """Make runs by the same methods once more, perturbed in another way."""
        return [run for _, name in first for run in self._in_doubles(name, 2)]

    def _in_doubles(self, name: str, off: int) -> list[_Ended]:
        tolerance = _TOLERANCES[INTEGRATORS[name].implicit]
        run = self._run(name, self._problem, self._coarse, tolerance, off)
        return [] if run is None else [(run, name)]

    def _methods(self) -> Sequence[str]:
        if not self._coarse.stiff:
            return ("Gauss16", "DOP853")
        projects = structured(self._problem.rhs).project is not None
        return ("DOP853", "Radau", "BDF" if projects else "LSODA")

    def _run(
        self,
        name: str,
        problem: InitialValueProblem,
        coarse: CoarseResult,
        tolerance: float,
        off: int = 0,
    ) -> Run | None:
        """Return a run that reached the end, perturbed by pattern ``off``, or None."""
        absolute = np.maximum(tolerance * coarse.scales, _noise(problem, coarse) + LEAST)
        # Other steps: sums of the same ones round alike.
        absolute, longest = absolute * (1 + off), problem.longest_step * _SHORTER**off
        control = Control(np.zeros_like(absolute), absolute, coarse.first_step, longest)
        perturbed = problem.perturbed or (problem.rhs, problem.rhs)
        rhs = perturbed[off - 1] if off else None
        run = Run(INTEGRATORS[name], problem, control, rhs=rhs, y0=problem.start_off(off))
        hopeless = self._coarse.stiff and not run.method.implicit
        budget = self._budget * (_EXPLICIT_PART if hopeless else 1.0)
        watch = Watch(RunProgress(self._progress), Deadline.after(budget))
        try:
            while run.go(len(problem.times)):
                watch((run.t - problem.start) / problem.span)
            if run.failure is None:
                watch(1.0)  # also where it ended before the first look
        except StoppedError:
            self.spent = True
            return None
        if run.failure is not None:
            self.failures.append(run.failure)
            return None
        return run


def _noise(problem: InitialValueProblem, coarse: CoarseResult) -> Array:
    """Bound the accuracy of steps from below, in units of coordinates and velocities, shape (2n,).

    It is the larger of two: the effect of the last place of each number of the start on a step,
    and the rounding of coordinates that are large beside their scales.
    """
    y0, t0, n = problem.y0, problem.start, len(problem.kinds)
    last_places, h = ulps(y0), _PER_STEP * problem.span / coarse.evaluations
    moved = [
        np.abs(problem.rhs(t0, y0 + row) - problem.rhs(t0, y0)) for row in np.diag(last_places)
    ]
    of_start = h * np.sum(moved, axis=0)
    of_start = np.where(np.isfinite(of_start), of_start, 0.0)
    finer = problem.epsilon / float(np.finfo(float).eps)
    noise = np.maximum(coarse.noise[-1], finer * of_start)
    noise[:n] = np.maximum(noise[:n], finer * last_places[:n])
    return np.asarray(NOISE_PART * noise)


def _compared(
    problem: InitialValueProblem,
    best: Run,
    companions: Sequence[tuple[float, Run]],
    method: str,
) -> Reference:
    """Make a reference of a run; its error is estimated by the weighted distances of others."""
    motion = motion_of(best)
    scales = running_scales(problem, best.states)[-1]
    apart = [weight * errors(problem, scales, motion, motion_of(run)) for weight, run in companions]
    common = min(map(len, apart))
    ratios = np.sum([distances[:common] for distances in apart], axis=0)
    _require_agreement(problem, ratios, _WORST)
    floor = ulps(np.abs(best.states).max(axis=0)) / scales
    return Reference(motion, scales, method, max(float(ratios[-1]), float(floor.max())))


def _require(
    problem: InitialValueProblem, ended: Sequence[Run], makers: _Makers, number: int
) -> None:
    """Refuse if fewer runs than needed reached the end, or impacts accumulate before it."""
    bounces = min((first_zeno_time(run.switches) for run in ended), default=math.inf)
    if bounces < problem.until:
        raise _refused(
            f"bounces become infinitely many by t = {bounces:.9g}, and no reference is past that",
            _until(problem, _before(problem, bounces)),
        )
    if len(ended) >= number:
        return
    if makers.failures:
        failure = min(makers.failures, key=lambda f: f.time)
        raise _refused(
            f"no reference: the motion cannot be continued past t = {failure.time:.9g}:"
            f" {failure.reason}",
            _until(problem, _before(problem, failure.time)),
        )
    raise no_time()


def _require_agreement(problem: InitialValueProblem, ratios: Array, most: float) -> None:
    """Refuse if runs of highest accuracy are farther apart than ``most``, relative to scales."""
    if len(ratios) == len(problem.times) and ratios[-1] <= most:
        return
    distance = f"differ by {ratios[-1]:.1e} of the scales at the end"
    if not np.isfinite(ratios[-1]):
        distance = f"differ in what contacts do before t = {problem.until:.9g}"
    raise _refused(
        f"no reference: runs of highest accuracy {distance}, since the motion is chaotic or loses"
        " digits; nothing can be measured there",
        _until(problem, ratios),
    )


def _before(problem: InitialValueProblem, end: float) -> Array:
    """Return 0 for samples clearly before an end, infinity for those from there on."""
    clear = problem.start + _CLEAR * (end - problem.start)
    return np.where(problem.times[:] < clear, 0.0, np.inf)


def _until(problem: InitialValueProblem, ratios: Array) -> str:
    """Suggest an end that has a reference, as an option; empty if there is none."""
    good = problem.times[: len(ratios)][ratios <= _SUGGESTED]
    if len(good) < 2:
        return ""
    digits = math.floor(math.log10(good[-1] - problem.start)) - 2
    until = problem.start + math.floor((good[-1] - problem.start) / 10.0**digits) * 10.0**digits
    return f"--until {until:.6g}"


def no_time() -> AccuracyError:
    """Return the refusal of a budget that is too small for any reference."""
    return _refused(
        "no reference: runs of highest accuracy do not end within the budget", "--budget 60"
    )


def _refused(message: str, hint: str) -> AccuracyError:
    return AccuracyError(Problem(message, hint=hint, rule="no-reference"))
