"""Conjugate points along a path, counted by the turning of its Jacobi fields.

The fields that vanish at the start span a Lagrangian plane at every time, with the frame
(D, P): D the fields, P their momenta. The eigenvalues e^{2iφ} of the unitary
W = (P + iD)(P − iD)⁻¹ pass through 1 where D is singular: in one direction only where the mass
matrix is positive definite, so that Σφ and the φ at a time tell how many conjugate points, with
their multiplicities, were passed (V. I. Arnold, *Functional Analysis and Its Applications* 1, 1967,
1). Their number is the index of the second variation (M. Morse, *The Calculus of Variations in the
Large*, 1934, chapter III).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.studies.chebyshev import DEGREE, barycentric

if TYPE_CHECKING:
    from lagrange_cli.studies.chebyshev import Panels
    from lagrange_cli.studies.path.motions import Shot

#: What a stationary path is among its neighbours.
Kind = Literal["minimum", "saddle", "degenerate", "undecided"]

#: Distance of an angle φ from a multiple of π within which an end is conjugate to the start.
_CONJUGATE = 1e-7

#: Most that an eigenvalue of W may turn from one node to the next, in radians.
_MOST_TURN = 1.5

#: Largest condition number of a frame, times the error of the fields, with which angles are known.
_KNOWN = 1e-4

#: Halvings of an interval with a conjugate point.
_HALVINGS = 48


@dataclass(frozen=True)
class Conjugacy:
    """Conjugate points of a path.

    Attributes
    ----------
    kind
        ``minimum`` without conjugate points up to the end; ``saddle`` with some before the end,
        or where the mass matrix is not positive definite; ``degenerate`` if the end is one;
        ``undecided`` if the fields are not known well enough.
    index
        Number of those between the ends, with their multiplicities; None if it is not known.
    times
        Their times, one for each.
    """

    kind: Kind
    index: int | None
    times: tuple[float, ...] = ()


class TooCoarseError(Exception):
    """Fields turn too far from one node to the next."""


def conjugacy(shot: Shot, inertia: Array, velocity_slopes: Array, panels: Panels) -> Conjugacy:
    """Count the conjugate points of a path between its ends.

    Parameters
    ----------
    shot
        The path at the nodes of the panels.
    inertia
        Mass matrix there, shape (m, n, n).
    velocity_slopes
        Derivatives of the accelerations by the velocities there, shape (m, n, n).
    panels
        The nodes.

    Raises
    ------
    TooCoarseError
        The nodes are too far apart to follow the fields.
    """
    if not all(np.isfinite(x).all() for x in (inertia, velocity_slopes, shot.rates, shot.fields)):
        return Conjugacy("undecided", None)
    if np.min(np.linalg.eigvalsh(inertia)) <= 0:
        return Conjugacy("saddle", None)
    frames = _frames(shot, inertia, velocity_slopes, panels.span)
    if not np.max(np.linalg.cond(frames)) * max(shot.estimated, 1e-16) < _KNOWN:
        return Conjugacy("undecided", None)
    # The fields vanish at the first node: from there on every φ grows from 0.
    planes = _planes(frames[1:])
    turns = _turns(planes[:-1], planes[1:])
    if max(np.max(np.abs(turns), initial=0.0), 2 * np.max(_angles(planes[0]))) > _MOST_TURN:
        raise TooCoarseError
    totals = np.sum(_angles(planes[0])) + np.append(0.0, np.cumsum(turns.sum(1) / 2))
    counts = [_passed(total, plane) for total, plane in zip(totals, planes, strict=True)]
    last = _angles(planes[-1])
    degenerate = bool(np.min(np.minimum(last, np.pi - last)) < _CONJUGATE)
    if degenerate:
        counts[-1] = counts[-2]
    times = tuple(
        _located(frames, panels, k + 1, totals[k], number)
        for k in range(len(counts) - 1)
        for number in range(counts[k], counts[k + 1])
    )
    kind: Kind = "degenerate" if degenerate else "saddle" if counts[-1] else "minimum"
    return Conjugacy(kind, counts[-1], times)


def _frames(shot: Shot, inertia: Array, velocity_slopes: Array, span: float) -> Array:
    """Return P + iD, shape (m, n, n), in units in which it is the identity at the start.

    The momenta of a field η are L_vv η̇ + L_vq η. A symmetric part of L_vq shears all planes along
    the momenta, which moves no conjugate point, and is left out; M ∂a/∂q̇ has the other part.
    """
    turning = inertia @ velocity_slopes
    gyroscopic = (turning.transpose(0, 2, 1) - turning) / 4
    momenta = inertia @ shot.rates + gyroscopic @ shot.fields
    root = np.linalg.cholesky(inertia[0])
    back = np.linalg.inv(root)
    frames = (back @ momenta + 1j / span * (root.T @ shot.fields)) @ back.T
    return np.asarray(frames)


def _planes(frames: Array) -> Array:
    """Return the unitary W of each frame."""
    # W solves W X̄ = X, and is symmetric.
    return np.asarray(np.linalg.solve(frames.conj().swapaxes(-1, -2), frames.swapaxes(-1, -2)))


def _angles(plane: Array) -> Array:
    """Return the angles φ of W, in [0, π)."""
    return np.asarray(np.angle(np.linalg.eigvals(plane)) % (2 * np.pi) / 2)


def _turns(before: Array, after: Array) -> Array:
    """Return the angles by which the eigenvalues of W turn, in (-π, π], one row a plane."""
    return np.asarray(np.angle(np.linalg.eigvals(after @ before.conj().swapaxes(-1, -2))))


def _passed(total: float, plane: Array) -> int:
    """Return the number of multiples of π that angles have passed, whose sum is ``total``."""
    return round((total - float(np.sum(_angles(plane)))) / np.pi)


def _located(frames: Array, panels: Panels, node: int, total: float, number: int) -> float:
    """Bisect between a node and the next for where conjugate point ``number`` is passed.

    ``total``: the sum of the angles at the node.
    """
    first = node // DEGREE * DEGREE
    rows = slice(first, first + DEGREE + 1)
    nodes, values = panels.nodes[rows], frames[rows]
    before, low, high = _planes(frames[node]), panels.nodes[node], panels.nodes[node + 1]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        plane = _planes(barycentric(nodes, values, middle))
        reached = total + float(np.sum(_turns(before, plane))) / 2
        if _passed(reached, plane) > number:
            high = middle
        else:
            low = middle
    return float((low + high) / 2)
