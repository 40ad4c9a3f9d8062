"""One integration over the sample times, in pieces, keeping all that was good."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.integrators import Control, Integrator, Rhs, StepError
from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.problem import InitialValueProblem

__all__ = ["Failure", "Run"]


@dataclass(frozen=True)
class Failure:
    """Where and why a run could not go on."""

    time: float
    reason: str


class Run:
    """A method on its way through the sample times of a problem.

    ``states[:filled]`` are the samples reached, shape (filled, 2n); ``steps``
    and ``evaluations`` count the work; ``failure`` says why it cannot go on.
    """

    def __init__(
        self,
        method: type[Integrator],
        problem: InitialValueProblem,
        control: Control,
        *,
        rhs: Rhs | None = None,
        y0: Array | None = None,
    ) -> None:
        self.method = method
        self.failure: Failure | None = None
        self.steps = self.evaluations = 0
        self._times = problem.times
        self._rhs = problem.rhs if rhs is None else rhs
        start = problem.y0 if y0 is None else y0
        self._states = np.empty((len(problem.times), len(start)))
        self._states[0] = start
        self.filled = 1
        self._integrator = method(self._counted, problem.start, start, problem.until, control)

    def _counted(self, t: float, y: Array) -> Array:
        self.evaluations += 1
        return self._rhs(t, y)

    @property
    def states(self) -> Array:
        return self._states[: self.filled]

    @property
    def t(self) -> float:
        return self._integrator.t

    @property
    def y(self) -> Array:
        return self._integrator.y

    def step(self) -> bool:
        """Make one step and take the samples in it; False once the run failed or is complete."""
        if self.failure is not None or self.filled == len(self._times):
            return False
        integrator = self._integrator
        limit = self._times[-1] if self.method.interpolates else self._times[self.filled]
        try:
            integrator.step(float(limit))
        except StepError as error:
            self.failure = Failure(integrator.t, error.reason)
            return False
        self.steps += 1
        self._take_samples()
        return self.failure is None

    def _take_samples(self) -> None:
        integrator = self._integrator
        reached = int(np.searchsorted(self._times, integrator.t, side="right"))
        if reached <= self.filled:
            return
        times = self._times[self.filled : reached]
        if times[-1] == integrator.t:
            self._states[reached - 1] = integrator.y
            times = times[:-1]
        if len(times):
            states = integrator.interpolate(times)
            if not np.isfinite(states).all():
                self.failure = Failure(float(times[0]), "the state is no longer finite")
                return
            self._states[self.filled : self.filled + len(times)] = states
        self.filled = reached
