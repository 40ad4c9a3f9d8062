"""Aiming: the initial velocity with which a promised motion comes to the other end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.studies.chebyshev import panels
from lagrange_cli.studies.path.motions import looser

if TYPE_CHECKING:
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.motions import Motions, Shot

#: Steps of Newton's method from one candidate.
_MOST_STEPS = 16

#: Panels while aiming.
_PANELS = 4

#: Accuracy that motions are promised at first, as a part of that of the path.
_SHARE = 0.1

#: Smallest singular value of the fields at the end over their largest along the path; smaller ones
#: are of directions in which the end does not move.
_MOVES = 1e-9

#: Distance from the end over the error of the motion at which no start comes closer.
_CLOSE = 4

#: Finest accuracy that motions are asked for.
_FINEST = 1e-15


@dataclass(frozen=True)
class Aim:
    """A motion that comes to the other end.

    Attributes
    ----------
    v
        Initial velocity, shape (n,).
    inner
        Accuracy that its motions are promised.
    error
        Bound of the distance from the exact path at any time, over the scales: the miss of the end
        and the errors of motions, carried along the fields.
    """

    v: Array
    inner: float
    error: float


def aimed(motions: Motions, first: End, last: End, v: Array, accuracy: float) -> Aim | None:
    """Correct an initial velocity until the path is accurate; None if it leads to no path.

    Newton's method with exact derivatives. Where the path loses digits, motions are promised with
    more of them, as far as there are any. The most accurate aim is returned, though it be less
    accurate than asked for.
    """
    times = panels(first.t, last.t, _PANELS).nodes
    inner: float | None = max(_SHARE * accuracy, _FINEST)
    best = None
    for _ in range(_MOST_STEPS):
        if inner is None or not np.isfinite(v).all():
            break
        shot = motions.shot(times, first.q, v, inner)
        if shot is None:
            # The motion may lose digits on its way.
            inner = looser(inner)
            if best is not None:
                break
            continue
        miss = shot.q[-1] - last.q
        error = path_error(shot, miss)
        if best is None or error < best.error:
            best = Aim(v, inner, error)
        if error <= accuracy:
            break
        if np.max(np.abs(miss) / shot.scales[0]) < _CLOSE * shot.estimated:
            # The rest of the miss are errors of the motion, not of its start.
            if inner <= _FINEST:
                break
            inner = max(inner * min(0.1, _SHARE * accuracy / error), _FINEST)
        v = v - _inverse(shot) @ miss
    return best


def _inverse(shot: Shot) -> Array:
    """Invert the fields at the end, except in directions in which they do not move it."""
    rows, columns = shot.scales
    scaled = shot.fields / rows[:, None] * columns
    u, s, vt = np.linalg.svd(scaled[-1])
    largest = np.max(np.linalg.norm(scaled, axis=(1, 2)))
    shares = np.where(s > _MOVES * largest, 1 / np.where(s > 0, s, 1), 0)
    return np.asarray(columns[:, None] * (vt.T * shares) @ u.T / rows)


def path_error(shot: Shot, miss: Array) -> float:
    """Bound the distance of a path from the exact one between the ends, over the scales.

    ``miss``: distance of its last configuration from the end, shape (n,).
    """
    rows, columns = shot.scales
    off = np.abs(miss) + shot.estimated * rows
    inverse = _inverse(shot)
    # The part of the miss in directions in which no initial velocity moves the end.
    beyond = np.max(np.abs(miss - shot.fields[-1] @ inverse @ miss) / rows)
    positions = np.max((np.abs(shot.fields @ inverse) @ off) / rows)
    velocities = np.max((np.abs(shot.rates @ inverse) @ off) / columns)
    return float(max(positions, velocities) + beyond) + shot.estimated
