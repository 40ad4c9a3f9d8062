"""Functions of a model along a motion with contacts, and its penetrations."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lagrange_cli.simulate.accuracy.measured import Measured
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.hybrid.contact_system import (
    TOUCHING,
    ContactMode,
    ModeChange,
)
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.samples import RowRanges, RowSequence, windows
from lagrange_cli.simulate.system.contacts import ContactRhs
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.simulate.system.tables import Table
from lagrange_cli.simulate.verification.drifts import constraint_drift
from lagrange_cli.state_layout import StateLayout

#: Depth of a negative gap that disproves an accuracy, as a multiple of its first-order effect.
_MARGIN = 8.0


@dataclass(frozen=True)
class MotionFunctions:
    """A model's functions along one motion, and the energy that impacts took.

    Attributes
    ----------
    functions
        Evaluate accelerations, multipliers and constraints with the contacts that are closed at
        their time.
    contact
        Evaluates them with any set of closed contacts; None without contacts.
    lost
        Times (m,) → sum of the energy after impacts less that before, until then, (m,).
    gained
        Time and contacts of the first impact that adds energy; None if none does.
    drift
        Measure of :func:`.drifts.constraint_drift`.
    layout
        Layout of a state.
    """

    functions: RightHandSide
    contact: ContactRhs | None
    lost: Callable[[Array], Array]
    gained: tuple[float, tuple[int, ...]] | None
    drift: Callable[[RowSequence, RowSequence, Array], float | None]
    layout: StateLayout


def functions_along(
    model: Model, functions: RightHandSide, start: float, measured: Measured
) -> MotionFunctions:
    """Bind the functions of a model to a motion that begins at the time ``start``."""
    rhs = functions.rhs
    if not isinstance(rhs, ContactRhs):
        return MotionFunctions(
            functions,
            None,
            lambda t: np.zeros(len(t)),
            None,
            partial(constraint_drift, functions.constraints) if model.residuals else _no_drift,
            model.layout,
        )
    history = _History(measured.switches, measured.began or rhs.free)
    count = len(model.multipliers) + len(rhs.free)
    moving = replace(
        functions,
        rhs=lambda t, y: rhs.side(history.at(t))(t, y),
        multipliers=_by_mode(history, lambda c: rhs.table("contact_multipliers", count, c), count),
    )
    columns = model.residuals + 2 * len(rhs.free)
    behind_start = _behind_the_start(measured.switches, start, rhs.free) or history

    def drift(times: RowSequence, states: RowSequence, scales: Array) -> float | None:
        drifts = []
        for closed, ranges in behind_start.ranges(times, len(states)):
            table = rhs.table("contact_constraints", columns, closed)
            if any(closed) or model.multipliers:
                rows = RowRanges(times, ranges), RowRanges(states, ranges)
                drifts.append(constraint_drift(table, *rows, scales))
        return max((x for x in drifts if x is not None), default=None)

    steps = _energy_steps(functions.energy, rhs, measured.switches)
    gains = ((s.t, s.contacts) for s in steps if s.change > TOUCHING * s.size)
    first_gain = min(gains, default=None)
    return MotionFunctions(moving, rhs, _sums(steps, start), first_gain, drift, model.layout)


def _no_drift(t: RowSequence, y: RowSequence, scales: Array) -> float | None:
    return None


def _sums(steps: Sequence[_EnergyStep], start: float) -> Callable[[Array], Array]:
    """Make the function that sums the changes until each of some times."""
    at = np.array([s.t for s in steps])
    sums = np.cumsum([0.0, *(s.change for s in steps)])

    def lost(t: Array) -> Array:
        # The first sample is the start as it was given, before any impact.
        return np.where(t == start, 0.0, sums[np.searchsorted(at, t, side="right")])

    return lost


class _History:
    """The closed contacts at each time."""

    def __init__(self, switches: Sequence[ModeChange], began: ContactMode) -> None:
        self._times = [s.t for s in switches]
        self._closed = [began, *(s.flags for s in switches)]

    def at(self, t: float) -> ContactMode:
        return self._closed[int(np.searchsorted(self._times, t, side="right"))]

    def ranges(self, t: RowSequence, count: int) -> list[tuple[ContactMode, list[tuple[int, int]]]]:
        """Return the ranges, of ``count`` times, in which each set of contacts is closed."""
        ends = [min(bisect_left(t, time), count) for time in self._times]
        by_mode: dict[ContactMode, list[tuple[int, int]]] = {}
        for closed, first, last in zip(self._closed, [0, *ends], [*ends, count], strict=True):
            if first < last:
                by_mode.setdefault(closed, []).append((first, last))
        return list(by_mode.items())


def _behind_the_start(
    switches: Sequence[ModeChange], start: float, free: ContactMode
) -> _History | None:
    """Return the history behind an impact at the start: the first sample is the state before it.
    None if there is no such impact."""
    if not any(s.jumps for s in switches if s.t == start):
        return None
    behind = float(np.nextafter(start, np.inf))
    return _History([replace(s, t=max(s.t, behind)) for s in switches], free)


def _by_mode(history: _History, table: Callable[[ContactMode], Table], columns: int) -> Table:
    """Make a table whose rows are those of the function for the contacts closed there."""

    def rows(t: Array, y: Array) -> Array:
        out = np.zeros((len(t), columns))
        for closed, ranges in history.ranges(t, len(t)):
            for first, last in ranges:
                # Of open contacts the solution may be -0.
                out[first:last] = table(closed)(t[first:last], y[first:last]) + 0.0
        return out

    return rows


@dataclass(frozen=True)
class _EnergyStep:
    """Change of the energy by an impact.

    Attributes
    ----------
    t
        Time of the impact.
    contacts
        Numbers of the contacts that are struck.
    change
        Energy after the impact less that before.
    size
        Energy that the change is compared with; infinity if contacts move, which may add energy.
    """

    t: float
    contacts: tuple[int, ...]
    change: float
    size: float


def _energy_steps(
    energy: Table, rhs: ContactRhs, switches: Sequence[ModeChange]
) -> list[_EnergyStep]:
    """Return the change of energy at each impact."""
    impacts: dict[int, list[ModeChange]] = {}
    for s in switches:
        if s.jumps:
            impacts.setdefault(id(s.before), []).append(s)
    steps = []
    for s, *others in impacts.values():
        states = np.array([s.before, s.after])
        before, after = energy(np.full(2, s.t), states)[:, 0].tolist()
        gaps = rhs.gaps(s.t, s.before)
        size = np.inf if gaps.rates.any() else abs(before) + abs(after)
        # A contact that its impact does not close is struck, too, where it touches.
        struck = {k for k, touches in enumerate(gaps.touching) if touches}
        struck |= {switch.contact for switch in (s, *others)}
        steps.append(_EnergyStep(s.t, tuple(sorted(struck)), after - before, size))
    return steps


def first_penetration(
    rhs: ContactRhs, t: RowSequence, states: RowSequence, accuracy: float, scales: Array
) -> tuple[int, tuple[int, ...]] | None:
    """Find the first sample at which gaps are negative by more than the accuracy explains.

    Parameters
    ----------
    t, states
        Samples, shapes (m,) and (m, 2n).
    accuracy, scales
        Each component of a state is known to ``accuracy·scales``, shape (2n,).

    Returns
    -------
    Number of the sample, and numbers of the contacts; None if there is none.
    """
    first = 0
    for times, part in windows(t, states):
        penetration = _penetration(rhs, times, part, accuracy * scales)
        if penetration is not None:
            return first + penetration[0], penetration[1]
        first += len(part)
    return None


def _penetration(
    rhs: ContactRhs, t: Array, states: Array, errors: Array
) -> tuple[int, tuple[int, ...]] | None:
    """Find the first penetration among a few samples, known to ``errors``, shape (2n,)."""
    count = len(rhs.free)
    every = rhs.table("gaps", 2 * count, rhs.free)(t, states)
    # Most of those that are negative are so by rounding.
    negative = every[:, :count] < -_MARGIN * (TOUCHING * every[:, count:])
    for k in np.flatnonzero(negative.any(axis=1)).tolist():
        gaps = rhs.gaps(float(t[k]), states[k])
        noise = gaps.noise(errors[: gaps.coordinates])
        violated = np.flatnonzero(gaps.values < -_MARGIN * noise)
        if len(violated):
            return int(k), tuple(violated.tolist())
    return None
