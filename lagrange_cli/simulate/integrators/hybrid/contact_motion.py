"""Motion with contacts: smooth pieces, each with a right-hand side of its own, events between.

A piece goes on until the event function of a contact falls through zero: the multiplier of a
closed one, the gap of an open one. Then the state is reset and the next piece begins. Bounces
that follow each other ever faster are ended where what is left of them is shorter than a part
of the span (accumulation points, after Zeno; Leine and van de Wouw, *Stability and Convergence
of Mechanical Systems with Unilateral Constraints*, 2008, section 2.6).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise, takewhile
from typing import ClassVar

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    Control,
    Integrator,
    SavedState,
    Slides,
    Toggles,
)
from lagrange_cli.simulate.integrators.events import RISES
from lagrange_cli.simulate.integrators.hybrid.contact_system import (
    TOUCHING,
    ContactEventKind,
    ContactMode,
    Gaps,
    HybridRhs,
    ModeChange,
    NearContact,
    Stuck,
)
from lagrange_cli.simulate.integrators.hybrid.motion import CHATTER, LOCATED, Begin, HybridMotion
from lagrange_cli.simulate.integrators.right_hand_side import structured

#: Bounces are ended where all that are left take less than this part of the span.
_ACCUMULATED = 1e-10

#: Errors of steps beside the tolerance where a gap opens slowly: many may add up.
_ADDED_UP = 100.0

#: Bounces of a height below this part of what the gap is the difference of are ended, too.
_LOW = 1e-12

#: Gaps are followed that come as close to zero as many errors of steps beside the tolerance do.
_REACH = 1e6

#: A contact that is struck faster than this part of what it was struck at before is not grazed.
_SLOW = 0.1

#: Shrinking intervals between bounces that make a sequence.
_SEQUENCE = 4

#: Events that are followed, and kept.
_MOST_MODE_CHANGES = 250_000

#: Why a motion cannot be continued.
ENDLESS = Phrase("contacts close and open without end")
IMPOSSIBLE = Phrase("contacts leave no motion")
TOO_MANY = Phrase("contacts close and open more often than can be followed")
UNDETERMINED = Phrase("what contacts do next cannot be determined")

#: The event of a reset at the start of a motion.
_START = -1


class ContactMotion(HybridMotion):
    """One method over all pieces, called like any.

    ``switches`` are those passed so far; ``began`` the contacts that are closed at first;
    ``grazes`` the gaps that came close to zero and opened again.
    """

    resets: ClassVar[bool] = True
    begun_with: ClassVar[tuple[str, ...]] = ("signs", "noise", "reach")

    def __init__(
        self, begin: Begin, rhs: HybridRhs, t0: float, y0: Array, t_end: float, control: Control
    ) -> None:
        super().__init__(begin, t0, y0, t_end, control)
        self._rhs = rhs
        self._shortest = _ACCUMULATED * (t_end - t0)
        self._closed = rhs.free
        self._bounces: dict[int, list[float]] = {}
        self.stuck: Stuck | None = None
        self._runs: dict[ContactMode, Integrator] = {}
        self.switches: list[ModeChange] = []
        self.grazes: list[NearContact] = []
        self._seen = 0
        self._slid: list[tuple[int, float, float]] = []
        self._toggled: list[tuple[int, float]] = []
        self._looked: tuple[Array, tuple[Gaps, Array, Array]] | None = None
        self._fastest: dict[int, float] = {}
        self._reset(_START, "contact")
        self.began = self._closed

    @property
    def closed(self) -> ContactMode:
        """The contacts that are closed now."""
        return self._closed

    def _read(self, run: Integrator) -> None:
        super()._read(run)
        for event in run.dips[self._seen :]:
            gaps = self._rhs.gaps(event.time, event.state)
            self._dip(gaps, event.index, event.time, event.state, gaps.values[event.index])
        self._seen = len(run.dips)

    @property
    def toggles(self) -> Toggles:
        return (*self._toggled, *(() if self._run is None else self._run.toggles))

    @property
    def slides(self) -> Slides:
        return (*self._slid, *(() if self._run is None else self._run.slides))

    def _end_piece(self) -> None:
        super()._end_piece()
        if self._run is not None:
            ended = ((k, start, min(end, self.t)) for k, start, end in self._run.slides)
            self._slid += [slide for slide in ended if slide[2] > slide[1]]
            self._toggled += self._run.toggles

    def _pass(self, event: int) -> bool:
        self._end_piece()
        if self._closed[event]:
            self._reset(event, "release")
        elif self._accumulates(event):
            self.y = self._at_rest_on(event)
            self._reset(event, "zeno")
        else:
            self._graze(event)
            self._reset(event, "contact")
        most = CHATTER * len(self._rhs.free)
        last = self.switches[-most:]
        if len(last) == most and self.t - last[0].t <= self._together:
            self._end(ENDLESS, {s.contact for s in last})
        elif len(self.switches) >= _MOST_MODE_CHANGES:
            self._end(TOO_MANY, {s.contact for s in last})
        return True

    def _end(self, reason: str, contacts: Iterable[int]) -> None:
        self._run, self._failure = None, reason
        self.stuck = Stuck(reason, tuple(sorted(contacts)))

    def _accumulates(self, contact: int) -> bool:
        """Tell whether the bounces of a contact that are left take next to no time, or are too low
        to be told from rounding."""
        times = self._bounces.setdefault(contact, [])
        times.append(self.t)
        del times[: -_SEQUENCE - 1]
        between = [after - before for before, after in pairwise(times)]
        ends = len(between) > 0 and self._is_last(contact, between)
        if ends:
            times.clear()
        return ends

    def _is_last(self, contact: int, between: Sequence[float]) -> bool:
        """Tell whether nothing is left behind bounces with these intervals."""
        tolerances = self._tolerances
        gaps, speeds, _ = self._moving(self.y)
        n = gaps.coordinates
        speed = float(speeds[contact])
        height = abs(speed) * between[-1]
        hidden = height <= gaps.noise(tolerances[:n])[contact]
        if hidden and speed >= 0 and self.t_end - self.t > self._together:
            # The step took the bounce for none, since its tolerance is larger.
            return True
        if len(between) < _SEQUENCE:
            return False
        if hidden and abs(speed) <= np.abs(gaps.gradients[contact]) @ tolerances[n : 2 * n]:
            return True
        if not all(after < before for before, after in pairwise(between)):
            return False
        ratio = between[-1] / between[-2]
        remaining = between[-1] * ratio / (1 - ratio)
        is_short = remaining <= max(self._shortest, self._together)
        return bool(is_short or height <= _LOW * gaps.sizes[contact])

    def _at_rest_on(self, contact: int) -> Array:
        """Close a contact that still rises as its bounces end; return the state."""
        gaps = self._rhs.gaps(self.t, self.y)
        if gaps.speeds_at(self.y)[0][contact] <= 0:
            return self.y
        closed = tuple(flag or k == contact for k, flag in enumerate(self._closed))
        project = structured(self._rhs.side(closed)).project
        moved = self.y if project is None else project(self.t, self.y)
        return moved if np.isfinite(moved).all() else self.y

    def _moving(self, y: Array) -> tuple[Gaps, Array, Array]:
        """Evaluate the gaps at a state, their rates, and the sizes of the sums behind these."""
        if self._looked is None or self._looked[0] is not y:
            gaps = self._rhs.gaps(self.t, y)
            self._looked = y, (gaps, *gaps.speeds_at(y))
        return self._looked[1]

    @property
    def _tolerances(self) -> Array:
        """The tolerance of steps in each component here, shape (2n,)."""
        return np.asarray(self._control.atol + self._control.rtol * np.abs(self.y))

    def _reset(self, event: int, kind: ContactEventKind) -> None:
        """Reset state and contacts at an event, record the changes, and begin the next piece."""
        before, was = self.y, self._closed
        bounce = 0.0 if kind == "zeno" else 1.0
        late = 0.0 if event == _START else self._late(event)
        met = before - late * self._rhs.side(was)(self.t, before) if late else before
        after, closed = self._rhs.reset(self.t, met, was, event, bounce)
        if late and after is not None:
            after = after + late * self._rhs.side(closed)(self.t, after)
        if after is None:
            self._end(*self._deadlock(event, closed))
            return
        self.y, self._closed = after, closed
        changes: dict[int, ContactEventKind] = {} if event == _START else {event: kind}
        changes |= {k: "contact" for k in self._struck(before) if k not in changes}
        for k, (old, now) in enumerate(zip(was, self._closed, strict=True)):
            if old != now and event != _START:
                changes.setdefault(k, "contact" if now else "release")
        self.switches += [
            ModeChange(self.t, k, kind, before, self.y, self._closed) for k, kind in changes.items()
        ]
        self._start_piece()

    def _late(self, event: int) -> float:
        """Return the time since the gap of a struck contact was zero; 0 if times resolve it.

        Bounces would add up what rounding of their times does.
        """
        gaps, speeds, sizes = self._moving(self.y)
        if not speeds[event] < -TOUCHING * sizes[event]:
            return 0.0
        late = float(gaps.values[event] / speeds[event])
        return late if abs(late) <= LOCATED * np.spacing(abs(self.t)) else 0.0

    def _graze(self, event: int) -> None:
        """Remember a contact that is struck so slightly that it might as well be missed."""
        gaps, speeds, _ = self._moving(self.y)
        speed = -float(speeds[event])
        fastest = self._fastest.get(event, 0.0)
        if not _SLOW * fastest < speed or not fastest:
            self._dip(gaps, event, self.t, self.y, speed=speed)
        self._fastest[event] = max(speed, fastest)

    def _has_just_opened(self, contact: int, t: float, depth: float, bend: float) -> bool:
        """Tell whether a gap is so small only since the contact opened, as the piece began."""
        opened = self._piece["signs"][contact] == RISES
        return bool(opened and (t - self._piece["from"][0]) ** 2 * bend <= 2 * depth)

    def _dip(
        self, gaps: Gaps, contact: int, t: float, y: Array, least: float = 0.0, speed: float = 0.0
    ) -> None:
        """Remember a gap with its least value, or the speed at which it is struck, if it is
        close enough to zero."""
        slope = self._rhs.side(self._closed)(t, y)
        gradient = gaps.gradients[contact]
        n = gaps.coordinates
        bend = float(gradient @ slope[n : 2 * n] + gaps.biases[contact])
        if speed:
            least = -(speed**2) / (2 * bend) if bend > 0 else -np.inf
        size = float(gaps.sizes[contact])
        if not speed and self._has_just_opened(contact, t, abs(least) + TOUCHING * size, bend):
            return
        if abs(least) < self._piece["reach"][contact]:
            dip = NearContact(t, contact, float(least), bend, size, gradient, y, self._closed)
            self.grazes.append(dip)

    def _deadlock(self, event: int, leave_none: ContactMode) -> tuple[str, set[int]]:
        """Say why no motion follows an event, and which contacts are in the way."""
        if any(leave_none):
            return IMPOSSIBLE, {k for k, flag in enumerate(leave_none) if flag}
        touching = self._rhs.gaps(self.t, self.y).touching
        met = {k for k, flags in enumerate(zip(touching, self._closed, strict=True)) if any(flags)}
        return UNDETERMINED, met if event == _START else met | {event}

    def _struck(self, before: Array) -> list[int]:
        """Find contacts that take an impact here, though the event may be of another one."""
        if np.array_equal(before, self.y):
            return []
        gaps, speed, size = self._moving(before)
        near = TOUCHING * gaps.sizes + self._together * np.abs(speed)
        struck = (speed < -TOUCHING * size) & (np.abs(gaps.values) <= near)
        return [int(k) for k in np.flatnonzero(struck)]

    def _start_piece(self) -> None:
        """Begin a piece here, unless nothing is left of the motion."""
        if self._is_over():
            return
        gaps, speeds, sizes = self._moving(self.y)
        newest = takewhile(lambda s: s.t == self.t, reversed(self.switches))
        began = {s.contact for s in newest}
        # A contact that has just opened has a gap of zero but for rounding, of either sign.
        rises = [
            not closed and (touches or k in began)
            for k, (closed, touches) in enumerate(zip(self._closed, gaps.touching, strict=True))
        ]
        # Errors of gaps by those of steps; none that opens by more than rounding is in doubt.
        errors = np.abs(gaps.gradients) @ self._tolerances[: gaps.coordinates]
        opening = speeds > TOUCHING * sizes
        noise = np.where(opening, 0.0, _ADDED_UP * errors + TOUCHING * gaps.sizes)
        reach = _REACH * errors * ~np.array(self._closed)
        signs = tuple(RISES if rising else 1.0 for rising in rises)
        self._begin_piece(signs, tuple(noise.tolist()), tuple(reach.tolist()))

    def _begin_piece(
        self, signs: tuple[float, ...], noise: tuple[float, ...], reach: tuple[float, ...]
    ) -> Integrator:
        """Begin a piece here, with the signs of its event functions, noise and reach."""
        self._piece = {"from": (self.t, self.y), "signs": signs, "noise": noise, "reach": reach}
        self._seen = 0
        first_step = min(self._control.first_step, self.t_end - self.t)
        run, begun = self._runs.get(self._closed), (signs, noise, reach)
        if run is None or not run.again(self.t, self.y, first_step, begun):
            # The tolerances stay those of the control, which may change between steps.
            control = replace(self._control, first_step=first_step)
            side = self._rhs.side(self._closed)
            run = self._begin(side, self.t, self.y, self.t_end, control)
            run.stop_at(self._rhs.terminal_events(self._closed, *begun))
            self._runs[self._closed] = run
        self._run = run
        return run

    def state(self) -> SavedState:
        switches = [(s.t, s.contact, s.kind, s.before, s.after, s.flags) for s in self.switches]
        values = {
            "closed": self._closed,
            "began": self.began,
            "bounces": [(contact, tuple(times)) for contact, times in self._bounces.items()],
            "switches": tuple(switches),
            "grazes": tuple(tuple(vars(dip).values()) for dip in self.grazes),
            "slid": tuple(self._slid),
            "toggled": tuple(self._toggled),
            "fastest": tuple(self._fastest.items()),
            "stuck": None if self.stuck is None else (self.stuck.reason, self.stuck.contacts),
        }
        return {**super().state(), **values}

    def restore(self, state: SavedState) -> None:
        self.switches = [ModeChange(*fields) for fields in state["switches"]]
        self.grazes = [NearContact(*fields) for fields in state["grazes"]]
        self._fastest, self._slid = dict(state["fastest"]), list(state["slid"])
        self._toggled = list(state["toggled"])
        self._bounces = {contact: list(times) for contact, times in state["bounces"]}
        self._closed, self.began = state["closed"], state["began"]
        if state["stuck"] is not None:
            self.stuck = Stuck(*state["stuck"])
            self._failure = self.stuck.reason
        super().restore(state)
