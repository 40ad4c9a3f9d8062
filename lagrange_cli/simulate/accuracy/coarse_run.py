"""A coarse run that is followed step by step: what is seen of the motion on the way."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, in_mode
from lagrange_cli.simulate.runs.problem import (
    InitialValueProblem,
    groups,
    running_scales,
    unsampled_motion,
)
from lagrange_cli.simulate.runs.run import Run

#: Relative tolerance of the coarse run, and those of further ones where it is no use.
COARSE = 1e-5
COARSE_TOLERANCES = (COARSE, 1e-8, 1e-11)

#: A motion is close to the origin where its steps are below this part of the longest so far; set by
#: hand.
_SHORT = 0.05

#: It is too close for a coarse run within so many tolerances of the scales; set by hand.
_TOO_CLOSE = 1e3

#: Least absolute tolerance: scales may underflow, tolerances must not.
LEAST = 1e-290

#: Steps that are made one by one, until their length has settled.
_START = 12

#: Most steps that are made later before tolerances are looked at again.
_FEW = 16

#: A run is lost that would need more steps than this at the pace of its last ones: if it is coarse
#: it may fall into a singularity that the motion passes.
_MOST_STEPS = 1e9

#: Number of these last steps.
_WINDOW = 2**14

#: How much longer than those of other runs its steps may be: it shows scales alone.
_LONGER = 2.0

#: The first step as a part of the span; steps grow tenfold from there.
FIRST_STEP = 1e-8

#: Part of accelerations that may change in the first step.
_STEADY = 0.5

#: Factor of the first step if more of them changes.
_SHRINK = 0.125

#: Smallest first step that is tried, as a part of the time or the span.
_SMALLEST_STEP = 1e-15


def steady_time(problem: InitialValueProblem, most: float, closed: ContactMode) -> float:
    """Return a time, no longer than ``most``, in which accelerations with these contacts closed
    stay about what they are at the start, beside the largest of their kind."""
    n, t, y = len(problem.kinds), problem.start, problem.y0
    rhs, h = in_mode(problem.rhs, closed), most
    push = rhs(t, y)[n:]
    while h > _SMALLEST_STEP * max(problem.span, abs(t)):
        change = np.abs(rhs(t + h, _accelerated(y, push, h))[n:] - push)
        if all(
            change[alike].max() <= _STEADY * np.abs(push[alike]).max()
            for alike in groups(problem.kinds)
        ):
            break
        h *= _SHRINK
    return h


def _accelerated(y: Array, push: Array, h: float) -> Array:
    """Return the state after a time h of constant accelerations, shape (2n,)."""
    n = len(push)
    return np.concatenate([y[:n] + h * y[n:] + h * h / 2 * push, y[n:] + h * push])


def _way(start: Array, end: Array, h: float) -> Array:
    """Return about how far coordinates go in a time h between two states, shape (n,).

    The slower end counts where they come back, as between two bounces; the faster one would take
    a rush at the end of a step for a way.
    """
    n = len(start) // 2
    slower = np.minimum(np.abs(start[n:]), np.abs(end[n:]))
    return np.asarray(np.maximum(np.abs(end[:n] - start[:n]), slower * h))


def _first_step(problem: InitialValueProblem, push: Array) -> float:
    """Return a part of the span in which accelerations, if they matter, stay as at the start.

    Else what they are there, times that step, would be no scale of what follows (a comet that
    starts at its perihelion).
    """
    n, t, y = len(problem.kinds), problem.start, problem.y0
    speeds, h = y[n:], FIRST_STEP * problem.span
    while h > _SMALLEST_STEP * max(problem.span, abs(t)):
        change = np.abs(problem.rhs(t + h, _accelerated(y, push, h))[n:] - push)
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
        self._longest, self._closest = 0.0, np.ones(len(problem.kinds))
        n = len(problem.kinds)
        speeds = problem.y0[n:]
        push = problem.rhs(problem.start, problem.y0)[n:]
        h = _first_step(problem, push)
        first = np.concatenate([np.abs(speeds) * h + np.abs(push) * (h * h), np.abs(push) * h])
        first = np.where(np.isfinite(first), first, 0.0)
        self._moved = np.stack([np.zeros_like(first), first])
        self._path = np.zeros(n)
        self._atol = np.maximum(self._tolerance * self.seen(), LEAST)
        control = Control(
            # Positions count from the start: an offset of the origin is no scale.
            rtol=np.repeat([0.0, tolerance], n),
            atol=self._atol,
            first_step=h,
            max_step=_LONGER * problem.longest_step,
            autonomous=problem.autonomous,
        )
        self._control = control
        self.first_step = h
        self._ends: list[float] = []
        self._steps: list[float] = []
        self.explicit = Run(INTEGRATORS["DOP853"], problem, control)

    def seen(self) -> Array:
        """Return the scales of the motion so far, shape (2n,)."""
        n = len(self._problem.kinds)
        states = self._moved.copy()
        states[:, n:] = np.maximum(states[:, n:], np.abs(self._problem.y0[n:]))
        return np.asarray(running_scales(self._problem, states)[-1])

    def step_at(self, t: float) -> float:
        """Return the mean length of the few steps that were made around a time."""
        if t <= self._problem.start or not self._steps:
            return self.first_step
        return self._steps[min(bisect_left(self._ends, t), len(self._steps) - 1)]

    def implicit(self) -> Run:
        """Begin anew by Radau, for a system that is stiff."""
        self._ends, self._steps = [], []
        self._path[:] = 0.0
        control = Control(
            rtol=self._control.rtol,
            atol=self._tolerance * self.seen(),
            first_step=self._control.first_step,
            max_step=self._control.max_step,
        )
        return Run(INTEGRATORS["Radau"], self._problem, control)

    def go(self, run: Run, evaluations: int | None) -> bool:
        """Step until complete, failed or lost (True), or until a limit is reached or the motion
        comes too close to the origin (False)."""
        problem, first = self._problem, run.steps
        counted, reached = run.steps, run.t
        while evaluations is None or run.evaluations < evaluations:
            before, done, state = run.t, run.steps - first, run.y
            if not run.advance(len(problem.times), min(1 + done // _FEW, _FEW)):
                self._end(run)
                return True
            if first == 0 and done == _START - 1:
                self.first_step = run.t - before
            elif done >= _START:
                self._note(run, (run.t - before) / max(run.steps - first - done, 1))
                if self.too_close:
                    return False
            if run.steps - counted >= _WINDOW:
                if (run.t - reached) * _MOST_STEPS < _WINDOW * problem.span:
                    return True
                counted, reached = run.steps, run.t
            self._watch((run.t - problem.start) / problem.span)
            moved = np.abs(run.y - problem.y0)
            moved[len(problem.kinds) :] = np.abs(run.y[len(problem.kinds) :])
            self._path += _way(state, run.y, run.t - before)
            self._moved[1] = np.maximum(self._moved[1], moved)
            self._atol[:] = np.maximum(self._tolerance * self.seen(), LEAST)
        return False

    def _note(self, run: Run, h: float) -> None:
        """Remember the length of steps, and how far from the origin the short ones are."""
        self._ends.append(run.t)
        self._steps.append(h)
        self._longest = max(self._longest, h)
        if h < _SHORT * self._longest:
            self._see(run.y, h)

    def _end(self, run: Run) -> None:
        """The start was close to the origin as well, unless the motion runs away from there."""
        if run.failure is None and self.first_step < _SHORT * self._longest:
            self._see(self._problem.y0, 0.0)

    def _see(self, y: Array, h: float) -> None:
        """Note the distance from the origin of a state, or of its step, relative to the scales."""
        n = len(self._problem.kinds)
        sizes, scales = np.maximum(np.abs(y[:n]), h * np.abs(y[n:])), self.seen()[:n]
        for alike in groups(self._problem.kinds):
            size = sizes[alike].max() / scales[alike].max()
            if size > 0:
                self._closest[alike] = np.minimum(self._closest[alike], size)

    @property
    def too_close(self) -> bool:
        """Tell whether bodies come closer to the origin than a coarse run resolves: it may take
        them to the wrong side of what attracts them. The finest run is trusted."""
        if self._tolerance == COARSE_TOLERANCES[-1]:
            return False
        near = self._closest < _TOO_CLOSE * self._tolerance
        return bool((near & ~self._problem.angles).any())

    @property
    def closest(self) -> Array:
        """Least distance of each coordinate from the origin in short steps, others of its kind with
        it, relative to scales; 1 if it came no closer, and for velocities; shape (2n,)."""
        return np.concatenate([self._closest, np.ones_like(self._closest)])

    def scales(self, run: Run) -> Array:
        """The scales so far at each sample, or of the motion where no sample was reached."""
        if run.filled < 2:
            return self.seen()[None, :]
        problem = replace(self._problem, unsampled=self.between(run))
        return running_scales(problem, run.states)[1:]

    def between(self, run: Run) -> Array:
        """Return the motion of components that samples do not show, shape (2n,).

        Behind the last sample of a motion that ends in a singularity they go anywhere.
        """
        if run.failure is not None:
            return np.zeros_like(self._moved[1])
        mean_speeds = self._path / (run.t - self._problem.start)
        farthest = self._moved[1, : len(mean_speeds)]
        return unsampled_motion(self._problem, run.states, np.append(farthest, mean_speeds))
