"""A motion with contacts, looked at afterwards: what holds where which contacts are closed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lagrange_cli.simulate.accuracy import Measured
from lagrange_cli.simulate.constraints import constraint_drift
from lagrange_cli.simulate.contacts import ContactRhs
from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.integrators.switching import TOUCHING, Flags, Switch
from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.right_hand_side import RightHandSide
from lagrange_cli.simulate.tables import Table

__all__ = ["Along", "along", "first_penetration"]

#: How far beyond the accuracy's first-order effect a gap must be negative to disprove it.
MARGIN = 8.0


@dataclass(frozen=True)
class Along:
    """A model's functions along one motion, and what impacts took of its energy.

    ``functions`` evaluate accelerations, multipliers and constraints with the contacts that are
    closed at their time, ``contact`` with any set of them. ``lost`` is the energy after impacts
    less that before, in all, at each sample; ``gained`` the time and contacts of the first impact
    that adds energy. ``drift`` is that of :func:`.constraints.constraint_drift`.
    """

    functions: RightHandSide
    contact: ContactRhs | None
    lost: Array
    gained: tuple[float, tuple[int, ...]] | None
    drift: Callable[[Array, Array, Array], float | None]


def along(model: Model, functions: RightHandSide, t: Array, measured: Measured) -> Along:
    """The functions of a model along the samples of a motion.

    Parameters
    ----------
    t
        Times of the samples, shape (m,).
    """
    rhs = functions.rhs
    if not isinstance(rhs, ContactRhs):
        nothing = np.zeros(len(t))
        return Along(
            functions,
            None,
            nothing,
            None,
            lambda t, y, scales: constraint_drift(functions.constraints, t, y, scales),
        )
    history = _History(measured.switches, measured.began or rhs.free)
    count = len(model.multipliers) + len(rhs.free)
    moving = replace(
        functions,
        rhs=lambda t, y: rhs.side(history.at(t))(t, y),
        multipliers=_by_mode(history, lambda c: rhs.table("contact_multipliers", count, c), count),
    )
    columns = model.residuals + 2 * len(rhs.free)

    def drift(times: Array, states: Array, scales: Array) -> float | None:
        found = []
        for closed, rows in history.rows(times):
            table = rhs.table("contact_constraints", columns, closed)
            if any(closed) or model.multipliers:
                found.append(constraint_drift(table, times[rows], states[rows], scales))
        return max((x for x in found if x is not None), default=None)

    steps = _energy_steps(functions.energy, rhs, measured.switches)
    # The first sample is the start as it was given, before any impact.
    passed = [[s.change for s in steps if s.t <= time] for time in t[1:].tolist()]
    lost = np.array([0.0, *map(sum, passed)])
    gains = ((s.t, s.contacts) for s in steps if s.change > TOUCHING * s.size)
    return Along(moving, rhs, lost, min(gains, default=None), drift)


class _History:
    """Which contacts are closed when."""

    def __init__(self, switches: Sequence[Switch], began: Flags) -> None:
        self._times = [s.t for s in switches]
        self._closed = [began, *(s.flags for s in switches)]

    def at(self, t: float) -> Flags:
        return self._closed[int(np.searchsorted(self._times, t, side="right"))]

    def rows(self, t: Array) -> list[tuple[Flags, list[int]]]:
        """The numbers of the times at which each set of contacts is closed."""
        closed = [self.at(time) for time in t.tolist()]
        return [
            (of, [k for k, own in enumerate(closed) if own == of]) for of in dict.fromkeys(closed)
        ]


def _by_mode(history: _History, table: Callable[[Flags], Table], columns: int) -> Table:
    """A table whose rows are of the function for the contacts that are closed there."""

    def found(t: Array, y: Array) -> Array:
        out = np.zeros((len(t), columns))
        for closed, rows in history.rows(t):
            # Of open contacts the solution may be -0.
            out[rows] = table(closed)(t[rows], y[rows]) + 0.0
        return out

    return found


@dataclass(frozen=True)
class _EnergyStep:
    """How an impact changes the energy, and the size of what that is to be beside; infinity
    where contacts move, which may add energy."""

    t: float
    contacts: tuple[int, ...]
    change: float
    size: float


def _energy_steps(energy: Table, rhs: ContactRhs, switches: Sequence[Switch]) -> list[_EnergyStep]:
    """What each impact does to the energy."""
    impacts: dict[int, list[Switch]] = {}
    for s in switches:
        if s.jumps:
            impacts.setdefault(id(s.before), []).append(s)
    found = []
    for s, *others in impacts.values():
        states = np.array([s.before, s.after])
        before, after = energy(np.full(2, s.t), states)[:, 0].tolist()
        gaps = rhs.gaps(s.t, s.before)
        size = np.inf if gaps.rates.any() else abs(before) + abs(after)
        # A contact that its impact does not close is struck, too, where it touches.
        struck = {k for k, touches in enumerate(gaps.touching) if touches}
        struck |= {of.contact for of in (s, *others)}
        found.append(_EnergyStep(s.t, tuple(sorted(struck)), after - before, size))
    return found


def first_penetration(
    rhs: ContactRhs, t: Array, states: Array, accuracy: float, scales: Array
) -> tuple[int, tuple[int, ...]] | None:
    """Number of the first sample at which gaps are negative by more than the accuracy explains,
    and of these.

    Parameters
    ----------
    t, states
        Samples, shapes (m,) and (m, 2n).
    accuracy, scales
        Each component of a state is known to ``accuracy·scales``, shape (2n,).
    """
    count, n = len(rhs.free), states.shape[1] // 2
    values = rhs.table("gaps", 2 * count, rhs.free)(t, states)[:, :count]
    for k in np.flatnonzero((values < 0).any(axis=1)).tolist():
        gaps = rhs.gaps(float(t[k]), states[k])
        allowed = MARGIN * gaps.noise(accuracy * scales[:n])
        violated = np.flatnonzero(gaps.values < -allowed)
        if len(violated):
            return int(k), tuple(violated.tolist())
    return None
