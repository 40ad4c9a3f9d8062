"""Curves of very many samples as a picture shows them: what is least and largest in each part."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.results.columns import Sampled

#: Parts of the time: more than a picture has pixels beside each other.
_PARTS = 2000


class Decimator:
    """The least and the largest value of each curve in equal parts of the time.

    Fast oscillations become a band, as they would if every sample were drawn.
    """

    def __init__(self, start: float, until: float, names: tuple[str, ...]) -> None:
        self._edges = np.linspace(start, until, _PARTS + 1)
        self._names = names
        # The last row is that of the energy.
        self._bounds = np.full((2, len(names) + 1, _PARTS), np.nan)

    def add(self, part: Sampled) -> None:
        """Take further samples."""
        curves = np.array([*(part.columns[name] for name in self._names), part.energy])
        inner = np.searchsorted(self._edges, part.t, side="right") - 1
        inside, firsts = np.unique(np.minimum(inner, _PARTS - 1), return_index=True)
        for bound, extreme in zip(self._bounds, (np.fmin, np.fmax), strict=True):
            bound[:, inside] = extreme(bound[:, inside], extreme.reduceat(curves, firsts, axis=1))

    def curves(self) -> Sampled:
        """Return two points a part, in place of samples."""
        seen = ~np.isnan(self._bounds[0]).all(axis=0)
        middles = (self._edges[:-1] + self._edges[1:])[seen] / 2
        *columns, energy = (self._both(k, seen) for k in range(len(self._names) + 1))
        named: Mapping[str, Array] = dict(zip(self._names, columns, strict=True))
        return Sampled(np.repeat(middles, 2), named, energy, {}, {})

    def _both(self, curve: int, seen: Array) -> Array:
        return np.asarray(self._bounds[:, curve, seen].T.ravel())
