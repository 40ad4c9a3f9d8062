"""A coarse run that is observed step by step: scales of the motion, steps, close approaches."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, in_mode
from lagrange_cli.simulate.integrators.observed_motion import BRIEF, ObservedMotion
from lagrange_cli.simulate.runs.problem import (
    InitialValueProblem,
    groups,
    motion,
    moved_scales,
    unsampled_motion,
)
from lagrange_cli.simulate.runs.run import Run
from lagrange_cli.state_layout import StateLayout

#: Relative tolerance of the coarse run, and those of further ones where it is no use.
COARSE = 1e-5
COARSE_TOLERANCES = (COARSE, 1e-8, 1e-11)

#: A distance from the origin of no more than so many tolerances of the scales is too close for a
#: coarse run. Chosen so that errors of a thousand steps do not reach the origin; not tuned.
_TOO_CLOSE = 1e3

#: Least absolute tolerance: scales may underflow, tolerances must not.
LEAST = 1e-290

#: Longest step of a coarse run, as a multiple of that of other runs: it shows scales alone.
_LONGER = 2.0

#: The first step as a part of the span; steps grow tenfold from there.
FIRST_STEP = 1e-8

#: Part of accelerations that may change in the first step.
_STEADY = 0.5

#: Factor of the first step if more of them changes.
_SHRINK = 0.125

#: Smallest first step that is tried, as a part of the time or the span.
_SMALLEST_STEP = 1e-15


def steady_time(
    problem: InitialValueProblem, least: float, most: float, closed: ContactMode
) -> float:
    """Return a time, no longer than ``most``, in which accelerations with these contacts closed
    stay about what they are at the start, beside the largest of their kind; any below ``least``
    where that is too long."""
    velocities, t, y = problem.layout.velocities, problem.start, problem.y0
    if least >= most:
        return most
    rhs, h = in_mode(problem.rhs, closed), most
    push = rhs(t, y)[velocities]
    sizes, smallest = np.abs(push), max(_SMALLEST_STEP * max(problem.span, abs(t)), least)
    for alike in groups(problem.kinds):
        sizes[alike] = sizes[alike].max()
    while h > smallest:
        change = np.abs(rhs(t + h, _accelerated(y, push, h))[velocities] - push)
        if (change <= _STEADY * sizes).all():
            break
        h *= _SHRINK
    return h


def _accelerated(y: Array, push: Array, h: float) -> Array:
    """Return the state after a time h of constant accelerations, shape (2n,)."""
    layout, moved = StateLayout(len(push), len(y) - 2 * len(push)), y.copy()
    moved[layout.positions] += h * y[layout.velocities] + h * h / 2 * push
    moved[layout.velocities] += h * push
    return moved


def _first_step(problem: InitialValueProblem, push: Array) -> float:
    """Return a part of the span in which accelerations, if they matter, stay as at the start.

    Else what they are there, times that step, would be no scale of what follows (a comet that
    starts at its perihelion).
    """
    velocities, t, y = problem.layout.velocities, problem.start, problem.y0
    speeds, h = y[velocities], FIRST_STEP * problem.span
    while h > _SMALLEST_STEP * max(problem.span, abs(t)):
        change = np.abs(problem.rhs(t + h, _accelerated(y, push, h))[velocities] - push)
        steady = change <= _STEADY * np.abs(push)
        if (steady | (h * np.abs(push) <= np.abs(speeds))).all():
            break
        h *= _SHRINK
    return h


class CoarseRun:
    """Run whose tolerance grows with the motion, since no scales are known before it.

    ``tolerance`` is relative to them; ``first_step`` is the length that steps settle at.
    """

    def __init__(self, problem: InitialValueProblem, watch: Watch, tolerance: float) -> None:
        self._problem, self._watch, self._tolerance = problem, watch, tolerance
        n, layout = len(problem.kinds), problem.layout
        slope = problem.rhs(problem.start, problem.y0)
        accelerations = slope[layout.velocities]
        h, push = _first_step(problem, accelerations), np.abs(accelerations)
        # Positions have moved from the start; velocities and states are as large as they are.
        still = np.where(np.arange(layout.size) < n, 0.0, np.abs(problem.y0))
        first = np.maximum(np.abs(slope) * h, still)
        first[:n] += push * (h * h)
        finest = tolerance == COARSE_TOLERANCES[-1]
        self.motion = ObservedMotion(
            problem.y0,
            problem.kinds,
            start=problem.start,
            span=problem.span,
            tolerance=tolerance,
            least=LEAST,
            moved=np.where(np.isfinite(first), first, still),
            nearest=0.0 if finest else _TOO_CLOSE * tolerance,
            scales_of=partial(moved_scales, problem),
        )
        self._control = Control(
            # Positions count from the start: an offset of the origin is no scale.
            rtol=np.array([0.0] * n + [tolerance] * (layout.size - n)),
            atol=self.motion.atol,
            first_step=h,
            max_step=_LONGER * problem.longest_step,
            autonomous=problem.autonomous,
            observed=self.motion,
        )
        self.explicit = Run(INTEGRATORS["DOP853"], problem, self._control)

    @property
    def first_step(self) -> float:
        """Length that the first steps settle at, in time."""
        return self.motion.first_step or self._control.first_step

    def steps_at(self, times: Array) -> Array:
        """Return the lengths of the steps that were made around some times, shape (m,)."""
        first_step, steps = self.first_step, self.motion.steps_at(times)
        return np.where(
            times <= self._problem.start, first_step, first_step if steps is None else steps
        )

    def implicit(self) -> Run:
        """Begin anew by Radau, for a system that is stiff."""
        self.motion.begin_anew()
        return Run(INTEGRATORS["Radau"], self._problem, self._control)

    def go(self, run: Run, evaluations: float = math.inf) -> bool:
        """Step until complete, failed or lost (True), or until a limit is reached or the motion
        comes too close to the origin (False)."""
        problem = self._problem
        while run.evaluations < evaluations and not self.motion.ended:
            if not run.go(len(problem.times), most_evaluations=evaluations - run.evaluations):
                self._end(run)
                return True
            self._watch((run.t - problem.start) / problem.span)
        return bool(self.motion.ended) and not self.too_close

    def _end(self, run: Run) -> None:
        """Note a close approach at the start too, unless the motion runs away from there."""
        if run.failure is None and self.first_step < BRIEF * self.motion.longest:
            self.motion.approach(self._problem.y0, 0.0)

    @property
    def too_close(self) -> bool:
        """Tell whether bodies come closer to the origin than a coarse run resolves: it may take
        them to the wrong side of what attracts them. The finest run is trusted."""
        near = self.motion.closest < self.motion.nearest
        return bool((near > self._problem.angles).any())

    @property
    def closest(self) -> Array:
        """Least distance of each coordinate from the origin in short steps, others of its kind with
        it, relative to scales; 1 if it came no closer, and for velocities; shape (2n,)."""
        others = self._problem.layout.size - len(self.motion.closest)
        return np.concatenate([self.motion.closest, np.ones(others)])

    def scales(self, run: Run) -> tuple[Array, Array, Array]:
        """Return the motion so far at each sample, or where it stands if no sample was reached,
        scales of the whole, and the motion of components that samples do not show, shapes (m, 2n),
        (2n,) and (2n,)."""
        n = len(self._problem.kinds)
        largest = np.maximum.accumulate(motion(self._problem.y0[:n], run.states), axis=0)
        between = self._between(run, largest[-1])
        if run.filled < 2:
            return self.motion.moved[None, :], self.motion.scales, between
        problem = self._problem.with_unsampled(between)
        return largest[1:], moved_scales(problem, largest[-1]), between

    def _between(self, run: Run, shown: Array) -> Array:
        """Compare the motion with the largest distances that samples show, shapes (2n,).

        Behind the last sample of a motion that ends in a singularity it goes anywhere.
        """
        if run.failure is not None:
            return np.zeros_like(self.motion.moved)
        mean_speeds = self.motion.way / (run.t - self._problem.start)
        moved = self.motion.moved.copy()
        moved[self._problem.layout.velocities] = mean_speeds
        return unsampled_motion(self._problem, shown, moved)
