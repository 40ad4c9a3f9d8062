"""The promise of ``--accuracy eps``, kept by measuring.

A coarse pilot finds the scales. Then three runs go through the samples side
by side: the *run* that is returned, a *looser* one of ten times its
tolerance, and a *disturbed* one by another method where one is as accurate.
In the last two every given number and every operation of the right-hand side
is off by its rounding error, in different patterns (after the stochastic
arithmetic of Vignes, *Math. Comput. Simul.* 35 (1993) 233). The difference to
the looser run bounds the error of truncation from above, since its own error
is the larger; the difference to the disturbed one shows how rounding and the
last place of the initial state grow. Where the sum exceeds eps the tolerance is tightened;
where rounding stands in the way the same is done in wider arithmetic, if the
machine has one. At the smallest tolerance the result holds as far as the sum
stays below.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from lagrange_cli.errors import InputError, Problem, StoppedError
from lagrange_cli.simulate.accuracy.attempt import Attempt
from lagrange_cli.simulate.accuracy.error_estimate import FLOOR_ULPS, ErrorEstimate
from lagrange_cli.simulate.accuracy.event_agreement import EventAgreement, UnclearContacts
from lagrange_cli.simulate.accuracy.method_selection import (
    CoarseResult,
    explicit_method,
    restored_or_coarse_result,
)
from lagrange_cli.simulate.accuracy.roundoff import NOISE_PART
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.checkpoint import CheckpointWriter
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, ModeChange
from lagrange_cli.simulate.runs.problem import InitialValueProblem, running_scales, ulps
from lagrange_cli.simulate.runs.run import Failure
from lagrange_cli.simulate.samples.rows import RowSequence, first_rows, windows
from lagrange_cli.simulate.sharpness.peaks import watching

__all__ = [
    "Disproof",
    "LimitingComponent",
    "Measured",
    "integrate_to_accuracy",
    "limiting_component",
    "reason_for_method",
    "start_alone",
    "switches_until",
]

#: The first tolerance as a part of eps: errors grow over a run.
_FIRST_TOLERANCE = 1e-4

#: The same where coordinates are read off positions later, which may take digits.
_FIRST_READ_OFF = 1e-5

#: The largest first tolerance: differences of coarser runs say little of their errors.
_LARGEST_TOLERANCE = 1e-8

#: A first tolerance that is no larger than this many smallest ones is the smallest.
_NEAR_SMALLEST = 10.0

#: Smallest useful tolerance of an explicit (compensated) and an implicit run.
_SMALLEST_TOLERANCE = {False: 1e-16, True: 1e-13}

_MOST_ATTEMPTS = 5

#: A result that misses the accuracy by no more than this factor says what it is close to.
_NEARLY = 1e3

#: The first tolerance in wider arithmetic is no larger than this, since a larger one
#: was not enough, and smaller than the last one by the excess, or this factor; further ones
#: are tried while each gets further by the last factor.
_FIRST_WIDER_TOLERANCE, _MOST_EXCESS_WIDER, _WORTHWHILE = 1e-15, 10.0, 1.05


@dataclass(frozen=True)
class Disproof:
    """When what shows that a result is wrong: a conserved energy that changes, gaps of
    ``contacts`` that are negative, or an impact on them that adds energy; or that a motion comes
    to rest where an equation in words holds, ``where``, and more than one follows."""

    time: float
    by: Literal["energy", "gap", "impact", "uniqueness"]
    contacts: tuple[int, ...] = ()
    where: str = ""


@dataclass(frozen=True)
class LimitingComponent:
    """The number of the state whose error is the largest at the end: of its ``scale``."""

    component: int
    error: float
    scale: float


@dataclass(frozen=True)
class Measured:
    """Samples with what is known of their error.

    ``states`` (samples, 2n) are those that hold; ``estimate`` the largest
    estimated error over its scale among them; ``failure`` says where the motion
    itself ends, ``stopped`` that the user or the budget ended it. ``choice``
    says why the method was taken; ``disproved`` what shows that the rest is wrong;
    ``wider`` whether the run was made in wider arithmetic than doubles. ``switches`` are
    what happened to contacts until the last sample, and the end of bounces that stands
    behind it, ``began`` the contacts that were closed at first, ``unclear`` at which
    contacts the promise ends; velocities at the times
    ``exempt`` are as close to a jump as the error of its time. ``limiting_component`` is what keeps
    runs that reach the end from the accuracy. ``steps`` and ``evaluations`` are those of the
    run, ``all_evaluations`` of everything.
    """

    states: RowSequence
    scales: Array
    estimate: float
    failure: Failure | None
    stopped: bool
    method: str
    choice: str
    steps: int
    evaluations: int
    all_evaluations: int
    run_seconds: float
    estimate_seconds: float
    disproved: Disproof | None = None
    wider: bool = False
    switches: tuple[ModeChange, ...] = ()
    began: ContactMode = ()
    unclear: UnclearContacts | None = None
    exempt: Array = field(default_factory=lambda: np.empty(0))
    limiting_component: LimitingComponent | None = None


def integrate_to_accuracy(
    problem: InitialValueProblem, eps: float, watch: Watch, keeper: CheckpointWriter | None = None
) -> Measured:
    """Integrate so that every sample is within ``eps`` of its scale, as measured.

    Raises
    ------
    InputError
        ``eps`` is below what double precision can tell apart here.
    """
    started = time.perf_counter()
    refuse_below_floor(problem, eps, np.where(problem.angles, 1.0, np.inf))
    attempts: list[Attempt] = []
    stopped = False
    with np.errstate(all="ignore"):
        try:
            part = _FIRST_READ_OFF if problem.read_off else _FIRST_TOLERANCE
            first = min(part * eps, _LARGEST_TOLERANCE)
            coarse = restored_or_coarse_result(problem, first, watch, keeper, looks=True)
            problem = replace(problem, between=coarse.between)
            problem = watching(problem) if coarse.sharp else problem
            refuse_below_floor(problem, eps, coarse.scales[-1, : len(problem.kinds)])
            if keeper is not None:
                keeper.keep(
                    lambda: {"pilot": coarse.state(), "attempts": [a.state() for a in attempts]}
                )
            _attempt(problem, eps, coarse, first, attempts, watch, keeper)
            _attempt_wider(problem, eps, coarse, attempts, watch, keeper)
        except (StoppedError, KeyboardInterrupt):
            stopped = True
    if not attempts:
        return start_alone(problem, time.perf_counter() - started)
    seconds = time.perf_counter() - started
    with np.errstate(all="ignore"):
        return _measured(problem, eps, coarse, attempts, stopped, seconds)


def refuse_below_floor(problem: InitialValueProblem, eps: float, scales: Array) -> None:
    """Refuse an ``eps`` below 4 units in the last place of the start values."""
    n = len(problem.kinds)
    floors = FLOOR_ULPS * ulps(problem.y0[:n]) / scales
    floor = max(float(floors.max(initial=0.0)), FLOOR_ULPS * float(np.finfo(float).epsneg))
    if eps < floor:
        less = f"ask for --accuracy {_round_up(floor):g} or more, or " if floor < 0.1 else ""
        raise InputError(
            Problem(
                f"accuracy {eps:g} is below what double precision can hold here, {floor:.1g}",
                hint=f"{less}measure positions from a nearer origin (angles: nearer to 0)",
                rule="accuracy-floor",
            )
        )


def _round_up(value: float) -> float:
    """The next number with one digit."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(np.ceil(value / power) * power)


