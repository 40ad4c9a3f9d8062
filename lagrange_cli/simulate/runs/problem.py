"""The initial value problem as numbers, and the scales in which its errors are stated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Rhs
from lagrange_cli.simulate.integrators.native.landmarks import NativeLandmarks
from lagrange_cli.simulate.samples.buffer import MemoryBuffer, SampleBuffer
from lagrange_cli.simulate.samples.rows import Grid, RowSequence, windows

__all__ = [
    "InitialValueProblem",
    "RunningScales",
    "last_scales",
    "running_scales",
    "scales_from",
    "ulps",
    "unsampled_motion",
]

#: A coordinate that moves less than this part of the largest of its kind, or of how far it goes
#: between the samples, is measured by the larger one.
_SMALL_BESIDE_OTHERS = 1e-3

#: Longest step as a part of the span, and where something depends on time (a pulse).
_LONGEST_STEP, _LONGEST_STEP_DRIVEN = 1 / 128, 1 / 512


@dataclass(frozen=True)
class InitialValueProblem:
    """y' = rhs(t, y), y = [q, q̇], wanted at ``times`` (ascending, the first is the start).

    ``kinds`` has one entry a coordinate: ``angle``, or a word that coordinates
    of the same dimension share. ``disturbed`` holds two more right-hand sides in
    which every given number and every operation is off by its rounding error,
    each in its own way: what they change is what rounding may change.
    ``autonomous``: rhs does not depend on t. ``epsilon``: the distance from 1
    to the next number that rhs computes with; ``wider`` makes the same problem
    in wider arithmetic, or None where there is none, and is worth to be asked where it
    ``widens``. ``room`` gives each run a place for its samples where memory is not to hold
    them. ``read_off``: other coordinates are to be found from these. ``between`` is how far
    components go between samples that show next to nothing of it (:func:`unsampled_motion`).
    ``landmarks``: exponents of sharp functions, None where there are none, or where they are
    watched already.
    """

    rhs: Rhs
    y0: Array
    times: RowSequence
    kinds: tuple[str, ...]
    disturbed: tuple[Rhs, Rhs] | None = None
    autonomous: bool = True
    epsilon: float = 2.0**-52
    wider: Callable[[], InitialValueProblem | None] = lambda: None
    widens: bool = False
    read_off: bool = False
    room: Callable[[], SampleBuffer] | None = None
    between: Array | None = None
    landmarks: NativeLandmarks | None = None

    def samples(self) -> SampleBuffer:
        """Where a run puts its samples."""
        if self.room is None or not isinstance(self.times, Grid):
            return MemoryBuffer(len(self.times), len(self.y0))
        return self.room()

    @property
    def start(self) -> float:
        return float(self.times[0])

    @property
    def until(self) -> float:
        return float(self.times[-1])

    @property
    def span(self) -> float:
        return self.until - self.start

    @property
    def longest_step(self) -> float:
        """No step is longer, so that what is sharp in a long quiet motion is not passed unseen."""
        return self.span * (_LONGEST_STEP if self.autonomous else _LONGEST_STEP_DRIVEN)

    @cached_property
    def angles(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Which coordinates are angles, shape (n,)."""
        return np.array([kind == "angle" for kind in self.kinds])


def ulps(values: Array) -> Array:
    """One unit in the last place of |values|, 0 for 0."""
    return np.where(values == 0, 0.0, np.spacing(np.abs(values)))


@cache
def groups(kinds: tuple[str, ...]) -> list[list[int]]:
    """The numbers of the coordinates of each kind."""
    return [[i for i, k in enumerate(kinds) if k == kind] for kind in dict.fromkeys(kinds)]


def running_scales(problem: InitialValueProblem, states: Array) -> Array:
    """Scales of q and q̇ over the samples so far, for each number of samples.

    R = largest magnitude, from the start value for lengths, 1 for angles; G =
    largest R of the kind; scale(q) = max(R, 1e-3 G), 1 where all are 0;
    scale(q̇) = max(R of q̇, scale(q) / (until − from)). Of what goes a thousand times as far
    between the samples, that is G, and a thousandth of it the least scale of q̇.

    Parameters
    ----------
    states
        Shape (samples, 2n).

    Returns
    -------
    Shape (samples, 2n); the last row holds the scales of the whole.
    """
    return RunningScales(problem, states[0]).add(states)


class RunningScales:
    """:func:`running_scales` of samples that are added in parts, the first of them ``start``."""

    def __init__(self, problem: InitialValueProblem, start: Array) -> None:
        self._problem, self._start = problem, start[: len(problem.kinds)]
        self._largest = np.zeros((2, 1, len(problem.kinds)))

    def add(self, states: Array) -> Array:
        """The scales so far at each of further samples."""
        n = len(self._problem.kinds)
        moved = np.abs(states[:, :n] - self._start), np.abs(states[:, n:])
        parts = [np.concatenate(of) for of in zip(self._largest, moved, strict=True)]
        largest, speed = (np.maximum.accumulate(part, axis=0)[1:] for part in parts)
        self._largest = np.array([largest[-1:], speed[-1:]])
        return scales_from(self._problem, largest, speed)


def last_scales(problem: InitialValueProblem, states: RowSequence) -> Array:
    """The last row of :func:`running_scales`, of states that may not all be in memory."""
    scales, found = RunningScales(problem, states[0]), np.empty(0)
    for _, part in windows(problem.times, states):
        found = scales.add(part)[-1]
    return found


def scales_from(problem: InitialValueProblem, largest: Array, speed: Array) -> Array:
    """Scales from the largest motion of each coordinate and its largest speed, both (m, n)."""
    n = len(problem.kinds)
    largest = np.where(problem.angles, 1.0, largest)
    scales = np.empty((len(largest), 2 * n))
    between = np.zeros(2 * n) if problem.between is None else problem.between
    for own in groups(problem.kinds):
        of_kind = np.maximum(largest, between[:n])[:, own].max(axis=1, keepdims=True)
        scale = np.maximum(largest[:, own], _SMALL_BESIDE_OTHERS * of_kind)
        scales[:, own] = np.where(of_kind == 0, 1.0, scale)
    speed = np.maximum(speed, _SMALL_BESIDE_OTHERS * between[n:])
    scales[:, n:] = np.maximum(speed, scales[:, :n] / problem.span)
    return scales


def unsampled_motion(problem: InitialValueProblem, states: Array, moved: Array) -> Array:
    """How far components go that samples show less than a thousandth of, 0 for others, (2n,).

    Samples once a period show a coordinate always at the same place, but for rounding, which is
    no scale.

    Parameters
    ----------
    states
        At the samples, shape (m, 2n).
    moved
        The largest distances of coordinates from the start and the largest velocities, wherever
        they were seen, shape (2n,).
    """
    n = len(problem.kinds)
    shown = np.abs(np.concatenate([states[:, :n] - problem.y0[:n], states[:, n:]], axis=1))
    return np.where(shown.max(axis=0) < _SMALL_BESIDE_OTHERS * moved, moved, 0.0)
