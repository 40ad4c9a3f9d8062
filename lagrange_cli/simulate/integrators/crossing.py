"""Motion across switching surfaces: smooth pieces, each on one side of every surface.

Where ``abs``, ``sign``, ``min`` or ``max`` has a kink or a jump, a step ends: the surface is
located on the step's interpolant, and the next piece begins with the equations of the other
side. What happens on a surface is decided by the rates on both sides of it (A. F. Filippov,
*Differential Equations with Discontinuous Righthand Sides*, 1988, §4): the motion passes
through, or leaves to one side, or slides along it while both sides push it back, as dry friction
holds a body at rest. Where more than one of these is possible, the motion is not determined.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar, TypeAlias

import numpy as np

from lagrange_cli.simulate.integrators.base import (
    Advance,
    Array,
    Control,
    Integrator,
    Rhs,
    State,
    StepError,
    projection,
)
from lagrange_cli.simulate.integrators.falling import RISES, Falling
from lagrange_cli.simulate.integrators.switching import LOCATED, TOGETHER, Begin

__all__ = [
    "AMBIGUOUS",
    "CROWDED",
    "IMPULSIVE",
    "UNSETTLED",
    "Crossing",
    "Rates",
    "Sides",
    "Surfaces",
    "surfaces_of",
]

#: On which side of each surface: 1, −1, or the part between that keeps the motion on it.
Sides: TypeAlias = tuple[float, ...]

#: A surface is met where its function is below this part of the terms that it is the sum of.
ON_SURFACE = 1e-14

#: Surfaces met at one instant of which every combination of sides is looked at.
MOST_AT_ONCE = 3

#: Crossings of each surface one upon the other that are taken for endless.
CHATTER = 40

#: A step whose event lies in less than this part of it is made again, to this many times the time
#: until the event (advance.c does the same).
EARLY, BEHIND = 0.5, 1.25

ONE_STEP: Any = {"most_steps": 1, "most_evaluations": math.inf}

#: Crossings that are followed.
MOST_CROSSINGS = 250_000

#: Part of the energy that may change where a surface is crossed: more is an impulse.
ENERGY_STEP = 1e-9

#: How exactly rates must hang linearly on the part between both sides of a surface.
LINEAR = 1e-6

#: Why a motion cannot be continued.
AMBIGUOUS = (
    "the motion from there is not unique: abs, sign, min or max has a kink there that pushes"
    " the motion away to both sides"
)
CROWDED = "kinks of abs, sign, min or max are crossed without end"
UNSETTLED = "what follows at a kink of abs, sign, min or max cannot be determined"
IMPULSIVE = (
    "the energy jumps where abs, sign, min or max does, so that an impulse acts that the"
    " equations do not hold"
)


@dataclass(frozen=True)
class Rates:
    """How the functions of the surfaces change.

    Attributes
    ----------
    first, second
        First rates, and second ones of surfaces that do not hang on velocities, shape (S,).
    sizes
        Magnitudes that the first rates are sums of, shape (S,).
    """

    first: Array
    second: Array
    sizes: Array

    def leading(self, k: int, positional: bool) -> float:
        """The first of them that is not zero but for rounding, 0 where there is none."""
        if abs(self.first[k]) > ON_SURFACE * self.sizes[k]:
            return float(self.first[k])
        return float(self.second[k]) if positional else 0.0


class Surfaces(ABC):
    """The switching surfaces of a right-hand side, which has them as its attribute ``surfaces``.

    Attributes
    ----------
    positional
        Of each surface whether it hangs on positions and time alone.
    """

    positional: tuple[bool, ...]

    @abstractmethod
    def side(self, sides: Sides) -> Rhs:
        """The smooth right-hand side on these sides."""

    @abstractmethod
    def through(self, change: Callable[[Rhs], Rhs]) -> Surfaces:
        """The same with every right-hand side changed."""

    @abstractmethod
    def values(self, t: float, y: Array, sides: Sides) -> tuple[Array, Array]:
        """What is positive on these sides, and the magnitudes behind it, both (S,)."""

    @abstractmethod
    def rates(self, t: float, y: Array, sides: Sides, slope: Array) -> Rates:
        """How they change where the state has the slope ``slope`` (of y)."""

    @abstractmethod
    def energy(self, t: float, y: Array, sides: Sides) -> float:
        """The energy function on these sides."""

    @abstractmethod
    def falling(
        self,
        sides: Sides,
        signs: tuple[float, ...],
        noise: tuple[float, ...],
        beside: Falling | None,
    ) -> Falling:
        """Where the motion leaves these sides, behind what else is looked for."""

    def placed(
        self, t: float, y: Array, sides: Sides, met: Sequence[int] = ()
    ) -> tuple[Sides, tuple[int, ...]]:
        """The sides of surfaces on which a state is not, and the numbers of the others.

        Those that are ``met`` are among them. A surface may hang on the sides of those before it.
        """
        on = set(met)
        for _ in range(len(sides) + 1):
            values, sizes = self.values(t, y, sides)
            on = {*met, *map(int, np.flatnonzero(np.abs(values) <= ON_SURFACE * sizes))}
            clear = [k for k in range(len(sides)) if k not in on and values[k] != 0]
            placed = _put(sides, {k: float(np.sign(values[k])) for k in clear})
            if placed == sides:
                break
            sides = placed
        return sides, tuple(sorted(on))

    def around(self, t: float, y: Array) -> Sides:
        """The sides of a state; of surfaces on which it is the positive ones."""
        return self.placed(t, y, (1.0,) * len(self.positional))[0]


def surfaces_of(rhs: Rhs) -> Surfaces | None:
    """The switching surfaces of a right-hand side, None where it has none."""
    surfaces: Surfaces | None = getattr(rhs, "surfaces", None)
    return surfaces


@dataclass(frozen=True)
class _Way:
    """One way in which the motion may go on, with its slope, and whether it departs at once from
    each surface that it meets."""

    sides: Sides
    slope: Array
    departs: bool


class Crossing(Integrator):
    """One method over all pieces, called like any."""

    interpolates: ClassVar[bool] = False

    def __init__(
        self, begin: Begin, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control
    ) -> None:
        self._begin, self._rhs, self._control = begin, rhs, control
        surfaces = surfaces_of(rhs)
        assert surfaces is not None
        self._surfaces = surfaces
        self.t, self.y, self.t_end = t0, np.array(y0, dtype=float), t_end
        self._beside: Falling | None = None
        self._past = 0, 0, 0
        self._crossings: list[float] = []
        self._count = 0
        self._run: Integrator | None = None
        self._stuck: str | None = None
        self._piece: dict[str, Any] = {}
        self._sides: Sides = (1.0,) * len(self._surfaces.positional)
        self._settle(())

    # Pieces.

    def stop_at(self, falling: Falling) -> None:
        self._beside = falling
        if self._run is not None:
            self._begin_piece(self._piece["signs"], self._piece["noise"])

    def step(self, limit: float) -> None:
        states = np.empty((1, len(self.y)))
        done = self.advance(np.array([np.inf]), states, most_steps=1, most_evaluations=float("inf"))
        if done.failure is not None:
            raise StepError(done.failure)

    def advance(
        self, times: Array, states: Array, *, most_steps: int, most_evaluations: float
    ) -> Advance:
        filled, steps, evaluations = 0, self.steps, self.evaluations
        while self._run is not None:
            waiting = self._run.fallen is not None
            done = self._go(
                times[filled:],
                states[filled:],
                0 if waiting else most_steps - (self.steps - steps),
                most_evaluations - (self.evaluations - evaluations),
            )
            run = self._run
            filled += done.filled
            self._read(run)
            if done.failure is not None or run.fallen is None:
                return Advance(filled, done.failure)
            if filled == len(times) and times[-1] < self.t:
                # Samples that are asked for later may lie before the surface.
                return Advance(filled)
            others = 0 if self._beside is None else len(self._beside.signs)
            if run.fallen < others:
                self.fallen = run.fallen
                return Advance(filled)
            self._cross(run.fallen - others)
            spent = self.evaluations - evaluations
            if (
                filled == len(times)
                or self.steps - steps >= most_steps
                or spent >= most_evaluations
            ):
                break
        if self._run is None and self._stuck is None and filled < len(times):
            # The surface was met at the end, as far as that can be told.
            states[filled:] = self.y
            filled = len(times)
        return Advance(filled, self._stuck)

    def _go(self, times: Array, states: Array, most_steps: int, most_evaluations: float) -> Advance:
        """Step on in this piece. The compiled integrators make a step again whose event is early
        in it (kernels/advance.c); for others that is done here."""
        run = self._run
        assert run is not None
        if run.repeats or most_steps == 0:
            return run.advance(
                times, states, most_steps=most_steps, most_evaluations=most_evaluations
            )
        filled, steps, evaluations = run.take(times, states, 0), run.steps, run.evaluations
        while (
            filled < len(times)
            and run.fallen is None
            and run.steps - steps < most_steps
            and run.evaluations - evaluations < most_evaluations
        ):
            start, signs = (run.t, run.y), run.signs
            done = run.advance(np.array([np.inf]), np.empty((1, len(self.y))), **ONE_STEP)
            if done.failure is not None:
                return Advance(filled, done.failure)
            part = self._part_of_step(run, start[0])
            if part < EARLY:
                run = self._again(start, signs, BEHIND * (run.t - start[0]))
                steps, evaluations = 0, 0
                continue
            end = len(times) if run.fallen is None else np.searchsorted(times, run.t, "right")
            filled = run.take(times[:end], states, filled)
        return Advance(filled)

    def _part_of_step(self, run: Integrator, start: float) -> float:
        """How far into its step an event is; 1 where there is none, or it cannot be earlier."""
        if run.fallen is None or run.t - start <= TOGETHER * np.spacing(abs(run.t)):
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
        others = 0 if self._beside is None else len(self._beside.signs)
        # Behind those of the surfaces stand the ends of what holds the motion on some of them.
        kept = [k for k in range(len(self._sides)) if k not in sliding]
        whole = list(self._piece["signs"])
        for k, sign in zip(kept, signs[others:], strict=False):
            whole[k] = sign
        return self._begin_piece(tuple(whole), self._piece["noise"], first_step)

    def _read(self, run: Integrator) -> None:
        self.t, self.y = run.t, run.y
        steps, evaluations, remade = self._past
        self.steps, self.evaluations = steps + run.steps, evaluations + run.evaluations
        self.remade = remade + run.remade

    def _cross(self, event: int) -> None:
        """Go on behind a surface that was met, or that no longer holds the motion."""
        self._past = self.steps, self.evaluations, self.remade
        self._count += 1
        self._crossings.append(self.t)
        most = CHATTER * len(self._sides)
        del self._crossings[:-most]
        crowded = len(self._crossings) == most and self.t - self._crossings[0] <= self._together
        if crowded or self._count >= MOST_CROSSINGS:
            self._run, self._stuck = None, CROWDED
            return
        sliding = self._sliding(self._sides)
        if len(sliding) and event >= len(self._sides) - len(sliding):
            self._let_go(event, sliding)
        else:
            met = [k for k in range(len(self._sides)) if k not in sliding][event]
            self._settle((met,))

    @property
    def _together(self) -> float:
        return float(TOGETHER * np.spacing(max(abs(self.t), abs(self.t_end))))

    def _let_go(self, event: int, sliding: Sequence[int]) -> None:
        """Leave a surface along which the motion slid, to the side that no longer pushes back."""
        place = event - (len(self._sides) - len(sliding))
        k, upper = sliding[place // 2], place % 2 == 0
        self._stand(_put(self._sides, {k: 1.0 if upper else -1.0}), (k,))

    def _begin_piece(
        self, signs: tuple[float, ...], noise: tuple[float, ...], first_step: float = np.inf
    ) -> Integrator:
        """Begin a piece here on the present sides."""
        self._piece = {"from": (self.t, self.y), "signs": signs, "noise": noise}
        self._piece["first_step"] = first_step
        first_step = min(self._control.first_step, self.t_end - self.t, first_step)
        control = replace(self._control, first_step=first_step)
        sliding = self._sliding(self._sides)
        side = self._slide(sliding) if sliding else self._surfaces.side(self._sides)
        self._run = run = self._begin(side, self.t, self.y, self.t_end, control)
        run.stop_at(self._falling(sliding, signs, noise))
        return run

    def _falling(
        self, sliding: Sequence[int], signs: tuple[float, ...], noise: tuple[float, ...]
    ) -> Falling:
        whole = self._surfaces.falling(self._sides, signs, noise, self._beside)
        if not sliding:
            return whole
        others = 0 if self._beside is None else len(self._beside.signs)
        kept = [*range(others), *(others + k for k in range(len(signs)) if k not in sliding)]
        slide = self._slide(sliding)

        def values(t: float, y: Array) -> Array:
            parts, _ = slide.parts(t, y)
            ends = [end for part in parts for end in (1 - part, 1 + part)]
            return np.array([*whole.values(t, y)[kept], *ends])

        held = (1.0,) * 2 * len(sliding)
        return Falling(
            values,
            (*(whole.signs[k] for k in kept), *held),
            (*(whole.noise[k] for k in kept), *(0.0 for _ in held)),
        )

    # What follows on surfaces.

    def _sliding(self, sides: Sides) -> tuple[int, ...]:
        return tuple(k for k, side in enumerate(sides) if abs(side) < 1)

    def _settle(self, met: Sequence[int]) -> None:
        """Find the sides that hold behind surfaces that are met, and begin the next piece."""
        before = self._sides
        self._sides, on = self._surfaces.placed(self.t, self.y, before, met)
        if not on:
            self._stand(self._sides, ())
            return
        quick = self._passed(on) if met else None
        ways = [quick] if quick is not None else list(self._ways(on))
        chosen = _only(ways)
        if chosen is None:
            self._run = None
            self._stuck = AMBIGUOUS if ways else UNSETTLED
        elif self._jumps(before if met else chosen.sides, chosen.sides):
            self._run, self._stuck = None, IMPULSIVE
        else:
            self._stand(chosen.sides, on)

    def _passed(self, on: Sequence[int]) -> _Way | None:
        """The way through surfaces of positions, which are passed whatever acts; None where one
        of them is another, or is only touched."""
        positional = self._surfaces.positional
        sides = _put(self._sides, dict.fromkeys(on, 1.0))
        slope = self._surfaces.side(sides)(self.t, self.y)
        rates = self._surfaces.rates(self.t, self.y, sides, slope)
        clear = np.abs(rates.first) > ON_SURFACE * rates.sizes
        if not all(positional[k] and clear[k] for k in on):
            return None
        sides = _put(self._sides, {k: float(np.sign(rates.first[k])) for k in on})
        return _Way(sides, slope, True)

    def _ways(self, on: Sequence[int]) -> Iterator[_Way]:
        """The ways in which the motion may go on from surfaces."""
        if len(on) > MOST_AT_ONCE:
            return
        for choice in product((1.0, -1.0, 0.0), repeat=len(on)):
            sides = _put(self._sides, dict(zip(on, choice, strict=True)))
            held = [k for k, side in zip(on, choice, strict=True) if side == 0]
            way = self._held(sides, held) if held else self._free(sides)
            if way is not None and self._consistent(way, [k for k in on if k not in held]):
                yield replace(way, departs=self._departs(way, [k for k in on if k not in held]))

    def _free(self, sides: Sides) -> _Way | None:
        slope = self._surfaces.side(sides)(self.t, self.y)
        return _Way(sides, slope, True) if np.isfinite(slope).all() else None

    def _held(self, sides: Sides, held: Sequence[int]) -> _Way | None:
        """The way along surfaces that hold the motion from both sides, if they do."""
        parts, slope = _Slide(self._surfaces, sides, held).parts(self.t, self.y)
        if not np.isfinite(slope).all() or not (np.abs(parts) < 1).all():
            return None
        placed = _put(sides, dict(zip(held, parts.tolist(), strict=True)))
        exact = self._surfaces.side(placed)(self.t, self.y)
        end = self._surfaces.side(_put(sides, dict.fromkeys(held, 1.0)))(self.t, self.y)
        size = (np.abs(exact) + np.abs(slope) + np.abs(end)).max()
        linear = bool((np.abs(exact - slope) <= LINEAR * size).all())
        return _Way(placed, slope, True) if linear else None

    def _consistent(self, way: _Way, on: Sequence[int]) -> bool:
        """Whether a way keeps to the sides that it is for."""
        rates = self._surfaces.rates(self.t, self.y, way.sides, way.slope)
        leading = [rates.leading(k, self._surfaces.positional[k]) for k in on]
        return all(way.sides[k] * rate >= 0 for k, rate in zip(on, leading, strict=True))

    def _departs(self, way: _Way, on: Sequence[int]) -> bool:
        rates = self._surfaces.rates(self.t, self.y, way.sides, way.slope)
        return any(rates.leading(k, self._surfaces.positional[k]) != 0 for k in on)

    def _jumps(self, before: Sides, after: Sides) -> bool:
        """Whether the energy is another one behind the surfaces, for the same state."""
        one, other = (self._surfaces.energy(self.t, self.y, s) for s in (before, after))
        return bool(abs(one - other) > ENERGY_STEP * (abs(one) + abs(other)))

    def _slide(self, sliding: Sequence[int]) -> _Slide:
        return _Slide(self._surfaces, self._sides, sliding)

    def _stand(self, sides: Sides, on: Sequence[int]) -> None:
        """Begin a piece here on these sides, unless nothing is left of the motion."""
        self._run, self._sides = None, sides
        if self.t_end - self.t <= LOCATED * np.spacing(abs(self.t_end)):
            self.t = self.t_end
            return
        signs = tuple(RISES if k in on else 1.0 for k in range(len(sides)))
        noise = np.zeros(len(sides))
        values, _ = self._surfaces.values(self.t, self.y, sides)
        for k in on:
            noise[k] = self._noise(k, sides, values)
        self._begin_piece(signs, tuple(noise.tolist()))

    def _noise(self, k: int, sides: Sides, values: Array) -> float:
        """What the tolerance makes of a surface that the motion may stay on; 0 where it leaves."""
        slope = self._surfaces.side(sides)(self.t, self.y)
        rates = self._surfaces.rates(self.t, self.y, sides, slope)
        if rates.leading(k, self._surfaces.positional[k]) != 0:
            return 0.0
        tolerances = self._control.atol + self._control.rtol * np.abs(self.y)
        noise = 0.0
        for i, tolerance in enumerate(tolerances):
            moved = self.y.copy()
            moved[i] += tolerance
            noise += abs(self._surfaces.values(self.t, moved, sides)[0][k] - values[k])
        return float(noise)

    # Going on.

    def state(self) -> State:
        own = {
            "past": self._past,
            "crossings": tuple(self._crossings),
            "count": self._count,
            "sides": self._sides,
            "stuck": self._stuck,
            "run": None if self._run is None else self._run.state(),
        }
        return {**super().state(), **own, **self._piece}

    def restore(self, state: State) -> None:
        self._past, self._crossings = state["past"], list(state["crossings"])
        self._count, self._sides, self._stuck = state["count"], state["sides"], state["stuck"]
        self._run = None
        if state["run"] is not None:
            self.t, self.y = state["from"]
            begun = state["signs"], state["noise"], state["first_step"]
            self._begin_piece(*begun).restore(state["run"])
        super().restore(state)


def _put(sides: Sides, changed: dict[int, float]) -> Sides:
    return tuple(changed.get(k, side) for k, side in enumerate(sides))


def _only(ways: Sequence[_Way]) -> _Way | None:
    """The way that the motion takes; None where there is none, or more than one.

    Ways that differ in nothing but the name of a side are one.
    """
    if not ways:
        return None
    first = ways[0]
    same = all(np.array_equal(way.slope, first.slope) for way in ways)
    if same:
        return next((way for way in ways if not way.departs), first)
    return first if len(ways) == 1 else None


class _Slide:
    """The right-hand side along surfaces that hold the motion, called like any.

    Their functions stay zero: the parts between both sides solve a linear system, whose entries
    are differences of rates.
    """

    def __init__(self, surfaces: Surfaces, sides: Sides, held: Sequence[int]) -> None:
        self._surfaces, self._held = surfaces, list(held)
        self._base = _put(sides, dict.fromkeys(held, 0.0))
        self._ends = [_put(self._base, {k: 1.0}) for k in held]
        self.project = projection(surfaces.side(self._base))

    def __call__(self, t: float, y: Array) -> Array:
        return self.parts(t, y)[1]

    def parts(self, t: float, y: Array) -> tuple[Array, Array]:
        """The parts between both sides, and the slope."""
        slope, rates = self._at(t, y, self._base)
        ends = [self._at(t, y, sides) for sides in self._ends]
        matrix = np.array([r - rates for _, r in ends]).T
        try:
            parts = np.linalg.solve(matrix, -rates)
        except np.linalg.LinAlgError:
            return np.full(len(self._held), np.nan), np.full(len(y), np.nan)
        changes = np.array([end - slope for end, _ in ends])
        return parts, slope + parts @ changes

    def _at(self, t: float, y: Array, sides: Sides) -> tuple[Array, Array]:
        """The slope on some sides, and how the surfaces that hold the motion change there."""
        slope = self._surfaces.side(sides)(t, y)
        rates = self._surfaces.rates(t, y, self._base, slope)
        positional = self._surfaces.positional
        held = [rates.second[k] if positional[k] else rates.first[k] for k in self._held]
        return slope, np.array(held)
