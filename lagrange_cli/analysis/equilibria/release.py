"""Release from rest beside singular coordinates: what moves off there is in no equilibrium.

Where a chart is singular, forces may balance along its coordinates and not otherwise: at gimbal
lock two of three Euler angles turn about one axis, and none is left for a torque about another.
Gauss' sum over the accelerations of a motion from rest, Σ m a² = aᵀ M a, is the same in all
coordinates and continuous in the configuration (A. Sommerfeld, *Mechanics*, 1952, section 48):
beside an equilibrium it falls with the square of the distance. Where it does not, there is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from mpmath import mpf

from lagrange_cli.analysis.equilibria.rest_system import RestSystem
from lagrange_cli.analysis.values import Matrix, Mpf

#: Condition of M beyond which coordinates are singular.
_SINGULAR = 1e12
#: Distances from there at which motions from rest are compared, and number of directions.
_DISTANCES, _DIRECTIONS = (1e-3, 1e-4), 3
#: Part of the usual aᵀ M a below which a system counts as staying.
_STAYING = 1e-6
#: Singular values below which no acceleration is sought.
_CUT = 1e-13


class Release:
    """Motions that begin at rest.

    Parameters
    ----------
    system
        Forces and constraints at rest.
    length
        A usual length of the system, in the unit of its coordinates.
    """

    def __init__(self, system: RestSystem, length: float) -> None:
        self._system = system
        angles = (c.is_angle or c.unit == "rad" for c in system.equations.system.coordinates)
        lengths = [1.0 if angle else length for angle in angles]
        drawn = np.random.default_rng(0).uniform(-1, 1, (_DIRECTIONS, len(lengths)))
        self._ways = drawn * lengths

    def moves(self, position: Sequence[Mpf | float]) -> bool:
        """Say whether a system moves off beside a position at which coordinates are singular.

        False at positions that are as regular as the start, of steady motions, where states of
        first order change by themselves, and where forces have kinks: they are not continuous.
        """
        system = self._system
        if (
            system.states
            or system.free_to_give
            or system.kinks
            or not self._is_regular(self._start)
        ):
            return False
        place = np.array([float(x) for x in position])
        if self._is_regular(place):
            return False
        far, near = (
            min(self._acceleration(place + step * way) for way in self._ways) for step in _DISTANCES
        )
        return near > max(_STAYING * self._usual, far / 2)

    @cached_property
    def _start(self) -> Matrix:
        """A place beside the start, which may be singular itself."""
        start: Matrix = np.array([float(x) for x in self._system.start])
        return np.asarray(start + self._ways[0])

    @cached_property
    def _usual(self) -> float:
        return max(self._acceleration(self._start + way) for way in self._ways)

    def _is_regular(self, position: Matrix) -> bool:
        """Say whether M has its rank, or no value; of the parts of a quaternion it never has."""
        mass = self._masses(position)
        return not np.isfinite(mass).all() or bool(np.linalg.cond(mass) < _SINGULAR)

    def _masses(self, position: Matrix) -> Matrix:
        """Evaluate the mass matrix; not a number where it has no value."""
        n = self._system.functions.n
        try:
            mass = self._system.functions.masses_at([mpf(float(x)) for x in position])
        except (ArithmeticError, ValueError):
            return np.full((n, n), np.nan)
        return np.array(mass.tolist(), dtype=float).reshape(n, n)

    def _acceleration(self, position: Matrix) -> float:
        """Return aᵀ M a of the motion that begins at rest; 0 where it is not known."""
        functions = self._system.functions
        n, m = functions.n, functions.m
        unknown = np.concatenate([position, np.zeros(m)])
        level, jacobian = (values[0] for values in functions.residuals(unknown[:, None]))
        mass = self._masses(position)
        # M gets a diagonal of 1 where coordinates have inertia, gradients the length 1.
        size = np.sqrt(np.abs(mass.diagonal()))
        size[size == 0.0] = 1.0
        pull, force = jacobian[:n, n:] / size[:, None], level[:n] / size
        pull = pull / np.maximum(np.linalg.norm(pull, axis=0), np.finfo(float).tiny)
        matrix = np.block([[mass / np.outer(size, size), -pull], [pull.T, np.zeros((m, m))]])
        if not (np.isfinite(matrix).all() and np.isfinite(force).all()):
            return 0.0
        a = np.linalg.lstsq(matrix, np.concatenate([force, np.zeros(m)]), rcond=_CUT)[0][:n]
        return float(a @ force)
