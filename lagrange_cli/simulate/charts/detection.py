"""Detection of singular configurations at the start, on the way or at the end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lagrange_cli.simulate.accuracy.coarse_run import COARSE, CoarseRun
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.model.model import ChartSingularity, Model
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.results.outcome import Status
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.runs.run import Run
from lagrange_cli.simulate.samples import Grid, RowSequence, windows
from lagrange_cli.simulate.simulation import RunContext, problem_of
from lagrange_cli.simulate.system.singular_guard import lost_rates, singular_factors
from lagrange_cli.simulate.system.tables import Table

#: A factor this small beside its largest value has vanished at the start.
_VANISHED = 1e-12

#: Distance in samples, at the last pace, within which a run counts as having arrived.
_ARRIVED = 3.0

#: Part of its largest value below which a factor makes angles lose so many digits that quaternions
#: are quicker: a heavy body to 1e-9 takes 1 s by angles at 1e-5, 4 s at 1e-6, minutes at 1e-9.
_LOCKED = 1e-5

#: Evaluations after which a coarse run is ended, of which most take a few thousand, and states
#: that are looked at together.
_EVALUATIONS, _STRETCH = 100_000, 64

#: A factor this small beside its largest value is near the singular configuration as well.
NEAR_SINGULAR = 1e-3


@dataclass(frozen=True)
class SingularPassage:
    """A singular configuration on the way of a run.

    Attributes
    ----------
    singularity
        The singular configuration.
    samples
        Number of samples before it.
    passed
        The run went past it; if false, it ended there.
    """

    singularity: ChartSingularity
    samples: int
    passed: bool


def singular_start(model: Model) -> ChartSingularity | None:
    """Return the singular configuration at which the motion begins; None if it does at none."""
    if model.initial is None:
        return None
    values = singular_factors(model)(model.defaults.start, np.array(model.initial))
    for singularity, value in zip(model.singular, values, strict=True):
        if not abs(value) > _VANISHED:
            return singularity
    return None


def gimbal_lock(model: Model, request: Request, context: RunContext) -> ChartSingularity | None:
    """Return a gimbal lock that a coarse run comes near; None if there is none, or not in memory.

    Runs that promise an accuracy resolve how angles turn there, at a cost that grows with the
    nearness, though they lose their digits: a coarse run, ended early, is enough to leave them.
    """
    numbers = [k for k, place in enumerate(model.singular) if place.is_of_turns]
    if not numbers or request.accuracy is None or isinstance(request.times, Grid):
        return None
    functions, ends = context.functions_of(model, request.budget), request.times[:][[0, -1]]
    problem = problem_of(model, replace(request, times=ends), functions)
    if not np.isfinite(problem.rhs(problem.start, problem.y0)).all():
        return None
    least, largest = np.full(len(numbers), np.inf), np.zeros(len(numbers))
    for times, states in _stretches(CoarseRun(problem, Watch(), COARSE).explicit):
        factors = np.abs(functions.singular(times, states)[:, numbers])
        least = np.minimum(least, factors.min(axis=0))
        largest = np.maximum(largest, factors.max(axis=0))
        near = np.flatnonzero(least <= _LOCKED * largest)
        if len(near):
            return model.singular[numbers[int(near[0])]]
    return None


def _stretches(run: Run) -> Iterator[tuple[Array, Array]]:
    """Yield times and states of the steps of a run, shapes (m,) and (m, 2n), some at a time."""
    goes_on = True
    while goes_on and run.evaluations < _EVALUATIONS:
        times, states = [run.t], [run.y.copy()]
        while goes_on and len(times) < _STRETCH:
            goes_on = run.advance(2, 1)
            times.append(run.t)
            states.append(run.y.copy())
        yield np.array(times), np.array(states)


def passage_of_run(model: Model, factors: Table, run: Trajectory) -> SingularPassage | None:
    """Find the first singular configuration that a run passed or ended at; None without any.

    ``factors``: :attr:`.system.functions.RightHandSide.singular`.
    """
    states = np.column_stack([run.columns[name] for name in model.state_names])
    return first_passage(model, factors, run.t, states, run.status, run.requested)


def first_passage(
    model: Model,
    factors: Table,
    times: RowSequence,
    states: RowSequence,
    status: Status,
    accuracy: float | None,
) -> SingularPassage | None:
    """Find the first singular configuration of samples (m,), (m, 2n); None without any."""
    passed, near = _barred(model, factors, times, states)
    passages = []
    for number, singularity in enumerate(model.singular):
        if near.moves[number]:
            closest = near.closest[number]
            unresolved = _unresolved(model, factors, times[closest], states[closest], number)
            if unresolved > (accuracy or NEAR_SINGULAR):
                passed.setdefault(number, closest)
                passed[number] = min(passed[number], closest)
        if number in passed:
            passages.append(SingularPassage(singularity, passed[number] + 1, passed=True))
        elif status not in ("ok", "stopped") and near.ends(number):
            passages.append(SingularPassage(singularity, len(states), passed=False))
    return min(passages, key=lambda met: met.samples, default=None)


class _Near:
    """Distances of samples from each singular configuration, added in parts, in order."""

    def __init__(self, model: Model) -> None:
        places = len(model.singular)
        self._rates = [lost_rates(model, place) for place in model.singular]
        self._seen = 0
        self._least, self._largest = np.full(places, np.inf), np.zeros(places)
        self._last = np.zeros((0, places))
        self.closest = [0] * places
        self.moves = [False] * places

    def add(self, states: Array, values: Array) -> list[tuple[int, int]]:
        """Take further states with their factors; give numbers of factors that change their
        sign, with the number of the sample before."""
        both = np.concatenate([self._last[-1:], values])
        first = self._seen - len(self._last[-1:])
        changes = np.argwhere(np.signbit(both[1:]) != np.signbit(both[:-1]))
        sizes = np.abs(values)
        for number, rates in enumerate(self._rates):
            at = int(sizes[:, number].argmin())
            if sizes[at, number] < self._least[number] or np.isnan(sizes[at, number]):
                self._least[number], self.closest[number] = sizes[at, number], self._seen + at
            self.moves[number] = self.moves[number] or bool(states[:, rates].any())
        self._largest = np.maximum(self._largest, sizes.max(axis=0))
        self._last = np.concatenate([self._last, values])[-2:]
        self._seen += len(states)
        return [(number, first + k) for k, number in changes.tolist()]

    def ends(self, number: int) -> bool:
        """Tell if a factor is about to vanish at the last sample."""
        last = abs(float(self._last[-1, number]))
        if last <= NEAR_SINGULAR * float(self._largest[number]):
            return True
        pace = abs(float(self._last[-2, number])) - last if len(self._last) > 1 else 0.0
        return pace > 0 and last <= _ARRIVED * pace


def _barred(
    model: Model, factors: Table, times: RowSequence, states: RowSequence
) -> tuple[dict[int, int], _Near]:
    """Find the sample before each singular configuration was first passed, if it was."""
    near, passed = _Near(model), dict[int, int]()
    for t, part in windows(times, states):
        for number, before in near.add(part, factors(t, part)):
            if number in passed:
                continue
            around = slice(max(before - 2, 0), min(before + 4, len(states)))
            values = factors(times[around], states[around])[:, number]
            if _is_barred(model, number, values, states[around]):
                passed[number] = before
    return passed, near


def _unresolved(model: Model, factors: Table, t: float, state: Array, number: int) -> float:
    """Return the relative change of a factor by the last places of coordinates.

    All runs that estimate the error hold coordinates there with the same few bits.
    """
    n = len(model.coordinates)
    moved_states = [state + row for row in np.diag(np.spacing(np.abs(state)))[:n]]
    times = np.full(n + 1, t)
    factor, *moved = factors(times, np.array([state, *moved_states]))[:, number].tolist()
    change = sum(abs(value - factor) for value in moved)
    return change / abs(factor) if factor else float("inf") if change else 0.0


def _is_barred(model: Model, number: int, factors: Array, states: Array) -> bool:
    """Tell if a motion that changed sides among some samples cannot have done so.

    The momentum of a coordinate that loses its inertia as the factor's square keeps its
    value: then the rate grows without bound, and the motion turns round. If instead the
    rate is steady, the momentum goes to zero as the inertia does.
    """
    inertia = factors**2
    lost = lost_rates(model, model.singular[number])
    rates = (rate for rate in states[:, lost].T if rate.any())
    return any(_spread(rate * inertia) < _spread(rate) for rate in rates)


def _spread(values: Array) -> float:
    """Return the standard deviation of numbers, relative to their size."""
    size = float(np.abs(values).mean())
    return float(values.std()) / size if size > 0 else 0.0
