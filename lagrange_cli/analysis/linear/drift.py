"""Small motions at all values of the coordinates that are free at an equilibrium.

A verdict is printed for all of these values, and computed at one of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.analysis.forms.voronets import voronets_form
from lagrange_cli.analysis.linear.linearize import exact_matrices
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.proofs.zero_test import does_not_depend
from lagrange_cli.mechanics.sparse import entries

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.analysis.linear.second_order import LinearSystem
    from lagrange_cli.analysis.values import Equilibrium


def varies_along_drift(system: RestSystem, at: Equilibrium, linear: LinearSystem) -> bool:
    """True unless verdicts are proven to be the same at all values of free coordinates.

    With constraints between velocities the equations over independent velocities are not to hold
    them. Otherwise K does not where no force depends on them at rest, and C and M are asked; M
    does not matter where signs of K decide, which is where C is zero and K symmetric.
    """
    equations, names = system.equations, set(at.free)
    coordinates = equations.system.coordinates
    if any(c.kind == "velocity" for c in equations.system.closures):
        return bool(names) and not names <= _placeless(system)
    free = {c.q for c in coordinates if c.name in names}
    if free & {c.q for k, c in enumerate(coordinates) if k not in system.free}:
        exact = exact_matrices(system, at)
        if exact is None:
            return True
        matrices = (exact.mass, exact.damping, exact.stiffness)
        return any(e.free_symbols & free for rows in matrices for row in rows for e in row)
    still = {c.v: sp.S.Zero for c in coordinates}
    dragging = [f for f in equations.system.forcing if symbols_in(f) & free]
    varying = [derivative(f, c.v).xreplace(still) for f in dragging for c in coordinates]
    if linear.has_velocity_forces or linear.stiffness != linear.stiffness.T:
        varying += [e for row in equations.system.mass_matrix for e in entries(row).values()]
    return not all(does_not_depend(e, q) for e in varying for q in free & e.free_symbols)


def _placeless(system: RestSystem) -> set[str]:
    """List coordinates that the equations over independent velocities do not hold."""
    try:
        written = voronets_form(system.equations)
    except InputError:
        return set()
    return {c.name for c in (*written.dependent, *written.ignored)}
