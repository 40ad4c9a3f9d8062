"""Drift of a motion from the closure equations beside its coordinates."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.samples.rows import WINDOW, RowSequence, windows

#: Samples at which the change of residuals with the state is measured.
_SAMPLES = 8

#: Distance by which a state is moved for that, as a part of its scales: the error of a difference
#: quotient and its rounding are then about equal.
_MOVE = 2.0**-17

#: Residuals of many states: t (m,), y (m, 2n) → (m, k).
Constraints = Callable[[Array, Array], Array]


def constraint_drift(
    constraints: Constraints, t: RowSequence, states: RowSequence, scales: Array
) -> float | None:
    """Return the largest residual at any sample, as a part of its own scale.

    The scale of a residual c is Σ |∂c/∂y_i|·scale_i, the largest at a few samples: a drift
    of 1e-12 means that the constraint is off by what moving every coordinate (or velocity)
    by 1e-12 of its scale can do. So neither units nor the way in which a constraint is
    written matter.

    Parameters
    ----------
    constraints
        Residuals at many states.
    t, states
        Samples, shapes (m,) and (m, 2n).
    scales
        Of the numbers of a state, shape (2n,).

    Returns
    -------
    None if there are no constraints, or a residual does not exist.
    """
    parts = [np.abs(constraints(*part)).max(axis=0) for part in windows(t, states)]
    residuals = np.array(parts).max(axis=0)
    if len(residuals) == 0:
        return None
    with np.errstate(all="ignore"):
        ratios = residuals / _residual_scales(constraints, t, states, scales)
    drift = float(np.where(residuals == 0, 0.0, ratios).max())
    return drift if math.isfinite(drift) else None


def _residual_scales(
    constraints: Constraints, t: RowSequence, states: RowSequence, scales: Array
) -> Array:
    """Σ |∂c/∂y_i|·scale_i of each residual c, the largest at a few samples."""
    picked = np.unique(np.linspace(0, len(states) - 1, _SAMPLES).round().astype(int)).tolist()
    times, at = np.array([t[k] for k in picked]), np.array([states[k] for k in picked])
    total, block = 0.0, max(1, WINDOW // (2 * at.size))
    for first in range(0, len(scales), block):
        rows = min(block, len(scales) - first)
        moves = _MOVE * scales * np.eye(rows, len(scales), first)[:, None]
        moved = np.concatenate([at + moves, at - moves])
        every = constraints(np.tile(times, len(moved)), moved.reshape(-1, len(scales)))
        above, below = every.reshape(2, rows, len(at), -1)
        total = total + (np.abs(above - below) / (2 * _MOVE)).sum(axis=0)
    return np.asarray(np.max(total, axis=0))
