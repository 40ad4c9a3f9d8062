"""Members of an ensemble that are stepped side by side, a lane of a vector each.

The promise is kept as for a single run (:mod:`.accuracy`): the run is compared with a looser
one of ten times its tolerance and a disturbed one, both with given numbers and operations off by
their rounding. All three are Taylor series, of one order more in the disturbed one, whose
steps follow from their own coefficients, so that no coarse run is needed before. A member
for which this does not show the accuracy is left to a single run, which has more means.
"""

from __future__ import annotations

import ctypes
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.cache import Cache
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.accuracy import Measured, obstacle
from lagrange_cli.simulate.attempt import LOOSER, LOOSER_WEIGHT, OTHER_STEPS, ROUNDING_WEIGHT
from lagrange_cli.simulate.compiler import CompileError, find_compiler
from lagrange_cli.simulate.disturbance import each_off_by_one_ulp, rounding_factors
from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.integrators.native import DOUBLE, EXTENDED, NativeReal
from lagrange_cli.simulate.integrators.side_by_side import (
    Samples,
    SideBySide,
    Steps,
    digits_of,
)
from lagrange_cli.simulate.library import Source, load
from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.problem import InitialValueProblem, scales_from, spacing
from lagrange_cli.simulate.right_hand_side import OPTIONS
from lagrange_cli.simulate.verdict import FLOOR_ULPS, verdict

__all__ = ["METHOD", "Runs", "Together", "together"]

#: What the method is called in reports.
METHOD = "Taylor"

#: The tolerances that are tried in doubles, as parts of the accuracy, and the smallest of them;
#: no second one is tried below the last.
TOLERANCES, SMALLEST_TOLERANCE, WORTHWHILE = (3e-6, 1e-7), 1e-16, 1e-16

#: The tolerance in wider arithmetic: what remains is what the last place of the start does.
WIDER_TOLERANCE = 1e-17

#: Lowest and highest order.
ORDERS = 6, 24

#: Steps of a run after which a member is left to a single run, which asks whether it is stiff.
MOST_STEPS = 20_000

#: Slopes that are looked at within the whole time, and where something depends on time.
GLANCES, GLANCES_DRIVEN = 768, 3072

#: What slopes may be off over a step, as a part of the accuracy, and at least.
FORGIVEN, FORGIVEN_AT_LEAST = 1e-2, 1e-13

#: The longest step of the disturbed run beside that of the run.
SHORTER = 0.8

Flags: TypeAlias = NDArray[np.bool_]
Integers: TypeAlias = NDArray[np.int64]
Indices: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True)
class Runs:
    """Runs of some members, by their ``numbers``: ``states`` (m, samples, 2n) and their
    ``scales`` (m, 2n); where an accuracy is promised the ``estimate`` of each, and the states
    of its two ``companions``. ``steps`` and ``evaluations`` are those of the run,
    ``all_evaluations`` those of everything; a coefficient of the slope counts as one."""

    numbers: Indices
    states: Array
    scales: Array
    estimate: Array
    steps: Integers
    evaluations: Integers
    all_evaluations: Integers
    companions: tuple[Array, Array] | None = None

    def only(self, which: Indices) -> Runs:
        """Some of them; all of them are not copied."""
        if len(which) == len(self.numbers):
            return self
        both = self.companions
        return Runs(
            self.numbers[which],
            self.states[which],
            self.scales[which],
            self.estimate[which],
            self.steps[which],
            self.evaluations[which],
            self.all_evaluations[which],
            None if both is None else (both[0][which], both[1][which]),
        )


def together(model: Model, problem: InitialValueProblem, cache: Cache) -> Together | None:
    """What steps members that differ from a model in numbers alone; None where its equations
    have no such form, or there is no compiler."""
    apart = (model.multipliers, model.contacts, model.recordings, model.singular, model.chart)
    if any(apart) or not model.code.taylor:
        return None
    system = Source({"system.c": model.code.c + model.code.lanes, **kernels.headers()}, OPTIONS)
    try:
        functions, series, stepper = load(
            find_compiler(), [system, *_sources(model, DOUBLE)], cache
        )
    except CompileError:
        return None
    motions = SideBySide(series, stepper, _kinds(model))
    return Together(model, problem, functions, motions, Samples(stepper), cache)


def _sources(model: Model, real: NativeReal) -> list[Source]:
    """The series of a model, and what steps them."""
    headers = {name: text for name, text in kernels.members().items() if name.endswith(".h")}
    stepping, options = kernels.members(), kernels.options(2 * len(model.coordinates))
    if real is DOUBLE:
        series = {"series.c": model.code.taylor + model.code.tables, **headers}
        return [Source(series, options), Source(stepping, options)]
    series, options = {"series.c": model.code.taylor, **headers}, (*options, "-DLAGRANGE_WIDE")
    return [Source(kernels.extended(files), options) for files in (series, stepping)]