def _attempt(
    problem: InitialValueProblem,
    eps: float,
    coarse: CoarseResult,
    first: float,
    attempts: list[Attempt],
    watch: Watch,
    keeper: CheckpointWriter | None,
) -> None:
    """Try smaller and smaller tolerances; ``attempts`` grows by those that are begun."""
    mine: list[Attempt] = []
    least = smallest_tolerance(problem, coarse)
    for tolerance in tolerances(least, first, problem.epsilon, mine):
        watch.progress.next_pass()
        before = attempts[-1] if attempts else None
        last = tolerance == least and not problem.widens
        mine.append(Attempt(problem, eps, coarse, tolerance, len(mine), before, last))
        attempts.append(mine[-1])
        if keeper is not None:
            _go_on(mine[-1], len(attempts) - 1, keeper)
        mine[-1].go(watch if keeper is None else keeper.watched(watch))


def _go_on(attempt: Attempt, number: int, keeper: CheckpointWriter) -> None:
    """Let an attempt stand where it stood before the runs were interrupted, if they were.

    Raises
    ------
    InputError
        Its samples are damaged, or a method cannot go on.
    """
    for method in sorted(attempt.methods, key=lambda method: method.name):
        keeper.require(method)
    before = () if keeper.before is None else keeper.before["attempts"]
    if number < len(before) and not attempt.restore(before[number]):
        raise keeper.damaged()


