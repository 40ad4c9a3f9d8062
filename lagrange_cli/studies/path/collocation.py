"""The two-point problem over polynomials at Chebyshev points, and Newton's method for it.

Steps are damped by the natural monotonicity test (P. Deuflhard, *Newton Methods for Nonlinear
Problems*, 2004, section 3.3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.studies.chebyshev import Points, coefficients_of, nodes, points_of

if TYPE_CHECKING:
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.motions import Motions

#: Largest degree of polynomials that are refined.
LARGEST_DEGREE = 256

#: Steps of Newton's method, and the last damping.
_MOST_STEPS, _LEAST_DAMPING = 30, 1 / 256

#: Change over the scales at which a step is the last.
CLOSE = 1e-7

#: Least pivot over the largest of a matrix that is not singular.
_SINGULAR = 1e-13

#: The same at a solution, known to fewer digits, whose neighbours are solutions.
_DEGENERATE = 1e-9

#: Part of the highest coefficients of a polynomial that is resolved.
_RESOLVED = 1e-5


@dataclass(frozen=True)
class TwoPointProblem:
    """A two-point problem with s = (t − t0)/span and Q = q/scale in place of t and q."""

    motions: Motions
    first: End
    last: End
    scales: Array

    @property
    def span(self) -> float:
        return self.last.t - self.first.t

    def velocity(self, path: Array) -> Array:
        """Return the initial velocity of a path."""
        rates = points_of(len(path) - 1).first @ path
        return np.asarray(rates[0] * self.scales / self.span)

    def _states(self, points: Points, path: Array) -> tuple[Array, Array, Array]:
        """Return times, coordinates and velocities at the inner points."""
        rates = (points.first @ path)[1:-1] * self.scales / self.span
        return self.first.t + self.span * points.s[1:-1], path[1:-1] * self.scales, rates

    def residual(self, points: Points, path: Array) -> Array:
        """Return Q″ less the accelerations of the forces at the inner points, in one row."""
        accelerations = self.motions.accelerations(*self._states(points, path))
        bent = (points.second @ path)[1:-1]
        return np.asarray((bent - accelerations * self.span**2 / self.scales).ravel())

    def is_degenerate(self, path: Array) -> bool:
        """Decide whether neighbours of a solution are solutions, as between conjugate ends."""
        from scipy.linalg import lu_factor

        factors: Any = lu_factor(self.jacobian(points_of(len(path) - 1), path), check_finite=False)
        pivots = np.abs(np.diag(factors[0]))
        return bool(np.min(pivots) <= _DEGENERATE * np.max(pivots))

    def jacobian(self, points: Points, path: Array) -> Array:
        """Return the derivatives of :meth:`residual` by the inner values, in the same order."""
        by_q, by_v = self.motions.slopes(*self._states(points, path))
        ratio = self.scales / self.scales[:, None]
        m, n = len(points.s) - 2, len(self.scales)
        jacobian = np.zeros((m, n, m, n))
        inner = slice(1, -1)
        forces = -self.span * (by_v * ratio)[:, :, None, :] * points.first[inner, None, inner, None]
        jacobian += forces
        for i in range(n):
            jacobian[:, i, :, i] += points.second[inner, inner]
        number = np.arange(m)
        jacobian[number, :, number, :] -= self.span**2 * by_q * ratio
        return jacobian.reshape(m * n, m * n)


def solved(problem: TwoPointProblem, path: Array) -> Array | None:
    """Lead a path to a solution, by polynomials of a degree that resolves it.

    Paths are values at Chebyshev points, shape (degree + 1, n), over the scales.
    """
    while True:
        points = points_of(len(path) - 1)
        solution = _newton(problem, points, path)
        if solution is None:
            return None
        if _is_resolved(solution) or len(path) > LARGEST_DEGREE:
            return solution
        path = _refined(solution)


def solver(matrix: Array) -> Callable[[Array], Array]:
    """Return a solver of systems with a matrix, in least squares if it is singular, as it is where
    the last end is conjugate to the first."""
    from scipy.linalg import lu_factor, lu_solve

    factors: Any = lu_factor(matrix, check_finite=False)
    pivots = np.abs(np.diag(factors[0]))
    if np.min(pivots) > _SINGULAR * np.max(pivots):
        return lambda right: np.asarray(lu_solve(factors, right, check_finite=False))
    inverse = np.linalg.pinv(matrix, rcond=_SINGULAR)
    return lambda right: np.asarray(inverse @ right)


def _newton(problem: TwoPointProblem, points: Points, path: Array) -> Array | None:
    residual = problem.residual(points, path)
    for _ in range(_MOST_STEPS):
        jacobian = problem.jacobian(points, path)
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        solve = solver(jacobian)
        step = -solve(residual)
        size = np.max(np.abs(step))
        damping = 1.0
        while damping >= _LEAST_DAMPING:
            tried = path.copy()
            tried[1:-1] += damping * step.reshape(path[1:-1].shape)
            residual = problem.residual(points, tried)
            left = np.max(np.abs(solve(residual)))
            if left <= (1 - damping / 4) * size or size < CLOSE:
                break
            damping /= 2
        else:
            return None
        path = tried
        if size < CLOSE or left < CLOSE:
            return path
    return None


def _is_resolved(path: Array) -> bool:
    coefficients = np.abs(coefficients_of(path))
    tail = max(2, len(path) // 8)
    return bool(np.max(coefficients[-tail:]) <= _RESOLVED * max(np.max(coefficients[1:]), 1e-300))


def _refined(path: Array) -> Array:
    """Return the same polynomial at the points of twice the degree."""
    x = nodes(2 * (len(path) - 1))
    return np.asarray(np.polynomial.chebyshev.chebval(x, coefficients_of(path)).T)
