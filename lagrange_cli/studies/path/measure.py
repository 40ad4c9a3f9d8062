"""A path measured and certified: its action, conjugate points, end, and varied paths beside it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.studies.chebyshev import Panels, panels
from lagrange_cli.studies.path.aiming import path_error
from lagrange_cli.studies.path.morse import Conjugacy, TooCoarseError, conjugacy
from lagrange_cli.studies.path.motions import looser

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.results.trajectory import Trajectory
    from lagrange_cli.studies.chebyshev import Panels
    from lagrange_cli.studies.path.aiming import Aim
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.morse import Conjugacy
    from lagrange_cli.studies.path.motions import ActionValues, Motions, Shot

#: Largest estimated error of a path, over the scales.
_LARGEST_ERROR = 1e-3

#: Steps of the integrator for each panel, the fewest panels and the most.
_STEPS_A_PANEL, _FEWEST_PANELS, _MOST_PANELS = 4, 16, 4096

#: Rounding error of a sum, relative to the sum of magnitudes.
_ROUNDING = 1e-15


@dataclass(frozen=True)
class StationaryPath:
    """One path of stationary action.

    Attributes
    ----------
    last
        Its end: other turns of an angle than those asked for are possible.
    velocity
        Initial velocity, shape (n,).
    action, action_error
        ∫ L dt, and a bound of its error.
    conjugacy
        Its kind and its conjugate points.
    reached
        Distance from the end over the scales, with the estimated error, of the motion that
        ``simulate`` promises from the start of the path.
    estimated
        Estimated distance from the exact path between the ends, over the scales.
    trajectory
        That motion, with the samples that were asked for.
    shot, panels
        The same with its Jacobi fields, at the nodes of the panels.
    """

    last: End
    velocity: Array
    action: float
    action_error: float
    conjugacy: Conjugacy
    reached: float
    estimated: float
    trajectory: Trajectory
    shot: Shot
    panels: Panels


def measured_path(
    motions: Motions, first: End, last: End, aim: Aim, accuracy: float, samples: int
) -> StationaryPath | None:
    """Measure a path; None if its motion does not come to the end.

    The action is integrated on finer and finer panels until its error is within the accuracy,
    relative to ∫ |L| dt, and until the Jacobi fields can be followed from node to node.
    """
    trajectory = _simulated(motions, first, last, aim, samples)
    if trajectory is None:
        return None
    scales = np.array([trajectory.scales[name] for name in motions.coordinates])
    end = np.array([trajectory.columns[name][-1] for name in motions.coordinates])
    reached = float(np.max(np.abs(end - last.q) / scales)) + (trajectory.estimated or 0.0)
    if not reached <= _LARGEST_ERROR:
        return None
    points = Conjugacy("undecided", None)
    for nodes in _finer(first, last, trajectory.steps):
        sampled = motions.shot(nodes.nodes, first.q, aim.v, aim.inner)
        if sampled is None:
            return None
        shot = sampled
        values = motions.action_values(shot.t, shot.q, shot.v)
        action, rough = nodes.integral(values.lagrangian)
        whole, _ = nodes.integral(np.abs(values.lagrangian))
        if not np.isfinite(whole):
            return None
        try:
            slopes = motions.slopes(shot.t, shot.q, shot.v)[1]
            points = conjugacy(shot, values.inertia, slopes, nodes)
        except TooCoarseError:
            continue
        if rough <= max(accuracy, 10 * _ROUNDING) * whole:
            break
    miss = shot.q[-1] - last.q
    estimated = path_error(shot, miss)
    if not estimated <= _LARGEST_ERROR:
        return None
    return StationaryPath(
        last=last,
        velocity=aim.v,
        action=action,
        action_error=rough + _ROUNDING * whole + _carried(values, shot, miss, nodes),
        conjugacy=points,
        reached=reached,
        estimated=estimated,
        trajectory=trajectory,
        shot=shot,
        panels=nodes,
    )


def _simulated(
    motions: Motions, first: End, last: End, aim: Aim, samples: int
) -> Trajectory | None:
    """Simulate a path from its start as accurately as possible; None if it does not end."""
    times = np.array([first.t, last.t])
    accuracy: float | None = aim.inner
    while accuracy is not None:
        trajectory = motions.simulated(times, first.q, aim.v, accuracy, samples)
        if trajectory is not None:
            return trajectory
        accuracy = looser(accuracy)
    return None


def _finer(first: End, last: End, steps: int) -> Iterator[Panels]:
    """Yield panels, first of few steps of the integrator each, which has resolved the motion."""
    count = _FEWEST_PANELS
    while count < min(steps / _STEPS_A_PANEL, _MOST_PANELS):
        count *= 2
    while count <= _MOST_PANELS:
        yield panels(first.t, last.t, count)
        count *= 2


def _carried(values: ActionValues, shot: Shot, miss: Array, nodes: Panels) -> float:
    """Bound the error of the action that comes from those of the path.

    The action is stationary but for p·δq at the end, and for velocities that are not quite those
    of the coordinates.
    """
    rows, columns = shot.scales
    at_end = np.abs(values.momenta[-1]) @ (np.abs(miss) + shot.estimated * rows)
    along = nodes.weights() @ (np.abs(values.momenta) @ columns) * shot.estimated
    return float(at_end + along)


# Variations.

#: Sines a coordinate that modes are made of, besides two for each conjugate point, and the most.
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
    lagrangian = motions.action_values(shot.t, shot.q, shot.v).lagrangian
    stationary, _ = path.panels.integral(lagrangian)
    changed = []
    for size in sizes:
        q, v = shot.q + size * variation.values, shot.v + size * variation.rates
        action, _ = path.panels.integral(motions.action_values(shot.t, q, v).lagrangian)
        changed.append(action - stationary)
    return np.array(changed)
