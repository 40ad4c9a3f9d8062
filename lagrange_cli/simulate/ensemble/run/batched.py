"""Batched runs: members of an ensemble in lanes of vectors.

The promise is kept as for a single run (:mod:`.accuracy.controller`): the run is compared with a
looser companion, with given numbers and operations off by their rounding. If that alone does not
show the accuracy with a wide margin, there is a second one of one order more and half the
tolerance, perturbed in another way. All are Taylor series, whose steps follow from their own
coefficients, so that no coarse run is needed before. A member for which this does not show the
accuracy is left to a single run, which has more means.
"""

from __future__ import annotations

import ctypes
import math
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.cache import Cache
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.accuracy.error_estimate import FLOOR_ULPS, error_estimate
from lagrange_cli.simulate.accuracy.measured import Measured, limiting_component
from lagrange_cli.simulate.accuracy.tuning import BATCHED
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.batched_taylor import (
    BatchedMotions,
    BatchedSamples,
    BatchedTaylor,
    TaylorSteps,
    digits_of,
)
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, EXTENDED, NativeReal
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.runs.problem import InitialValueProblem, scales_from, ulps
from lagrange_cli.simulate.system.library_sources import system_source
from lagrange_cli.simulate.system.rounding import each_off_by_one_ulp, rounding_factors
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.toolchain.shared_library import CSource, load_libraries

#: Name of the method in reports.
METHOD = "Taylor"

_Flags: TypeAlias = NDArray[np.bool_]
_Integers: TypeAlias = NDArray[np.int64]
Indices: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True)
class BatchedRuns:
    """Runs of some members in lanes of vectors.

    Attributes
    ----------
    numbers
        Numbers of the members, shape (m,).
    states
        States at the samples, shape (m, samples, 2n).
    scales
        Scales of the states, shape (m, 2n).
    estimate
        Estimated errors, relative to scales, shape (m,); infinite before a companion.
    steps, evaluations
        Steps and right-hand sides of the runs; a coefficient of the slope counts as one.
    all_evaluations
        Right-hand sides of the runs and their companions.
    companions
        States of the companions if an accuracy is promised, each shaped as ``states``.
    """

    numbers: Indices
    states: Array
    scales: Array
    estimate: Array
    steps: _Integers
    evaluations: _Integers
    all_evaluations: _Integers
    companions: tuple[Array, ...] = ()

    def only(self, which: Indices) -> BatchedRuns:
        """Return some of them; all of them are not copied."""
        return self if len(which) == len(self.numbers) else self._some(which)

    def decided(self, eps: float) -> BatchedRuns:
        """Return the runs whose estimate is below an accuracy, without companions."""
        return replace(self, companions=()).only(np.flatnonzero(self.estimate < eps))

    def undecided(self, eps: float) -> BatchedRuns:
        """Return the runs whose estimate is finite, but not below an accuracy."""
        return self.only(np.flatnonzero((self.estimate >= eps) & np.isfinite(self.estimate)))

    def in_turn(self, count: int) -> Iterator[BatchedRuns]:
        """Yield ``count`` of them at a time, not copied."""
        for first in range(0, len(self.numbers), count):
            yield self._some(slice(first, first + count))

    def _some(self, which: Indices | slice) -> BatchedRuns:
        return BatchedRuns(
            self.numbers[which],
            self.states[which],
            self.scales[which],
            self.estimate[which],
            self.steps[which],
            self.evaluations[which],
            self.all_evaluations[which],
            tuple(companion[which] for companion in self.companions),
        )


def batched_members(
    model: Model, problem: InitialValueProblem, cache: Cache
) -> BatchedMembers | None:
    """Create the batched stepper of members; None without a compiler or a Taylor form."""
    apart = (model.multipliers, model.contacts, model.surfaces, model.recordings, model.states)
    if any((*apart, model.singular, model.chart)) or not model.code.taylor:
        return None
    sources = [system_source(model.code), *_sources(model, DOUBLE)]
    try:
        functions, series, stepper = load_libraries(find_compiler(), sources, cache)
    except CompileError:
        return None
    motions = BatchedTaylor(series, stepper, _kinds(model))
    return BatchedMembers(model, problem, functions, motions, BatchedSamples(stepper), cache)


