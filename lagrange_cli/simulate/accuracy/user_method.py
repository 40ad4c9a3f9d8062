"""A run with a method and tolerances that the user chose: no promise, no estimate."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lagrange_cli.errors import StoppedError
from lagrange_cli.simulate.accuracy.coarse_run import FIRST_STEP
from lagrange_cli.simulate.accuracy.controller import Measured, only_the_start, until, why
from lagrange_cli.simulate.accuracy.method_selection import Pilot, pilot_or_before
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.checkpoint import Keeper
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.runs.problem import InitialValueProblem, last_scales
from lagrange_cli.simulate.runs.run import Run

__all__ = ["control_of", "integrate_with_method", "measured_run"]

#: Absolute part of the tolerance beside the relative one, in scales of the motion.
ABSOLUTE_PART = 0.01


def integrate_with_method(
    problem: InitialValueProblem, request: Request, watch: Watch, keeper: Keeper | None = None
) -> Measured:
    """Integrate once; all samples that the run reached are kept, and its state by the keeper.

    Raises
    ------
    InputError
        The samples of a run that is to go on are damaged, or its method cannot go on.
    """
    started = time.perf_counter()
    with np.errstate(all="ignore"):
        try:
            found = _pilot_if_needed(problem, request, watch, keeper)
        except (StoppedError, KeyboardInterrupt):
            return only_the_start(problem, time.perf_counter() - started)
        method = request.method or (found.method if found else INTEGRATORS["DOP853"])
        watch.progress.next_pass()
        run_started = time.perf_counter()
        run = Run(method, problem, control_of(problem, request, found))
        if keeper is not None:
            _begin(run, keeper, found)
        stopped = _go(run, problem, watch if keeper is None else keeper.watched(watch))
    return replace(
        measured_run(run, problem),
        stopped=stopped,
        choice="as requested"
        if request.method
        else why(found, problem.longest_step)
        if found
        else "",
        all_evaluations=run.evaluations + (found.evaluations if found else 0),
        run_seconds=time.perf_counter() - run_started,
        estimate_seconds=run_started - started,
    )


def _begin(run: Run, keeper: Keeper, found: Pilot | None) -> None:
    """Go on where a run stood before, if it did."""
    keeper.require(run.method)
    if keeper.before is not None and not run.restore(keeper.before["run"]):
        raise keeper.damaged()
    pilot = None if found is None else found.state()
    keeper.keep(lambda: {"pilot": pilot, "run": run.state()})


def measured_run(run: Run, problem: InitialValueProblem) -> Measured:
    """What a single run came to: nothing is estimated."""
    return Measured(
        states=run.rows,
        scales=last_scales(problem, run.rows),
        estimate=0.0,
        failure=run.failure,
        stopped=False,
        method=run.method.name,
        choice="",
        steps=run.steps,
        evaluations=run.evaluations,
        all_evaluations=run.evaluations,
        run_seconds=0.0,
        estimate_seconds=0.0,
        switches=until(run.switches, problem, run.filled),
        began=run.began,
    )


def _go(run: Run, problem: InitialValueProblem, watch: Callable[[float], None]) -> bool:
    """Run to the end; True if the user or the budget stopped it."""
    try:
        while run.go(len(problem.times)):
            watch((run.t - problem.start) / problem.span)
    except (StoppedError, KeyboardInterrupt):
        return True
    return False


def _pilot_if_needed(
    problem: InitialValueProblem, request: Request, watch: Watch, keeper: Keeper | None
) -> Pilot | None:
    """The coarse run, where scales for ``atol`` or a method are wanted of it."""
    known = request.atol is not None or request.rtol is None
    if request.method is not None and known:
        return None
    return pilot_or_before(problem, request.rtol or 1e-6, watch, keeper)


def control_of(problem: InitialValueProblem, request: Request, found: Pilot | None) -> Control:
    """What steers the steps of a run with a method that was asked for."""
    n = len(problem.y0)
    rtol = request.rtol or 0.0
    if request.atol is not None:
        atol = np.full(n, request.atol)
    else:
        scales: Array = found.scales[-1] if found else np.zeros(n)
        atol = ABSOLUTE_PART * rtol * scales
    return Control(
        rtol=np.full(n, rtol),
        atol=atol,
        first_step=found.first_step if found else FIRST_STEP * problem.span,
        max_step=problem.span,
        step=request.step,
    )
