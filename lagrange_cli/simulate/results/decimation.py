"""Curves of very many samples with as few points as a picture needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.results.columns import Sampled

#: Parts of the time: more than a picture has pixels beside each other.
_PARTS = 2000

#: Points of a path.
_PATH = 50_000


@dataclass(frozen=True)
class Decimated:
    """Samples for a picture.

    Attributes
    ----------
    curves
        Over the time: two points a part of it, with the least and the largest values there.
    path
        Samples at equal distances.
    """

    curves: Sampled
    path: Sampled


class Decimator:
    """The least and the largest value of each curve in equal parts of the time, and a path.

    Fast oscillations become a band, as they would if every sample were drawn.

    Parameters
    ----------
    start, until
        Bounds of the time.
    count
        Number of samples, or more.
    names
        Columns that are drawn; the energy is drawn as well.
    """

    def __init__(self, start: float, until: float, count: int, names: tuple[str, ...]) -> None:
        self._edges = np.linspace(start, until, _PARTS + 1)
        self._names = names
        # The last row is that of the energy.
        self._bounds = np.full((2, len(names) + 1, _PARTS), np.nan)
        self._seen, self._stride = 0, -(-count // _PATH)
        self._path: list[tuple[Array, Array]] = []

    def add(self, part: Sampled) -> None:
        """Take further samples."""
        curves = np.array([*(part.columns[name] for name in self._names), part.energy])
        inner = np.searchsorted(self._edges, part.t, side="right") - 1
        inside, firsts = np.unique(np.minimum(inner, _PARTS - 1), return_index=True)
        for bound, extreme in zip(self._bounds, (np.fmin, np.fmax), strict=True):
            bound[:, inside] = extreme(bound[:, inside], extreme.reduceat(curves, firsts, axis=1))
        first = -self._seen % self._stride
        self._seen += len(part.t)
        self._path.append((part.t[first :: self._stride], curves[:, first :: self._stride].copy()))

    def result(self) -> Decimated:
        """Return the points in place of samples."""
        seen = ~np.isnan(self._bounds[0]).all(axis=0)
        middles = (self._edges[:-1] + self._edges[1:])[seen] / 2
        bounds = self._bounds[:, :, seen].transpose(1, 2, 0).reshape(len(self._names) + 1, -1)
        times, rows = zip(*self._path, strict=True)
        return Decimated(
            self._sampled(np.repeat(middles, 2), bounds),
            self._sampled(np.concatenate(times), np.concatenate(rows, axis=1)),
        )

    def _sampled(self, t: Array, curves: Array) -> Sampled:
        *columns, energy = curves
        return Sampled(t, dict(zip(self._names, columns, strict=True)), energy, {}, {})