def _attempt_wider(
    problem: InitialValueProblem,
    eps: float,
    coarse: CoarseResult,
    attempts: list[Attempt],
    watch: Watch,
    keeper: CheckpointWriter | None,
) -> None:
    """Try on in wider arithmetic where doubles were not enough."""
    best = max(attempts, key=lambda attempt: attempt.error_estimate().samples)
    kept = best.error_estimate().samples == len(problem.times)
    if kept or best.failure is not None or coarse.stiff:
        return
    wider = problem.wider()
    if wider is not None:
        wider = replace(wider, between=problem.between)
        last = attempts[-1]
        excess = min(last.expected_excess, _MOST_EXCESS_WIDER)
        first = min(last.tolerance, _FIRST_WIDER_TOLERANCE) / excess
        method = explicit_method(wider, first)
        finer = replace(coarse.finer(wider.epsilon / problem.epsilon), method=method)
        _attempt(wider, eps, finer, first, attempts, watch, keeper)


def smallest_tolerance(problem: InitialValueProblem, coarse: CoarseResult) -> float:
    """The smallest tolerance that is of use."""
    n = len(problem.kinds)
    finer = problem.epsilon / float(np.finfo(float).eps)
    # Steps finer than the noise of the right-hand side are of no use.
    steps = finer * ulps(problem.y0[:n]) / coarse.scales[-1, :n] / 8
    noise = max(float(steps.max(initial=0.0)), NOISE_PART * coarse.relative_noise)
    return max(finer * _SMALLEST_TOLERANCE[coarse.stiff], noise)


def tolerances(
    smallest: float, first: float, epsilon: float, attempts: list[Attempt]
) -> Iterator[float]:
    """Tolerances to try, until the last attempt settles the matter."""
    tolerance = first if first > _NEAR_SMALLEST * smallest else smallest
    yield tolerance
    while not attempts[-1].settled and len(attempts) < _MOST_ATTEMPTS:
        if tolerance == smallest and not attempts[-1].loose_at_first:
            return
        if epsilon < float(np.finfo(float).eps) and not _worthwhile(attempts):
            return
        tolerance = max(smallest, tolerance / attempts[-1].reduction)
        yield tolerance


def _worthwhile(attempts: list[Attempt]) -> bool:
    """Whether the last attempt got clearly further than the one before."""
    reached = [attempt.error_estimate().samples for attempt in attempts[-2:]]
    return len(reached) < 2 or reached[1] > _WORTHWHILE * reached[0]


