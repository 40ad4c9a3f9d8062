"""The registry of integration methods; see :mod:`.base` for how to add one."""

from __future__ import annotations

from functools import partial

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Control, Integrator, StepError
from lagrange_cli.simulate.integrators.external.heyoka_method import Taylor
from lagrange_cli.simulate.integrators.external.ida import IDA
from lagrange_cli.simulate.integrators.external.sundials import CVODE
from lagrange_cli.simulate.integrators.gauss import Gauss16
from lagrange_cli.simulate.integrators.hybrid.contact_motion import ContactMotion
from lagrange_cli.simulate.integrators.hybrid.contact_system import HybridRhs
from lagrange_cli.simulate.integrators.hybrid.sampled_motion import SampledMotion
from lagrange_cli.simulate.integrators.hybrid.surface_motion import SurfaceMotion
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.native.methods import COMPILED
from lagrange_cli.simulate.integrators.piecewise import in_pieces
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, structured
from lagrange_cli.simulate.integrators.scipy_methods import BDF, DOP853, LSODA, RK4, RK45, Radau
from lagrange_cli.simulate.integrators.symplectic import Gauss4, Gauss6, Rattle, Verlet

__all__ = ["INTEGRATORS", "Control", "Integrator", "Rhs", "StepError", "start_integrator"]

#: Every method by the name that the user types.
INTEGRATORS: dict[str, type[Integrator]] = {
    method.name: method
    for method in (
        *(DOP853, Gauss16, RK45, RK4, Verlet, Rattle, Gauss4, Gauss6),
        *(Radau, BDF, LSODA, Taylor, CVODE, IDA),
    )
}


def start_integrator(
    method: type[Integrator], rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control
) -> Integrator:
    """Stand at (t0, y0) with a method, in machine code where it and ``rhs`` have one."""
    structure = structured(rhs)
    if not method.projects and structure.project is not None:
        raise ValueError(f"{method.name} cannot move its states onto constraints")
    if structure.sampling is not None:
        return SampledMotion(partial(start_integrator, method), rhs, t0, y0, t_end, control)
    if isinstance(rhs, HybridRhs):
        return ContactMotion(partial(start_integrator, method), rhs, t0, y0, t_end, control)
    if structure.surfaces is not None and method.interpolates and not method.traces:
        return SurfaceMotion(partial(start_integrator, method), rhs, t0, y0, t_end, control)
    implementation = _implementation(method, rhs)
    if implementation is method and structure.pieces is not None:
        integrator = in_pieces(method, structure, t0, y0, t_end, control)
    else:
        integrator = implementation(rhs, t0, y0, t_end, control)
    if control.observed is not None:
        integrator.observe(control.observed)
    if control.loosening is not None:
        integrator.loosen_by(control)
    return integrator


def _implementation(method: type[Integrator], rhs: Rhs) -> type[Integrator]:
    """Return the compiled method if ``rhs`` is compiled and its kernel there, else the method."""
    compiled = COMPILED.get(method.name)
    if compiled is None or not isinstance(rhs, NativeRhs) or rhs.kernels is None:
        return method
    return method if rhs.kernels(compiled.kernel) is None else compiled
