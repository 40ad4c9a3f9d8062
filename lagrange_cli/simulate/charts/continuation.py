"""Continuation of a chart's coordinates along a motion in other coordinates.

From sample to sample the coordinates that give a position are found by Newton's method,
beginning with those of the sample before, moved on with their rates. A step is trusted
where the rates at its two ends account for it; else it is halved, on a cubic between the
samples. Close to where the chart is singular, closer than the positions are known,
halving ends. If the motion is proven to turn round there, so do the coordinates; if it
is proven to go through, they go on as smoothly as they came, which is one choice of several;
else they are not followed further.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.charts.inverse import (
    LONGEST_STEP,
    ChartInverse,
    ChartPoint,
    Function,
    alikeness,
    moving_nothing,
)

#: Part of a step that its rates may leave open.
_LOOSE = 0.2

#: Smallest step of which that is asked.
_LEAST = 1e-3

#: Least cosine between the tangent planes at the ends of a step.
_ALIKE = 0.25

#: Values of all coordinates from which they are looked for where no start is given.
_GUESSES = (0.5, -0.5, 1.0, 2.0)

#: Most halvings of the time between two samples.
_HALVINGS = 60

#: Positions that are looked at for each sample before coordinates are given up.
_EACH = 16

#: Positions that are looked at besides.
_BESIDES = 4000

#: Angle, in radians, by which a turn past a singular configuration may exceed half a turn, since
#: positions beside it are known to some accuracy only.
_BEYOND = 0.3

#: Lengths within this factor of 1 stay in their units.
_COMMON = 1000.0


class KnownMotion(NamedTuple):
    """A motion in the coordinates that have replaced those of the chart.

    Attributes
    ----------
    t
        Times of the samples, shape (m,).
    positions, velocities
        Coordinates of the motion and their rates, shape (m, k).
    errors
        Uncertainty of the positions, shape (k,).
    """

    t: Array
    positions: Array
    velocities: Array
    errors: Array


@dataclass(frozen=True)
class AngleReversal:
    """Facts on coordinates whose rates move nothing at singular configurations.

    Attributes
    ----------
    angles
        The coordinate is an angle, shape (n,).
    steady
        Its rate is proven to keep the sign it has in ``rates``, or to stay zero, shape (n,).
    rates
        Rates at the start, shape (n,).
    """

    angles: NDArray[np.bool_]
    steady: NDArray[np.bool_]
    rates: Array


@dataclass(frozen=True)
class ContinuedCoordinates:
    """Coordinates of a chart along a motion, as far as they can be followed.

    Attributes
    ----------
    q, v
        Coordinates and rates at the samples that were reached, shape (m, n).
    amplification
        Largest change of each coordinate if positions change by their errors, shape (m, n).
    lost
        Pairs of times between which coordinates became one choice of several.
    unknown
        Time after which coordinates are not known; None if they are known to the end.
    """

    q: Array
    v: Array
    amplification: Array
    lost: tuple[tuple[float, float], ...]
    unknown: float | None = None


class _GivenUpError(Exception):
    """The motion between samples takes too long to follow."""


class _UnknownError(Exception):
    """Nothing tells which of several coordinates a position has past a singular configuration."""


def continue_coordinates(
    samples: KnownMotion,
    start: Array | None,
    number: int,
    positions: Function,
    velocities: Function,
    deadline: float = np.inf,
    turning: AngleReversal | None = None,
) -> ContinuedCoordinates:
    """Find coordinates and rates of a chart at all samples, or as many as can be followed.

    Parameters
    ----------
    start
        [q, v] at the first sample. None if it is not known: then coordinates are the
        smallest that are found at the first sample that is clear of singular configurations, and
        NaN before.
    number
        How many coordinates there are.
    positions, velocities
        What the chart gives for t and [q, v]; velocities are linear in v.
    deadline
        What :func:`time.perf_counter` tells when no further sample is followed.
    turning
        What decides at singular configurations. None: the motion goes through them.
    """
    with np.errstate(all="ignore"):
        units = _units(samples, start, number, velocities, turning)
        both = np.tile(units, 2)
        if start is not None:
            start = start / both
        follower = _Follower(
            samples,
            ChartInverse(
                lambda t, state: positions(t, state * both),
                lambda t, state: velocities(t, state * both),
                samples.errors,
            ),
            deadline,
            turning,
        )
        run = follower.run(start, number)
        q, v, amplification = (
            x.reshape(-1, number) * units for x in (run.q, run.v, run.amplification)
        )
        return replace(run, q=q, v=v, amplification=amplification)


def _units(
    samples: KnownMotion,
    start: Array | None,
    number: int,
    velocities: Function,
    turning: AngleReversal | None,
) -> Array:
    """Choose powers of two, one a coordinate, in which lengths and angles are of one order.

    An orbit of 1e10 metres moves by its angle 1e10 times as much as by its radius, which would
    look like one that moves nothing. Angles have the unit 1, and so have lengths of common size.
    """
    units = np.ones(number)
    if start is None or turning is None:
        return units
    size = float(np.abs(samples.positions).max(initial=0.0))
    at_rest = np.asarray(velocities(float(samples.t[0]), np.append(start[:number], units * 0)))
    for j in np.flatnonzero(~turning.angles):
        state = np.append(start[:number], np.eye(number)[j])
        moved = np.linalg.norm(velocities(float(samples.t[0]), state) - at_rest)
        if moved > 0 and not 1 / _COMMON < size / moved < _COMMON:
            units[j] = np.ldexp(1.0, round(np.log2(size / moved)))
    return units


@dataclass
class _Follower:
    """Search for coordinates from sample to sample.

    Attributes
    ----------
    samples, deadline, turning
        As in :func:`continue_coordinates`.
    inverse
        Finds coordinates, in units in which they are of one order.
    looks
        Positions that have been looked at.
    lost, unknown
        As in :class:`ContinuedCoordinates`.
    _last_clear
        Last clear point; None before the first.
    _before
        Clear point before a singular configuration that is being passed; else None.
    _angle
        Number of the angle that turns there.
    """

    samples: KnownMotion
    inverse: ChartInverse
    deadline: float
    turning: AngleReversal | None = None
    looks: int = 0
    lost: list[tuple[float, float]] = field(default_factory=list)
    unknown: float | None = None
    _last_clear: ChartPoint | None = None
    _before: ChartPoint | None = None
    _angle: int = 0

    def run(self, start: Array | None, n: int) -> ContinuedCoordinates:
        t, r, w, _ = self.samples
        if start is None:
            points = self._begun(n)
        else:
            here = self.inverse.point(float(t[0]), start[:n], r[0], w[0])
            self._at_rest(self.inverse.jacobian(float(t[0]), start[:n])[0])
            # Coordinates that are given stay, also where they are one choice of several.
            points = [replace(here, q=start[:n], v=start[n:], amplification=np.zeros(n))]
        try:
            for k in range(len(points), len(t)):
                between = (k - 1, k)
                points.append(
                    self._advance(points[-1], float(t[k]), r[k], w[k], between, _HALVINGS)
                )
        except _GivenUpError:
            pass
        except _UnknownError:
            # Choices since the singular configuration was reached are not known either.
            self.unknown = self._before.t if self._before is not None else float(t[0])
            points = [p for p in points if p.t <= self.unknown]
        return ContinuedCoordinates(
            np.array([p.q for p in points]),
            np.array([p.v for p in points]),
            np.array([p.amplification for p in points]),
            tuple(self.lost),
            self.unknown,
        )

    def _at_rest(self, jacobian: Array) -> None:
        """Set rates to 0 of coordinates that move nothing at the start: they have no momentum."""
        if self.turning is not None:
            rates = np.where(jacobian.any(axis=0), self.turning.rates, 0.0)
            self.turning = replace(self.turning, rates=rates)

    def _begun(self, n: int) -> list[ChartPoint]:
        """Find points up to the first clear one; those before it have NaN for coordinates."""
        t, r, w, _ = self.samples
        points: list[ChartPoint] = []
        for k in range(len(t)):
            guesses = [np.full(n, x) for x in _GUESSES]
            tried = [self.inverse.point(float(t[k]), guess, r[k], w[k]) for guess in guesses]
            clear = [p for p in tried if p.clear and np.isfinite(p.amplification).all()]
            if clear:
                return [*points, min(clear, key=lambda p: float(np.abs(p.q).max()))]
            none = np.full(n, np.nan)
            points.append(replace(tried[0], q=none, v=none, amplification=np.full(n, np.inf)))
        return points

    def _advance(
        self,
        here: ChartPoint,
        t: float,
        r: Array,
        w: Array,
        between: tuple[int, int],
        halvings: int,
    ) -> ChartPoint:
        self._look()
        step = t - here.t
        moved = here.v * step
        there = self.inverse.point(
            t, here.q + np.minimum(np.maximum(moved, -LONGEST_STEP), LONGEST_STEP), r, w
        )
        if here.clear and self._before is None:
            self._last_clear = here
        if self._is_accounted_for(here, there, step):
            return there if self._before is None else self._turned(there)
        middle = here.t + step / 2
        if halvings == 0 or not here.t < middle < t or self._is_lost(here, there):
            return self._past(here, there)
        at, rate = self._between(middle, between)
        halfway = self._advance(here, middle, at, rate, between, halvings - 1)
        return self._advance(halfway, t, r, w, between, halvings - 1)

    def _look(self) -> None:
        self.looks += 1
        most = _EACH * len(self.samples.t) + _BESIDES
        if self.looks > most or time.perf_counter() > self.deadline:
            raise _GivenUpError

    def _past(self, here: ChartPoint, there: ChartPoint) -> ChartPoint:
        """Return the point ``there`` with coordinates past a singular configuration.

        Raises
        ------
        _UnknownError
            Nothing tells them.
        """
        if self._before is None:
            self._before = here if self._last_clear is None else self._last_clear
            if self._goes_through(moving_nothing(there if here.clear else here)):
                self._before = None
                self.lost.append((here.t, there.t))
                return there
        return self._turned(there)

    def _goes_through(self, lost: NDArray[np.bool_]) -> bool:
        """Tell whether a motion goes through where some coordinates move nothing, or turns.

        Raises
        ------
        _UnknownError
            Nothing tells.
        """
        if self.turning is None:
            return True
        at_rest = not self.turning.rates[lost].any()
        turns = lost.sum() == 1 and bool(self.turning.angles[lost].all())
        if not self.turning.steady[lost].all() or not (at_rest or turns):
            raise _UnknownError
        self._angle = int(np.flatnonzero(lost)[0])
        return at_rest

    def _turned(self, there: ChartPoint) -> ChartPoint:
        """Find coordinates past a singular configuration, one of which has made half a turn.

        Raises
        ------
        _UnknownError
            None are found in which it has.
        """
        if not there.clear:
            return there
        before, number = self._before, self._angle
        assert before is not None
        assert self.turning is not None
        sense = float(np.sign(self.turning.rates[number]))
        guess = before.q.copy()
        guess[number] += sense * np.pi
        turned = self.inverse.point(there.t, guess, there.r, there.w)
        turn = sense * float(turned.q[number] - before.q[number])
        alike = alikeness(before, turned) >= _ALIKE
        if not (before.clear and turned.clear and alike and 0 < turn < np.pi + _BEYOND):
            raise _UnknownError
        self._before = None
        return turned

    @staticmethod
    def _is_accounted_for(here: ChartPoint, there: ChartPoint, step: float) -> bool:
        change = there.q - here.q
        expected = (here.v + there.v) / 2 * step
        size = np.maximum(np.maximum(np.abs(change), np.abs(expected)), _LEAST)
        near = (np.abs(change - expected) <= _LOOSE * size).all()
        alike = alikeness(here, there) >= _ALIKE
        return bool(near and alike and (np.abs(change) <= LONGEST_STEP).all())

    @staticmethod
    def _is_lost(here: ChartPoint, there: ChartPoint) -> bool:
        """Tell if halving only approaches what the positions do not tell apart."""
        return not (here.clear and there.clear)

    def _between(self, t: float, numbers: tuple[int, int]) -> tuple[Array, Array]:
        """Evaluate position and velocity on the cubic between two samples, shapes (k,)."""
        a, b = numbers
        times, r, w, _ = self.samples
        step = float(times[b] - times[a])
        s = (t - float(times[a])) / step
        place = (1 + 2 * s) * (1 - s) ** 2 * r[a] + s**2 * (3 - 2 * s) * r[b]
        place = place + step * (s * (1 - s) ** 2 * w[a] - s**2 * (1 - s) * w[b])
        rate = 6 * s * (1 - s) * (r[b] - r[a]) / step
        rate = rate + (1 - s) * (1 - 3 * s) * w[a] + s * (3 * s - 2) * w[b]
        return place, rate
