"""Methods of SUNDIALS through the optional package scikit-sundae.

Hindmarsh and others, *ACM Trans. Math. Softw.* 31 (2005) 363. CVODE keeps its past states to
itself, so that they can be neither moved onto constraints nor written.
"""

from __future__ import annotations

from contextlib import redirect_stdout
from io import StringIO
from typing import Any, ClassVar

import numpy as np

from lagrange_cli.simulate.integrators.base import Array, Control, Integrator, Rhs, StepError

__all__ = ["CVODE", "CVODEAdams"]

#: Its smallest relative tolerance; below it the tolerance is what ``atol`` gives.
_SMALLEST_RTOL = 1e-14

#: Steps of fewer units in the last place of t have underflowed.
SMALLEST_STEP = 10


class CVODE(Integrator):
    """Backward differentiation of variable coefficients, orders 1 to 5.

    Over z = y − y0, so that a large offset costs no digits.
    """

    name = "CVODE"
    title = "backward differentiation of SUNDIALS, implicit, for stiff systems"
    order = 5
    variable_order = True
    implicit = True
    projects = False
    resumes = False
    package = "sksundae", "sundials"
    formulas: ClassVar[str] = "BDF"

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        from sksundae import cvode

        origin, counted = np.array(y0, dtype=float), self._counted(rhs)
        self._origin, self.t, self.y, self.t_end = origin, t0, origin, t_end

        def slope(t: float, z: Array, out: Array) -> None:
            out[:] = counted(t, origin + z)

        rtol = float(np.max(control.rtol, initial=0.0))
        last = max(abs(t0), abs(t_end))
        self._solver: Any = cvode.CVODE(
            slope,
            method=self.formulas,
            rtol=max(rtol, _SMALLEST_RTOL),
            # |y| in the tolerance is taken from the start where it is an offset of z.
            atol=np.maximum(control.atol + control.rtol * np.abs(origin), np.finfo(float).tiny),
            first_step=min(control.first_step, t_end - t0),
            min_step=SMALLEST_STEP * float(np.spacing(last)),
            max_step=min(control.max_step, t_end - t0),
        )
        self._solver.init_step(t0, np.zeros_like(origin))

    def step(self, limit: float) -> None:
        # It prints why a step failed.
        with redirect_stdout(StringIO()):
            found = self._solver.step(limit, method="onestep", tstop=limit)
        if not found.success:
            raise StepError("the step size underflowed")
        y = self._origin + np.asarray(found.y, dtype=float)
        if not np.isfinite(y).all():
            raise StepError("the state is no longer finite")
        self.t, self.y = float(found.t), y

    def interpolate(self, times: Array) -> Array:
        return np.array([self._origin + self._solver.step(t).y for t in times.tolist()])


class CVODEAdams(CVODE):
    """Adams' formulas of variable coefficients, orders 1 to 12, solved by Newton's method: those
    of orders 1 and 2 pass over stiffness."""

    name = "CVODE-Adams"
    title = "Adams' formulas of SUNDIALS, for smooth motion"
    order = 12
    formulas = "Adams"
