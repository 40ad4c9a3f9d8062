"""A short trial of an explicit and an implicit method side by side."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Run

#: Right-hand sides that each method may take.
_LONGEST_TRIAL = 4_000

#: Factor by which the implicit method must come farther: its steps cost more besides.
_AHEAD = 2.0

#: First step of the trial as a part of the span.
_FIRST_STEP = 1e-8

#: Finest tolerance at which the trial is made.
_FINEST = 1e-12


@dataclass(frozen=True)
class StiffnessTrial:
    """Outcome of a trial: the implicit method came farther or not, and the right-hand sides
    used."""

    stiff: bool
    evaluations: int


def stiffness_trial(
    problem: InitialValueProblem,
    t: float,
    y: Array,
    tolerance: float,
    scales: Array,
    least: Array,
    watch: Watch,
) -> StiffnessTrial:
    """Let both methods start from (t, y), past any initial layer, at the tolerance to come.

    ``least``: the smallest absolute tolerance, below which steps only chase rounding.
    """
    remaining = replace(problem, y0=y, times=np.array([t, problem.until]))
    tolerance = max(tolerance, _FINEST)
    n = len(problem.kinds)
    reached, evaluations = [], 0
    for name in ("DOP853", "Radau"):
        control = Control(
            rtol=np.repeat([0.0, tolerance], n),
            atol=np.maximum(tolerance * scales, least),
            first_step=problem.span * _FIRST_STEP,
            max_step=problem.longest_step,
        )
        run = Run(INTEGRATORS[name], remaining, control)
        while run.go(len(remaining.times), most_evaluations=_LONGEST_TRIAL - run.evaluations):
            watch((t - problem.start) / problem.span)
            if run.evaluations >= _LONGEST_TRIAL:
                break
        reached.append(run.t - t)
        evaluations += run.evaluations
    return StiffnessTrial(reached[1] > _AHEAD * reached[0], evaluations)
