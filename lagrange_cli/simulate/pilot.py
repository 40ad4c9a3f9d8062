"""A coarse first run: how far things move, in what steps, and whether the system is stiff."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from lagrange_cli.simulate.integrators import INTEGRATORS, Control, Integrator
from lagrange_cli.simulate.integrators.base import Array, Rhs, State
from lagrange_cli.simulate.integrators.native import NativeRhs
from lagrange_cli.simulate.integrators.pieces import pieces
from lagrange_cli.simulate.integrators.taylor import Taylor
from lagrange_cli.simulate.noise import NOISE_PART, noise_of_step
from lagrange_cli.simulate.problem import InitialValueProblem, groups, running_scales
from lagrange_cli.simulate.rows import Grid, thinned
from lagrange_cli.simulate.run import Run
from lagrange_cli.simulate.sight import Place, Sight, longest_step
from lagrange_cli.simulate.stiffness import probe
from lagrange_cli.simulate.watch import Watch

__all__ = [
    "COARSE",
    "FIRST_STEP",
    "LEAST",
    "Pilot",
    "explicit_method",
    "pilot",
    "pilot_or_before",
    "suits_gauss",
]

#: Relative tolerance of the coarse run, and those of further ones where it is no use.
COARSE = 1e-5
COARSE_TOLERANCES = (COARSE, 1e-8, 1e-11)

#: A motion is close to the origin where it takes steps of less than this part of the longest so
#: far, and too close for a coarse run within so many tolerances of the scales.
SHORT, TOO_CLOSE = 0.05, 1e3

#: Least absolute tolerance: scales may underflow, tolerances must not.
LEAST = 1e-290

#: Steps that are made one by one, until their length has settled; later a few are
#: made before tolerances are looked at again.
START, FEW = 12, 16

#: A run is lost that would need more steps than this at the pace of its last ones, so many: where
#: it is coarse it may fall into a singularity that the motion passes.
MOST_STEPS, WINDOW = 1e9, 2**14

#: How much longer than those of other runs its steps may be: it shows scales alone.
LONGER = 2.0

#: A motion of fewer steps than this, by what is seen of it (:mod:`.sight`), is followed at the
#: tolerance to come at once.
FEW_STEPS = 16

#: How much longer than without sight steps must become for it to be worth to look, unless they
#: are as long as they may be but for such a part.
WORTH, FULL = 1.5, 0.9

#: The first step as a part of the span; steps grow tenfold from there.
FIRST_STEP = 1e-8

#: Part of accelerations that may change in the first step, by how much it is shortened where more
#: does, and the least part of the time or the span that is tried.
STEADY, SHRINK, SMALLEST_STEP = 0.5, 0.125, 1e-15

#: A step beside the time in which accelerations stay about what they are.
STEADY_STEPS = 0.1

#: States at which rounding of the right-hand side is looked at.
NOISE_SAMPLES = 16

#: Numbers of the samples of the coarse run, where those that are asked for are not in memory.
MOST = 2**20

#: Right-hand sides after which the explicit run pauses to ask whether the system is stiff.
PROBE_AFTER = 20_000

#: The tolerance from which on Gauss16 takes about as few right-hand sides as DOP853, or fewer;
#: side by side, eight cost little more than one or two.
FINE = 2e-11


@dataclass(frozen=True)
class Pilot:
    """What the coarse run found.

    ``scales`` of q and q̇ so far at each sample it reached, shape (samples,
    2n); ``method`` for the runs to come, an explicit one or, where stiff, an
    implicit one; ``first_step`` and ``longest_step`` for them. ``noise`` is the rounding error of a
    step so far, at samples equally far apart, shape (NOISE_SAMPLES at most,
    2n): a tolerance below it would only chase rounding. Each of its samples stands for
    ``stride`` of those that are asked for. ``closest`` is how close to the
    origin each coordinate came in short steps, as a part of the scales, shape (2n,).
    """

    scales: Array
    noise: Array
    closest: Array
    method: type[Integrator]
    first_step: float
    longest_step: float
    evaluations: int
    stride: int = 1

    def scales_so_far(self, samples: int) -> Array:
        """The scales within a number of samples."""
        return np.asarray(self.scales[min(self._own(samples), len(self.scales)) - 1])

    def _own(self, samples: int) -> int:
        """How many of its samples are within a number of samples."""
        return -(-samples // self.stride)

    @property
    def relative_noise(self) -> float:
        """The typical noise beside the scales, of the component where it is largest."""
        # The median; numpy.median would import much.
        ascending, middle = np.sort(self.noise, axis=0), (len(self.noise) - 1) / 2
        median = (ascending[math.floor(middle)] + ascending[math.ceil(middle)]) / 2
        typical = median / self.scales[-1]
        return float(np.max(typical, initial=0.0, where=np.isfinite(typical)))

    def noise_so_far(self, samples: int) -> Array:
        """The noise within a number of samples."""
        part = min(self._own(samples) / len(self.scales), 1.0)
        return np.asarray(self.noise[round(part * (len(self.noise) - 1))])

    def finer(self, factor: float) -> Pilot:
        """The same found with arithmetic whose rounding is that part of doubles'."""
        return replace(self, noise=factor * self.noise)

    def state(self) -> State:
        """The same as plain values."""
        numbers = {field.name: getattr(self, field.name) for field in fields(self)}
        return {**numbers, "method": self.method.name}

    @classmethod
    def restored(cls, state: State) -> Pilot:
        """What :meth:`state` was made of."""
        return cls(**{**state, "method": INTEGRATORS[state["method"]]})

    @property
    def stiff(self) -> bool:
        return self.method.implicit


