"""A run with a method and tolerances that the user chose: no promise, no estimate."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lagrange_cli.errors import StoppedError
from lagrange_cli.simulate.accuracy.coarse_run import FIRST_STEP
from lagrange_cli.simulate.accuracy.measured import (
    Measured,
    slides_until,
    start_alone,
    switches_until,
)
from lagrange_cli.simulate.accuracy.method_selection import (
    CoarseResult,
    reason_for_method,
    restored_or_coarse_result,
)
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.checkpoint import CheckpointWriter
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.runs.problem import InitialValueProblem, last_scales
from lagrange_cli.simulate.runs.run import Run

#: Absolute part of the tolerance beside the relative one, in scales of the motion.
_ABSOLUTE_PART = 0.01


def integrate_with_method(
    problem: InitialValueProblem,
    request: Request,
    watch: Watch,
    keeper: CheckpointWriter | None = None,
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
            coarse = _coarse_result_if_needed(problem, request, watch, keeper)
            method = request.method or (coarse.method if coarse else INTEGRATORS["DOP853"])
            watch.progress.next_pass()
            run_started = time.perf_counter()
            run = Run(method, problem, control_of(problem, request, coarse))
        except (StoppedError, KeyboardInterrupt):
            return start_alone(problem, time.perf_counter() - started)
        if keeper is not None:
            _begin(run, keeper, coarse)
        stopped = _go(run, problem, watch if keeper is None else keeper.watched(watch))
    return replace(
        measured_run(run, problem),
        stopped=stopped,
        choice="as requested" if request.method else reason_for_method(coarse) if coarse else "",
        all_evaluations=run.evaluations + (coarse.evaluations if coarse else 0),
        run_seconds=time.perf_counter() - run_started,
        estimate_seconds=run_started - started,
    )


def _begin(run: Run, keeper: CheckpointWriter, coarse: CoarseResult | None) -> None:
    """Go on where a run stood before, if it did."""
    keeper.require(run.method)
    if keeper.before is not None and not run.restore(keeper.before["run"]):
        raise keeper.damaged()
    coarse_state = None if coarse is None else coarse.state()
    keeper.keep(lambda: {"coarse": coarse_state, "run": run.state()})


def measured_run(run: Run, problem: InitialValueProblem) -> Measured:
    """Return the samples of a single run, without an estimate."""
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
        switches=switches_until(run.switches, problem, run.filled),
        slides=slides_until(run.slides, problem, run.filled),
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


def _coarse_result_if_needed(
    problem: InitialValueProblem, request: Request, watch: Watch, keeper: CheckpointWriter | None
) -> CoarseResult | None:
    """Make the coarse run if scales for ``atol`` or a method are wanted of it, else None."""
    known = request.atol is not None or request.rtol is None
    if request.method is not None and known:
        return None
    return restored_or_coarse_result(problem, request.rtol or 1e-6, watch, keeper)


def control_of(
    problem: InitialValueProblem, request: Request, coarse: CoarseResult | None
) -> Control:
    """Return tolerances and step limits for a method that was asked for."""
    n = len(problem.y0)
    rtol = request.rtol or 0.0
    if request.atol is not None:
        atol = np.full(n, request.atol)
    else:
        scales: Array = coarse.scales if coarse else np.zeros(n)
        atol = _ABSOLUTE_PART * rtol * scales
    return Control(
        rtol=np.full(n, rtol),
        atol=atol,
        first_step=coarse.first_step if coarse else FIRST_STEP * problem.span,
        max_step=problem.span,
        step=request.step,
    )
