"""A conserved energy as a witness: what it disproves is not promised.

The estimate of the error compares runs with each other. What all of them step
over, a barrier narrower than a step, they do not see; the energy function may.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from lagrange_cli.simulate.integrators.base import Array

__all__ = ["energy_drift", "first_contradiction"]

#: How far beyond the accuracy's first-order effect a change must be to disprove it.
MARGIN = 8.0

#: Rounding error of an energy, relative to its parts.
ROUNDING = 1e-12

#: Samples of largest change that are looked at before all are.
SUSPECTS = 5

#: Energies of many states: t (m,), y (m, 2n) → (m, 1).
Energy = Callable[[Array, Array], Array]


def first_contradiction(
    energy: Energy, t: Array, states: Array, accuracy: float, scales: Array, kinetic: Array
) -> int | None:
    """Number of the first sample whose energy the accuracy cannot explain.

    Parameters
    ----------
    energy
        Conserved function, at many states.
    t, states
        Samples, shapes (m,) and (m, 2n).
    accuracy, scales
        Each component of a state is promised to ``accuracy·scales``, shape (2n,).
    kinetic
        The part of the energy that depends on velocities at each sample, shape (m,).
    """
    values = energy(t, states)[:, 0]
    size = max(float(np.abs(values).max()), float(np.abs(kinetic).max()))
    change = np.abs(values - values[0]) - ROUNDING * size
    moves = accuracy * scales
    start = _allowance(energy, t[0], states[0], moves)

    def contradicts(k: int) -> bool:
        allowed = MARGIN * (start + _allowance(energy, t[k], states[k], moves))
        return bool(change[k] > allowed)

    suspects = np.argsort(change)[::-1][:SUSPECTS]
    if not any(change[k] > 0 and contradicts(int(k)) for k in suspects):
        return None
    return next((k for k in range(len(t)) if change[k] > 0 and contradicts(k)), None)


def _allowance(energy: Energy, t: float, y: Array, moves: Array) -> float:
    """Largest change of the energy when each component moves by its error."""
    moved = np.concatenate([y[None, :], y + np.diag(moves), y - np.diag(moves)])
    values = energy(np.full(len(moved), t), moved)[:, 0]
    changes = np.abs(values[1:] - values[0]).reshape(2, -1)
    return float(changes.max(axis=0).sum())


def energy_drift(energy: Array, kinetic: Array) -> float | None:
    """Largest change over the largest of the kinetic parts and of what impacts took, which no
    choice of zero shifts."""
    change, size = np.abs(energy - energy[0]).max(), np.abs(kinetic).max()
    drift = float(change / size) if size > 0 else float(change)
    return drift if math.isfinite(drift) else None
