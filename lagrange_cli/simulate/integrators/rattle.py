"""RATTLE: Störmer's and Verlet's method on constraints."""

from __future__ import annotations

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    UNMET,
    Control,
    Rhs,
    Shift,
    StepError,
    UnfitError,
    projection,
)
from lagrange_cli.simulate.integrators.symplectic import CALM, DIVERGES, MOST_ITERATIONS, Verlet


def require_shift(rhs: Rhs) -> Shift | None:
    """Return the change that leads positions back to constraints, None without constraints.

    Raises
    ------
    UnfitError
        It has constraints, and no such function.
    """
    shift: Shift | None = getattr(rhs, "shift", None)
    if shift is None and projection(rhs) is not None:
        raise UnfitError("its constraints are not to be had by themselves")
    return shift


class Rattle(Verlet):
    """Andersen, *J. Comput. Phys.* 52 (1983) 24; *Geometric Numerical Integration*, VII.1.4.

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
