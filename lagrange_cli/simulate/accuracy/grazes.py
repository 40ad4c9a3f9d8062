"""Gaps that almost close, or only just do: where runs cannot tell which, and whether it matters.

A gap with a least value φ that is known to δ may have been struck at a speed of √(2 φ̈ (|φ| + δ)),
which is much larger than the errors that leave it open: what follows a graze is uncertain by their
square root.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.hybrid.contact_system import HybridRhs, NearContact

#: Units in the last place of what a gap is the difference of, and of how far things move, to which
#: no run knows it.
_ROUNDING = 32 * 2.0**-52

#: Effect of an impact, as a part of the accuracy, below which it does not matter whether there is
#: one: what follows may let it grow.
_NEGLIGIBLE = 1e-3


@dataclass(frozen=True)
class Grazes:
    """Criteria for grazes of one run.

    Attributes
    ----------
    rhs
        Right-hand sides of the system with contacts.
    eps
        Accuracy, relative to scales.
    scales
        Scales of q and q̇, shape (2n,).
    end
        Time of the last sample.
    """

    rhs: HybridRhs
    eps: float
    scales: Array
    end: float

    def margin(self, dip: NearContact, spread: float) -> float:
        """Bound the error of a gap's least value, in which runs differ by ``spread``."""
        n = len(dip.gradient)
        moves = float(np.abs(dip.gradient) @ self.scales[:n])
        return spread + _ROUNDING * (dip.size + moves)

    def most(self, dip: NearContact) -> float:
        """Bound the error of a gap within the accuracy."""
        return float(np.abs(dip.gradient) @ self.scales[: len(dip.gradient)]) * self.eps

    def matters(self, dip: NearContact, depth: float) -> bool:
        """Tell if it matters that a gap is struck which is passed by ``depth`` at most."""
        if not dip.bend > 0:
            return True
        n, speed = len(dip.gradient), np.sqrt(2 * dip.bend * depth)
        change = np.abs(self._impact(dip, speed))
        allowed = _NEGLIGIBLE * self.eps * self.scales
        speeds, places = allowed[n : 2 * n], allowed[:n]
        negligible = (change <= speeds) & (change * (self.end - dip.t) <= places)
        return not bool(negligible.all())

    def _impact(self, dip: NearContact, speed: float) -> Array:
        """Return the change of velocities at an impact of some speed, shape (n,)."""
        n, y = len(dip.gradient), dip.y.copy()
        gaps, velocities = self.rhs.gaps(dip.t, y), y[n : 2 * n]
        off = float(gaps.speeds(velocities)[0][dip.contact]) + speed
        velocities -= dip.gradient * off / (dip.gradient @ dip.gradient)
        after, _ = self.rhs.reset(dip.t, y, dip.closed, dip.contact, 1.0)
        return np.full(n, np.inf) if after is None else after[n : 2 * n] - velocities


def first_graze(
    runs: Sequence[Sequence[NearContact]], weights: Sequence[float], reached: float, grazes: Grazes
) -> tuple[float, int] | None:
    """Find when and at which contact runs first cannot tell whether it is struck, if that matters.

    Parameters
    ----------
    runs
        The dips of the run, and of those that it is compared with.
    weights
        What the distances of each run from the first count.
    reached
        How far all runs have come.
    """
    unclear = []
    for number, dips in enumerate(runs):
        for dip in dips:
            if dip.t > reached:
                continue
            spread = _spread(dip, runs, weights, grazes) if number == 0 else None
            if number and _nearest(dip, runs[0]) is None:
                spread = grazes.most(dip)
            if spread is None:
                continue
            margin = grazes.margin(dip, spread)
            depth = abs(dip.least) + margin
            if abs(dip.least) <= margin and grazes.matters(dip, depth):
                before = np.sqrt(2 * depth / dip.bend) if dip.bend > 0 else 0.0
                unclear.append((float(dip.t - before), dip.contact))
    return min(unclear, default=None)


def _spread(
    dip: NearContact,
    runs: Sequence[Sequence[NearContact]],
    weights: Sequence[float],
    grazes: Grazes,
) -> float:
    """Return the weighted distances of companions from the run in the least value of a gap."""
    spread = 0.0
    for dips, weight in zip(runs[1:], weights[1:], strict=True):
        nearest = _nearest(dip, dips)
        if nearest is None:
            return grazes.most(dip)
        spread += weight * abs(nearest.least - dip.least)
    return spread


def _nearest(dip: NearContact, among: Sequence[NearContact]) -> NearContact | None:
    """Find the dip of the same contact that is nearest in time; None without any."""
    same = (candidate for candidate in among if candidate.contact == dip.contact)
    return min(same, key=lambda candidate: abs(candidate.t - dip.t), default=None)
