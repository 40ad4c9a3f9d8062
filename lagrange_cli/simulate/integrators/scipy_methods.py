"""Methods of SciPy as integrators: explicit pairs, implicit and switching methods; classical RK4.

SciPy is imported when one of its methods is first used.

The explicit ones integrate the increment z = y − base and move the base along after
every step, so that the sum over steps is compensated (Kahan; Hairer, Lubich,
Wanner, *Geometric Numerical Integration*, VIII.5): the rounding of y + Δy is
kept and added to the next step instead of being lost.

Jacobians of the implicit ones are differences of the right-hand side on the scale of the motion:
SciPy's own move numbers by a part of their offset from the start, or of the tolerance, which is
lost in the rounding of the state if that is small.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    UNDERFLOW,
    Control,
    FixedStep,
    Integrator,
    SavedState,
    StepError,
    two_sum,
)
from lagrange_cli.simulate.integrators.differences import distances, quotients
from lagrange_cli.simulate.integrators.right_hand_side import Rhs

if TYPE_CHECKING:
    from scipy.integrate import DenseOutput

#: Types of values, as against functions and other objects.
_PLAIN = (bool, int, float, str, np.generic, np.ndarray, type(None))


class ScipyIntegrator(Integrator):
    """A solver of SciPy over the difference to an origin, stepped one step at a time."""

    _solver: Any

    def state(self) -> SavedState:
        return {**super().state(), "solver": _solver_state(self._solver)}

    def restore(self, state: SavedState) -> None:
        super().restore(state)
        _restore_solver(self._solver, state["solver"])


def _solver_state(solver: Any) -> SavedState:
    """Copy all attributes of a solver that are values, or pairs of them."""
    return {name: _copied(value) for name, value in vars(solver).items() if _plain(value)}


def _restore_solver(solver: Any, state: SavedState) -> None:
    """Give a fresh solver of the same problem these attributes."""
    for name, value in state.items():
        setattr(solver, name, _copied(value))
    if hasattr(solver, "K_extended"):
        # The slopes of a step are a part of those of its interpolant.
        solver.K = solver.K_extended[: solver.n_stages + 1]
    if getattr(solver, "Z", None) is not None:
        # Radau's next step begins with the interpolant of the last one.
        solver.sol = solver._compute_dense_output()


def _plain(value: Any) -> bool:
    return isinstance(value, _PLAIN) or (isinstance(value, tuple) and all(map(_plain, value)))


def _copied(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_copied, value))
    return value.copy(order="K") if isinstance(value, np.ndarray) else value


class _ScipyPair(ScipyIntegrator):
    """An embedded pair of SciPy, stepped one step at a time."""

    pair: ClassVar[str]
    state_attributes = ("_base",)

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
            raise StepError(UNDERFLOW)
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


#: SciPy's smallest relative tolerance; below it the tolerance is what ``atol`` gives.
_SMALLEST_RTOL = 100 * np.finfo(float).eps


#: Steps of fewer units in the last place of t have underflowed.
_SMALLEST_STEP = 10


class _ScipyImplicit(ScipyIntegrator):
    """A solver of SciPy over z = y − y0, so that a large offset costs no digits."""

    implicit = True
    solver: ClassVar[str]
    state_attributes: ClassVar[tuple[str, ...]] = ("_moved",)

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
            raise StepError(Phrase("the Jacobian is no longer finite")) from error
        # LSODA goes on with steps that no longer change t.
        crawls = solver.t < limit and solver.t - self.t < _SMALLEST_STEP * np.spacing(abs(self.t))
        if solver.status == "failed" or crawls:
            raise StepError(UNDERFLOW)
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
    state_attributes = ("_moved", "_start")

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