def _measured(
    problem: InitialValueProblem,
    eps: float,
    coarse: CoarseResult,
    attempts: list[Attempt],
    stopped: bool,
    seconds: float,
) -> Measured:
    best = max(attempts, key=lambda attempt: attempt.error_estimate().samples)
    estimate = best.error_estimate()
    events = best.events
    return Measured(
        states=first_rows(best.run.rows, estimate.samples),
        scales=estimate.scales,
        estimate=estimate.estimate,
        failure=best.failure,
        stopped=stopped,
        method=best.run.method.name,
        choice=reason_for_method(coarse, problem.longest_step),
        steps=best.run.steps,
        evaluations=best.run.evaluations,
        all_evaluations=coarse.evaluations + sum(a.evaluations for a in attempts),
        run_seconds=best.run_seconds,
        estimate_seconds=seconds - best.run_seconds,
        wider=best.wider,
        switches=switches_until(best.run.switches, problem, estimate.samples),
        began=best.run.began,
        unclear=_unclear(best, estimate.samples, problem.times),
        exempt=_exempt(events, problem.times, best.run.rows, estimate.samples),
        limiting_component=limiting_component(
            [attempt.error_estimate() for attempt in attempts if attempt.complete], eps
        )
        if estimate.samples < len(problem.times)
        else None,
    )


def _exempt(
    events: EventAgreement | None, times: RowSequence, states: RowSequence, samples: int
) -> Array:
    """The times at which velocities are as close to a jump as the error of its time."""
    if events is None:
        return np.empty(0)
    parts = (part for part, _ in windows(times, first_rows(states, samples)))
    return np.concatenate([part[events.exempt(part)] for part in parts])


def _unclear(best: Attempt, samples: int, times: RowSequence) -> UnclearContacts | None:
    """The contacts at which the promise ends, None where it does not, or elsewhere."""
    if best.events is None or samples == len(times):
        return None
    kept, lost = times[samples - 1 : samples + 1].tolist()
    return best.events.unclear(kept, lost, best.run.switches)


def limiting_component(estimates: Sequence[ErrorEstimate], eps: float) -> LimitingComponent | None:
    """Of what came closest of complete attempts, where a little less accuracy could be had."""
    if not estimates:
        return None
    nearest = min(estimates, key=lambda estimate: estimate.excess)
    worst = int(nearest.errors.argmax())
    error, every = float(nearest.errors[worst]), nearest.excess * eps
    if error < every * (1 - 1e-9) or error > _NEARLY * eps:
        return None
    return LimitingComponent(worst, error, float(nearest.last[worst]))


def switches_until(
    switches: Sequence[ModeChange], problem: InitialValueProblem, samples: int
) -> tuple[ModeChange, ...]:
    """Those up to the last of so many samples, and the end of bounces next behind it."""
    last, all_of_them = float(problem.times[samples - 1]), samples == len(problem.times)
    inside = [s for s in switches if s.t <= last]
    beyond = [s for s in switches if s.t > last and s.kind == "zeno"]
    return (*inside, *([] if all_of_them else beyond[:1]))


def reason_for_method(coarse: CoarseResult, usual: float) -> str:
    """Why the pilot's method is taken, in words; ``usual``: the longest step of most runs."""
    if coarse.stiff:
        return "a coarse trial found the system stiff: an implicit method needs fewer evaluations"
    reason, by_gauss = "an explicit method of high order", coarse.method is INTEGRATORS["Gauss16"]
    if coarse.method is INTEGRATORS["taylor"]:
        reason = "series that are compiled without a compiler of C"
    if coarse.longest_step > usual:
        reason = "collocation at eight points" if by_gauss else reason
        reason += ", in long steps: nothing sharp is near the motion, around which it is analytic"
    elif by_gauss:
        reason = "collocation, whose eight stages are evaluated side by side"
    return f"no stiffness was found: {reason}"


def start_alone(problem: InitialValueProblem, seconds: float) -> Measured:
    """The start alone, where nothing else was finished before the run was stopped."""
    states = problem.y0[None, :].copy()
    return Measured(
        states=states,
        scales=running_scales(problem, states)[-1],
        estimate=0.0,
        failure=None,
        stopped=True,
        method="DOP853",
        choice="stopped before a choice was made",
        steps=0,
        evaluations=0,
        all_evaluations=0,
        run_seconds=0.0,
        estimate_seconds=seconds,
    )
