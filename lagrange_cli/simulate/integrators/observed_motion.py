"""Observation of a motion step by step: its scales so far, its way, and the lengths of steps.

The tolerance of a run whose scales are not known before it follows what it has seen of them.
Compiled integrators do the same in machine code (kernels/observed.c).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lagrange_cli.simulate.arrays import Array

#: First steps whose lengths say nothing: they grow until they fit the motion.
SETTLING = 12

#: Steps whose ends there is room for between two looks at them.
ROOM = 1024

#: A motion is close to the origin if its steps are below this part of the longest so far: steps of
#: a smooth motion away from it vary by less.
BRIEF = 0.05

#: A run is lost that would need more steps than this at the pace of its last ones: if it is coarse
#: it may fall into a singularity that the motion passes.
_MOST_STEPS = 1e9

#: Number of these last steps.
WINDOW = 2**14


class ObservedMotion:
    """A motion as far as it has been observed.

    Parameters
    ----------
    y0
        State at the start, shape (2n,).
    kinds
        Coordinates that are measured together have the same word; ``angle``: by 1 each.
    span
        Time of the whole run, from ``start``.
    tolerance, least
        Absolute tolerances over scales, and the least of them.
    moved
        Motion and speeds that count as observed at the start, shape (2n,).
    nearest
        Distance from the origin over scales below which the run ends.
    scales_of
        Largest motions and speeds, shape (2n,) → scales, shape (2n,).

    Attributes
    ----------
    moved
        Largest distances from the start, and largest speeds, shape (2n,).
    scales
        Scales of the motion so far, shape (2n,).
    way
        How far coordinates went, back and forth, shape (n,).
    closest
        Least distance of each coordinate from the origin in short steps, others of its kind with
        it, relative to scales; 1 if it came no closer; shape (n,).
    atol
        Absolute tolerances, which follow the scales, shape (2n,).
    lengths
        Those of the steps, in time.
    ended
        1 if the run shall end: it is too close to the origin, or comes no further.
    """

    def __init__(
        self,
        y0: Array,
        kinds: tuple[str, ...],
        *,
        start: float,
        span: float,
        tolerance: float,
        least: float,
        moved: Array,
        nearest: float,
        scales_of: Callable[[Array], Array],
    ) -> None:
        n = len(kinds)
        numbers = {kind: number for number, kind in enumerate(dict.fromkeys(kinds))}
        self.origin, self.moved = y0[:n].copy(), moved.copy()
        self.kind = np.array([numbers[kind] for kind in kinds], dtype=np.int64)
        self.angle = np.array([float(kind == "angle") for kind in kinds])
        self.way, self.closest = np.zeros(n), np.ones(n)
        self.tolerance, self.least, self.span, self.nearest = tolerance, least, span, nearest
        self.slowest, self.since = WINDOW * span / _MOST_STEPS, start
        self._scales_of, self._start = scales_of, start
        self.scales = scales_of(self.moved)
        self.atol = np.maximum(tolerance * self.scales, least)
        self.longest, self.passed, self.ended = 0.0, 0, 0
        self._ends: list[float] = []
        self.lengths: list[float] = []

    def begin_anew(self) -> None:
        """Forget the way and the steps: another run begins at the start."""
        self.way[:], self._ends, self.lengths, self.passed = 0.0, [], [], 0
        self.since = self._start

    def add(self, start: float, before: Array, t: float, after: Array, grown: bool) -> None:
        """Take note of a step between two times, from state to state, shapes (2n,).

        ``grown``: the step is as long as the motion lets it be, neither one of the first of a run
        nor cut by an event.
        """
        n, h = len(self.way), t - start
        slower = np.minimum(np.abs(before[n : 2 * n]), np.abs(after[n : 2 * n]))
        self.way += np.maximum(np.abs(after[:n] - before[:n]), slower * h)
        seen = np.abs(after)
        seen[:n] = np.abs(after[:n] - self.origin)
        np.fmax(self.moved, seen, out=self.moved)
        self.scales[:] = self._scales_of(self.moved)
        self.extend([t], [h])
        if grown:
            self.longest = max(self.longest, h)
            if h < BRIEF * self.longest:
                self.approach(after, h)
        if self.passed % WINDOW == 0:
            self.ended |= t - self.since < self.slowest
            self.since = t

    def extend(self, ends: list[float], lengths: list[float]) -> None:
        """Append the ends and lengths of steps; absolute tolerances follow the scales."""
        np.maximum(self.tolerance * self.scales, self.least, out=self.atol)
        self._ends += ends
        self.lengths += lengths
        self.passed = len(self._ends)

    def approach(self, y: Array, h: float) -> None:
        """Note the distance from the origin of a state, or of its step, relative to the scales."""
        n = len(self.way)
        sizes = np.maximum(np.abs(y[:n]), h * np.abs(y[n : 2 * n]))
        for kind in range(int(self.kind.max(initial=-1)) + 1):
            alike = self.kind == kind
            size = sizes[alike].max() / self.scales[:n][alike].max()
            if size > 0:
                self.closest[alike] = np.minimum(self.closest[alike], size)
        self.ended |= bool(((self.closest < self.nearest) & (self.angle == 0)).any())

    @property
    def first_step(self) -> float | None:
        """Length of the step at which they have settled; None before it."""
        return self.lengths[SETTLING - 1] if self.passed >= SETTLING else None

    def steps_at(self, times: Array) -> Array | None:
        """Return the lengths of the steps around some times (m,); None if none has settled."""
        if self.passed <= SETTLING:
            return None
        numbers = np.searchsorted(np.array(self._ends), times)
        return np.array(self.lengths)[np.minimum(np.maximum(numbers, SETTLING), self.passed - 1)]
