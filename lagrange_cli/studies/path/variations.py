"""Fixed-end variations of a path: modes of the second variation, and actions of varied paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.simulate.arrays import Array

if TYPE_CHECKING:
    from lagrange_cli.studies.path.motions import Motions
    from lagrange_cli.studies.path.result import StationaryPath

#: Sines a coordinate that modes are made of, beside twice as many as conjugate points, and most.
_SINES, _MOST_SINES = 8, 60

#: Largest deviation of varied paths in a picture, over the extent of the path.
_DEVIATION = 0.2


@dataclass(frozen=True)
class Variation:
    """A direction η(t) in which a path is varied, zero at both ends.

    Attributes
    ----------
    values, rates
        η and its rate at the nodes of the path, shape (m, n); over the scales of the coordinates
        its largest component is 1.
    second
        δ²S: the second derivative by ε of the action of q + ε η.
    """

    values: Array
    rates: Array
    second: float


def modes(motions: Motions, path: StationaryPath) -> list[Variation]:
    """Return the modes of the second variation in ascending order of their eigenvalues.

    Eigenfunctions of δ²S[η] = ∫ η·M(∂a/∂q η + ∂a/∂q̇ η̇ − η̈) dt beside ∫ η·M η dt, in a basis of
    sines. As many have a negative eigenvalue as there are conjugate points.
    """
    from scipy.linalg import eigh

    shot, n, span = path.shot, motions.size, path.panels.span
    count = min(_SINES + 2 * (path.conjugacy.index or 0), max(_MOST_SINES // n, _SINES))
    wave = np.pi * np.arange(1, count + 1) / span
    phases = np.outer(shot.t - shot.t[0], wave)
    sines, cosines = np.sin(phases), np.cos(phases) * wave
    scales = shot.scales[0]
    by_q, by_v = motions.slopes(shot.t, shot.q, shot.v)
    inertia = motions.action_values(shot.t, shot.q, shot.v).inertia
    # Basis: sine k of coordinate i, times its scale, in the order (k, i).
    moved = np.einsum("tk,tij->tkij", sines, by_q) + np.einsum("tk,tij->tkij", cosines, by_v)
    moved += np.einsum("tk,ij->tkij", sines * wave**2, np.eye(n))
    weights = path.panels.weights()
    forces = np.einsum("t,tij,tkjl->tkil", weights, inertia, moved)
    size = count * n
    second = np.einsum("th,tkil->hikl", sines, forces) * scales[:, None, None] * scales
    norm = np.einsum("t,th,tk,tij->hikj", weights, sines, sines, inertia)
    norm *= scales[:, None, None] * scales
    matrix = second.reshape(size, size)
    values, vectors = eigh((matrix + matrix.T) / 2, norm.reshape(size, size))
    return [
        _mode(sines, cosines, vectors[:, number].reshape(count, n), scales, value)
        for number, value in enumerate(values)
    ]


def _mode(sines: Array, cosines: Array, shares: Array, scales: Array, value: float) -> Variation:
    """Make a mode whose largest component is 1 and positive."""
    values = sines @ shares
    largest = values.ravel()[np.argmax(np.abs(values))]
    # Modes have the norm 1.
    return Variation(
        values * scales / largest, cosines @ shares * scales / largest, value / largest**2
    )


def deviation(path: StationaryPath) -> float:
    """Return how far pictures vary a path, over the scales of its coordinates."""
    extent = float(np.max(np.ptp(path.shot.q, axis=0) / path.shot.scales[0]))
    return _DEVIATION * (extent or 1.0)


def actions(motions: Motions, path: StationaryPath, variation: Variation, sizes: Array) -> Array:
    """Integrate the actions of q + ε η for some ε, less that of the path; NaN where L is not
    known."""
    shot = path.shot
    own, _ = path.panels.integral(motions.action_values(shot.t, shot.q, shot.v).lagrangian)
    changed = []
    for size in sizes:
        q, v = shot.q + size * variation.values, shot.v + size * variation.rates
        action, _ = path.panels.integral(motions.action_values(shot.t, q, v).lagrangian)
        changed.append(action - own)
    return np.array(changed)
