"""Motions between their samples: polynomials of the state in each panel, with their errors.

A panel is the time between two samples, or a sample and an event. The state is the polynomial
through the samples around it, none beyond an event. Its distances from the polynomials through
fewer samples, whose errors are larger, bound what it leaves out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

#: Samples that a polynomial goes through, and those that it is compared with.
WIDTH, _NARROWER = 12, (10, 8)

#: Bound of the error of a polynomial over its distance from a narrower one: it is below that for
#: sines sampled at up to one and a half radians (tests/simulate/ensemble/test_kept.py).
_LARGER = 4.0

#: Rounding errors of such a polynomial in the last place of the largest sample. Not tuned.
_ROUNDING = 32 * float(np.finfo(float).eps)

#: Corrections of an inverse in wider numbers, each of which doubles its digits.
_CORRECTIONS = 2

Numbers = NDArray[np.intp]


@dataclass(frozen=True)
class Piece:
    """Samples of some motions at common times, between which no velocity jumps.

    Attributes
    ----------
    times
        Ascending, shape (nodes,).
    states
        Shape (members, nodes, 2n).
    """

    times: Array
    states: Array


@dataclass(frozen=True)
class Motions:
    """Some motions of a model in pieces of time.

    Attributes
    ----------
    pieces
        In order of time; of one motion alone there may be more than one.
    parameters
        Values of the model's parameters, shape (members, parameters).
    errors
        Promised errors of the states, shape (members, 2n); zeros if nothing is promised.
    """

    pieces: tuple[Piece, ...]
    parameters: Array
    errors: Array

    def __len__(self) -> int:
        return len(self.parameters)

    @property
    def span(self) -> tuple[float, float]:
        return float(self.pieces[0].times[0]), float(self.pieces[-1].times[-1])

    def in_turn(self, most: int) -> Iterator[tuple[slice, Motions]]:
        """Yield a few motions at a time, so that their panels are at most some number."""
        panels = sum(len(piece.times) - 1 for piece in self.pieces)
        count = max(1, most // max(panels, 1))
        for first in range(0, len(self), count):
            some = slice(first, first + count)
            pieces = tuple(Piece(p.times, p.states[some]) for p in self.pieces)
            yield some, Motions(pieces, self.parameters[some], self.errors[some])


@dataclass(frozen=True)
class Panels:
    """The panels of some motions.

    Attributes
    ----------
    edges
        First and last time of each panel, shape (panels, 2).
    coefficients
        Of the state as a polynomial in the place x from −1 to 1 in a panel, ascending, shape
        (WIDTH, 2n, members, panels).
    left_out
        Errors that the polynomials leave out, shape (2n, members, panels).
    """

    edges: Array
    coefficients: Array
    left_out: Array

    @classmethod
    def of_motions(cls, motions: Motions) -> Panels:
        parts = [_panels(piece) for piece in motions.pieces]
        edges = np.concatenate([np.stack([p.times[:-1], p.times[1:]], 1) for p in motions.pieces])
        coefficients = np.concatenate([part[0] for part in parts], axis=-1)
        return cls(edges, coefficients, np.concatenate([part[1] for part in parts], axis=-1))


def _panels(piece: Piece) -> tuple[Array, Array]:
    """Return coefficients and errors of the polynomials in all panels of a piece."""
    count = len(piece.times)
    narrower = [width if count > width else max(count - 2, 1) for width in _NARROWER]
    finer, *coarser = (_coefficients(piece, width) for width in (WIDTH, *narrower))
    near, far = (np.abs(finer - coarse).sum(axis=0) for coarse in coarser)
    # The rounding of a sum is that of the largest of the samples around.
    largest = np.abs(piece.states).max(axis=1).T[:, :, None]
    # Errors fall with the width as powers of the time between samples, of which the distance from
    # the narrowest is the eighth; by chance the distance from the next one may be small.
    with np.errstate(all="ignore"):
        falls = np.fmin(_LARGER * (far / largest) ** (2 / _NARROWER[-1]), 1.0)
    left_out = np.maximum(_LARGER * near, falls * far)
    return finer, left_out + _ROUNDING * largest


def _coefficients(piece: Piece, width: int) -> Array:
    """Return the coefficients of polynomials through ``width`` samples around each panel, shape
    (WIDTH, 2n, members, panels)."""
    width = min(width, len(piece.times))
    first, matrices = _interpolation(piece.times.tobytes(), width)
    members, _, size = piece.states.shape
    window = first[:, None] + np.arange(width)
    samples = piece.states.transpose(1, 2, 0)[window].reshape(len(first), width, -1)
    coefficients = np.zeros((WIDTH, size, members, len(first)))
    shape = len(first), width, size, members
    coefficients[:width] = (matrices @ samples).reshape(shape).transpose(1, 2, 3, 0)
    return coefficients


@lru_cache(maxsize=4)
def _interpolation(times: bytes, width: int) -> tuple[Numbers, Array]:
    """Return the first sample of the window of each panel, and matrices that make coefficients of
    the samples in windows, shape (panels, width, width)."""
    t = np.frombuffer(times)
    panels = np.arange(len(t) - 1)
    first = np.clip(panels - (width - 2) // 2, 0, len(t) - width)
    window = first[:, None] + np.arange(width)
    half = (t[1:] - t[:-1]) / 2
    middle = t[:-1] + half
    unit = (t[window[:, -1]] - t[window[:, 0]]) / 2 if width > 1 else half
    places = ((t[window] - middle[:, None]) / unit[:, None]).astype(np.longdouble)
    powers = places[..., None] ** np.arange(width)
    inverse = np.linalg.inv(powers.astype(float)).astype(np.longdouble)
    for _ in range(_CORRECTIONS):
        inverse = 2 * inverse - inverse @ (powers @ inverse)
    scaled = inverse * ((half / unit)[:, None] ** np.arange(width))[..., None]
    return first, scaled.astype(float)
