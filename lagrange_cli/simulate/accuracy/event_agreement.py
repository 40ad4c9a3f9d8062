"""Agreement of companion runs on the events of contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Toggles
from lagrange_cli.simulate.integrators.hybrid.contact_system import (
    TOUCHING,
    ContactMode,
    HybridRhs,
    ModeChange,
)
from lagrange_cli.simulate.integrators.hybrid.motion import LOCATED


@dataclass(frozen=True)
class UnclearContacts:
    """Contacts at which a promise ends.

    Attributes
    ----------
    time
        Time at which it ends.
    contacts
        Numbers of the contacts.
    differ
        Runs differ in what happens there; if false, in its consequences alone.
    """

    time: float
    contacts: tuple[int, ...]
    differ: bool


@dataclass(frozen=True)
class EventAgreement:
    """Events that all runs have, with the estimated errors of their times.

    Attributes
    ----------
    times, errors
        Time of each event in the first run, and its error, shape (events,).
    jumps
        Velocities change at the event, shape (events,).
    broken
        Time from which on the runs differ in what happens; infinity if they never do.
    differing
        Numbers of the contacts in which they differ from then on.
    """

    times: Array
    errors: Array
    jumps: NDArray[np.bool_]
    broken: float
    differing: tuple[int, ...] = ()

    def unclear(
        self, last_kept: float, first_lost: float, switches: Sequence[ModeChange]
    ) -> UnclearContacts | None:
        """Return the contacts at which a promise ends, between two samples of which the first is
        kept and the other is not; None if nothing happens there. ``switches`` are those of the
        first run."""
        if self.differing:
            return UnclearContacts(self.broken, self.differing, differ=True)
        between = [s for s in switches if last_kept < s.t <= first_lost]
        if not between:
            return None
        contacts = {s.contact for s in between}
        return UnclearContacts(between[0].t, tuple(sorted(contacts)), differ=False)

    def ratios(self, t: Array, span: float) -> Array:
        """Return the largest error of an event up to each time, as a part of the span, (m,)."""
        order = np.argsort(self.times)
        largest = np.maximum.accumulate(np.concatenate([[0.0], self.errors[order] / span]))
        so_far = largest[np.searchsorted(self.times[order], t, side="right")]
        return np.where(t < self.broken, so_far, np.inf)

    def but(self, graze: tuple[float, int] | None) -> EventAgreement:
        """Return it with a time from which on runs cannot tell whether a contact is struck."""
        if graze is None or graze[0] >= self.broken:
            return self
        return replace(self, broken=graze[0], differing=(graze[1],))

    def also(self, times: Array, errors: Array) -> EventAgreement:
        """Return it with jumps behind the end of the runs."""
        return replace(
            self,
            times=np.concatenate([self.times, times]),
            errors=np.concatenate([self.errors, errors]),
            jumps=np.concatenate([self.jumps, np.ones(len(times), dtype=bool)]),
        )

    def exempt(self, t: Array) -> NDArray[np.bool_]:
        """Flag the times that are as close to a jump as the error of its time."""
        times, errors = self.times[self.jumps], self.errors[self.jumps]
        if len(times) == 0:
            return np.zeros(len(t), dtype=bool)
        errors = np.maximum(errors, LOCATED * np.spacing(np.abs(times)))
        near = np.abs(t[:, None] - times[None, :]) <= errors[None, :]
        return np.asarray(near.any(axis=1))


def event_agreement(
    runs: Sequence[Sequence[ModeChange]],
    reached: Sequence[float],
    weights: Sequence[float],
    end: float = np.inf,
    near: float = 0.0,
) -> EventAgreement:
    """Compare the events of a run, the first, with those of others, contact by contact.

    So events of different contacts at one time may come in any order.

    Parameters
    ----------
    reached
        How far each run has come.
    weights
        What the distances of each run's times from the first one's count.
    end, near
        Where the runs end: an event no further before it may lie behind it for others.
    """
    matched: list[tuple[float, float, bool]] = []
    broken: dict[int, float] = {}
    until = min(reached)
    for contact in sorted({s.contact for run in runs for s in run}):
        of_contact = [[s for s in run if s.contact == contact] for run in runs]
        together = zip(*of_contact, strict=False)
        alike = list(takewhile(lambda same: len({s.kind for s in same}) == 1, together))
        at = np.array([[s.t for s in same] for same in alike]).reshape(-1, len(runs))
        errors = np.abs(at - at[:, :1]) @ np.asarray(weights)
        jumps = (any(s.jumps for s in same) for same in alike)
        matched += zip(at[:, 0].tolist(), errors.tolist(), jumps, strict=True)
        further = [run[len(alike)] for run in of_contact if len(run) > len(alike)]
        if not further:
            continue
        first = min(s.t for s in further)
        if len(further) < len(runs) and first >= end - near:
            matched.append((first, end - first, True))
        elif first <= until:
            broken[contact] = first
    times, off, struck = zip(*matched, strict=True) if matched else ((), (), ())
    begins = min(broken.values(), default=np.inf)
    return EventAgreement(
        np.array(times),
        np.array(off),
        np.array(struck, dtype=bool),
        begins,
        tuple(contact for contact, first in broken.items() if first == begins),
    )


def near_toggles(
    runs: Sequence[Toggles],
    weights: Sequence[float],
    end: float,
    near: float,
    t: Array,
) -> dict[int, NDArray[np.bool_]]:
    """Flag times that are as close to a change of a state with two values as the error of its time.

    Parameters
    ----------
    runs
        Changes of a run, and of its companions.
    weights
        What the distances of each run's times from the first one's count.
    end, near
        Where the runs end: a change no further before it may lie behind it for others.
    t
        The times, ascending, shape (m,).

    Returns
    -------
    Flags by the place of the state, each of shape (m,), of the states that change.
    """
    flags: dict[int, NDArray[np.bool_]] = {}
    for place in sorted({k for run in runs for k, _ in run}):
        times = [[s for k, s in run if k == place] for run in runs]
        at = np.array(list(zip(*times, strict=False))).reshape(-1, len(runs))
        errors = np.abs(at - at[:, :1]) @ np.asarray(weights)
        errors = np.maximum(errors, LOCATED * np.spacing(np.abs(at[:, 0])))
        further = [s for run in times for s in run[len(at) :] if s >= end - near]
        middle = np.concatenate([at[:, 0], further])
        errors = np.concatenate([errors, np.full(len(further), near)])
        first = np.searchsorted(t, middle - errors, side="left")
        behind = np.searchsorted(t, middle + errors, side="right")
        count = np.zeros(len(t) + 1, dtype=int)
        np.add.at(count, first, 1)
        np.add.at(count, behind, -1)
        flags[place] = np.cumsum(count[:-1]) > 0
    return flags


def contacts_near_end(
    rhs: HybridRhs, closed: ContactMode, t: float, y: Array, errors: Array
) -> tuple[Array, Array]:
    """Find contacts that may as well close before a run ends, at t, as behind that.

    Parameters
    ----------
    closed
        Contacts that are closed already.
    y, errors
        The last state and the errors of its coordinates, shapes (2n,) and (n,).

    Returns
    -------
    The times if what y shows goes on, and how much earlier they may be.
    """
    gaps, n = rhs.gaps(t, y), len(errors)
    speeds, sizes = gaps.speeds(y[n : 2 * n])
    noise = gaps.noise(errors)
    falls = (speeds < -TOUCHING * sizes) & (np.abs(gaps.values) <= noise) & ~np.array(closed)
    times = t - gaps.values[falls] / speeds[falls]
    return times, np.abs(times - t) + noise[falls] / np.abs(speeds[falls])


def first_zeno_time(switches: Sequence[ModeChange]) -> float:
    """Return the time at which ever shorter bounces first end; infinity without any."""
    return min((s.t for s in switches if s.kind == "zeno"), default=np.inf)
