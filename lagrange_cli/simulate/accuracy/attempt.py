"""One attempt at an accuracy: a run, and two companion runs that measure its error."""

from __future__ import annotations

import math
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.accuracy.coarse_run import COARSE, LEAST
from lagrange_cli.simulate.accuracy.error_estimate import FLOOR_ULPS, ErrorEstimate, RunningEstimate
from lagrange_cli.simulate.accuracy.event_agreement import (
    EventAgreement,
    contacts_near_end,
    event_agreement,
    first_zeno_time,
    near_toggles,
)
from lagrange_cli.simulate.accuracy.grazes import Grazes, first_graze
from lagrange_cli.simulate.accuracy.method_selection import NOISE_PART, CoarseResult
from lagrange_cli.simulate.accuracy.tuning import ATTEMPT
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, Integrator
from lagrange_cli.simulate.integrators.base import Loosening, SavedState
from lagrange_cli.simulate.integrators.hybrid.contact_system import HybridRhs
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.right_hand_side import structured
from lagrange_cli.simulate.runs.problem import InitialValueProblem, ulps
from lagrange_cli.simulate.runs.run import Failure, Run
from lagrange_cli.simulate.samples import window_rows

#: Part of the tolerance that does not shrink with |y|. A smaller one would shorten steps where a
#: component passes through zero, a larger one would resolve small values less; not tuned.
_ABSOLUTE_PART = 0.1

#: The same part at least if y comes close to 0, so that a comet's perihelion is resolved and
#: tolerances stay above rounding.
_LEAST_PART = 1e-12

#: Samples in which absolute tolerances stay as they are, in doubles and in wider arithmetic, and
#: the largest number of such stretches: as many as the blocks between two looks at the errors.
_STRETCH, _STRETCH_WIDER, _MOST_STRETCHES = 64, 4, 2**14

#: Least scale so far as a part of the last one, at each attempt: motion that grows from almost
#: nothing may need it resolved.
_SMALLEST_SCALE = (1e-9, 1e-60, 0.0)


