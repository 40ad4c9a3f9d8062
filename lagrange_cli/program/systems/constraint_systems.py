"""Closure equations as systems to solve and expressions to evaluate.

With accelerations a and multipliers λ, M a = f + Σ λ·gradient and
gradient·a + bias = 0. A state that has left the closures is led back by the
same matrix: M δ = Σ μ·gradient and gradient·δ + residual = 0 is the smallest
change δ, in the metric of the kinetic energy, that makes the linearized
residuals vanish (Hairer, Lubich, Wanner, *Geometric Numerical Integration*,
2nd ed., IV.4 and VII.1).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.program.solvers.blocks import MassMatrixSystem

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Closure, Equations


def _position_closures(e: Equations) -> list[Closure]:
    return [c for c in e.closures if c.kind == "position"]


def _rates(e: Equations) -> list[Expr]:
    """Residuals of the velocities: φ̇ of position closures, ψ of velocity closures."""
    return [rate_of(c, e) for c in e.closures]


def rate_of(closure: Closure, e: Equations) -> Expr:
    """gradient·v + rate."""
    return sympy.Add(*_rate_terms(closure, e))


def _rate_terms(closure: Closure, e: Equations) -> list[Expr]:
    return [*_products(closure, [c.v for c in e.coordinates]), closure.rate]


def _products(closure: Closure, by: Sequence[Expr]) -> list[Expr]:
    """The terms of gradient·x."""
    return [g * by[j] for j, g in entries(closure.gradient).items()]


def _acceleration(e: Equations) -> MassMatrixSystem:
    return MassMatrixSystem(e.forcing, [(c.gradient, c.bias) for c in e.closures])


def _multipliers(e: Equations) -> MassMatrixSystem:
    closures = [(c.gradient, c.bias) for c in e.closures]
    return MassMatrixSystem(e.forcing, closures, whole=False, multipliers=True)


def _position_change(e: Equations) -> MassMatrixSystem:
    closures = [(c.gradient, c.expression) for c in _position_closures(e)]
    return MassMatrixSystem([sympy.S.Zero] * len(e.coordinates), closures, whole=False)


def _shifted_change(e: Equations) -> MassMatrixSystem:
    """Like a change of positions, of those that stand in the place of velocities, along the
    gradients at the positions (RATTLE; *Geometric Numerical Integration*, VII.1.4)."""
    there = {c.q: c.v for c in e.coordinates}
    closures = [(c.gradient, c.expression.xreplace(there)) for c in _position_closures(e)]
    return MassMatrixSystem([sympy.S.Zero] * len(e.coordinates), closures, whole=False)


def _velocity_change(e: Equations) -> MassMatrixSystem:
    closures = [(c.gradient, rate) for c, rate in zip(e.closures, _rates(e), strict=True)]
    return MassMatrixSystem([sympy.S.Zero] * len(e.coordinates), closures, whole=False)


#: Output → the system with the mass matrix that it solves.
CLOSURE_SYSTEMS: dict[str, Callable[[Equations], MassMatrixSystem]] = {
    "acceleration": _acceleration,
    "multipliers": _multipliers,
    "position_change": _position_change,
    "shifted_change": _shifted_change,
    "velocity_change": _velocity_change,
}


def residual_size(closure: Closure, e: Equations) -> Expr:
    """Sum of the magnitudes that a residual is the difference of, each of which is rounded:
    its terms, and what the coordinates contribute to first order."""
    terms = sympy.Add.make_args(closure.expression)
    return _magnitude([*terms, *_products(closure, [c.q for c in e.coordinates])])


def gradient_square(gradient: Sequence[Expr], e: Equations) -> Expr:
    """Σ gradient²/M over the diagonal of the mass matrix: the square of what a change of norm 1,
    in the metric of the kinetic energy, does to a residual, but for couplings."""
    masses = {j: e.mass_matrix[j][j] for j in entries(gradient)}
    squares = (g**2 / masses[j] for j, g in entries(gradient).items() if masses[j] != 0)
    return sympy.Add(*squares)


def rate_size(closure: Closure, e: Equations) -> Expr:
    """Sum of the magnitudes that gradient·v + rate is the difference of."""
    return _magnitude(_rate_terms(closure, e))


def _magnitude(terms: Sequence[Expr]) -> Expr:
    """Σ |term|, as it stands: SymPy need not look into the terms."""
    numbers = [abs(term) for term in terms if term.is_Number]
    others = [sympy.Abs(term, evaluate=False) for term in terms if not term.is_Number]
    return sympy.Add(*numbers, *others)


#: Output of the closures → its expressions.
CLOSURE_OUTPUTS: dict[str, Callable[[Equations], Iterable[Expr]]] = {
    "closures": lambda e: [c.expression for c in _position_closures(e)],
    "closure_sizes": lambda e: [residual_size(c, e) for c in _position_closures(e)],
    "closure_gradient_squares": lambda e: [
        gradient_square(c.gradient, e) for c in _position_closures(e)
    ],
    "closure_rates": _rates,
    "closure_rate_sizes": lambda e: [rate_size(c, e) for c in e.closures],
}