def pilot_or_before(
    problem: InitialValueProblem, tolerance: float, watch: Watch, *, looks: bool = False
) -> Pilot:
    """What the pilot finds, or found before a run was interrupted that goes on."""
    before = None if watch.keeper is None else watch.keeper.before
    if before is not None:
        return Pilot.restored(before["pilot"])
    return pilot(problem, tolerance, watch, looks=looks)


def pilot(
    problem: InitialValueProblem, tolerance: float, watch: Watch, *, looks: bool = False
) -> Pilot:
    """Run coarsely over the whole problem; ``tolerance`` is what the finer runs will use.

    Where it ``looks``, steps are as long as :mod:`.sight` shows that they may be.
    """
    many = isinstance(problem.times, Grid)
    stride = -(-len(problem.times) * len(problem.y0) // MOST) if many else 1
    problem, spent = replace(problem, times=thinned(problem.times, stride)), 0
    sight = Sight(problem)
    reach = sight.first(_Tracker(problem, watch, COARSE).places[0]) if looks else 0.0
    for coarse in COARSE_TOLERANCES:
        tracker, run, method, more = _tracked(problem, coarse, tolerance, reach, watch)
        spent += more
        while not tracker.shown(seen := tracker.see(sight, tolerance)):
            reach = seen
            tracker, run, method, more = _tracked(problem, coarse, tolerance, reach, watch)
            spent += more
        reach = seen
        if not tracker.too_close:
            break
    longest = longest_step(problem, reach)
    if longest > problem.longest_step:
        method = _method_of_tame(problem, method, tolerance, tracker.few)
    scales, noise = tracker.scales(run), _noise(problem, run, tracker.step_at)
    closest, first_step = tracker.closest, tracker.first_step
    return Pilot(scales, noise, closest, method, first_step, longest, spent, stride)


def _method_of_tame(
    problem: InitialValueProblem, method: type[Integrator], tolerance: float, few: bool
) -> type[Integrator]:
    """What takes the fewest right-hand sides where long steps lead through a motion: few of them
    do not pay a higher order, whose many stages do elsewhere though they are not side by side."""
    names = "DOP853", "Gauss16"
    suits = isinstance(problem.rhs, NativeRhs) and pieces(problem.rhs) is None
    if method.name not in names or not suits:
        return method
    return INTEGRATORS[names[tolerance <= FINE and not few]]


def _tracked(
    problem: InitialValueProblem, coarse: float, tolerance: float, reach: float, watch: Watch
) -> tuple[_Tracker, Run, type[Integrator], int]:
    """A coarse run with sight of so much, the method for further ones, and what both cost."""
    few = longest_step(problem, reach) * FEW_STEPS > problem.span
    tracker = _Tracker(problem, watch, min(coarse, tolerance) if few else coarse, reach)
    run, method, trial = _followed(problem, tracker, tolerance, watch)
    return tracker, run, method, trial + run.evaluations


def _followed(
    problem: InitialValueProblem, tracker: _Tracker, tolerance: float, watch: Watch
) -> tuple[Run, type[Integrator], int]:
    """A coarse run to the end, the method for further ones, and what it cost to find that."""
    run, method = tracker.explicit, explicit_method(problem, tolerance)
    if tracker.go(run, PROBE_AFTER) or tracker.too_close:
        return run, method, 0
    least = NOISE_PART * noise_of_step(problem, run.t, run.y, tracker.step_at(run.t))
    probed = probe(problem, run.t, run.y, tolerance, tracker.seen(), least, watch)
    spent = probed.evaluations
    if probed.stiff:
        method, spent = INTEGRATORS["Radau"], spent + run.evaluations
        run = tracker.implicit()
    tracker.go(run, None)
    return run, method, spent


def suits_gauss(rhs: Rhs) -> bool:
    """Whether Gauss16 has what makes it fast: stages side by side, and no rows of inputs, which
    make steps so short that DOP853 is cheaper."""
    return isinstance(rhs, NativeRhs) and rhs.lanes_address is not None and pieces(rhs) is None


def suits_taylor(rhs: Rhs, size: int) -> bool:
    """Whether series that heyoka compiles stand in for a compiler of C: it is installed, and the
    right-hand side can be written in expressions."""
    return not isinstance(rhs, NativeRhs) and Taylor.suits(rhs, size)


def explicit_method(problem: InitialValueProblem, tolerance: float) -> type[Integrator]:
    """The method for motion that is not stiff."""
    if suits_taylor(problem.rhs, len(problem.y0)):
        return INTEGRATORS["taylor"]
    fits = tolerance <= FINE and suits_gauss(problem.rhs)
    return INTEGRATORS["Gauss16" if fits else "DOP853"]


def _noise(problem: InitialValueProblem, run: Run, step_at: Callable[[float], float]) -> Array:
    """How far rounding moves a step of mean size, or of the size there if smaller, so far."""
    if run.steps == 0:
        return np.zeros((1, len(problem.y0)))
    picked = np.linspace(0, run.filled - 1, NOISE_SAMPLES).round().astype(int)
    most = min(run.mean_step, problem.longest_step)
    steady, each = _steady(problem, most), []
    for k in picked.tolist():
        t = float(problem.times[k])
        # At the start steps are short because motion that begins has no scale yet.
        least = STEADY_STEPS * steady if k == 0 else 0.0
        h = min(max(step_at(t), least), most)
        each.append(noise_of_step(problem, t, run.states[k], h))
    return np.maximum.accumulate(np.array(each), axis=0)


def _steady(problem: InitialValueProblem, most: float) -> float:
    """A time, no longer than ``most``, in which accelerations stay about what they are at the
    start, beside the largest of their kind."""
    n, t, y = len(problem.kinds), problem.start, problem.y0
    push, h = problem.rhs(t, y)[n:], most
    while h > SMALLEST_STEP * max(problem.span, abs(t)):
        change = np.abs(problem.rhs(t + h, _fallen(y, push, h))[n:] - push)
        if all(
            change[alike].max() <= STEADY * np.abs(push[alike]).max()
            for alike in groups(problem.kinds)
        ):
            break
        h *= SHRINK
    return h


def _fallen(y: Array, push: Array, h: float) -> Array:
    """Where the state is after a time with accelerations as they are."""
    n = len(push)
    return np.concatenate([y[:n] + h * y[n:] + h * h / 2 * push, y[n:] + h * push])


def _first_step(problem: InitialValueProblem, push: Array) -> float:
    """A part of the span in which accelerations stay what they are at the start, if they matter.

    Else what they are there, times that step, would be no scale of what follows (a comet that
    starts at its perihelion).
    """
    n, t, y = len(problem.kinds), problem.start, problem.y0
    rest, h = y[n:], FIRST_STEP * problem.span
    while h > SMALLEST_STEP * max(problem.span, abs(t)):
        change = np.abs(problem.rhs(t + h, _fallen(y, push, h))[n:] - push)
        steady = change <= STEADY * np.abs(push)
        if (steady | (h * np.abs(push) <= np.abs(rest))).all():
            break
        h *= SHRINK
    return h


class _Tracker:
    """Scales that grow with the motion, since nothing is known of it before.

    ``tolerance`` is relative to them; ``first_step`` is the length that steps settle at.
    """

    def __init__(
        self, problem: InitialValueProblem, watch: Watch, tolerance: float, reach: float = 0.0
    ) -> None:
        self._problem, self._watch, self._tolerance = problem, watch, tolerance
        self._reach, self._widest = reach, 0.0
        self._longest, self._closest = 0.0, np.ones(len(problem.kinds))
        n = len(problem.kinds)
        rest = problem.y0[n:]
        push = problem.rhs(problem.start, problem.y0)[n:]
        longest = longest_step(problem, reach)
        h = longest if reach else _first_step(problem, push)
        first = np.concatenate([np.abs(rest) * h + np.abs(push) * (h * h), np.abs(push) * h])
        first = np.where(np.isfinite(first), first, 0.0)
        self._moved = np.stack([np.zeros_like(first), first])
        self._atol = np.maximum(self._tolerance * self.seen(), LEAST)
        control = Control(
            # Positions count from the start: an offset of the origin is no scale.
            rtol=np.repeat([0.0, tolerance], n),
            atol=self._atol,
            first_step=h,
            max_step=longest if reach else LONGER * longest,
            autonomous=problem.autonomous,
        )
        self._control = control
        self.first_step = h
        self._ends: list[float] = []
        self._steps: list[float] = []
        self.explicit = Run(INTEGRATORS["DOP853"], problem, control)
        self.places = [Place(problem.start, self.explicit.y, self.explicit.began)]

    def seen(self) -> Array:
        """Scales of the motion so far."""
        n = len(self._problem.kinds)
        states = self._moved.copy()
        states[:, n:] = np.maximum(states[:, n:], np.abs(self._problem.y0[n:]))
        return np.asarray(running_scales(self._problem, states)[-1])

    def step_at(self, t: float) -> float:
        """The mean length of the few steps that were made around a time."""
        if t <= self._problem.start or not self._steps:
            return self.first_step
        return self._steps[min(bisect_left(self._ends, t), len(self._steps) - 1)]

    def implicit(self) -> Run:
        self._ends, self._steps = [], []
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
            before, done = run.t, run.steps - first
            at_once = 1 if self._reach else min(1 + done // FEW, FEW)
            goes_on = run.advance(len(problem.times), at_once)
            if self._reach:
                self._go_to(run, before)
            if not goes_on:
                self._end(run)
                return True
            cut = self._reach and self.places[-2].t > before
            if first == 0 and done == (0 if self._reach else START - 1) and not cut:
                self.first_step = run.t - before
            elif done >= START:
                self._note(run, (run.t - before) / max(run.steps - first - done, 1))
                if self.too_close:
                    return False
            if run.steps - counted >= WINDOW:
                if (run.t - reached) * MOST_STEPS < WINDOW * problem.span:
                    return True
                counted, reached = run.steps, run.t
            self._watch((run.t - problem.start) / problem.span)
            moved = np.abs(run.y - problem.y0)
            moved[len(problem.kinds) :] = np.abs(run.y[len(problem.kinds) :])
            self._moved[1] = np.maximum(self._moved[1], moved)
            self._atol[:] = np.maximum(self._tolerance * self.seen(), LEAST)
        return False

    def _go_to(self, run: Run, before: float) -> None:
        """Remember where a step has led, and where contacts ended it."""
        self._widest = max(self._widest, run.t - before)
        closed = self.places[-1].closed
        for switch in run.switches:
            if switch.t > before:
                self.places.append(Place(switch.t, switch.before, closed))
                closed = switch.flags
        self.places.append(Place(run.t, run.y, closed))

    def see(self, sight: Sight, tolerance: float) -> float:
        """How far is seen from where the run has been, 0 where steps at a tolerance to come would
        be short without that."""
        finer = max(1.0, self._tolerance / tolerance) ** (1 / INTEGRATORS["DOP853"].order)
        limited = self._widest > FULL * longest_step(self._problem, self._reach)
        if self._widest < finer * WORTH * self._problem.longest_step and not limited:
            return 0.0
        return sight.along(self.places, self._reach, self.seen())

    def shown(self, reach: float) -> bool:
        """Whether to see so far is enough for the steps that were made."""
        possible = longest_step(self._problem, reach) if reach else 0.0
        return reach >= self._reach or self._widest <= possible

    @property
    def few(self) -> bool:
        """Whether few steps lead through the motion."""
        return longest_step(self._problem, self._reach) * FEW_STEPS > self._problem.span

    def _note(self, run: Run, h: float) -> None:
        """Remember the length of steps, and how far from the origin the short ones are."""
        self._ends.append(run.t)
        self._steps.append(h)
        self._longest = max(self._longest, h)
        if h < SHORT * self._longest:
            self._see(run.y, h)

    def _end(self, run: Run) -> None:
        """The start was close to the origin as well, unless the motion runs away from there."""
        if run.failure is None and self.first_step < SHORT * self._longest:
            self._see(self._problem.y0, 0.0)

    def _see(self, y: Array, h: float) -> None:
        """How far from the origin a state is, or how far its step goes, beside the scales."""
        n = len(self._problem.kinds)
        sizes, scales = np.maximum(np.abs(y[:n]), h * np.abs(y[n:])), self.seen()[:n]
        for alike in groups(self._problem.kinds):
            size = sizes[alike].max() / scales[alike].max()
            if size > 0:
                self._closest[alike] = np.minimum(self._closest[alike], size)

    @property
    def too_close(self) -> bool:
        """Whether bodies come closer to the origin than a coarse run can tell: it may take them
        to the wrong side of what attracts them. The finest run is trusted."""
        if self._tolerance == COARSE_TOLERANCES[-1]:
            return False
        near = self._closest < TOO_CLOSE * self._tolerance
        return bool((near & ~self._problem.angles).any())

    @property
    def closest(self) -> Array:
        """How close to the origin each coordinate came in short steps, others of its kind with
        it, as a part of the scales; 1 where it did not, and for velocities; shape (2n,)."""
        return np.concatenate([self._closest, np.ones_like(self._closest)])

    def scales(self, run: Run) -> Array:
        """The scales so far at each sample, or of the motion where no sample was reached."""
        if run.filled < 2:
            return self.seen()[None, :]
        return running_scales(self._problem, run.states)[1:]
