"""Explicit Runge–Kutta methods: SciPy's adaptive pairs and the classical RK4.

SciPy is imported when one of its methods is first used.

All of them integrate the increment z = y − base and move the base along after
every step, so that the sum over steps is compensated (Kahan; Hairer, Lubich,
Wanner, *Geometric Numerical Integration*, VIII.5): the rounding of y + Δy is
kept and added to the next step instead of being lost.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Control, Rhs, StepError
from lagrange_cli.simulate.integrators.fixed_step import FixedStep, two_sum
from lagrange_cli.simulate.integrators.scipy_state import ScipyIntegrator

if TYPE_CHECKING:
    from scipy.integrate import DenseOutput


class _ScipyPair(ScipyIntegrator):
    """An embedded pair of SciPy, stepped one step at a time."""

    pair: ClassVar[str]
    kept = ("_base",)

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        from scipy import integrate

        self._rhs = self._counted(rhs)
        self._control = control
        self._dense: DenseOutput | None = None
        self._base = np.array(y0, dtype=float)
        self._solver = getattr(integrate, self.pair)(
            self._of_increment,
            t0,
            np.zeros_like(self._base),
            t_end,
            max_step=control.max_step,
            first_step=min(control.first_step, t_end - t0),
        )
        # The tolerance belongs to y, not to the increment: it is set before each step.
        self._solver.rtol = 0.0
        self.t, self.y, self.t_end = t0, self._base, t_end

    def _of_increment(self, t: float, z: Array) -> Array:
        return self._rhs(t, self._base + z)

    def step(self, limit: float) -> None:
        solver = self._solver
        self._base, solver.y = two_sum(self._base, solver.y)
        solver.atol = self._control.atol + self._control.rtol * np.abs(self._base)
        solver.step()
        if solver.status == "failed":
            raise StepError("the step size underflowed")
        t, y = float(solver.t), self._base + solver.y
        projected = self._arrived(t, y)
        if projected is not y:
            # The slope is that of the next step's start.
            solver.y = solver.y + (projected - y)
            solver.f = solver.fun(t, solver.y)
        self.t, self.y = t, projected

    def interpolate(self, times: Array) -> Array:
        # Events are looked for at many times of a step, and an interpolant costs slopes.
        if self._dense is None or self._dense.t != self._solver.t:
            self._dense = self._solver.dense_output()
        return np.asarray(self._base[:, None] + self._dense(times)).T


class RK45(_ScipyPair):
    """Dormand and Prince, *J. Comput. Appl. Math.* 6 (1980) 19, order 5(4)."""

    name = "RK45"
    title = "Dormand–Prince 5(4), explicit"
    order = 5
    pair = "RK45"


class DOP853(_ScipyPair):
    """Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, II.5, order 8(5,3)."""

    name = "DOP853"
    title = "Dormand–Prince 8(5,3), explicit"
    order = 8
    pair = "DOP853"


class RK4(FixedStep):
    """Kutta's classical method of order 4 with a fixed step."""

    name = "RK4"
    title = "classical Runge–Kutta, explicit, fixed step"
    order = 4

    def _change(self, t: float, h: float) -> Array:
        y, rhs = self.y, self._rhs
        k1 = rhs(t, y)
        k2 = rhs(t + h / 2, y + h / 2 * k1)
        k3 = rhs(t + h / 2, y + h / 2 * k2)
        k4 = rhs(t + h, y + h * k3)
        return h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
