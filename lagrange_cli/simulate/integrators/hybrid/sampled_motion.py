"""Motion with sampled controllers: pieces between exact times, at which they set what they hold.

What is held is a number of the state of rate 0. A piece ends at the time of the next sample, where
the state is that behind the sample, as it is at the impacts of contacts; these and switching
surfaces are passed within the pieces (K. J. Åström and B. Wittenmark, *Computer-Controlled
Systems*, 1997, chapter 2).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    Advance,
    Control,
    Integrator,
    SavedState,
    Slides,
    Toggles,
)
from lagrange_cli.simulate.integrators.hybrid.contact_motion import ContactMotion
from lagrange_cli.simulate.integrators.hybrid.contact_system import (
    ContactEventKind,
    ContactMode,
    ModeChange,
    NearContact,
    Stuck,
)
from lagrange_cli.simulate.integrators.hybrid.motion import LOCATED, TOGETHER, Begin
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, structured

#: Why a motion ends where what a controller sets does not exist.
NO_VALUE = Phrase("what a controller sets is not finite")

#: First step of a piece as a multiple of the mean one before, which samples may have cut short.
_GROWTH = 2.0


class SampledMotion(Integrator):
    """One method over all pieces, called like any; of contacts it has what their motions have.

    It begins behind a sample (:meth:`.right_hand_side.Sampling.started`).
    """

    interpolates = False

    def __init__(
        self, begin: Begin, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control
    ) -> None:
        structure = structured(rhs)
        assert structure.sampling is not None
        self._begin, self._control, self._sampling = begin, control, structure.sampling
        self._rhs = structure.with_sampling(None)
        self.t, self.y, self.t_end = t0, np.array(y0, dtype=float), t_end
        self._numbers = self._sampling.numbers(t0)
        self._past = 0, 0, 0
        self._first_step = control.first_step
        self._ended = False
        self._slid: Slides = ()
        self._toggled: Toggles = ()
        self._switches: list[ModeChange] = []
        self._grazes: list[NearContact] = []
        self._run: Integrator | None = None
        self._start_piece()
        self.began = self.closed

    def _start_piece(self) -> None:
        """Begin a piece here, unless nothing is left of the motion or of the time to a sample."""
        end = min(self._sampling.due(self._numbers)[0], self.t_end)
        self._piece = self.t, self.y, self._first_step
        self._run = None
        if end - self.t > LOCATED * np.spacing(abs(end)):
            # The tolerances stay those of the control, which may change between steps.
            control = replace(self._control, first_step=min(self._first_step, end - self.t))
            self._run = self._begin(self._rhs, self.t, self.y, end, control)

    def step(self, limit: float) -> None:
        self._advance_by_a_step()

    def advance(
        self, times: Array, states: Array, *, most_steps: int, most_evaluations: float
    ) -> Advance:
        filled, steps, evaluations = 0, self.steps, self.evaluations
        while filled < len(times) and not self._ended:
            if self._run is not None:
                left = most_steps - (self.steps - steps)
                more = most_evaluations - (self.evaluations - evaluations)
                done, passed = self._go(self._run, times[filled:], states[filled:], left, more)
                filled += done.filled
                if not passed:
                    return Advance(filled, done.failure)
            failure = self._sample()
            while filled < len(times) and times[filled] <= self.t:
                states[filled] = self.y
                filled += 1
            if failure is not None:
                return Advance(filled, failure)
            if (
                self.steps - steps >= most_steps
                or self.evaluations - evaluations >= most_evaluations
            ):
                break
        return Advance(filled)

    def _go(
        self, run: Integrator, times: Array, states: Array, most_steps: int, most_evaluations: float
    ) -> tuple[Advance, bool]:
        """Step on in a piece, of which the end is asked for too; tell whether it is passed."""
        # A time that is that of the sample but for rounding has the state behind it.
        near = TOGETHER * np.spacing(abs(run.t_end))
        inside = int(np.searchsorted(times, run.t_end - near, side="left"))
        # Samples that are asked for later may lie before the end of the piece.
        asked = times if inside == len(times) else np.append(times[:inside], run.t_end)
        rows = np.empty((len(asked), len(self.y)))
        done = run.advance(asked, rows, most_steps=most_steps, most_evaluations=most_evaluations)
        filled = min(done.filled, inside)
        states[:filled] = rows[:filled]
        steps, evaluations, remade = self._past
        self.steps, self.evaluations = steps + run.steps, evaluations + run.evaluations
        self.remade = remade + run.remade
        passed = done.filled > inside
        self.t, self.y = (run.t_end, rows[inside]) if passed else (run.t, run.y)
        return Advance(filled, done.failure), passed

    def _sample(self) -> str | None:
        """End a piece by its sample, and begin the next one; return why that is not possible."""
        run, closed = self._run, self.closed
        time, due = self._sampling.due(self._numbers)
        if run is not None:
            self._past = self.steps, self.evaluations, self.remade
            self._first_step = _GROWTH * (run.t_end - self._piece[0]) / max(run.steps, 1)
            self._slid, self._switches = self.slides, self.switches
            self._toggled = self.toggles
            self._grazes = self.grazes
        self.t = min(time, self.t_end)
        if time <= self.t_end:
            before, self.y = self.y, self._sampling.sampled(self.t, self.y, due)
            if not np.isfinite(self.y).all():
                self.y, self._run = before, None
                return NO_VALUE
            self._numbers = [k + (c in due) for c, k in enumerate(self._numbers)]
        self._ended = self.t >= self.t_end
        if self._ended:
            self._run = None
            return None
        self._start_piece()
        if isinstance(self._run, ContactMotion):
            self._note_contacts(closed, self._run)
        return None

    def _note_contacts(self, before: ContactMode, run: ContactMotion) -> None:
        """Record contacts that a sample closes or opens; impacts are recorded by the run."""
        struck = {change.contact for change in run.switches}
        for k, (was, now) in enumerate(zip(before, run.began, strict=True)):
            if was != now and k not in struck:
                kind: ContactEventKind = "contact" if now else "release"
                self._switches.append(ModeChange(self.t, k, kind, self.y, self.y, run.began))

    # Contacts and surfaces, over all pieces.

    @property
    def toggles(self) -> Toggles:
        return (*self._toggled, *(() if self._run is None else self._run.toggles))

    @property
    def slides(self) -> Slides:
        return (*self._slid, *(() if self._run is None else self._run.slides))

    @property
    def _contacts(self) -> ContactMotion | None:
        return self._run if isinstance(self._run, ContactMotion) else None

    @property
    def switches(self) -> list[ModeChange]:
        """Changes of contacts so far."""
        return [*self._switches, *(self._contacts.switches if self._contacts else ())]

    @property
    def grazes(self) -> list[NearContact]:
        """Gaps that came close to zero and opened again."""
        return [*self._grazes, *(self._contacts.grazes if self._contacts else ())]

    @property
    def closed(self) -> ContactMode:
        """The contacts that are closed now."""
        if self._contacts is not None:
            return self._contacts.closed
        return self._switches[-1].flags if self._switches else getattr(self, "began", ())

    @property
    def stuck(self) -> Stuck | None:
        """Why contacts end the motion; None if they do not."""
        return None if self._contacts is None else self._contacts.stuck

    # Going on.

    def state(self) -> SavedState:
        values = {
            "numbers": tuple(self._numbers),
            "past": self._past,
            "ended": self._ended,
            "piece": self._piece,
            "slid": self._slid,
            "toggled": self._toggled,
            "began": self.began,
            "switches": tuple(
                (s.t, s.contact, s.kind, s.before, s.after, s.flags) for s in self._switches
            ),
            "grazes": tuple(tuple(vars(dip).values()) for dip in self._grazes),
            "run": None if self._run is None else self._run.state(),
        }
        return {**super().state(), **values}

    def restore(self, state: SavedState) -> None:
        self._numbers, self._past = list(state["numbers"]), state["past"]
        self._slid, self.began = state["slid"], state["began"]
        self._toggled = state["toggled"]
        self._switches = [ModeChange(*fields) for fields in state["switches"]]
        self._grazes = [NearContact(*fields) for fields in state["grazes"]]
        self.t, self.y, self._first_step = state["piece"]
        self._ended = state["ended"]
        self._start_piece()
        if state["run"] is None:
            self._run = None
        elif self._run is not None:
            self._run.restore(state["run"])
        super().restore(state)
