"""Canonical equations as a system to solve and expressions to evaluate.

With p = ∂L/∂q̇ = M q̇ + b, velocities solve M q̇ = p − b by the matrix of the accelerations, and
ṗ = ∂L/∂q − ∂D/∂q̇ + Q is read off at them: no derivative of an inverse stands in it. Where momenta
are inputs they take the places of the velocities.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.program.solvers.blocks import MassMatrixSystem

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations


def momenta(e: Equations) -> list[Expr]:
    """∂L/∂q̇ of each coordinate."""
    return [derivative(e.lagrangian, c.v) for c in e.coordinates]


def _legendre(e: Equations) -> MassMatrixSystem:
    at_rest = {c.v: sympy.S.Zero for c in e.coordinates}
    pairs = zip(e.coordinates, momenta(e), strict=True)
    return MassMatrixSystem([c.v - p.xreplace(at_rest) for c, p in pairs])


def _rates(e: Equations) -> Iterable[Expr]:
    for j, c in enumerate(e.coordinates):
        forces = (force.generalized[j] for force in e.forces)
        friction = -derivative(e.dissipation, c.v)
        yield sympy.Add(derivative(e.lagrangian, c.q), friction, *forces)


#: Output of equations without multipliers → the system with the mass matrix that it solves.
CANONICAL_SYSTEMS = {"legendre": _legendre}

#: Output of the same → its expressions.
CANONICAL_OUTPUTS = {"momenta": momenta, "momentum_rates": _rates}
