"""Candidates: paths that solve the two-point problem roughly, from many starts.

Each start is a path between the ends: a straight one that is bent by sines, or a motion with some
initial velocity that is turned to the end. Newton's method on a polynomial that obeys
the equations of motion at Chebyshev points leads it to a path of stationary action, if it finds
one; steps are damped by the natural monotonicity test (P. Deuflhard, *Newton Methods for Nonlinear
Problems*, 2004, section 3.3).
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.simulate.arrays import Array

if TYPE_CHECKING:
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.motions import Motions

#: Least and largest degree of polynomials.
_LEAST_DEGREE, _LARGEST_DEGREE = 32, 256

#: Degree for each half wave that bends a start.
_POINTS_A_WAVE = 8

#: Least and most half waves that bend starts.
_FEWEST_WAVES, _MOST_WAVES = 4, 32

#: Sizes of bends over the scale of coordinates, of which each start has one by chance.
_SIZES = 0.3, 3.0

#: Size of further bends over the main one.
_FURTHER = 0.3

#: Accuracy of motions that are starts.
_FLIGHT = 1e-4

#: Steps of Newton's method, and the last damping.
_MOST_STEPS, _LEAST_DAMPING = 30, 1 / 256

#: Change over the scales at which a step is the last.
_CLOSE = 1e-7

#: Least pivot over the largest of a matrix that is not singular.
_SINGULAR = 1e-13

#: Part of the highest coefficients of a polynomial that is resolved.
_RESOLVED = 1e-5


def candidates(motions: Motions, first: End, last: End, starts: int) -> Iterator[Array | None]:
    """Yield, for each start, the initial velocity of the path it leads to, or None.

    The first start is straight. The same starts are made every time.
    """
    problem = _Scaled(motions, first, last, scales_of(motions, first, last))
    waves = _waves(motions, first, last)
    degree = min(max(_LEAST_DEGREE, _POINTS_A_WAVE * waves), _LARGEST_DEGREE)
    ends = np.array([first.q, last.q]) / problem.scales
    s = _points(degree).s[:, None]
    straight = ends[0] + s * (ends[1] - ends[0])
    for number in range(starts):
        bend = _bend(number, motions.size, waves, s)
        start = _flown(problem, s, bend) if number % 2 else straight + bend
        with np.errstate(all="ignore"):
            yield None if start is None else _solved(problem, start)


def scales_of(motions: Motions, first: End, last: End) -> Array:
    """Return sizes by which coordinates are bent: 1 of angles; of others what the ends, a fall
    between them and the scene's start have, or else 1."""
    model, span = motions.models.motion, last.t - first.t
    middle, mean = (first.q + last.q) / 2, (last.q - first.q) / span
    falls = motions.accelerations(np.array([first.t]), middle[None], mean[None])[0] * span**2 / 8
    sizes = np.maximum(np.maximum(np.abs(first.q), np.abs(last.q)), np.abs(np.nan_to_num(falls)))
    if model.initial is not None:
        sizes = np.maximum(sizes, np.abs(model.initial[: len(sizes)]))
    kinds = np.array(model.kinds)
    found = np.ones(len(sizes))
    for kind in {*model.kinds} - {"angle"}:
        found[kinds == kind] = np.max(sizes[kinds == kind]) or 1.0
    return found


def _waves(motions: Motions, first: End, last: End) -> int:
    """Return a number of half waves above that of small oscillations between the ends."""
    span, q = last.t - first.t, np.array([first.q, (first.q + last.q) / 2, last.q])
    t = first.t + span * np.array([0, 0.5, 1])
    stiffness = motions.slopes(t, q, np.zeros_like(q))[0]
    frequency = math.sqrt(np.max(np.abs(np.nan_to_num(np.linalg.eigvals(stiffness)))))
    counted = min(frequency * span / math.pi, _MOST_WAVES)
    return min(max(_FEWEST_WAVES, math.ceil(counted) + 2), _MOST_WAVES)


