"""Keep the accuracy that a user states, by measuring the error of each run.

A coarse run finds the scales. Then three runs pass through the samples side by side: the *run*
that is returned, a *looser* companion of ten times its tolerance, and a *perturbed* one whose steps
fall on other times. In the companions every given number and every operation of the right-hand side
is off by its rounding error, in different patterns (stochastic arithmetic: Vignes, *Math. Comput.
Simul.* 35 (1993) 233). The difference to the looser run bounds the truncation error
from above, since its own error is the larger; the difference to the perturbed one shows how
rounding and the last place of the initial state grow. If the sum exceeds eps, the tolerance is
tightened; if rounding stands in the way, the same is done in wider arithmetic, if the machine has
one. At the smallest tolerance the result holds as far as the sum stays below eps.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lagrange_cli.errors import InputError, Problem, StoppedError
from lagrange_cli.simulate.accuracy.attempt import Attempt, costing_as
from lagrange_cli.simulate.accuracy.error_estimate import FLOOR_ULPS
from lagrange_cli.simulate.accuracy.event_agreement import UnclearContacts
from lagrange_cli.simulate.accuracy.measured import (
    Measured,
    limiting_component,
    slides_until,
    start_alone,
    switches_until,
)
from lagrange_cli.simulate.accuracy.method_selection import (
    NOISE_PART,
    CoarseResult,
    explicit_method,
    reason_for_method,
    restored_or_coarse_result,
)
from lagrange_cli.simulate.accuracy.tuning import SCHEDULE
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.checkpoint import CheckpointWriter
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Integrator
from lagrange_cli.simulate.integrators.base import UNDERFLOW
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE
from lagrange_cli.simulate.runs.problem import InitialValueProblem, ulps
from lagrange_cli.simulate.runs.run import Failure
from lagrange_cli.simulate.samples import RowSequence, first_rows, windows
from lagrange_cli.simulate.sharpness import watching

#: Last places of the time by which steps that are too short are away from a singularity, if it is
#: the reason, and much less; and the largest part of the span.
_AHEAD, _NEAR = 1e4, 1e-4
#: Last places of a coordinate in which accelerations hardly change then, and the least move.
_MOVED, _LEAST = 4, 1e-300

#: One unit in the last place below 1.
_LAST_PLACE = float(np.finfo(float).epsneg)


def integrate_to_accuracy(
    problem: InitialValueProblem, eps: float, watch: Watch, keeper: CheckpointWriter | None = None
) -> Measured:
    """Integrate until every sample is measured to be within ``eps`` of its scale.

    Parameters
    ----------
    eps
        Largest error of a component, relative to its scale.
    keeper
        Writes the state of the runs to a file; None if it is not kept.

    Returns
    -------
    The samples for which that could be shown; all of them, unless something says why not.

    Raises
    ------
    InputError
        ``eps`` is below what double precision can tell apart here.
    """
    started = time.perf_counter()
    _refuse_below_floor(problem, eps, np.where(problem.angles, 1.0, np.inf))
    attempts: list[Attempt] = []
    stopped = False
    with np.errstate(all="ignore"):
        try:
            first = _first_tolerance(problem, eps, explicit_method(problem))
            coarse = restored_or_coarse_result(problem, first, watch, keeper)
            problem = problem.with_unsampled(coarse.between)
            problem = watching(problem) if coarse.sharp else problem
            _refuse_below_floor(problem, eps, coarse.scales[: len(problem.kinds)])
            if keeper is not None:
                keeper.keep(
                    lambda: {"coarse": coarse.state(), "attempts": [a.state() for a in attempts]}
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


def _first_tolerance(problem: InitialValueProblem, eps: float, method: type[Integrator]) -> float:
    """Return the tolerance of the first attempt, relative to scales."""
    part = SCHEDULE.first_gauss if method is INTEGRATORS["Gauss16"] else SCHEDULE.first
    return min(part * eps * (SCHEDULE.read_off if problem.read_off else 1.0), SCHEDULE.largest)


def _refuse_below_floor(problem: InitialValueProblem, eps: float, scales: Array) -> None:
    """Refuse an ``eps`` below :data:`FLOOR_ULPS` units in the last place of the start values."""
    floors = ulps(problem.y0[: len(problem.kinds)]) / scales
    floor = FLOOR_ULPS * max([_LAST_PLACE, *floors.tolist()])
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
    """Round up to a number with one digit."""
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
    """Make attempts at smaller and smaller tolerances, and append them to ``attempts``."""
    begun: list[Attempt] = []
    least = _smallest_tolerance(problem, coarse)
    for tolerance in _tolerances(least, first, begun, wider=problem.real is not DOUBLE):
        watch.progress.next_pass()
        before = attempts[-1] if attempts else None
        last = tolerance == least and not problem.widens
        begun.append(Attempt(problem, eps, coarse, tolerance, len(begun), before, last))
        attempts.append(begun[-1])
        if keeper is not None:
            _go_on(begun[-1], len(attempts) - 1, keeper)
        begun[-1].go(watch if keeper is None else keeper.watched(watch))


def _go_on(attempt: Attempt, number: int, keeper: CheckpointWriter) -> None:
    """Restore the state of an attempt from before an interruption, if there was one.

    Raises
    ------
    InputError
        Its samples are damaged, or a method cannot go on.
    """
    keeper.require(attempt.run.method)
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
    """Make further attempts in wider and wider arithmetic while it is not enough and helps."""
    narrow: InitialValueProblem | None = problem
    lasts = [attempts[-1]]
    while narrow is not None and _worthwhile(lasts):
        best = _best(attempts)
        holds = best.error_estimate().samples == len(problem.times)
        ended = best.failure is not None and not _by_rounding(problem, best.failure)
        if holds or ended or coarse.stiff:
            return
        wider = narrow.wider()
        if wider is not None:
            wider = replace(wider, unsampled=problem.unsampled)
            last = attempts[-1]
            excess = min(last.expected_excess, costing_as(SCHEDULE.most_excess_wider, last))
            first = min(last.tolerance, SCHEDULE.first_wider) / excess
            method = explicit_method(wider)
            finer = replace(coarse.finer(wider.epsilon / problem.epsilon), method=method)
            _attempt(wider, eps, finer, first, attempts, watch, keeper)
            lasts.append(attempts[-1])
        # Quadruple numbers pass places closer than samples in doubles tell on which side.
        narrow = None if problem.read_off else wider


def _by_rounding(problem: InitialValueProblem, failure: Failure) -> bool:
    """Tell whether rounding of the time is why steps became too short, and no singularity.

    Then accelerations hardly change in many last places of the time, nor in a few of any
    coordinate: beside a jump and where coordinates are singular they do.
    """
    if failure.reason != UNDERFLOW or failure.contacts or failure.state is None:
        return False
    state, n = failure.state, len(problem.kinds)
    ahead = min(_AHEAD * float(np.spacing(abs(failure.time))), _NEAR * problem.span)
    here = problem.rhs(failure.time, state)
    steps = _MOVED * np.maximum(np.spacing(np.abs(state)), _LEAST)
    nearby = [state + sign * step for step in np.diag(steps)[:n] for sign in (1, -1)]
    there = [problem.rhs(failure.time, near) for near in nearby]
    there.append(problem.rhs(failure.time + ahead, state + ahead * here))
    apart = np.abs(np.array(there) - here)[:, n:]
    sizes = np.maximum(np.abs(there), np.abs(here))[:, n:].max(axis=1, initial=0.0)
    return bool((apart <= sizes[:, None] / 2).all())


def _smallest_tolerance(problem: InitialValueProblem, coarse: CoarseResult) -> float:
    """Return the smallest useful tolerance, relative to scales."""
    n = len(problem.kinds)
    finer = problem.epsilon / DOUBLE.epsilon
    # Steps finer than the noise of the right-hand side are of no use.
    steps = finer * ulps(problem.y0[:n]) / coarse.scales[:n] / 8
    noise = float(max([NOISE_PART * coarse.relative_noise, *steps.tolist()]))
    least = SCHEDULE.smallest_implicit if coarse.stiff else SCHEDULE.smallest_explicit
    return max(finer * least, noise)


def _tolerances(
    smallest: float, first: float, attempts: list[Attempt], *, wider: bool
) -> Iterator[float]:
    """Yield the tolerance schedule, until the last attempt settles the matter."""
    tolerance = first if first > SCHEDULE.near_smallest * smallest else smallest
    yield tolerance
    while not attempts[-1].settled and len(attempts) < SCHEDULE.most_attempts:
        if tolerance == smallest and not attempts[-1].loose_at_first:
            return
        if wider and not _worthwhile(attempts):
            return
        tolerance = max(smallest, tolerance / attempts[-1].reduction)
        yield tolerance


def _best(attempts: list[Attempt]) -> Attempt:
    """Return the attempt that holds the accuracy longest."""
    return max(attempts, key=lambda attempt: attempt.error_estimate().samples)


def _worthwhile(attempts: list[Attempt]) -> bool:
    """Tell if the last attempt reached clearly more samples than the one before, or was closer."""
    if len(attempts) < 2:
        return True
    before, last = (attempt.error_estimate() for attempt in attempts[-2:])
    further = last.samples > SCHEDULE.worthwhile * before.samples
    return further or last.excess * SCHEDULE.closer < before.excess


def _measured(
    problem: InitialValueProblem,
    eps: float,
    coarse: CoarseResult,
    attempts: list[Attempt],
    stopped: bool,
    seconds: float,
) -> Measured:
    best = _best(attempts)
    estimate = best.error_estimate()
    failure = best.failure
    if failure is not None and _by_rounding(problem, failure):
        failure = replace(failure, by_rounding=True)
    return Measured(
        states=first_rows(best.run.rows, estimate.samples),
        scales=estimate.scales,
        estimate=estimate.estimate,
        failure=failure,
        stopped=stopped,
        method=best.run.method.name,
        choice=reason_for_method(coarse),
        steps=best.run.steps,
        evaluations=best.run.evaluations,
        all_evaluations=coarse.evaluations + sum(a.evaluations for a in attempts),
        run_seconds=best.run_seconds,
        estimate_seconds=seconds - best.run_seconds,
        arithmetic=best.arithmetic,
        switches=switches_until(best.run.switches, problem, estimate.samples),
        slides=slides_until(best.run.slides, problem, estimate.samples),
        began=best.run.began,
        unclear=_unclear(best, estimate.samples, problem.times),
        exempt=_exempt(best, problem.times, estimate.samples),
        limiting_component=limiting_component(
            [attempt.error_estimate() for attempt in attempts if attempt.complete], eps
        )
        if estimate.samples < len(problem.times)
        else None,
    )


def _exempt(best: Attempt, times: RowSequence, samples: int) -> Array:
    """Return the times at which velocities, or states with two values, are as close to a jump as
    the error of its time."""
    events = best.events
    if events is None and not best.run.toggles:
        return np.empty(0)
    exempt = [np.empty(0)]
    for part, _ in windows(times, first_rows(best.run.rows, samples)):
        near = [] if events is None else [events.exempt(part)]
        near += best.near_toggles(part).values()
        exempt += [part[np.any(near, axis=0)]] if near else []
    return np.concatenate(exempt)


def _unclear(best: Attempt, samples: int, times: RowSequence) -> UnclearContacts | None:
    """Return the contacts at which the promise ends; None if it ends elsewhere, or not."""
    if best.events is None or samples == len(times):
        return None
    last_kept, first_lost = times[samples - 1 : samples + 1].tolist()
    return best.events.unclear(last_kept, first_lost, best.run.switches)
