"""The registry of integration methods; see :mod:`.base` for how to add one."""

from __future__ import annotations

from lagrange_cli.simulate.integrators.base import Control, Integrator, Rhs, StepError
from lagrange_cli.simulate.integrators.implicit import BDF, LSODA, Radau
from lagrange_cli.simulate.integrators.runge_kutta import DOP853, RK4, RK45

__all__ = ["INTEGRATORS", "Control", "Integrator", "Rhs", "StepError"]

#: Every method by the name that the user types.
INTEGRATORS: dict[str, type[Integrator]] = {
    method.name: method for method in (DOP853, RK45, RK4, Radau, BDF, LSODA)
}