def _bend(number: int, size: int, waves: int, s: Array) -> Array:
    """Return what bends a start, shape (m, size); the main waves take turns."""
    if number == 0:
        return np.zeros((len(s), size))
    chance = random.Random(number)
    amplitudes = np.array([[chance.gauss(0, 1) for _ in range(size)] for _ in range(waves)])
    amplitudes *= _FURTHER / (1 + np.arange(waves)[:, None])
    direction = np.array([chance.gauss(0, 1) for _ in range(size)])
    amplitudes[number // 2 % waves] = direction / (np.linalg.norm(direction) or 1.0)
    size_of_all = math.exp(chance.uniform(*map(math.log, _SIZES)))
    return np.asarray(size_of_all * np.sin(np.pi * s * (1 + np.arange(waves))) @ amplitudes)


def _flown(problem: _Scaled, s: Array, bend: Array) -> Array | None:
    """Return the motion that begins as the straight path with a bend does, with what it misses the
    end by taken off evenly; None if it does not come so far."""
    first, last, scales = problem.first, problem.last, problem.scales
    v = (last.q - first.q + (bend[1] - bend[0]) / s[1] * scales) / problem.span
    times = first.t + problem.span * s[:, 0]
    times[-1] = last.t
    shot = problem.motions.shot(times, first.q, v, _FLIGHT)
    if shot is None:
        return None
    return np.asarray((shot.q + s * (last.q - shot.q[-1])) / scales)


@dataclass(frozen=True)
class _Points:
    """Chebyshev points on [0, 1] in ascending order, and derivatives of polynomials there."""

    s: Array
    first: Array
    second: Array


@cache
def _points(degree: int) -> _Points:
    # Trefethen, Spectral Methods in MATLAB, chapter 6.
    number = np.arange(degree + 1)
    x = -np.cos(np.pi * number / degree)
    signs = np.where(number % 2, -1.0, 1.0)
    signs[[0, -1]] *= 2
    first = np.outer(signs, 1 / signs) / (x[:, None] - x + np.eye(degree + 1))
    first -= np.diag(first.sum(1))
    first *= 2
    return _Points((1 + x) / 2, first, first @ first)


@dataclass(frozen=True)
class _Scaled:
    """A two-point problem with s = (t − t0)/span and Q = q/scale in place of t and q."""

    motions: Motions
    first: End
    last: End
    scales: Array

    @property
    def span(self) -> float:
        return self.last.t - self.first.t

    def _states(self, points: _Points, path: Array) -> tuple[Array, Array, Array]:
        """Return times, coordinates and velocities at the inner points."""
        rates = (points.first @ path)[1:-1] * self.scales / self.span
        return self.first.t + self.span * points.s[1:-1], path[1:-1] * self.scales, rates

    def residual(self, points: _Points, path: Array) -> Array:
        """Return Q″ less what the forces make it at the inner points, in one row."""
        accelerations = self.motions.accelerations(*self._states(points, path))
        bent = (points.second @ path)[1:-1]
        return np.asarray((bent - accelerations * self.span**2 / self.scales).ravel())

    def jacobian(self, points: _Points, path: Array) -> Array:
        """Return the derivatives of :meth:`residual` by the inner values, in the same order."""
        by_q, by_v = self.motions.slopes(*self._states(points, path))
        ratio = self.scales / self.scales[:, None]
        m, n = len(points.s) - 2, len(self.scales)
        found = np.zeros((m, n, m, n))
        inner = slice(1, -1)
        forces = -self.span * (by_v * ratio)[:, :, None, :] * points.first[inner, None, inner, None]
        found += forces
        for i in range(n):
            found[:, i, :, i] += points.second[inner, inner]
        number = np.arange(m)
        found[number, :, number, :] -= self.span**2 * by_q * ratio
        return found.reshape(m * n, m * n)


def _solved(problem: _Scaled, path: Array) -> Array | None:
    """Lead a path to a solution, by polynomials of a degree that resolves it."""
    while True:
        points = _points(len(path) - 1)
        solution = _newton(problem, points, path)
        if solution is None:
            return None
        if _is_resolved(solution) or len(path) > _LARGEST_DEGREE:
            rates = points.first @ solution
            return np.asarray(rates[0] * problem.scales / problem.span)
        path = _refined(solution)


def _solver(matrix: Array) -> Callable[[Array], Array]:
    """Return what solves systems with a matrix, in least squares where it is singular, as it is
    where the last end is conjugate to the first."""
    from scipy.linalg import lu_factor, lu_solve

    factors: Any = lu_factor(matrix, check_finite=False)
    pivots = np.abs(np.diag(factors[0]))
    if np.min(pivots) > _SINGULAR * np.max(pivots):
        return lambda right: np.asarray(lu_solve(factors, right, check_finite=False))
    inverse = np.linalg.pinv(matrix, rcond=_SINGULAR)
    return lambda right: np.asarray(inverse @ right)


def _newton(problem: _Scaled, points: _Points, path: Array) -> Array | None:
    residual = problem.residual(points, path)
    for _ in range(_MOST_STEPS):
        jacobian = problem.jacobian(points, path)
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        solve = _solver(jacobian)
        step = -solve(residual)
        size = np.max(np.abs(step))
        damping = 1.0
        while damping >= _LEAST_DAMPING:
            tried = path.copy()
            tried[1:-1] += damping * step.reshape(path[1:-1].shape)
            residual = problem.residual(points, tried)
            left = np.max(np.abs(solve(residual)))
            if left <= (1 - damping / 4) * size or size < _CLOSE:
                break
            damping /= 2
        else:
            return None
        path = tried
        if size < _CLOSE or left < _CLOSE:
            return path
    return None


def _coefficients(path: Array) -> Array:
    """Return the Chebyshev coefficients of a path, of ascending degree, shape (m, n)."""
    from scipy.fft import dct

    found = np.asarray(dct(path[::-1], 1, axis=0)) / (len(path) - 1)
    found[[0, -1]] /= 2
    return found


def _is_resolved(path: Array) -> bool:
    coefficients = np.abs(_coefficients(path))
    tail = max(2, len(path) // 8)
    return bool(np.max(coefficients[-tail:]) <= _RESOLVED * max(np.max(coefficients[1:]), 1e-300))


def _refined(path: Array) -> Array:
    """Return the same polynomial at the points of twice the degree."""
    degree = 2 * (len(path) - 1)
    x = -np.cos(np.pi * np.arange(degree + 1) / degree)
    return np.asarray(np.polynomial.chebyshev.chebval(x, _coefficients(path)).T)
