"""Motions of hybrid systems: smooth pieces of one method, located events between them.

:mod:`.contact_motion` and :mod:`.surface_motion` say what happens at an event; that the samples
before it, the counters and the saved state do not depend on how the work is divided is here.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, TypeAlias

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Advance, Control, Integrator, SavedState
from lagrange_cli.simulate.integrators.right_hand_side import Rhs

#: Events of each contact or surface at one time that count as endless. Contacts of the shipped
#: scenes settle within a few; a larger number would only end such motions later.
CHATTER = 40

#: Units in the last place of time within which events count as simultaneous: a few times the error
#: of their location.
TOGETHER = 16

#: Units in the last place of time within which events are located at best.
LOCATED = 4

#: Stands at a state with a method: (rhs, t, y, t_end, control).
Begin: TypeAlias = Callable[[Rhs, float, Array, float, Control], Integrator]


class HybridMotion(Integrator):
    """One method over all pieces of a motion, called like any.

    Attributes
    ----------
    counters
        Attributes that are summed over the pieces.
    resets
        Events change the state: a sample at an event has the state behind it.
    begun_with
        Keys of ``_piece`` that :meth:`_begin_piece` takes, in its order.
    """

    interpolates: ClassVar[bool] = False
    counters: ClassVar[tuple[str, ...]] = ("steps", "evaluations")
    resets: ClassVar[bool]
    begun_with: ClassVar[tuple[str, ...]]

    #: Why the motion cannot be continued, None while it can.
    _failure: str | None = None

    def __init__(self, begin: Begin, t0: float, y0: Array, t_end: float, control: Control) -> None:
        self._begin, self._control = begin, control
        self.t, self.y, self.t_end = t0, np.array(y0, dtype=float), t_end
        self._past = (0,) * len(self.counters)
        self._run: Integrator | None = None
        self._piece: dict[str, Any] = {}

    @abstractmethod
    def _pass(self, event: int) -> bool:
        """Go on behind an event; False if the run is to end there."""

    @abstractmethod
    def _begin_piece(self, *start: Any) -> Integrator:
        """Begin a piece at the present state."""

    def _go(
        self, run: Integrator, times: Array, states: Array, most_steps: int, most_evaluations: float
    ) -> Advance:
        """Step on in this piece."""
        return run.advance(times, states, most_steps=most_steps, most_evaluations=most_evaluations)

    def step(self, limit: float) -> None:
        self._advance_by_a_step()

    def advance(
        self, times: Array, states: Array, *, most_steps: int, most_evaluations: float
    ) -> Advance:
        filled, steps, evaluations = 0, self.steps, self.evaluations
        while self._run is not None:
            # Samples behind which a located event lies are filled without a further step.
            steps_left = most_steps - (self.steps - steps) if self._run.end_event is None else 0
            evaluations_left = most_evaluations - (self.evaluations - evaluations)
            part = times[filled:], states[filled:]
            done = self._go(self._run, *part, steps_left, evaluations_left)
            filled += done.filled
            self._read(self._run)
            event = self._run.end_event
            if done.failure is not None or event is None:
                return Advance(filled, done.failure)
            if filled == len(times) and times[-1] < self.t:
                # Samples that are asked for later may lie before the event.
                return Advance(filled)
            if not self._pass(event):
                return Advance(filled)
            if self.resets and filled and times[filled - 1] == self.t:
                states[filled - 1] = self.y
            if (
                filled == len(times)
                or self.steps - steps >= most_steps
                or self.evaluations - evaluations >= most_evaluations
            ):
                break
        if self._run is None and self._failure is None and filled < len(times):
            # The event was at the end, as far as that can be told.
            states[filled:] = self.y
            filled = len(times)
        return Advance(filled, self._failure)

    def _read(self, run: Integrator) -> None:
        """Bring time, state and counters up to date."""
        self.t, self.y = run.t, run.y
        for name, past in zip(self.counters, self._past, strict=True):
            setattr(self, name, past + getattr(run, name))

    def _end_piece(self) -> None:
        """Keep the counters as they are for the pieces that follow."""
        self._past = tuple(getattr(self, name) for name in self.counters)

    @property
    def _together(self) -> float:
        """The time within which events count as simultaneous."""
        return float(TOGETHER * np.spacing(max(abs(self.t), abs(self.t_end))))

    def _is_over(self) -> bool:
        """Tell whether nothing is left of the motion but rounding of times; it then ends here."""
        self._run = None
        if self.t_end - self.t > LOCATED * np.spacing(abs(self.t_end)):
            return False
        self.t = self.t_end
        return True

    def state(self) -> SavedState:
        run = None if self._run is None else self._run.state()
        return {**super().state(), "past": self._past, "run": run, **self._piece}

    def restore(self, state: SavedState) -> None:
        self._past, self._run = state["past"], None
        if state["run"] is not None:
            self.t, self.y = state["from"]
            self._begin_piece(*(state[name] for name in self.begun_with)).restore(state["run"])
        super().restore(state)
