"""One integration over the sample times, in pieces, keeping all that was good."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators import Control, Integrator, Rhs, start_integrator
from lagrange_cli.simulate.integrators.base import SavedState, Slides, Toggles, UnfitError
from lagrange_cli.simulate.integrators.hybrid.contact_motion import ContactMotion
from lagrange_cli.simulate.integrators.hybrid.contact_system import (
    ContactMode,
    ModeChange,
    NearContact,
)
from lagrange_cli.simulate.integrators.hybrid.sampled_motion import SampledMotion
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.samples import RowSequence

#: Seconds between two looks at the clock, roughly: a person perceives shorter times as at once.
_GLANCE = 0.02

#: Numbers of the states in the steps until the first look: some milliseconds of interpreted code.
FIRST_LOOK = 1024

#: Most steps until the next look: the cheapest ones take about a glance.
_MOST_PACE = 2**16

#: Largest factor by which the steps until the next look exceed those until the last.
FASTER = 8.0


@dataclass(frozen=True)
class Failure:
    """End of a run that could not go on.

    Attributes
    ----------
    time
        Its time.
    reason
        Phrase for a person.
    contacts
        Numbers of the contacts that are in the way.
    state
        The last state, shape (2n,), in doubles.
    by_rounding
        The motion goes on, but no step is long enough beside the last places of the time.
    """

    time: float
    reason: str
    contacts: tuple[int, ...] = ()
    state: Array | None = None
    by_rounding: bool = False


def _unfit(method: type[Integrator], error: UnfitError) -> InputError:
    """Return the refusal of a method that finds that a right-hand side is not for it."""
    message = f"{method.name} cannot integrate this system: {error.reason}"
    hint = "--method DOP853 --rtol 1e-9"
    return InputError(Problem(message, hint=hint, rule="simulate"))


class Run:
    """A method on its way through the sample times of a problem.

    ``rows`` are the states at those that are reached, ``filled`` of them, and ``states`` the
    same as an array, shape (filled, 2n); ``steps`` and ``evaluations`` count the work;
    ``failure`` says why it cannot go on.
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
        self._times = problem.times
        first = problem.start_off(0) if y0 is None else y0
        self._samples = problem.samples()
        self._samples.unfilled(0, 1)[0] = problem.real.doubles(first)
        self.filled = 1
        self._pace = max(1, FIRST_LOOK // len(first))
        rhs = problem.rhs if rhs is None else rhs
        try:
            self._integrator = start_integrator(
                method, rhs, problem.start, first, problem.until, control
            )
        except UnfitError as error:
            raise _unfit(method, error) from error
        made = self._integrator
        self._contacts = made if isinstance(made, ContactMotion | SampledMotion) else None

    @property
    def rows(self) -> RowSequence:
        return self._samples.rows(self.filled)

    @property
    def states(self) -> Array:
        return self.rows[:]

    @property
    def t(self) -> float:
        return self._integrator.t

    @property
    def y(self) -> Array:
        return self._integrator.y

    @property
    def steps(self) -> int:
        return self._integrator.steps

    @property
    def evaluations(self) -> int:
        return self._integrator.evaluations

    @property
    def remade(self) -> int:
        """Steps that were made again for a sharp function; more than none is what counts."""
        return self._integrator.remade

    @property
    def mean_step(self) -> float:
        """The mean length of the steps so far, 0 where there are none."""
        return (self.t - float(self._times[0])) / max(self.steps, 1)

    @property
    def switches(self) -> Sequence[ModeChange]:
        """Changes of contacts so far."""
        return () if self._contacts is None else self._contacts.switches

    @property
    def toggles(self) -> Toggles:
        """Changes of states with two values so far."""
        return self._integrator.toggles

    @property
    def slides(self) -> Slides:
        """Slides along switching surfaces so far."""
        return self._integrator.slides

    @property
    def began(self) -> ContactMode:
        """The contacts that were closed at first."""
        return () if self._contacts is None else self._contacts.began

    @property
    def grazes(self) -> Sequence[NearContact]:
        """Least values of gaps that came close to zero and opened again."""
        return () if self._contacts is None else self._contacts.grazes

    @property
    def closed(self) -> ContactMode:
        """The contacts that are closed where the run stands."""
        return () if self._contacts is None else self._contacts.closed

    def closed_at(self, t: float) -> ContactMode:
        """Return the contacts that were closed at a time before the one where the run stands."""
        if self._contacts is None:
            return ()
        return next((s.flags for s in reversed(self.switches) if s.t <= t), self.began)

    @property
    def _in_the_way(self) -> tuple[int, ...]:
        stuck = None if self._contacts is None else self._contacts.stuck
        return () if stuck is None else stuck.contacts

    @property
    def ended(self) -> bool:
        """True if the run is complete or has failed."""
        return self.failure is not None or self.filled == len(self._times)

    def state(self) -> SavedState:
        """Return all that the run goes on from; samples in a file are on the disk then."""
        failure = self.failure
        return {
            "filled": self.filled,
            "failure": failure and (failure.time, failure.reason, failure.contacts, failure.state),
            "samples": self._samples.state(self.filled),
            "integrator": self._integrator.state(),
        }

    def restore(self, state: SavedState) -> bool:
        """Go on where a run of the same problem stood; False where its samples are not there."""
        self.filled = state["filled"]
        self.failure = state["failure"] and Failure(*state["failure"])
        self._integrator.restore(state["integrator"])
        return self._samples.restore(state["samples"])

    def go(self, samples: int, *, most_evaluations: float = math.inf) -> bool:
        """Advance for a short while, so that the caller can look at the clock.

        The part that one call does depends on the machine; the result of all calls does not.
        """
        started = time.perf_counter()
        goes_on = self.advance(samples, self._pace, most_evaluations)
        taken = time.perf_counter() - started
        faster = FASTER if taken == 0 else min(_GLANCE / (2 * taken), FASTER)
        self._pace = min(max(1, int(faster * self._pace)), _MOST_PACE)
        return goes_on

    def advance(self, samples: int, most_steps: int, most_evaluations: float = math.inf) -> bool:
        """Step until ``samples`` are filled or a limit is reached; False once the run has ended."""
        if self.ended:
            return False
        free = self._samples.unfilled(self.filled, max(samples, self.filled))
        try:
            done = self._integrator.advance(
                self._times[self.filled : self.filled + len(free)],
                free,
                most_steps=most_steps,
                most_evaluations=most_evaluations,
            )
        except UnfitError as error:
            raise _unfit(self.method, error) from error
        self.filled += done.filled
        if done.failure is not None:
            state = np.array(self.y, dtype=float)
            self.failure = Failure(self.t, done.failure, self._in_the_way, state)
        return not self.ended
