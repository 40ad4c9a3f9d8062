"""Methods of fixed step that preserve the structure of Hamiltonian motion.

Hairer, Lubich, Wanner, *Geometric Numerical Integration*, 2nd ed.: their error in
energy stays bounded and does not grow, for any duration that rounding allows. That
is proven for canonical coordinates, which [q, q̇] are if the mass matrix is
constant; elsewhere the collocation methods are symmetric in time, which does nearly
as well in reversible systems (chapter XI).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    NOT_FINITE,
    UNMET,
    Control,
    FixedStep,
    StepError,
    UnfitError,
)
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, Shift, structured

#: Iterations of the equations of a step after which it is given up (rattle.c and collocation.c do
#: the same).
MOST_ITERATIONS = 60

#: Iterations without progress after which they end.
CALM = 2

#: Distance of converged iterations, as a part of the change over the step: far above the rounding
#: at which they end, far below the iterates of a diverging step; not tuned.
_CONVERGED = 2.0**-20


class Verlet(FixedStep):
    """Störmer's and Verlet's method in the form of velocities.

    Verlet, *Phys. Rev.* 159 (1967) 98; *Geometric Numerical Integration*, I.1.4. One
    evaluation a step: accelerations must not depend on velocities.
    """

    name = "Verlet"
    title = "Störmer–Verlet, explicit, fixed step, symplectic"
    order = 2
    symplectic = True
    needs = ("separable",)
    projects = False
    state_attributes = ("_low", "_slope")

    _slope: Array | None = None

    def _change(self, t: float, h: float) -> Array:
        n = len(self.y) // 2
        start = self._slope if self._slope is not None else self._acceleration(t, self.y)
        faster = h / 2 * start
        moved = h * (self.y[n:] + self._low[n:] + faster)
        moved, faster, point = self._drift(t, h, moved, faster)
        self._slope = self._acceleration(t + h, point)
        return np.concatenate([moved, faster + h / 2 * self._slope])

    def _drift(self, t: float, h: float, moved: Array, faster: Array) -> tuple[Array, Array, Array]:
        """Return changes of positions, those of velocities in half a step, and the state then.

        Parameters
        ----------
        moved, faster
            These changes without constraints.
        """
        n = len(moved)
        return moved, faster, np.concatenate([self.y[:n] + (self._low[:n] + moved), self.y[n:]])

    def _acceleration(self, t: float, y: Array) -> Array:
        return self._rhs(t, y)[len(y) // 2 :]


@dataclass(frozen=True)
class _Tableau:
    """Coefficients of collocation with s stages.

    Attributes
    ----------
    nodes
        On [0, 1], shape (s,).
    matrix
        Matrix of the stages, shape (s, s).
    weights
        Weights of the slopes, shape (s,).
    ahead
        Matrix from slopes to the values, one step later, of the polynomial through them, shape (s,
        s).
    """

    nodes: Array
    matrix: Array
    weights: Array
    ahead: Array


@cache
def _gauss(stages: int) -> _Tableau:
    """Compute the coefficients of Gauss–Legendre collocation on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(stages)
    nodes = (1 + x) / 2
    powers = np.vander(nodes, increasing=True)
    degrees = np.arange(stages)
    inverse = np.linalg.inv(powers)
    integrals = nodes[:, None] ** (degrees + 1) / (degrees + 1)
    ahead = np.vander(1 + nodes, stages, increasing=True)
    return _Tableau(nodes, integrals @ inverse, w / 2, ahead @ inverse)


