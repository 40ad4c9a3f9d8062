"""Shapes of springs, dampers, supports and hatchings as polylines, in centimetres."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array: TypeAlias = NDArray[np.float64]

#: Half the width of a spring, and of a damper's cylinder.
_HALF_WIDTH = 0.15
#: Length of a turn of a spring; a spring has between 3 and 14 of them.
_TURN = 0.22
_HATCH, _BETWEEN_HATCHES = 0.16, 0.16


def across(direction: Array) -> Array:
    """Return the direction turned left by a right angle."""
    return np.array([-direction[1], direction[0]])


def spring(start: Array, end: Array) -> Array:
    """Return the zigzag of a spring, with straight ends, shape (P, 2)."""
    length = float(np.linalg.norm(end - start))
    if length < 4 * _HALF_WIDTH:
        return np.array([start, end])
    return coiled(start, end, coils(length))


def coils(length: float) -> int:
    """Return the number of turns of a spring."""
    return min(14, max(3, round(0.75 * length / _TURN)))


def coiled(start: Array, end: Array, turns: int) -> Array:
    """Return the zigzag of a spring of so many turns, shape (2 turns + 4, 2)."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length if length > 0 else np.array([1.0, 0.0])
    lead = 0.125 * length
    marks = lead + (length - 2 * lead) * (np.arange(2 * turns) + 0.5) / (2 * turns)
    sides = _HALF_WIDTH * (-1.0) ** np.arange(2 * turns)
    zigzag = start + marks[:, None] * along + sides[:, None] * across(along)
    return np.array([start, start + lead * along, *zigzag, end - lead * along, end])


def rope(start: Array, end: Array, slack: float) -> Array:
    """Return a rope that hangs through below its chord, shape (13, 2); ``slack`` is √(l² − d²).

    The parabola is that of a rope nearly taut, whose sag is √(3 (l² − d²)/16).
    """
    parts = np.linspace(0, 1, 13)[:, None]
    sag = 0.433 * slack * 4 * parts * (1 - parts)
    hanging: Array = start + parts * (end - start) - sag * np.array([0.0, 1.0])
    return hanging


def damper(start: Array, end: Array) -> list[Array]:
    """Return the lines of a cylinder with its piston."""
    length = float(np.linalg.norm(end - start))
    if length < 4 * _HALF_WIDTH:
        return [np.array([start, end])]
    along = (end - start) / length
    side = _HALF_WIDTH * across(along)
    middle, half = (start + end) / 2, min(0.25, length / 6) * along
    bottom, piston, mouth = middle - half, middle + 0.2 * half, middle + half
    return [
        np.array([start, bottom]),
        np.array([mouth + side, bottom + side, bottom - side, mouth - side]),
        np.array([piston + 0.75 * side, piston - 0.75 * side]),
        np.array([piston, end]),
    ]


def support(at: Array) -> list[Array]:
    """Return the lines of a fixed pivot: a triangle that stands on hatched ground."""
    corners = at + np.array([[0.0, 0.0], [-0.16, -0.26], [0.16, -0.26]])
    ground = at + np.array([[-0.28, -0.26], [0.28, -0.26]])
    return [np.array([*corners, corners[0]]), ground, *hatching(ground, left=False)]


def hanger(at: Array) -> list[Array]:
    """Return the lines of a fixed pivot below its ground, from which something hangs."""
    return [2 * at - line for line in support(at)]


def fastening(at: Array) -> list[Array]:
    """Return a small cross: a fixed place among many."""
    return [at + np.array([[-d, -0.06], [d, 0.06]]) for d in (-0.06, 0.06)]


def hatching(line: Array, *, left: bool) -> list[Array]:
    """Return slanted ticks along a polyline, on its left or on its right."""
    lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
    marks = np.concatenate([[0.0], np.cumsum(lengths)])
    ticks = []
    for mark in np.arange(0.5 * _BETWEEN_HATCHES, marks[-1], _BETWEEN_HATCHES):
        k = int(np.searchsorted(marks, mark)) - 1
        part = (mark - marks[k]) / lengths[k]
        at = line[k] + part * (line[k + 1] - line[k])
        along = (line[k + 1] - line[k]) / lengths[k]
        outward = across(along) if left else -across(along)
        ticks.append(np.array([at, at + _HATCH * (0.8 * outward - 0.6 * along)]))
    return ticks
