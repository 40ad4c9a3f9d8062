"""Methods of SUNDIALS through the optional package scikit-sundae.

Hindmarsh and others, *ACM Trans. Math. Softw.* 31 (2005) 363. Its solvers keep their past states
to themselves, so that they can be neither moved nor written.
"""

from __future__ import annotations

from abc import abstractmethod
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import UNDERFLOW, Control, Integrator, StepError
from lagrange_cli.simulate.integrators.right_hand_side import Rhs

#: Its smallest relative tolerance; below it the tolerance is what ``atol`` gives.
_SMALLEST_RTOL = 1e-14

#: Steps of fewer units in the last place of t have underflowed.
_SMALLEST_STEP = 10

#: Factor by which a first step becomes shorter that could not be made.
_SHORTER = 1e-6

#: Shortest first step, as a part of the time to the end.
_SHORTEST = 1e-25


class Sundials(Integrator):
    """A solver of SUNDIALS over z = (y − y0)/scale, so that a large offset costs no digits."""

    variable_order = True
    resumes = False
    shortens = False
    package = "sksundae", "sundials"

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        self._origin = np.array(y0, dtype=float)
        self.t, self.y, self.t_end = t0, self._origin, t_end
        self._rhs = self._counted(rhs)
        rtol = float(np.max(control.rtol, initial=0.0))
        # |y| in the tolerance is taken from the start where it is an offset of z.
        atol = control.atol + control.rtol * np.abs(self._origin)
        self._scale = self._scales(np.where(control.atol > 0, control.atol, atol))
        self._options: dict[str, Any] = {
            "rtol": max(rtol, _SMALLEST_RTOL),
            "atol": np.maximum(atol / self._scale, np.finfo(float).tiny),
            "first_step": min(control.first_step, t_end - t0),
            "max_step": min(control.max_step, t_end - t0),
        }
        self._start = t0
        self._solver: Any = self._begun(**self._options)

    def _scales(self, small: Array) -> Array:
        """Return the unit of each component of z in y; ``small`` is what counts as little of it."""
        return np.ones_like(small)

    @abstractmethod
    def _begun(self, **options: Any) -> Any:
        """Make the solver, at the start."""

    def step(self, limit: float) -> None:
        solution = self._one_step(limit)
        while not solution.success and self.t == self._start and self._begins_shorter():
            solution = self._one_step(limit)
        shortest = _SMALLEST_STEP * np.spacing(abs(self.t))
        if not solution.success or (solution.t < limit and solution.t - self.t < shortest):
            raise StepError(UNDERFLOW)
        self._arrive(solution)

    def _one_step(self, limit: float) -> Any:
        # It prints why a step failed.
        with redirect_stdout(StringIO()):
            solution = self._solver.step(limit, method="onestep", tstop=limit)
            if solution.success and solution.t == self.t:
                # After a state within the last step it gives that of the step's end first.
                solution = self._solver.step(limit, method="onestep", tstop=limit)
        return solution

    def _begins_shorter(self) -> bool:
        """Begin anew with a shorter step, as it gives up after few; False where there is none."""
        step = self._options["first_step"] * _SHORTER
        rounding = _SMALLEST_STEP * np.spacing(abs(self.t))
        if step < max(rounding, _SHORTEST * (self.t_end - self.t)):
            return False
        self._options["first_step"] = step
        self._solver = self._begun(**self._options)
        return True

    def _arrive(self, solution: Any) -> None:
        """Stand at the end of a step."""
        t = float(solution.t)
        self.y, self.t = self._arrived(t, self._state(solution.y)), t

    def _state(self, z: Array) -> Array:
        return self._origin + self._scale * z

    def interpolate(self, times: Array) -> Array:
        return np.array([self._state(self._solver.step(t).y) for t in times.tolist()])


class CVODE(Sundials):
    """Backward differentiation of variable coefficients, orders 1 to 5.

    SUNDIALS can project within its steps (Eich, *SIAM J. Numer. Anal.* 30 (1993) 1467), which
    scikit-sundae does not offer; a solver begun anew behind each projected step would stay at
    order 1. :class:`.ida.IDA` is for systems with constraints.
    """

    name = "CVODE"
    title = "backward differentiation of SUNDIALS, implicit, for stiff systems"
    order = 5
    implicit = True
    projects = False

    def _begun(self, **options: Any) -> Any:
        from sksundae import cvode

        def slope(t: float, z: Array, out: Array) -> None:
            out[:] = self._rhs(t, self._state(z))

        solver = cvode.CVODE(slope, method="BDF", **options)
        solver.init_step(self.t, np.zeros_like(self._origin))
        return solver
