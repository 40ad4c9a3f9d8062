"""Motion across switching surfaces: smooth pieces, each on one side of every surface.

A step ends at a kink or jump of ``abs``, ``sign``, ``min`` or ``max``: the surface is located on
the step's interpolant, and the next piece begins with the equations of the other side. The rates
on both sides of a surface decide how the motion goes on (A. F. Filippov, *Differential Equations
with Discontinuous Righthand Sides*, 1988, §4): it passes through, or leaves to one side, or slides
along the surface while both sides push it back, as dry friction holds a body at rest. If more than
one of these is possible, the motion is not determined.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, ClassVar

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
from lagrange_cli.simulate.integrators.events import RISES, TerminalEvents, ZeroCrossing
from lagrange_cli.simulate.integrators.hybrid.meeting import (
    NOT_ONE_COMBINATION,
    settled,
)
from lagrange_cli.simulate.integrators.hybrid.motion import (
    CHATTER,
    TOGETHER,
    Begin,
    HybridMotion,
)
from lagrange_cli.simulate.integrators.hybrid.sliding import SlidingRhs
from lagrange_cli.simulate.integrators.hybrid.switches import RESTLESS, SwitchPlace, switched
from lagrange_cli.simulate.integrators.right_hand_side import (
    Rhs,
    SurfaceSides,
    structured,
    with_sides,
)

#: A step whose event lies in less than this part of it is made again (advance.c does the same).
EARLY = 0.5

#: Length of the step that is made again, as a multiple of the time until the event.
BEHIND = 1.25

_ONE_STEP: Any = {"most_steps": 1, "most_evaluations": math.inf}

#: Crossings that are followed.
_MOST_CROSSINGS = 250_000

#: Part of the energy, or of a momentum, that may change where a surface is crossed: more is an
#: impulse.
_JUMP = 1e-9

#: Why a motion cannot be continued.
CROWDED = Phrase("kinks or jumps of the forces are crossed without end")
IMPULSIVE = Phrase(
    "energy or momentum jumps where an expression of the scene does, so that an impulse acts that"
    " the equations do not hold"
)


class SurfaceMotion(HybridMotion):
    """One method over all pieces, called like any."""

    counters: ClassVar[tuple[str, ...]] = ("steps", "evaluations", "remade")
    resets: ClassVar[bool] = False
    begun_with: ClassVar[tuple[str, ...]] = ("signs", "noise", "first_step")

    def __init__(
        self, begin: Begin, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control
    ) -> None:
        super().__init__(begin, t0, y0, t_end, control)
        surfaces = structured(rhs).surfaces
        assert surfaces is not None
        self._surfaces = surfaces
        self._other_events: TerminalEvents | None = None
        self._crossings: list[float] = []
        self._count = 0
        self._dips: list[ZeroCrossing] = []
        self._slid: list[tuple[int, float, float]] = []
        self._since: dict[int, float] = {}
        self._toggled: list[tuple[int, float]] = []
        self._sides: SurfaceSides = (1.0,) * len(self._surfaces.positional)
        self._corners: tuple[SurfaceSides, ...] = (self._sides,)
        self._settle((), self._switch(at_start=True))

    # Pieces.

    def stop_at(self, events: TerminalEvents) -> None:
        self._other_events = events
        if self._run is not None:
            self._begin_piece(self._piece["signs"], self._piece["noise"])

    @property
    def dips(self) -> list[ZeroCrossing]:
        return [*self._dips, *([] if self._run is None else self._run.dips)]

    @property
    def toggles(self) -> Toggles:
        return tuple(self._toggled)

    @property
    def slides(self) -> Slides:
        """The surfaces along which the motion slid for longer than times are known, with when."""
        sliding = ((k, start, math.inf) for k, start in self._since.items())
        return (*self._slid, *sliding)

    def _note_slides(self, sliding: Sequence[int]) -> None:
        """Take note of surfaces along which the motion slides from here on, and of others."""
        for k in [k for k in self._since if k not in sliding]:
            start = self._since.pop(k)
            if self.t - start > self._together:
                self._slid.append((k, start, self.t))
        for k in sliding:
            self._since.setdefault(k, self.t)

    def _go(
        self, run: Integrator, times: Array, states: Array, most_steps: int, most_evaluations: float
    ) -> Advance:
        # Compiled integrators make a step again whose event is early in it (kernels/advance.c).
        if run.repeats or most_steps == 0:
            return super()._go(run, times, states, most_steps, most_evaluations)
        filled, steps, evaluations = run.take(times, states, 0), run.steps, run.evaluations
        while (
            filled < len(times)
            and run.end_event is None
            and not (self._control.observed is not None and self._control.observed.ended)
            and run.steps - steps < most_steps
            and run.evaluations - evaluations < most_evaluations
        ):
            start, signs = (run.t, run.y), run.signs
            done = run.advance(np.array([np.inf]), np.empty((1, len(self.y))), **_ONE_STEP)
            if done.failure is not None:
                return Advance(filled, done.failure)
            part = self._part_of_step(run, start[0])
            if part < EARLY:
                run = self._again(start, signs, BEHIND * (run.t - start[0]))
                steps, evaluations = 0, 0
                continue
            end = len(times) if run.end_event is None else np.searchsorted(times, run.t, "right")
            filled = run.take(times[:end], states, filled)
        return Advance(filled)

    def _part_of_step(self, run: Integrator, start: float) -> float:
        """Return the part of its step before an event; 1 without one, or if none can be earlier.

        Nor can any be where a step that was made again became several, as at the start of LSODA.
        """
        begun, planned = self._piece["from"][0], self._piece["first_step"]
        shorter = begun < start and run.t <= begun + planned < math.inf
        if run.end_event is None or shorter or run.t - start <= TOGETHER * np.spacing(abs(run.t)):
            return 1.0
        return (run.t - start) / run.last_step

    def _again(
        self, start: tuple[float, Array], signs: tuple[float, ...], first_step: float
    ) -> Integrator:
        """Begin the piece anew where its last step began, with a shorter one."""
        assert self._run is not None
        self._read(self._run)
        self._past = self.steps - 1, self.evaluations, self.remade
        self.t, self.y = start
        sliding = self._sliding(self._sides)
        others = 0 if self._other_events is None else len(self._other_events.signs)
        # Behind those of the surfaces stand the ends of what holds the motion on some of them.
        crossed = [k for k in range(len(self._sides)) if k not in sliding]
        whole = list(self._piece["signs"])
        for k, sign in zip(crossed, signs[others:], strict=False):
            whole[k] = sign
        return self._begin_piece(tuple(whole), self._piece["noise"], first_step)

    def _pass(self, event: int) -> bool:
        before = 0 if self._other_events is None else len(self._other_events.signs)
        if event < before:
            self.end_event = event
        else:
            self._cross(event - before)
        return event >= before

    def _cross(self, event: int) -> None:
        """Go on behind a surface that was met, or that no longer holds the motion."""
        self._end_piece()
        self._dips, self._run = self.dips, None
        self._count += 1
        self._crossings.append(self.t)
        most = CHATTER * len(self._sides)
        del self._crossings[:-most]
        crowded = len(self._crossings) == most and self.t - self._crossings[0] <= self._together
        sliding = self._sliding(self._sides)
        end = event - (len(self._sides) - len(sliding))
        switch = event - (len(self._sides) - len(sliding) - len(self._surfaces.switches))
        if crowded or self._count >= _MOST_CROSSINGS:
            self._failure = RESTLESS if end < 0 <= switch else CROWDED
        elif end < 0 <= switch:
            self._settle(self._together_with(sliding), self._switch(switch))
        elif end < 0:
            met = [k for k in range(len(self._sides)) if k not in sliding][event]
            self._settle(self._together_with((met, *sliding)), self._switch())
        elif end == 2 * len(sliding):
            self._failure = NOT_ONE_COMBINATION
        else:
            self._leave_surface(sliding[end // 2], 1.0 if end % 2 == 0 else -1.0)

    def _together_with(self, met: Sequence[int]) -> list[int]:
        """List surfaces that are met, or hold the motion, and those that are crossed within the
        error of the time at which they are met."""
        sliding = self._sliding(self._sides)
        side = self._slide(sliding) if sliding else self._surfaces.side(self._sides)
        slope, near = side(self.t, self.y), np.zeros(len(self._sides), dtype=bool)
        for sides in self._corners:
            values, _ = self._surfaces.values(self.t, self.y, sides)
            rates = self._surfaces.rates(self.t, self.y, sides, slope)
            near |= np.abs(values) <= self._together * np.abs(rates.first)
        return sorted({*met, *np.flatnonzero(near).tolist()})

    def _switch(self, met: int | None = None, *, at_start: bool = False) -> dict[int, float] | str:
        """Change the states with two values whose conditions hold, and the one whose condition is
        met; return the surfaces of those that are at their next condition but for errors, with
        these; or why states have no values."""
        places = self._surfaces.switches
        if not places:
            return {}
        late = 0.0 if at_start else self._together
        at = SwitchPlace(self._surfaces, self._sides, self.t, self.y, late, self._tolerances)
        change = switched(at, () if met is None else (met,))
        if isinstance(change, str):
            return change
        self.y = change.y
        self._toggled += [(places[k], self.t) for k in change.toggled]
        first = len(self._sides) - len(places)
        return {first + k: error for k, error in change.at_conditions.items()}

    def _leave_surface(self, k: int, side: float) -> None:
        """Leave a surface along which the motion slid, to the side that no longer pushes back."""
        corners = tuple(corner for corner in self._corners if corner[k] == side)
        sliding = [j for j in self._sliding(self._sides) if j != k]
        between = {j: self._sides[j] for j in sliding}
        self._start_piece(with_sides(corners[0], between), corners, (k,))

    def _begin_piece(
        self, signs: tuple[float, ...], noise: tuple[float, ...], first_step: float = np.inf
    ) -> Integrator:
        """Begin a piece here on the present sides."""
        self._piece = {"from": (self.t, self.y), "signs": signs, "noise": noise}
        self._piece["first_step"] = first_step
        first_step = min(self._control.first_step, self.t_end - self.t, first_step)
        control = replace(self._control, first_step=first_step)
        self._dips = self.dips
        sliding = self._sliding(self._sides)
        slide = self._slide(sliding) if sliding else None
        side = self._surfaces.side(self._sides) if slide is None else slide
        self._run = run = self._begin(side, self.t, self.y, self.t_end, control)
        run.stop_at(self._terminal_events(slide, sliding, signs, noise))
        return run

    def _terminal_events(
        self,
        slide: SlidingRhs | None,
        sliding: Sequence[int],
        signs: tuple[float, ...],
        noise: tuple[float, ...],
    ) -> TerminalEvents:
        # Corners that differ in nothing else have the same other events.
        bare = dict.fromkeys(sliding, 1.0)
        apart = {with_sides(sides, bare): sides for sides in reversed(self._corners)}
        whole, *further = [
            self._surfaces.terminal_events(sides, signs, noise, self._other_events)
            for sides in apart.values()
        ]
        if slide is None:
            return whole
        others = 0 if self._other_events is None else len(self._other_events.signs)
        numbers = [*range(others), *(others + k for k in range(len(signs)) if k not in sliding)]
        watched = [whole, *further]

        def values(t: float, y: Array) -> Array:
            first = watched[0].values(t, y)
            if len(watched) > 1:
                first = np.min([first, *(e.values(t, y) for e in watched[1:])], axis=0)
            return np.array([*first[numbers], *slide.ends(t, y)])

        ones = (1.0,) * slide.ends_count
        return TerminalEvents(
            values,
            (*(whole.signs[k] for k in numbers), *ones),
            (*(whole.noise[k] for k in numbers), *(0.0 for _ in ones)),
            reach=(*(whole.reach[k] for k in numbers), *(0.0 for _ in ones)) if whole.reach else (),
        )

    # Going on from surfaces.

    def _sliding(self, sides: SurfaceSides) -> tuple[int, ...]:
        return tuple(k for k, side in enumerate(sides) if abs(side) < 1)

    def _settle(self, met: Sequence[int], at_conditions: dict[int, float] | str) -> None:
        """Determine the sides behind surfaces that are met, and begin the next piece, at the
        conditions of some states with two values; or end here if these have no values."""
        if isinstance(at_conditions, str):
            self._failure = at_conditions
            return
        before = self._sides
        chosen = settled(self._surfaces, self.t, self.y, self._corners, met)
        if isinstance(chosen, str):
            self._failure = chosen
        elif self._jumps(before if met else chosen.sides, chosen.sides):
            self._failure = IMPULSIVE
        else:
            self._start_piece(chosen.sides, chosen.corners, chosen.on, at_conditions)

    def _jumps(self, before: SurfaceSides, after: SurfaceSides) -> bool:
        """Tell whether energy or momenta jump at the surfaces, for the same state."""
        earlier, later = (self._surfaces.continuous(self.t, self.y, s) for s in (before, after))
        return bool((np.abs(later - earlier) > _JUMP * (np.abs(earlier) + np.abs(later))).any())

    def _slide(self, sliding: Sequence[int]) -> SlidingRhs:
        return SlidingRhs(self._surfaces, sliding, self._corners)

    def _start_piece(
        self,
        sides: SurfaceSides,
        corners: tuple[SurfaceSides, ...],
        on: Sequence[int],
        errors: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        """Begin a piece here on these sides, unless nothing is left of the motion.

        ``on``: surfaces on which it begins; others on which it does, with their errors, are in
        ``errors``.
        """
        self._sides, self._corners = sides, corners
        sliding = self._sliding(sides)
        self._note_slides(sliding)
        if self._is_over():
            return
        if sliding:
            moved = self._slide(sliding).onto_surfaces(self.t, self.y)
            self.y = moved if np.isfinite(moved).all() else self.y
        signs = tuple(RISES if k in on or k in errors else 1.0 for k in range(len(sides)))
        noise = np.zeros(len(sides))
        values, _ = self._surfaces.values(self.t, self.y, sides)
        for k in on:
            noise[k] = self._noise(k, sides, values)
        for k, error in errors.items():
            noise[k] = error
        self._begin_piece(signs, tuple(noise.tolist()))

    def _noise(self, k: int, sides: SurfaceSides, values: Array) -> float:
        """Bound the error, by the tolerance, of a surface that holds the motion; 0 if it leaves."""
        slope = self._surfaces.side(sides)(self.t, self.y)
        rates = self._surfaces.rates(self.t, self.y, sides, slope)
        if rates.leading(k, self._surfaces.positional[k]) != 0:
            return 0.0
        noise = 0.0
        for i, tolerance in enumerate(self._tolerances):
            moved = self.y.copy()
            moved[i] += tolerance
            noise += abs(self._surfaces.values(self.t, moved, sides)[0][k] - values[k])
        return float(noise)

    @property
    def _tolerances(self) -> Array:
        """The tolerance of steps in each component here, shape (2n,)."""
        return np.asarray(self._control.atol + self._control.rtol * np.abs(self.y))

    # Going on.

    def state(self) -> SavedState:
        values = {
            "crossings": tuple(self._crossings),
            "count": self._count,
            "sides": self._sides,
            "corners": self._corners,
            "stuck": self._failure,
            "slid": tuple(self._slid),
            "toggled": tuple(self._toggled),
            "since": tuple(self._since.items()),
        }
        return {**super().state(), **values}

    def restore(self, state: SavedState) -> None:
        self._crossings = list(state["crossings"])
        self._count, self._failure = state["count"], state["stuck"]
        self._sides, self._corners = state["sides"], state["corners"]
        self._slid, self._since = list(state["slid"]), dict(state["since"])
        self._toggled = list(state["toggled"])
        super().restore(state)