def _kinds(model: Model) -> Integers:
    numbers = [0 if kind == "angle" else 1 + model.kinds.index(kind) for kind in model.kinds]
    return np.array(numbers, np.int64)


@dataclass(frozen=True)
class Together:
    """Members of one model: their times and kinds are those of ``problem``."""

    model: Model
    problem: InitialValueProblem
    system: ctypes.CDLL
    motions: SideBySide
    samples: Samples
    cache: Cache

    @cached_property
    def _times(self) -> Array:
        """Of the samples."""
        return self.problem.times[:]

    @cached_property
    def _wider(self) -> SideBySide | None:
        """The same in numbers wider than doubles, None where there are none."""
        if EXTENDED.epsilon >= DOUBLE.epsilon:
            return None
        try:
            series, stepper = load(find_compiler(), _sources(self.model, EXTENDED), self.cache)
        except CompileError:
            return None
        if 2.0 ** (1 - digits_of(stepper)) != EXTENDED.epsilon:
            return None
        return SideBySide(series, stepper, _kinds(self.model), EXTENDED)

    def promised(
        self, eps: float, starts: Array, parameters: Array, between: Callable[[], None]
    ) -> Iterator[Runs]:
        """Runs of those members whose error is measured to be below ``eps``; then of those for
        which wider arithmetic shows that it is not.

        Parameters
        ----------
        starts, parameters
            Shapes (members, 2n) and (members, parameters).
        between
            Called now and then.
        """
        left = np.arange(len(starts))
        for tolerance, real in _attempts(eps):
            motions = self.motions if real is DOUBLE else self._wider
            if len(left) == 0 or motions is None:
                continue
            runs = self._attempt(motions, tolerance, eps, starts[left], parameters[left], between)
            runs = replace(runs, numbers=left[runs.numbers])
            yield replace(runs, companions=None).only(np.flatnonzero(runs.estimate < eps))
            missed = np.flatnonzero((runs.estimate >= eps) & np.isfinite(runs.estimate))
            if real is not DOUBLE:
                yield runs.only(missed)
            left = runs.numbers[missed]

    def measured(self, eps: float, runs: Runs, k: int) -> Measured:
        """What is known of a run that misses an accuracy, number k of some."""
        assert runs.companions is not None
        own, one, other = (of[k] for of in (runs.states, *runs.companions))
        errors = LOOSER_WEIGHT * np.abs(one - own) + ROUNDING_WEIGHT * np.abs(other - own)
        found = verdict(self.problem, eps, own, errors, np.zeros(len(own)))
        return Measured(
            states=own[: found.samples].copy(),
            scales=found.scales,
            estimate=found.estimate,
            failure=None,
            stopped=False,
            method=METHOD,
            choice="members of an ensemble are stepped side by side",
            steps=int(runs.steps[k]),
            evaluations=int(runs.evaluations[k]),
            all_evaluations=int(runs.all_evaluations[k]),
            run_seconds=0.0,
            estimate_seconds=0.0,
            wider=True,
            obstacle=obstacle([found], eps) if found.samples < len(own) else None,
        )

    def unpromised(
        self, rtol: float, starts: Array, parameters: Array, between: Callable[[], None]
    ) -> Runs:
        """Runs of the members that reach the end with a local tolerance."""
        steps, times = self._steps(rtol), self._times
        run = self.motions.run("rhs", times, starts, parameters, steps, between)
        evaluations, scales = run.steps * steps.order, self._scales(run.states)
        every, nothing = np.arange(len(starts)), np.zeros(len(starts))
        runs = Runs(every, run.states, scales, nothing, run.steps, evaluations, evaluations)
        return runs.only(np.flatnonzero(run.filled == len(times)))

    def _steps(self, tolerance: float, higher: int = 0, longer: float = 1.0) -> Steps:
        order = round(2 - math.log(tolerance) / 2)
        return Steps(
            min(max(order, ORDERS[0]), ORDERS[1]) + higher,
            tolerance,
            longer * self.problem.longest_step,
            MOST_STEPS,
        )

    def _attempt(
        self,
        motions: SideBySide,
        tolerance: float,
        eps: float,
        starts: Array,
        parameters: Array,
        between: Callable[[], None],
    ) -> Runs:
        """Runs at one tolerance of those members that reach the end."""
        steps = self._steps(tolerance)
        forgiven = max(FORGIVEN * eps, FORGIVEN_AT_LEAST)
        # What happens between the times of expansion was looked at before.
        glance = self._glance if motions is self.motions else 0.0
        looked = replace(steps, glance=glance, forgiven=forgiven)
        times = self._times
        run = motions.run("rhs", times, starts, parameters, looked, between)
        scales = self._scales(run.states)
        possible = (run.filled == len(times)) & self._above_floor(eps, starts, scales)
        tried = np.flatnonzero(possible)
        own = run.states if possible.all() else run.states[tried]
        starts, parameters = starts[tried], parameters[tried]
        looser = self._looser(steps)
        disturbed = self._steps(OTHER_STEPS * tolerance, 1, SHORTER)
        one, other = (
            motions.run(
                "disturbed",
                times,
                each_off_by_one_ulp(starts, pattern),
                self._disturbed(parameters, pattern, motions.real),
                how,
                between,
            )
            for pattern, how in ((1, looser), (2, disturbed))
        )
        evaluations = run.steps[tried] * steps.order
        return Runs(
            numbers=tried,
            states=own,
            scales=scales[tried],
            estimate=self._estimate(own, one.states, other.states, scales[tried]),
            steps=run.steps[tried],
            evaluations=evaluations,
            all_evaluations=evaluations + one.steps * looser.order + other.steps * disturbed.order,
            companions=(one.states, other.states),
        )

    def _looser(self, steps: Steps) -> Steps:
        """Of the same order, so that errors are larger as tolerances are."""
        tolerance, longer = LOOSER * steps.tolerance, LOOSER ** (1 / steps.order)
        return replace(steps, tolerance=tolerance, longest=longer * steps.longest)

    def _estimate(self, own: Array, one: Array, other: Array, scales: Array) -> Array:
        """The largest estimated error of each member over its scale, infinite where a companion
        does not reach the end."""
        n = own.shape[2] // 2
        errors = self.samples.errors(own, one, LOOSER_WEIGHT, other, ROUNDING_WEIGHT)
        largest = self.samples.extent(own, from_start=False)[:, :n]
        errors[:, :n] = np.maximum(errors[:, :n], FLOOR_ULPS * spacing(largest))
        ratios = np.where(np.isnan(errors), np.inf, errors) / scales
        return np.asarray(ratios.max(axis=1, initial=0.0))

    def _disturbed(self, parameters: Array, pattern: int, real: NativeReal) -> Any:
        """Parameters off by their rounding error, then the factors of a pattern."""
        factors = rounding_factors(self.model.code.factors, pattern, real)
        off = each_off_by_one_ulp(parameters, pattern)
        return np.hstack([off, np.broadcast_to(factors, (len(off), len(factors)))])

    @property
    def _glance(self) -> float:
        return self.problem.span / (GLANCES if self.problem.autonomous else GLANCES_DRIVEN)

    def _above_floor(self, eps: float, starts: Array, scales: Array) -> Flags:
        """Whether an accuracy can be held in doubles, of each member."""
        n = len(self.problem.kinds)
        floors = FLOOR_ULPS * spacing(starts[:, :n]) / scales[:, :n]
        least = FLOOR_ULPS * float(np.finfo(float).epsneg)
        return np.asarray(eps >= np.maximum(floors.max(axis=1), least))

    def _scales(self, states: Array) -> Array:
        n = len(self.problem.kinds)
        extent = self.samples.extent(states, from_start=True)
        return scales_from(self.problem, extent[:, :n], extent[:, n:])

    # What else is known of a motion.

    def table(self, name: str, states: Array, parameters: Array, columns: int) -> Array:
        """A function of the system at the samples of members, (columns, members, samples)."""
        return self._table(name, self._times, states, parameters, columns)

    def table_at_start(self, name: str, states: Array, parameters: Array, columns: int) -> Array:
        """The same at any states of members, at the time of the start."""
        times = np.full(states.shape[1], self.problem.start)
        return self._table(name, times, states, parameters, columns)

    def _table(
        self, name: str, times: Array, states: Array, parameters: Array, columns: int
    ) -> Array:
        both: tuple[Any, Any] = None, None
        if columns:
            both = self.system[f"system_{name}"], self._at_once.get(name)
        work = self.model.code.work
        return self.samples.table(both, times, states, parameters, work, columns)

    @cached_property
    def _at_once(self) -> dict[str, Any]:
        """Functions at eight states at once, where there are such, by name."""
        names = re.findall(r"^int system_(\w+)_lanes\(", self.model.code.tables, re.MULTILINE)
        return {name: self.motions.system[f"system_{name}_lanes"] for name in names}


def _attempts(eps: float) -> Iterator[tuple[float, NativeReal]]:
    """The local tolerances to try, and in which arithmetic."""
    first, second = (part * eps for part in TOLERANCES)
    yield max(first, SMALLEST_TOLERANCE), DOUBLE
    if second >= WORTHWHILE:
        yield second, DOUBLE
    yield WIDER_TOLERANCE, EXTENDED