def _sources(model: Model, real: NativeReal) -> list[CSource]:
    """Return the C of a model's series, and of their stepper."""
    headers = {name: text for name, text in kernels.batched_files().items() if name.endswith(".h")}
    stepping, options = kernels.batched_files(), kernels.kernel_options(model.layout.size)
    if real is DOUBLE:
        series = {"series.c": model.code.taylor + model.code.tables, **headers}
        return [CSource(series, options), CSource(stepping, options)]
    series, options = (
        {"series.c": model.code.taylor, **headers},
        (*options, *kernels.options_of(real)),
    )
    return [CSource(files, options) for files in (series, stepping)]


def _kinds(model: Model) -> _Integers:
    numbers = [0 if kind == "angle" else 1 + model.kinds.index(kind) for kind in model.kinds]
    return np.array(numbers, np.int64)


class _Scratch(threading.local):
    """Arrays that a thread uses again and again: new memory costs more than what fills it."""

    def __init__(self) -> None:
        self._arrays: dict[str, Array] = {}

    def array(self, name: str, shape: tuple[int, ...]) -> Array:
        """Return the array of a name, whatever is in it."""
        size = math.prod(shape)
        if name not in self._arrays or self._arrays[name].size < size:
            self._arrays[name] = np.empty(size)
        return self._arrays[name][:size].reshape(shape)