class ToleranceSchedule:
    """Tolerances of attempt ``number`` at a problem, relative to the scales of a coarse run."""

    def __init__(self, problem: InitialValueProblem, coarse: CoarseResult, number: int) -> None:
        self._problem, self._coarse, n = problem, coarse, len(problem.kinds)
        self._smallest = _SMALLEST_SCALE[min(number, len(_SMALLEST_SCALE) - 1)]
        #: Flags of the components that sweep over their own size, shape (2n,).
        self._sweeping = np.abs(problem.y0) <= coarse.scales
        self._sweeping[:n] &= ~problem.angles
        # Part of the tolerance that does not shrink with |y|, less if y comes near 0.
        part = np.maximum(_ABSOLUTE_PART * coarse.closest, _LEAST_PART)
        stretch = _STRETCH if problem.real is DOUBLE else _STRETCH_WIDER
        stretch = max(stretch, len(problem.times) // _MOST_STRETCHES)
        #: The times at which stretches of samples begin, shape (k,).
        self._since = problem.times[::stretch]
        # Samples that are reached where stretches begin, and all of them, shape (k + 1,).
        end = len(self._since) * stretch + 2
        reached = np.minimum(np.arange(1, end, stretch), len(problem.times))
        so_far = np.maximum(coarse.scales_so_far(problem, reached), self._smallest * coarse.scales)
        #: Scales of absolute tolerances where stretches begin, and at the end, (k + 1, 2n).
        self._scales = np.where(self._sweeping, part * so_far, coarse.scales)
        #: The least absolute tolerances there, shape (k + 1, 2n).
        self._noise = NOISE_PART * coarse.noise_so_far(reached) + LEAST

    def control(
        self, method: type[Integrator], tolerance: float, first_step: float, longest: float
    ) -> Control:
        """Return tolerances and step limits of a run from its start."""
        # A component that sweeps over its own size is taken relatively, so that
        # motion of many sizes (a comet's) is resolved at each; an angle, or a
        # position far from the origin, relative to how far it moves.
        rows = np.maximum(tolerance * self._scales, self._noise)
        return Control(
            np.where(self._sweeping, tolerance, 0.0),
            rows[-1 if method.implicit else 0].copy(),
            first_step,
            longest,
            autonomous=self._problem.autonomous,
            loosening=None if method.implicit else Loosening(self._since, rows[:-1]),
        )

    @property
    def loose_at_first(self) -> bool:
        """True if the absolute tolerance at first follows a least scale, not the motion so far."""
        first = self._coarse.scales_so_far(self._problem, np.array([1]))
        return bool((first < self._smallest * self._coarse.scales).any())


@dataclass
class _March:
    """Progress of runs that advance in turn.

    Attributes
    ----------
    blocks
        Blocks of samples that all runs have passed.
    turn
        Number of the run whose turn it is.
    ended
        No run goes on.
    """

    blocks: int = 0
    turn: int = 0
    ended: bool = False


class Attempt:
    """A run with its looser and its perturbed companion, at one tolerance."""

    def __init__(
        self,
        problem: InitialValueProblem,
        eps: float,
        coarse: CoarseResult,
        tolerance: float,
        number: int,
        before: Attempt | None = None,
        last: bool = True,
    ) -> None:
        self._problem, self._eps, self._coarse = problem, eps, coarse
        self.tolerance, self._last = tolerance, last
        self._tolerances = ToleranceSchedule(problem, coarse, number)
        method = coarse.method
        # If the longest step rules instead of the tolerance, it must differ too.
        longer = ATTEMPT.looser ** (1 / method.order)
        looser = None if before is None else before.looser_for(self.arithmetic)
        self._longest = problem.longest_step
        if number > 0 and before is not None:
            self._longest = before._longest / (ATTEMPT.shorter if looser is None else longer)
        #: Runs that are not an earlier attempt's.
        self._own_runs: list[Run] = []
        self.run = self._start(method, tolerance)
        self._looser = looser or self._start(
            method, tolerance * ATTEMPT.looser, longer=longer, off=1
        )
        self._perturbed = self._start(
            self._perturbed_method(method),
            tolerance * ATTEMPT.perturbed,
            longer=ATTEMPT.perturbed_step,
            off=2,
        )
        expected = max(coarse.evaluations, ATTEMPT.few_evaluations)
        each = ATTEMPT.gauss if method is INTEGRATORS["Gauss16"] else 1.0
        self._most: float = ATTEMPT.lost * each * self._growth(tolerance) * expected
        self._march_at = _March()
        self._runs = self.run, self._looser, self._perturbed
        self._estimated: ErrorEstimate | None = None
        self.run_seconds = 0.0

    def _growth(self, tolerance: float) -> float:
        """Estimate the steps at a tolerance, as a multiple of the coarse run's."""
        # The coarse run was one of DOP853 if its method was not implicit.
        order = min(self._coarse.method.order, INTEGRATORS["DOP853"].order)
        return float(max(1.0, COARSE / tolerance) ** (1 / order))

    def _start(
        self, method: type[Integrator], tolerance: float, *, longer: float = 1.0, off: int = 0
    ) -> Run:
        """Start a run, with longest steps a multiple of the usual, perturbed by pattern ``off``."""
        problem = self._problem
        longest = longer * self._longest
        first_step = self._coarse.first_step
        if self.wider:  # where steps are made anew, those of the coarse run are much too long
            first_step /= self._growth(tolerance)
        control = self._tolerances.control(method, tolerance, first_step, longest)
        perturbed = problem.perturbed or (problem.rhs, problem.rhs)
        run = Run(
            method,
            problem,
            control,
            rhs=perturbed[off - 1] if off else None,
            y0=problem.start_off(off),
        )
        self._own_runs.append(run)
        return run

    def _perturbed_method(self, method: type[Integrator]) -> type[Integrator]:
        """Choose the perturbed companion's method: the run's, unless all steps are cut alike.

        Between two surfaces close to each other, or in a sharp peak, stages of one method fall on
        the same states, and so do the roundings of these.
        """
        cut = structured(self._problem.rhs).surfaces is not None or self._coarse.sharp
        by_gauss = method is INTEGRATORS["Gauss16"]
        return INTEGRATORS["DOP853"] if by_gauss and cut else method

    @property
    def evaluations(self) -> int:
        return sum(run.evaluations for run in self._own_runs)

    def _spent(self, run: Run) -> bool:
        return run in self._own_runs and run.evaluations > self._most

    @property
    def lost(self) -> bool:
        """True if steps have become so small that only rounding can be the reason."""
        return any(run.evaluations > self._most for run in self._own_runs)

    @property
    def arithmetic(self) -> str:
        """Name of the arithmetic of the runs."""
        return self._problem.real.name

    @property
    def wider(self) -> bool:
        """True if the arithmetic is wider than that of doubles."""
        return self._problem.real is not DOUBLE

    def go(self, watch: Callable[[float], None]) -> None:
        """Advance the runs side by side until the end, a failure, or a hopeless error."""
        samples, at, block = len(self._problem.times), self._march_at, self._block
        while not at.ended:
            goal = 1 + (at.blocks + 1) * block
            while at.turn < len(self._runs):
                self._advance(self._runs[at.turn], min(goal, samples), watch)
                at.turn += 1
            ended = goal >= samples or any(run.failure or self._spent(run) for run in self._runs)
            at.ended = ended or self._hopeless(goal - block)
            at.blocks, at.turn = at.blocks + 1, 0

    @property
    def _block(self) -> int:
        """Samples between two looks at the errors: a look costs little beside the runs."""
        samples = len(self._problem.times)
        if self.wider:
            return max(ATTEMPT.block_wider, samples // ATTEMPT.most_blocks)
        expected = self._coarse.evaluations * self._growth(self.tolerance)
        looks = min(expected / ATTEMPT.look, ATTEMPT.most_blocks)
        return max(ATTEMPT.block, math.ceil(samples / max(looks, 1)))

    def state(self) -> SavedState:
        """Return all that the runs go on from, as plain values."""
        return {
            "runs": [run.state() for run in self._own_runs],
            "march": vars(self._march_at),
            "seconds": self.run_seconds,
        }

    def restore(self, state: SavedState) -> bool:
        """Go on where an attempt at this tolerance stood; False where its samples are lost."""
        self._march_at = _March(**state["march"])
        self.run_seconds, self._estimated = state["seconds"], None
        known = True
        for run, run_state in zip(self._own_runs, state["runs"], strict=True):
            known = run.restore(run_state) and known
        return known

    def _advance(self, run: Run, samples: int, watch: Callable[[float], None]) -> None:
        started, self._estimated = time.perf_counter(), None
        start, span = self._problem.start, self._problem.span
        try:
            while run.filled < samples and not self._spent(run):
                evaluations_left = self._most - run.evaluations
                if not run.go(samples, most_evaluations=max(evaluations_left, 1.0)):
                    break
                watch((min(r.t for r in self._runs) - start) / span)
        finally:
            if run is self.run:
                self.run_seconds += time.perf_counter() - started

    @property
    def _common(self) -> int:
        """Number of samples that all runs have reached."""
        return min(run.filled for run in self._runs)

    @property
    def _reached(self) -> float:
        """Part of all samples that all runs have reached."""
        return self._common / len(self._problem.times)

    def _windows(self) -> Iterator[tuple[int, int]]:
        """Yield first and last numbers of the windows in which common samples are compared."""
        common, rows = self._common, self.run.rows
        size = common if isinstance(rows, np.ndarray) else window_rows(len(self._problem.y0))
        return ((k, min(k + size, common)) for k in range(0, common, size))

    def _errors(self, first: int, last: int, events: EventAgreement | None) -> Array:
        """Estimate the errors of samples that all runs have reached, shape (last - first, 2n)."""
        states, looser, perturbed = (run.rows[first:last] for run in self._runs)
        _, looser_weight, weight = self._weights
        errors = looser_weight * np.abs(looser - states) + weight * np.abs(perturbed - states)
        if events is not None:
            exempt = events.exempt(self._problem.times[first:last])
            errors[exempt, self._problem.layout.velocities] = 0
        for place, exempt in self.near_toggles(self._problem.times[first:last]).items():
            errors[exempt, place] = 0
        return np.asarray(errors)

    def near_toggles(self, times: Array) -> dict[int, NDArray[np.bool_]]:
        """Flag times that are as close to a change of a state with two values as runs tell it, by
        the place of the state."""
        near = ATTEMPT.close * self._eps * self._problem.span
        toggles = [run.toggles for run in self._runs]
        return near_toggles(toggles, self._weights, self._problem.until, near, times)

    @property
    def _weights(self) -> tuple[float, float, float]:
        """Weights of the distances of the run, the looser and the perturbed one from the run."""
        alone = self._looser not in self._own_runs
        weight = ATTEMPT.only_rounding_weight if alone else ATTEMPT.rounding_weight
        return 0.0, ATTEMPT.looser_weight, weight

    @property
    def events(self) -> EventAgreement | None:
        """Agreement of the runs on the events of contacts; None if there are no contacts."""
        problem, rhs = self._problem, self._problem.rhs
        if not isinstance(rhs, HybridRhs):
            return None
        switches = [run.switches for run in self._runs]
        near = ATTEMPT.close * self._eps * problem.span
        reached = [run.t for run in self._runs]
        agreed = event_agreement(switches, reached, self._weights, problem.until, near)
        grazes = Grazes(rhs, self._eps, self._coarse.scales, problem.until)
        dips = [run.grazes for run in self._runs]
        agreed = agreed.but(first_graze(dips, self._weights, min(reached), grazes))
        if not self.complete:
            return agreed
        last, n = len(problem.times) - 1, len(problem.kinds)
        errors = self._errors(last, last + 1, None)[0, :n]
        sizes = np.maximum(np.abs(problem.y0[:n]), np.abs(self.run.y[:n]))
        errors = np.maximum(errors, FLOOR_ULPS * ulps(sizes))
        return agreed.also(
            *contacts_near_end(rhs, self.run.closed, problem.until, self.run.y, errors)
        )

    def _hopeless(self, first: int) -> bool:
        """Tell if the newest errors are (far) beyond eps on any scale to be expected."""
        last = self._common
        if first >= last:
            return False
        errors = self._errors(first, last, self.events)
        seen = np.abs(self.run.rows[first:last]).max(axis=0)
        scales = np.maximum(self._coarse.scales, seen)
        beyond = (
            ATTEMPT.missed if self._reached < ATTEMPT.early and not self._last else ATTEMPT.hopeless
        )
        return bool((errors > beyond * self._eps * scales).any())

    def error_estimate(self) -> ErrorEstimate:
        """Estimate the error of the samples that all runs have reached."""
        if self._estimated is None:
            self._estimated = self._estimate()
        return self._estimated

    def _estimate(self) -> ErrorEstimate:
        events, start = self.events, self.run.rows[0]
        running = RunningEstimate(self._problem, self._eps, start)
        rhs, weights = self._problem.rhs, np.array(self._weights[1:])
        toggles = any(run.toggles for run in self._runs)
        compare = rhs.compare if isinstance(rhs, NativeRhs) and not toggles else None
        for first, last in self._windows():
            if compare is not None:
                rows = [run.rows[first:last] for run in self._runs]
                if running.add_by_last(last - first, partial(compare, rows, weights, start)):
                    continue
            times, errors = self._problem.times[first:last], self._errors(first, last, events)
            event_errors = np.zeros(len(times))
            if events is not None:
                event_errors = events.ratios(times, self._problem.span)
                event_errors[times >= first_zeno_time(self.run.switches)] = np.inf
            running.add(self.run.rows[first:last], errors, event_errors)
        return running.estimate

    @property
    def complete(self) -> bool:
        """True if all runs reached the last sample."""
        return self._common == len(self._problem.times)

    def looser_for(self, arithmetic: str) -> Run | None:
        """Return the run as looser companion of another attempt; None if its error is too large."""
        ended = self.complete and self.failure is None
        reused = ATTEMPT.reused
        if arithmetic != self.arithmetic:
            reused = ATTEMPT.reused_in_other_arithmetic
        near = ended and self.error_estimate().excess <= reused
        return self.run if near else None

    @property
    def failure(self) -> Failure | None:
        """End of the motion, if all runs agree that it ends; else None.

        Before a singularity steps may become so many that a run is given up
        there; it agrees where it stands beside one that failed.
        """
        failure = next((run.failure for run in self._runs if run.failure is not None), None)
        times = [run.t for run in self._runs]
        ended = all(run.failure is not None or self._spent(run) for run in self._runs)
        same = max(times) - min(times) <= ATTEMPT.same_end * self._problem.span
        return failure if ended and same else None

    @property
    def settled(self) -> bool:
        """True if a smaller tolerance has nothing to add."""
        reached = self.error_estimate().samples
        possible = bisect_left(self._problem.times, first_zeno_time(self.run.switches))
        if reached == possible or self.lost:
            return True
        return self.failure is not None and reached == self._common

    @property
    def loose_at_first(self) -> bool:
        """True if the absolute tolerance at first follows a least scale, not the motion so far."""
        return self._tolerances.loose_at_first

    @property
    def reduction(self) -> float:
        """Factor by which the next tolerance is smaller: the expected excess with a margin."""
        near = self.looser_for(self.arithmetic) is not None
        return ATTEMPT.looser if near else max(10 * self.expected_excess, 30.0)

    @property
    def expected_excess(self) -> float:
        """Error over eps that is expected at the end, 1 or more."""
        excess, most = self.error_estimate().excess, costing_as(ATTEMPT.most_excess, self)
        excess = max(excess, 1.0) if np.isfinite(excess) else most
        if not self.wider:
            return float(min(excess / self._reached**2, most))
        # What doubles cannot hold grows exponentially.
        growth = max(excess * self._eps / self.tolerance, 1.0)
        with np.errstate(over="ignore"):
            return float(min(excess * np.power(growth, 1 / self._reached - 1), most))


def costing_as(factor: float, attempt: Attempt) -> float:
    """Return the factor of tolerances that costs as many steps as one of DOP853's tolerances."""
    if not attempt.wider:
        return factor
    return float(factor ** (attempt.run.method.order / INTEGRATORS["DOP853"].order))
