"""SciPy's implicit and switching methods, for stiff systems.

Jacobians are differences of the right-hand side on the scale of the motion: SciPy's own move
numbers by a part of their offset from the start, or of the tolerance, which is lost in the rounding
of the state where that is small. SciPy is imported when one of its methods is first used.
"""

from __future__ import annotations

import warnings
from typing import Any, ClassVar

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Control, Rhs, StepError
from lagrange_cli.simulate.integrators.differences import distances, quotients
from lagrange_cli.simulate.integrators.scipy_state import ScipyIntegrator

#: SciPy's smallest relative tolerance; below it the tolerance is what ``atol`` gives.
_SMALLEST_RTOL = 100 * np.finfo(float).eps


#: Steps of fewer units in the last place of t have underflowed.
_SMALLEST_STEP = 10


class _ScipyImplicit(ScipyIntegrator):
    """A solver of SciPy over z = y − y0, so that a large offset costs no digits."""

    implicit = True
    solver: ClassVar[str]
    kept: ClassVar[tuple[str, ...]] = ("_moved",)

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        from scipy import integrate

        origin = np.array(y0, dtype=float)
        rtol = max(float(np.max(control.rtol, initial=0.0)), _SMALLEST_RTOL)
        # |y| in the tolerance is taken from the start where it is an offset of z.
        atol = np.maximum(control.atol + control.rtol * np.abs(origin), np.finfo(float).tiny)
        self._origin = origin
        self.t, self.y, self.t_end = t0, origin, t_end
        self._counted_rhs = self._counted(rhs)
        # How far each number has come, and the tolerance at least.
        self._moved = atol
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._solver: Any = getattr(integrate, self.solver)(
                lambda t, z: self._counted_rhs(t, origin + z),
                t0,
                np.zeros_like(origin),
                t_end,
                first_step=min(control.first_step, t_end - t0),
                max_step=control.max_step,
                rtol=rtol,
                atol=atol,
                **self._jacobian_option(),
            )

    def _jacobian_option(self) -> dict[str, Any]:
        return {"jac": self._jacobian}

    def _jacobian(self, t: float, z: Array) -> Array:
        """Differentiate the right-hand side."""
        y, self._moved = self._origin + z, np.maximum(self._moved, np.abs(z))
        return quotients(lambda y: self._counted_rhs(t, y), y, distances(y, self._moved))

    def step(self, limit: float) -> None:
        solver = self._solver
        if not self.interpolates:
            solver.t_bound, solver.status = limit, "running"
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                solver.step()
        except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
            raise StepError("the Jacobian is no longer finite") from error
        # LSODA goes on with steps that no longer change t.
        crawls = solver.t < limit and solver.t - self.t < _SMALLEST_STEP * np.spacing(abs(self.t))
        if solver.status == "failed" or crawls:
            raise StepError("the step size underflowed")
        t, y = float(solver.t), self._origin + solver.y
        projected = self._arrived(t, y)
        if projected is not y:
            self._move(projected - y)
        self.t, self.y = t, projected

    def _move(self, change: Array) -> None:
        """Let the next step start from a state moved by ``change``."""
        raise NotImplementedError(f"{self.name} does not project")

    def interpolate(self, times: Array) -> Array:
        return np.asarray(self._origin[:, None] + self._solver.dense_output()(times)).T


class Radau(_ScipyImplicit):
    """Hairer and Wanner, *Solving Ordinary Differential Equations II*, IV.8, Radau IIA.

    SciPy's interpolant is of order 3 only: states between the ends of a step are those of a
    shorter step to there, with the same Jacobian.
    """

    name = "Radau"
    title = "Radau IIA, implicit, for stiff systems"
    order = 5
    solver = "Radau"
    kept = ("_moved", "_start")

    def step(self, limit: float) -> None:
        start = self.t, self._solver.y
        super().step(limit)
        self._start = start

    def _move(self, change: Array) -> None:
        solver = self._solver
        solver.y = solver.y + change
        solver.f = solver.fun(solver.t, solver.y)

    def interpolate(self, times: Array) -> Array:
        return np.array([self._origin + self._at(t) for t in times.tolist()])

    def _at(self, end: float) -> Array:
        """Return the solver's state after a shorter step."""
        solver, (t, z) = self._solver, self._start
        if end == t:
            return np.asarray(z)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                part = type(solver)(
                    solver.fun,
                    t,
                    z,
                    end,
                    first_step=end - t,
                    rtol=solver.rtol,
                    atol=solver.atol,
                    jac=solver.J,
                )
                while part.status == "running":
                    part.step()
        except (ValueError, ArithmeticError, np.linalg.LinAlgError):
            return np.full_like(z, np.nan)
        return np.asarray(part.y) if part.status == "finished" else np.full_like(z, np.nan)


class BDF(_ScipyImplicit):
    """Shampine and Reichelt, *SIAM J. Sci. Comput.* 18 (1997) 1, orders 1 to 5."""

    name = "BDF"
    title = "backward differentiation, implicit, for stiff systems"
    order = 5
    variable_order = True
    solver = "BDF"
    shortens = False

    def _move(self, change: Array) -> None:
        # Row 0 is the state, the rows after it are backward differences: this moves the
        # polynomial through the past states as a whole.
        self._solver.D[0] += change
        self._solver.y = self._solver.y + change


class LSODA(_ScipyImplicit):
    """Petzold, *SIAM J. Sci. Stat. Comput.* 4 (1983) 136: Adams to order 12, BDF where stiff.

    Its past states are out of reach, so that they cannot be moved onto constraints, nor written.
    """

    name = "LSODA"
    title = "Adams, switching to backward differentiation where stiff"
    order = 12
    variable_order = True
    solver = "LSODA"
    projects = False
    resumes = False
    shortens = False

    def _jacobian_option(self) -> dict[str, Any]:
        return {}  # its own differences serve it as well