@dataclass(frozen=True)
class BatchedMembers:
    """Stepper of members that differ from one model in numbers alone.

    Attributes
    ----------
    model
        Model of one member.
    problem
        Initial value problem of one member, for its sample times and kinds.
    system
        Library with the functions of the system.
    motions
        Taylor series of the system in doubles, with their stepper.
    samples
        Functions of samples.
    cache
        Keeps what is compiled.
    _scratch
        Memory of each thread.
    """

    model: Model
    problem: InitialValueProblem
    system: ctypes.CDLL
    motions: BatchedTaylor
    samples: BatchedSamples
    cache: Cache
    _scratch: _Scratch = field(default_factory=_Scratch)

    @cached_property
    def _times(self) -> Array:
        """The times of the samples."""
        return self.problem.times[:]

    @cached_property
    def wider(self) -> BatchedTaylor | None:
        """The same series in numbers wider than doubles; None if there are none."""
        if EXTENDED.epsilon >= DOUBLE.epsilon:
            return None
        try:
            series, stepper = load_libraries(
                find_compiler(), _sources(self.model, EXTENDED), self.cache
            )
        except CompileError:
            return None
        if 2.0 ** (1 - digits_of(stepper)) != EXTENDED.epsilon:
            return None
        return BatchedTaylor(series, stepper, _kinds(self.model), EXTENDED)

    def promised(
        self, eps: float, starts: Array, parameters: Array, between: Callable[[], None]
    ) -> Iterator[BatchedRuns]:
        """Yield the runs whose error is measured to be below ``eps``; then those for which wider
        arithmetic shows that it is not.

        Parameters
        ----------
        starts, parameters
            Shapes (members, 2n) and (members, parameters).
        between
            Called now and then.
        """
        left = np.arange(len(starts))
        for tolerance, real in _attempts(eps):
            motions = self.motions if real is DOUBLE else self.wider
            if len(left) == 0 or motions is None:
                continue
            members = starts[left], parameters[left]
            for attempted in self._attempt(motions, tolerance, eps, *members, between):
                runs = replace(attempted, numbers=left[attempted.numbers])
                yield runs.decided(eps)
            missing = runs.undecided(eps)
            if real is not DOUBLE:
                yield missing
            left = missing.numbers

    def measured(self, eps: float, runs: BatchedRuns, k: int) -> Measured:
        """Return the result of run k, which misses an accuracy."""
        states, *companions = (states[k] for states in (runs.states, *runs.companions))
        distances = (np.abs(companion - states) for companion in companions)
        errors = sum(w * far for w, far in zip(BATCHED.weights(2), distances, strict=True))
        estimate = error_estimate(self.problem, eps, states, errors, np.zeros(len(states)))
        return Measured(
            states=states[: estimate.samples].copy(),
            scales=estimate.scales,
            estimate=estimate.estimate,
            failure=None,
            stopped=False,
            method=METHOD,
            choice="members of an ensemble are stepped side by side",
            steps=int(runs.steps[k]),
            evaluations=int(runs.evaluations[k]),
            all_evaluations=int(runs.all_evaluations[k]),
            run_seconds=0.0,
            estimate_seconds=0.0,
            arithmetic="long double",
            limiting_component=limiting_component([estimate], eps)
            if estimate.samples < len(states)
            else None,
        )

    def unpromised(
        self, rtol: float, starts: Array, parameters: Array, between: Callable[[], None]
    ) -> BatchedRuns:
        """Return the runs that reach the end with a local tolerance."""
        steps, times = self._steps(rtol), self._times
        out = self._scratch.array("run", (len(starts), len(times), starts.shape[1]))
        run = self.motions.run("rhs", times, starts, parameters, steps, between, out)
        evaluations, scales = run.steps * steps.order, self._scales(run.states)
        every, nothing = np.arange(len(starts)), np.zeros(len(starts))
        runs = BatchedRuns(every, run.states, scales, nothing, run.steps, evaluations, evaluations)
        return runs.only(np.flatnonzero(run.filled == len(times)))

    def _steps(self, tolerance: float, higher: int = 0, longer: float = 1.0) -> TaylorSteps:
        order = round(2 - math.log(tolerance) / 2) + BATCHED.above
        return TaylorSteps(
            min(max(order, BATCHED.lowest_order), BATCHED.highest_order) + higher,
            tolerance,
            longer * self.problem.longest_step,
            BATCHED.most_steps,
        )

    def _attempt(
        self,
        motions: BatchedTaylor,
        tolerance: float,
        eps: float,
        starts: Array,
        parameters: Array,
        between: Callable[[], None],
    ) -> Iterator[BatchedRuns]:
        """Yield the runs at one tolerance that reach the end: first those that one companion shows
        to be accurate, then the others, which have two or more."""
        steps = self._steps(tolerance)
        forgiven = max(BATCHED.forgiven * eps, BATCHED.least_forgiven)
        # Slopes between the times of expansion were compared in doubles.
        glance = self._glance if motions is self.motions else 0.0
        looked = replace(steps, glance=glance, forgiven=forgiven)
        out = self._scratch.array("run", (len(starts), len(self._times), starts.shape[1]))
        run = motions.run("rhs", self._times, starts, parameters, looked, between, out)
        scales = self._scales(run.states)
        possible = (run.filled == len(self._times)) & self._above_floor(eps, starts, scales)
        evaluations, nothing = run.steps * steps.order, np.full(len(starts), np.inf)
        every = np.arange(len(starts))
        ended = BatchedRuns(every, run.states, scales, nothing, run.steps, evaluations, evaluations)
        ended = ended.only(np.flatnonzero(possible))

        def followed(
            runs: BatchedRuns, patterns: Sequence[int], companion_steps: TaylorSteps
        ) -> BatchedRuns:
            """Return runs with a further companion perturbed by each pattern."""
            if len(runs.numbers) == 0:
                return runs
            off = [
                self._perturbed(parameters[runs.numbers], pattern, motions.real)
                for pattern in patterns
            ]
            shape = (len(patterns) * len(runs.numbers), *runs.states.shape[1:])
            companions = motions.run(
                "disturbed",
                self._times,
                np.concatenate(each_off_by_one_ulp(starts[runs.numbers], tuple(patterns))),
                np.concatenate(off),
                companion_steps,
                between,
                self._scratch.array(f"companion {patterns[0]}", shape),
            )
            return self._with_companions(runs, companions, companion_steps.order)

        ended = followed(ended, [1], self._looser(steps))
        if tolerance >= BATCHED.least_of_one:
            yield ended.decided(eps)
            ended = ended.undecided(eps)
        tuning = BATCHED.attempt
        perturbed = self._steps(tuning.perturbed * tolerance, 1, tuning.perturbed_step)
        ended = followed(ended, [2], perturbed)
        if motions is self.motions and tolerance <= BATCHED.schedule.smallest_explicit:
            yield ended.decided(eps)
            ended = followed(ended.undecided(eps), BATCHED.more_patterns, perturbed)
        yield ended

    def _with_companions(
        self, runs: BatchedRuns, motions: BatchedMotions, order: int
    ) -> BatchedRuns:
        """Return runs with further companions, and with the estimate by all companions."""
        count = len(runs.numbers)
        more = range(0, len(motions.states), count)
        companions = (*runs.companions, *(motions.states[k : k + count] for k in more))
        spent = sum((motions.steps[k : k + count] for k in more), np.zeros(count, np.int64))
        return replace(
            runs,
            companions=companions,
            estimate=self._estimate(runs.states, companions, runs.scales),
            all_evaluations=runs.all_evaluations + spent * order,
        )

    def _looser(self, steps: TaylorSteps) -> TaylorSteps:
        """Loosen steps at the same order, so that errors grow with the tolerance."""
        looser = BATCHED.attempt.looser
        tolerance, longer = looser * steps.tolerance, looser ** (1 / steps.order)
        return replace(steps, tolerance=tolerance, longest=longer * steps.longest)

    def _estimate(self, states: Array, companions: tuple[Array, ...], scales: Array) -> Array:
        """Estimate the largest error of each member over its scale, (m,); infinite if a companion
        does not reach the end."""
        n = len(self.problem.kinds)
        errors = self.samples.errors(states, companions, BATCHED.weights(len(companions)))
        largest = self.samples.extent(states, from_start=False)[:, :n]
        errors[:, :n] = np.maximum(errors[:, :n], FLOOR_ULPS * ulps(largest))
        ratios = np.where(np.isnan(errors), np.inf, errors) / scales
        return np.asarray(ratios.max(axis=1, initial=0.0))

    def _perturbed(self, parameters: Array, pattern: int, real: NativeReal) -> Any:
        """Return parameters off by their rounding error, then the factors of a pattern."""
        factors = rounding_factors(self.model.code.factors, pattern, real)
        off = each_off_by_one_ulp(parameters, (pattern,))[0]
        return np.hstack([off, np.broadcast_to(factors, (len(off), len(factors)))])

    @property
    def _glance(self) -> float:
        return self.problem.span / (
            BATCHED.glances if self.problem.autonomous else BATCHED.glances_driven
        )

    def _above_floor(self, eps: float, starts: Array, scales: Array) -> _Flags:
        """Decide for each member whether doubles can hold an accuracy."""
        n = len(self.problem.kinds)
        floors = FLOOR_ULPS * ulps(starts[:, :n]) / scales[:, :n]
        least = FLOOR_ULPS * float(np.finfo(float).epsneg)
        return np.asarray(eps >= np.maximum(floors.max(axis=1), least))

    def _scales(self, states: Array) -> Array:
        extent = self.samples.extent(states, from_start=True)
        return scales_from(self.problem, extent)

    # Functions along motions.

    def table(
        self, name: str, states: Array, parameters: Array, columns: int, moving: float = 1.0
    ) -> Array:
        """Evaluate a function at the samples of members, (columns, members, samples); kept until
        the same is asked for again; velocities are taken times ``moving``."""
        out = self._scratch.array(f"{name} {moving}", (columns, *states.shape[:2]))
        return self._table(name, self._times, states, parameters, out, moving)

    def table_at_end(self, name: str, states: Array, parameters: Array, columns: int) -> Array:
        """Evaluate a function at the last sample of members, states of shape (members, 1, 2n)."""
        out = np.empty((columns, *states.shape[:2]))
        return self._table(name, self._times[-1:], states, parameters, out)

    def table_at_start(self, name: str, states: Array, parameters: Array, columns: int) -> Array:
        """Evaluate a function at any states of members, at the time of the start."""
        times = np.full(states.shape[1], self.problem.start)
        return self._table(name, times, states, parameters, np.empty((columns, *states.shape[:2])))

    def _table(
        self,
        name: str,
        times: Array,
        states: Array,
        parameters: Array,
        out: Array,
        moving: float = 1.0,
    ) -> Array:
        both: tuple[Any, Any] = None, None
        if len(out):
            both = self.system[f"system_{name}"], self._at_once.get(name)
        work = self.model.code.work
        return self.samples.table(both, times, states, parameters, work, out, moving)

    @cached_property
    def _at_once(self) -> dict[str, Any]:
        """Functions that are compiled for eight states at once, by name."""
        names = re.findall(r"^int system_(\w+)_lanes\(", self.model.code.tables, re.MULTILINE)
        return {name: self.motions.system[f"system_{name}_lanes"] for name in names}


def _attempts(eps: float) -> Iterator[tuple[float, NativeReal]]:
    """Yield the local tolerances to try, and their arithmetic."""
    smallest = BATCHED.schedule.smallest_explicit
    yield max(BATCHED.schedule.first * eps, smallest), DOUBLE
    if BATCHED.second * eps >= smallest:
        yield BATCHED.second * eps, DOUBLE
    yield BATCHED.wider, EXTENDED