class _Collocation(FixedStep):
    """Gauss–Legendre collocation; its equations are iterated until rounding stops them.

    The criterion is that of Antoñana, Makazaga and Murua (*Numer. Algorithms* 76 (2017)
    861): a component is done where it changes no more, or not less than it did before, twice
    in a row, since half of the components of a mechanical system change in turn.
    """

    symplectic = True
    state_attributes = ("_low", "_slopes", "_last")
    stages: ClassVar[int]

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        super().__init__(rhs, t0, y0, t_end, control)
        self._tableau = _gauss(self.stages)
        self._slopes: Array | None = None
        self._last = 0.0

    def _change(self, t: float, h: float) -> Array:
        tableau = self._tableau
        slopes = self._guess(t, h)
        before, calm = np.full(slopes.shape, np.inf), 0
        for _ in range(MOST_ITERATIONS):
            stages = self.y + (self._low + h * (tableau.matrix @ slopes))
            times = t + h * tableau.nodes
            evaluated = np.array(
                [self._rhs(s, y) for s, y in zip(times.tolist(), stages, strict=True)]
            )
            change = np.abs(evaluated - slopes)
            slopes = evaluated
            if not np.isfinite(slopes).all():
                raise StepError(NOT_FINITE)
            calm = calm + 1 if ((change == 0) | (change >= before)).all() else 0
            if calm == CALM:
                self._require_convergence(change, slopes, h)
                self._slopes, self._last = slopes, h
                return np.asarray(h * (tableau.weights @ slopes))
            before = np.where(change > 0, np.minimum(before, change), before)
        raise StepError(DIVERGES)

    def _guess(self, t: float, h: float) -> Array:
        """Predict the slopes by the polynomial of the last step, if that was as long."""
        if self._slopes is None or self._last != h:
            return np.tile(self._rhs(t, self.y), (self.stages, 1))
        return np.asarray(self._tableau.ahead @ self._slopes)

    def _require_convergence(self, change: Array, slopes: Array, h: float) -> None:
        size = _CONVERGED * abs(h) * np.abs(slopes).max(axis=0) + 64 * np.spacing(np.abs(self.y))
        if (abs(h) * change.max(axis=0) > size).any():
            raise StepError(DIVERGES)

    def _moved(self) -> None:
        self._slopes = None


#: Why a step of collocation cannot be made.
DIVERGES = Phrase("the iteration of a step does not converge; a smaller step may")


class Gauss4(_Collocation):
    """Gauss–Legendre collocation at two points (*Geometric Numerical Integration*, II.1.3)."""

    name = "Gauss4"
    title = "Gauss–Legendre with two stages, by iteration, fixed step, symplectic"
    order = 4
    stages = 2


class Gauss6(_Collocation):
    """Gauss–Legendre collocation at three points (*Geometric Numerical Integration*, II.1.3)."""

    name = "Gauss6"
    title = "Gauss–Legendre with three stages, by iteration, fixed step, symplectic"
    order = 6
    stages = 3


def require_shift(rhs: Rhs) -> Shift | None:
    """Return the change that leads positions back to constraints, None without constraints.

    Raises
    ------
    UnfitError
        It has constraints, and no such function.
    """
    structure = structured(rhs)
    if structure.shift is None and structure.project is not None:
        raise UnfitError("its constraints are not to be had by themselves")
    return structure.shift


class Rattle(Verlet):
    """RATTLE, Störmer's and Verlet's method on constraints.

    Andersen, *J. Comput. Phys.* 52 (1983) 24; *Geometric Numerical Integration*, VII.1.4.

    Positions are led back along the gradients where the step began, and velocities along those
    where it ends, which makes it symmetric in time and symplectic. One evaluation a step:
    accelerations must not depend on velocities but for the forces of constraints.
    """

    name = "RATTLE"
    title = "Störmer–Verlet on constraints, fixed step, symplectic"
    needs = ("separable_on_closures",)
    projects = True

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        super().__init__(rhs, t0, y0, t_end, control)
        self._shift = require_shift(rhs)

    def _drift(self, t: float, h: float, moved: Array, faster: Array) -> tuple[Array, Array, Array]:
        if self._shift is not None:
            moved, faster = self._led_back(self._shift, t, h, moved, faster)
        return moved, faster, self.y + (self._low + np.concatenate([moved, faster]))

    def _led_back(
        self, shift: Shift, t: float, h: float, moved: Array, faster: Array
    ) -> tuple[Array, Array]:
        """Return changes of positions and velocities that lead positions onto the constraints."""
        n, calm = len(moved), 0
        before = np.full(n, np.inf)
        for _ in range(MOST_ITERATIONS):
            by = shift(t, self.y[:n], self.y[:n] + (self._low[:n] + moved))
            if not np.isfinite(by).all():
                raise StepError(UNMET)
            size = np.abs(by)
            moved, faster = moved + by, faster + by / h
            calm = calm + 1 if ((size == 0) | (size >= before)).all() else 0
            if calm == CALM:
                return moved, faster
            before = np.where(size > 0, np.minimum(before, size), before)
        raise StepError(DIVERGES)
