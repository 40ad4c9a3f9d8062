"""Chebyshev panels: nodes in time, and the integrals of what is known there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from lagrange_cli.simulate.arrays import Array

#: Intervals of a panel, whose nodes are the extrema of a Chebyshev polynomial; even.
DEGREE = 16


@dataclass(frozen=True)
class Panels:
    """Panels of equal length between two times.

    Attributes
    ----------
    nodes
        Times in ascending order, shape (panels · :data:`DEGREE` + 1,); panels share their ends.
    count
        Number of panels.
    """

    nodes: Array
    count: int

    @property
    def span(self) -> float:
        return float(self.nodes[-1] - self.nodes[0])

    def integral(self, values: Array) -> tuple[float, float]:
        """Integrate what has these values at the nodes, by Clenshaw and Curtis; return also the
        difference from the same with every other node, far above the error of the first."""
        rows = np.arange(self.count)[:, None] * DEGREE + np.arange(DEGREE + 1)
        half = self.span / self.count / 2
        fine = float(half * np.sum(values[rows] @ weights(DEGREE)))
        coarse = float(half * np.sum(values[rows[:, ::2]] @ weights(DEGREE // 2)))
        return fine, abs(fine - coarse)

    def weights(self) -> Array:
        """Weights of the nodes in integrals over the whole time."""
        total = np.zeros(len(self.nodes))
        for first in range(0, len(self.nodes) - 1, DEGREE):
            total[first : first + DEGREE + 1] += weights(DEGREE)
        return total * self.span / self.count / 2


def panels(start: float, end: float, count: int) -> Panels:
    """Divide a time into panels."""
    edges = np.linspace(start, end, count + 1)
    inner = (1 - np.cos(np.pi * np.arange(DEGREE) / DEGREE)) / 2
    nodes = edges[:-1, None] + np.diff(edges)[:, None] * inner
    return Panels(np.append(nodes.ravel(), end), count)


@cache
def weights(degree: int) -> Array:
    """Weights of Clenshaw and Curtis on [-1, 1] (L. N. Trefethen, *Spectral Methods in MATLAB*,
    2000, chapter 12); ``degree`` is even."""
    angles = np.pi * np.arange(degree + 1) / degree
    orders = np.arange(1, degree // 2 + 1)
    parts = np.where(orders == degree // 2, 1.0, 2.0) / (4.0 * orders**2 - 1)
    found = np.asarray(2.0 * (1 - np.cos(2 * np.outer(angles, orders)) @ parts) / degree)
    found[[0, -1]] /= 2
    return found


@cache
def interpolation_weights() -> Array:
    """Barycentric weights of the nodes of a panel (Trefethen, chapter 6)."""
    signs = np.where(np.arange(DEGREE + 1) % 2, -1.0, 1.0)
    signs[[0, -1]] /= 2
    return signs


def interpolated(nodes: Array, values: Array, t: float) -> Array:
    """Interpolate between the nodes of one panel."""
    distances = t - nodes
    if np.any(distances == 0):
        return np.asarray(values[int(np.argmin(np.abs(distances)))])
    shares = interpolation_weights() / distances
    return np.asarray(np.tensordot(shares / shares.sum(), values, 1))
