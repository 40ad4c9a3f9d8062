"""Continuation of a chart's coordinates along a motion in other coordinates.

From sample to sample the coordinates that give a position are found by Newton's method,
beginning with those of the sample before, moved on with their rates. A step is trusted
where the rates at its two ends account for it; else it is halved, on a cubic between the
samples. Close to where the chart is singular, closer than the positions are known,
halving ends. Where the motion is proven to turn round there, so do the coordinates; where it
is proven to go through, they go on as smoothly as they came, which is one choice of several;
else they are not followed further.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

#: A function of a chart: t, [q, v] → numbers.
Function = Callable[[float, Array], Array]

#: Most steps of Newton's method.
_NEWTON = 30

#: Its last step, relative to the size of the coordinates.
_SMALLEST = 1e-13

#: Misfit of a position, beside its size, that no coordinates of the chart account for.
_MISFIT = 1e-6

#: Part of a step that its rates may leave open.
_LOOSE = 0.2

#: Smallest step of which that is asked.
_LEAST = 1e-3

#: Largest step.
_MOST = 1.0

#: How much alike the tangent planes at the ends of a step must be: the cosine between them.
_ALIKE = 0.25

#: Values of all coordinates from which they are looked for where no start is given.
_GUESSES = (0.5, -0.5, 1.0, 2.0)

#: Most halvings of the time between two samples.
_HALVINGS = 60

#: Positions that are looked at for each sample before coordinates are given up.
_EACH = 16

#: Positions that are looked at besides.
_BESIDES = 4000

#: A direction that moves the positions by less than this part of what others do moves nothing.
_NOTHING = 1e-9

#: How much more than half a turn an angle may turn where the motion passes a singular place, for
#: how well positions are known beside it.
_BEYOND = 0.3

#: Lengths within this factor of 1 stay in their units.
_COMMON = 1000.0

#: How many times the uncertainty of positions a chart must keep away from its singular places.
_CLEAR = 10.0


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
    """Nothing tells which of several coordinates a position has past a singular place."""


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
        [q, v] at the first sample. None where it is not known: then coordinates are the
        smallest that are found at the first sample that is clear of singular places, and
        NaN before.
    number
        How many coordinates there are.
    positions, velocities
        What the chart gives for t and [q, v]; velocities are linear in v.
    deadline
        What :func:`time.perf_counter` tells when no further sample is followed.
    turning
        What decides at singular places. None: the motion goes through them.
    """
    with np.errstate(all="ignore"):
        units = _units(samples, start, number, velocities, turning)
        if start is not None:
            start = start / np.tile(units, 2)
        follower = _Follower(
            samples,
            lambda t, state: positions(t, state * np.tile(units, 2)),
            lambda t, state: velocities(t, state * np.tile(units, 2)),
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
    """Powers of two, one a coordinate, in which lengths and angles are of one order.

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
class _Point:
    """Coordinates of one position.

    Attributes
    ----------
    t
        Time.
    r, w
        Position and velocity, shape (k,).
    q, v
        Coordinates of the chart and their rates, shape (n,).
    jacobian
        ∂r/∂q, shape (k, n).
    clear
        The chart is regular here, by more than the uncertainty of the position.
    amplification
        As in :class:`ContinuedCoordinates`, shape (n,); infinite if q is not known.
    """

    t: float
    r: Array
    w: Array
    q: Array
    v: Array
    jacobian: Array
    clear: bool
    amplification: Array


@dataclass
class _Follower:
    """Search for coordinates from sample to sample.

    Attributes
    ----------
    samples, positions, velocities, deadline, turning
        As in :func:`continue_coordinates`, in units in which coordinates are of one order.
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
    positions: Function
    velocities: Function
    deadline: float
    turning: AngleReversal | None = None
    looks: int = 0
    lost: list[tuple[float, float]] = field(default_factory=list)
    unknown: float | None = None
    _last_clear: _Point | None = None
    _before: _Point | None = None
    _angle: int = 0

    def run(self, start: Array | None, n: int) -> ContinuedCoordinates:
        t, r, w, _ = self.samples
        if start is None:
            points = self._begun(n)
        else:
            here = self._arrive(float(t[0]), start[:n], r[0], w[0])
            self._at_rest(self._jacobian(float(t[0]), start[:n])[0])
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
            # What was chosen since the place was reached is not known either.
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
        """A coordinate that moves nothing at the start has no momentum, whatever its rate."""
        if self.turning is not None:
            rates = np.where(jacobian.any(axis=0), self.turning.rates, 0.0)
            self.turning = replace(self.turning, rates=rates)

    def _begun(self, n: int) -> list[_Point]:
        """Points up to the first that can be told, those before it empty."""
        t, r, w, _ = self.samples
        points: list[_Point] = []
        for k in range(len(t)):
            guesses = [np.full(n, x) for x in _GUESSES]
            tried = [self._arrive(float(t[k]), guess, r[k], w[k]) for guess in guesses]
            clear = [p for p in tried if p.clear and np.isfinite(p.amplification).all()]
            if clear:
                return [*points, min(clear, key=lambda p: float(np.abs(p.q).max()))]
            none = np.full(n, np.nan)
            points.append(replace(tried[0], q=none, v=none, amplification=np.full(n, np.inf)))
        return points

    def _advance(
        self, here: _Point, t: float, r: Array, w: Array, between: tuple[int, int], halvings: int
    ) -> _Point:
        self._look()
        step = t - here.t
        moved = here.v * step
        there = self._arrive(t, here.q + np.clip(moved, -_MOST, _MOST), r, w)
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

    def _past(self, here: _Point, there: _Point) -> _Point:
        """The coordinates of ``there``, on the way past a singular place.

        Raises
        ------
        _UnknownError
            Nothing tells them.
        """
        if self._before is None:
            self._before = here if self._last_clear is None else self._last_clear
            if self._goes_through(_moving_nothing(there if here.clear else here)):
                self._before = None
                self.lost.append((here.t, there.t))
                return there
        return self._turned(there)

    def _goes_through(self, lost: NDArray[np.bool_]) -> bool:
        """Tell whether a motion goes through a place where some coordinates move nothing, or turns.

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

    def _turned(self, there: _Point) -> _Point:
        """The coordinates of a position past a place, one of which has made half a turn.

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
        turned = self._arrive(there.t, guess, there.r, there.w)
        turn = sense * float(turned.q[number] - before.q[number])
        alike = _alikeness(before.jacobian, turned.jacobian) >= _ALIKE
        if not (before.clear and turned.clear and alike and 0 < turn < np.pi + _BEYOND):
            raise _UnknownError
        self._before = None
        return turned

    @staticmethod
    def _is_accounted_for(here: _Point, there: _Point, step: float) -> bool:
        change = there.q - here.q
        expected = (here.v + there.v) / 2 * step
        size = np.maximum(np.maximum(np.abs(change), np.abs(expected)), _LEAST)
        near = (np.abs(change - expected) <= _LOOSE * size).all()
        alike = _alikeness(here.jacobian, there.jacobian) >= _ALIKE
        return bool(near and alike and (np.abs(change) <= _MOST).all())

    @staticmethod
    def _is_lost(here: _Point, there: _Point) -> bool:
        """Tell if halving only approaches what the positions do not tell apart."""
        return not (here.clear and there.clear)

    def _between(self, t: float, numbers: tuple[int, int]) -> tuple[Array, Array]:
        """Position and velocity on the cubic between two samples."""
        a, b = numbers
        times, r, w, _ = self.samples
        step = float(times[b] - times[a])
        s = (t - float(times[a])) / step
        place = (1 + 2 * s) * (1 - s) ** 2 * r[a] + s**2 * (3 - 2 * s) * r[b]
        place = place + step * (s * (1 - s) ** 2 * w[a] - s**2 * (1 - s) * w[b])
        rate = 6 * s * (1 - s) * (r[b] - r[a]) / step
        rate = rate + (1 - s) * (1 - 3 * s) * w[a] + s * (3 * s - 2) * w[b]
        return place, rate

    def _arrive(self, t: float, guess: Array, r: Array, w: Array) -> _Point:
        """The coordinates of a position near a guess, with their rates."""
        q, n = guess.copy(), len(guess)
        for _ in range(_NEWTON):
            miss = r - self.positions(t, np.concatenate([q, np.zeros(n)]))
            step = _least(self._jacobian(t, q)[0], miss)
            if not np.isfinite(step).all():
                break
            q = q + np.clip(step, -_MOST, _MOST)
            if (np.abs(step) <= _SMALLEST * (1 + np.abs(q))).all():
                break
        jacobian, drift = self._jacobian(t, q)
        v = _least(jacobian, w - drift)
        size = np.abs(r).max(initial=1e-300)
        miss = np.abs(r - self.positions(t, np.concatenate([q, np.zeros(n)]))).max()
        there = bool(miss <= _MISFIT * size)
        if not np.isfinite(jacobian).all():
            return _Point(t, r, w, q, v, jacobian, False, np.full(n, np.inf))
        sizes = np.linalg.svd(jacobian, compute_uv=False)
        clear = bool(sizes[-1] > _NOTHING * sizes[0])
        spread = np.abs(np.linalg.pinv(jacobian)) @ self.samples.errors
        amplification = spread if clear and there else np.full(n, np.inf)
        away = clear and bool((_CLEAR * spread < 1).all())
        return _Point(t, r, w, q, v, jacobian, away, amplification)

    def _jacobian(self, t: float, q: Array) -> tuple[Array, Array]:
        """∂r/∂q and ∂r/∂t."""
        n = len(q)
        drift = np.asarray(self.velocities(t, np.concatenate([q, np.zeros(n)])))
        columns = []
        for j in range(n):
            unit = np.zeros(n)
            unit[j] = 1.0
            columns.append(self.velocities(t, np.concatenate([q, unit])) - drift)
        return np.array(columns).T, drift


def _moving_nothing(point: _Point) -> NDArray[np.bool_]:
    """Which coordinates take part in what moves the positions least, shape (n,)."""
    if not np.isfinite(point.jacobian).all():
        return np.ones(len(point.q), dtype=bool)
    least = np.linalg.svd(point.jacobian)[2][-1]
    return np.asarray(np.abs(least) > _NOTHING)


def _alikeness(one: Array, two: Array) -> float:
    """The cosine between the planes that columns span, −1 where one is turned over.

    It is turned over on the other side of a place where the columns become dependent.
    """
    volumes = np.linalg.det(one.T @ one) * np.linalg.det(two.T @ two)
    return float(np.linalg.det(one.T @ two) / np.sqrt(volumes)) if volumes > 0 else 0.0


def _least(matrix: Array, right: Array) -> Array:
    """The smallest x with matrix·x = right, NaN where there is none."""
    if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
        return np.full(matrix.shape[1], np.nan)
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=_NOTHING)[0], dtype=np.float64)
