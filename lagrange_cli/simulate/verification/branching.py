"""Cut off a motion at a rest after which several motions may follow.

A particle may climb a hill of the shape −|x|^(3/2) and reach its top with no speed, after which
it may rest, go on or fall back (:mod:`.uniqueness`). Runs that differ by their rounding alone may
choose alike. So where a motion comes to rest at such a place, others are begun a little beside
it shortly before, with more and with less energy: where they do not come to the same end,
nothing is promised behind the place.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lagrange_cli.simulate.accuracy.controller import integrate_to_accuracy
from lagrange_cli.simulate.accuracy.measured import Disproof, Measured
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.samples import first_rows
from lagrange_cli.simulate.verification.uniqueness import UnboundedSlopes

#: An argument this small beside those on the way may reach zero. It trades trials at rests that
#: are none against rests that are overlooked: samples are coarse beside a distance that vanishes
#: as a power of time; not tuned.
_NEAR = 0.05

#: The same part of its rate.
_SLOW = 0.5

#: Samples at which rests are looked for, at least.
_LEAST_LOOKED = 500

#: Samples at which rests are looked for, at most.
_LOOKED = 4000

#: Rests that are tried.
_TRIED = 4

#: Samples of a trial.
_SAMPLES = 33

#: Samples before the rest at which a trial begins.
_BEFORE = 2

#: An argument that is never below this part of its largest value keeps away from zero.
_AWAY = 0.2

#: Samples from which on a least value is believed to show that.
_ENOUGH = 50

#: Least displacement of a trial, relative to the state before.
_LEAST = 1e-13

#: Displacement of a trial as a part of the estimated error.
_PART = 1e-2


def without_branches(
    places: UnboundedSlopes,
    problem: InitialValueProblem,
    measured: Measured,
    eps: float,
    watch: Watch,
) -> Measured:
    """Cut a motion at a rest after which several may follow.

    Parameters
    ----------
    eps
        The accuracy that is promised.
    """
    if measured.stopped or measured.failure is not None or _keeps_away(places, problem, measured):
        return measured
    count, watch = len(measured.states), watch.apart()
    fine, seen = problem, measured
    if count < _LEAST_LOOKED:
        times = np.linspace(problem.start, problem.until, _LEAST_LOOKED)
        fine = replace(problem, times=times, buffer=None)
        seen = integrate_to_accuracy(fine, eps, watch)
    for number, place in _arrivals(places, fine, seen):
        if not places.pushes_away_from(place, float(fine.times[number]), seen.states[number]):
            continue
        before = max(number - _BEFORE, 0)
        at_the_end = number == len(seen.states) - 1
        if not at_the_end and not _branches(fine, seen, before, eps, watch):
            continue
        time = float(fine.times[before])
        samples = min(count, max(bisect_left(problem.times, time), 1))
        disproof = Disproof(time, "uniqueness", where=places.where[place])
        return replace(measured, states=first_rows(measured.states, samples), disproved=disproof)
    return measured


def _keeps_away(places: UnboundedSlopes, problem: InitialValueProblem, measured: Measured) -> bool:
    """Tell whether no argument comes near zero: a rest on the way lasts for many samples, if
    there are some."""
    count = len(measured.states)
    if count < _ENOUGH:
        return False
    numbers = np.unique(np.linspace(0, count - 1, min(count, _LOOKED)).astype(int)).tolist()
    values = np.abs([_rates(places, problem, measured, k)[0] for k in numbers])
    return bool((values.min(axis=0) > _AWAY * values.max(axis=0)).all())


def _arrivals(
    places: UnboundedSlopes, problem: InitialValueProblem, measured: Measured
) -> Iterator[tuple[int, int]]:
    """Find samples at which an argument has come close to zero slowly, and its number; the
    last sample only where the motion ends there."""
    count = len(measured.states)
    numbers = np.unique(np.linspace(0, count - 1, min(count, _LOOKED)).astype(int)).tolist()
    values = np.abs([_rates(places, problem, measured, k) for k in numbers])
    ends = count < len(problem.times)
    arrivals = [
        (numbers[k], place)
        for place, (distance, rate) in enumerate(values.transpose(2, 1, 0)[:, :2])
        for k in _slow_minima(distance, rate, ends)
    ]
    return iter(sorted(arrivals)[:_TRIED])


def _slow_minima(distance: Array, rate: Array, last: bool) -> Iterator[int]:
    """Yield the indices of minima of a distance, much smaller than the largest since the minimum
    before, at a rate below those on the way; the last of all where that counts."""
    begin = 0
    for k in range(1, len(distance)):
        falls = distance[k] < distance[k - 1]
        ends = k == len(distance) - 1
        if not falls or not (last if ends else distance[k] <= distance[k + 1]):
            continue
        near = distance[k] <= _NEAR * distance[begin : k + 1].max()
        if near and rate[k] <= _SLOW * rate[begin : k + 1].max():
            yield k
        begin = k


def _rates(
    places: UnboundedSlopes, problem: InitialValueProblem, measured: Measured, k: int
) -> Array:
    t, y = float(problem.times[k]), measured.states[k]
    values = places.rates(t, y, places.sides[0](t, y)[places.n :])
    return np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)


def _branches(
    problem: InitialValueProblem, measured: Measured, before: int, eps: float, watch: Watch
) -> bool:
    """Tell if motions from states beside that of a sample come to other ends."""
    layout, y = problem.layout, measured.states[before]
    sizes = np.abs(measured.states[: before + 1]).max(axis=0)
    moves = max(_LEAST, _PART * measured.estimate) * sizes
    times = np.linspace(float(problem.times[before]), problem.until, _SAMPLES)
    ends = []
    for part in (slice(0, 0), layout.positions, layout.velocities):
        # Velocities away from zero, or towards it: with more energy, or less.
        sense = np.where(y[part] < 0, -1.0, 1.0)
        for sign in (1.0, -1.0) if part.stop else (1.0,):
            moved = y.copy()
            moved[part] += sign * sense * moves[part]
            beside_run = integrate_to_accuracy(replace(problem, y0=moved, times=times), eps, watch)
            if len(beside_run.states) < _SAMPLES:
                return not beside_run.stopped
            ends.append(beside_run.states[-1])
    return bool((np.abs(np.array(ends) - ends[0]) > 2 * eps * measured.scales).any())
