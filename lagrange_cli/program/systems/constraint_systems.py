"""Closure and canonical equations as systems to solve and expressions to evaluate.

With accelerations a and multipliers λ, M a = f + Σ λ·gradient and
gradient·a + bias = 0. A state that has left the closures is led back by the
same matrix: M δ = Σ μ·gradient and gradient·δ + residual = 0 is the smallest
change δ, in the metric of the kinetic energy, that makes the linearized
residuals vanish (Hairer, Lubich, Wanner, *Geometric Numerical Integration*,
2nd ed., IV.4 and VII.1).

Canonical equations need the same matrix: with p = ∂L/∂q̇ = M q̇ + b, velocities solve M q̇ = p − b,
and ṗ = ∂L/∂q − ∂D/∂q̇ + Q is read off at them, without the derivative of an inverse. Where momenta
are inputs they take the places of the velocities.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import sympy

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.program.solvers.blocks import MassMatrixSystem

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure

_Weighted: TypeAlias = "Sequence[tuple[Closure, Expr]]"
"""Closures, each with its weight: 1, or the flag of a contact."""

_Choice: TypeAlias = "Callable[[Equations], _Weighted]"
"""Chooses closures of equations."""


def _rate_of(closure: Closure, e: Equations) -> Expr:
    """gradient·v + rate."""
    return sympy.Add(*_rate_terms(closure, e))


def _rate_terms(closure: Closure, e: Equations) -> list[Expr]:
    return [*_products(closure, [c.v for c in e.system.coordinates]), closure.rate]


def _products(closure: Closure, by: Sequence[Expr]) -> list[Expr]:
    """The terms of gradient·x."""
    return [g * by[j] for j, g in entries(closure.gradient).items()]


def times(weight: Expr, row: Sequence[Expr]) -> Sequence[Expr]:
    """Multiply the entries of a row."""
    if weight == 1:
        return row
    return ExpressionRow(len(row), {j: weight * entry for j, entry in entries(row).items()})


def no_forces(e: Equations) -> list[Expr]:
    """Return zeros, the right-hand side of a change without forces."""
    return [sympy.S.Zero] * len(e.system.coordinates)


def system_of(
    weighted: _Weighted,
    right: Sequence[Expr],
    bias: Iterable[Expr],
    *,
    whole: bool = False,
    multipliers: bool = False,
) -> MassMatrixSystem:
    """The system of weighted closures: rows with weight 0 leave their multipliers zero."""
    rows = [times(weight, closure.gradient) for closure, weight in weighted]
    biases = [weight * b for (_, weight), b in zip(weighted, bias, strict=True)]
    return MassMatrixSystem(
        right,
        list(zip(rows, biases, strict=True)),
        whole=whole,
        multipliers=multipliers,
        compliance=[1 - weight for _, weight in weighted],
    )


def systems_of(closures: _Choice) -> dict[str, Callable[[Equations], MassMatrixSystem]]:
    """Map each output to the system with the mass matrix that it solves."""

    def biases(e: Equations) -> list[Expr]:
        return [c.bias for c, _ in closures(e)]

    def position_change(e: Equations) -> MassMatrixSystem:
        weighted = _of_positions(closures(e))
        return system_of(weighted, no_forces(e), (c.expression for c, _ in weighted))

    return {
        "acceleration": lambda e: system_of(closures(e), e.system.forcing, biases(e), whole=True),
        "multipliers": lambda e: system_of(
            closures(e), e.system.forcing, biases(e), multipliers=True
        ),
        "position_change": position_change,
        "velocity_change": lambda e: system_of(
            closures(e), no_forces(e), (_rate_of(c, e) for c, _ in closures(e))
        ),
    }


def _plain(e: Equations) -> _Weighted:
    """The closures, with weight 1."""
    return [(closure, sympy.S.One) for closure in e.system.closures]


def _of_positions(weighted: _Weighted) -> _Weighted:
    return [(closure, weight) for closure, weight in weighted if closure.kind == "position"]


def _shifted_change(e: Equations) -> MassMatrixSystem:
    """Set up the change of shifted positions along the gradients at the positions q.

    The shifted positions stand in place of the velocities (RATTLE; *Geometric Numerical
    Integration*, VII.1.4).
    """
    there = {c.q: c.v for c in e.system.coordinates}
    weighted = _of_positions(_plain(e))
    return system_of(weighted, no_forces(e), (c.expression.xreplace(there) for c, _ in weighted))


#: Output → the system with the mass matrix that it solves.
CLOSURE_SYSTEMS = {**systems_of(_plain), "shifted_change": _shifted_change}


def residual_size(closure: Closure, e: Equations) -> Expr:
    """Sum the magnitudes of which a residual is the difference, each of them rounded.

    These are its terms, and the products of the gradient with the coordinates.
    """
    terms = sympy.Add.make_args(closure.expression)
    return _magnitude([*terms, *_products(closure, [c.q for c in e.system.coordinates])])


def _gradient_square(gradient: Sequence[Expr], e: Equations) -> Expr:
    """Σ gradient²/M over the diagonal of the mass matrix.

    But for couplings it is the square of the largest change of a residual by a change of the
    coordinates of norm 1 in the metric of the kinetic energy.
    """
    masses = {j: e.system.mass_matrix[j][j] for j in entries(gradient)}
    squares = (g**2 / masses[j] for j, g in entries(gradient).items() if masses[j] != 0)
    return sympy.Add(*squares)


def _rate_size(closure: Closure, e: Equations) -> Expr:
    """Sum the magnitudes of the terms of gradient·v + rate."""
    return _magnitude(_rate_terms(closure, e))


def _magnitude(terms: Sequence[Expr]) -> Expr:
    """Σ |term|, which SymPy does not evaluate further."""
    numbers = [abs(term) for term in terms if term.is_Number]
    others = [sympy.Abs(term, evaluate=False) for term in terms if not term.is_Number]
    return sympy.Add(*numbers, *others)


def outputs_of(closures: _Choice) -> dict[str, Callable[[Equations], Iterable[Expr]]]:
    """Map each output of closures to its expressions."""

    def of_positions(e: Equations) -> _Weighted:
        return _of_positions(closures(e))

    return {
        "closures": lambda e: [s * c.expression for c, s in of_positions(e)],
        "closure_sizes": lambda e: [s * residual_size(c, e) for c, s in of_positions(e)],
        "closure_gradient_squares": lambda e: [
            _gradient_square(times(s, c.gradient), e) for c, s in of_positions(e)
        ],
        "closure_rates": lambda e: [s * _rate_of(c, e) for c, s in closures(e)],
        "closure_rate_sizes": lambda e: [s * _rate_size(c, e) for c, s in closures(e)],
    }


#: Output of the closures → its expressions.
CLOSURE_OUTPUTS = outputs_of(_plain)


def momenta(e: Equations) -> list[Expr]:
    """∂L/∂q̇ of each coordinate."""
    return [derivative(e.system.lagrangian, c.v) for c in e.system.coordinates]


def _legendre(e: Equations) -> MassMatrixSystem:
    at_rest = {c.v: sympy.S.Zero for c in e.system.coordinates}
    pairs = zip(e.system.coordinates, momenta(e), strict=True)
    return MassMatrixSystem([c.v - p.xreplace(at_rest) for c, p in pairs])


def _rates(e: Equations) -> Iterable[Expr]:
    for j, c in enumerate(e.system.coordinates):
        forces = (force.generalized[j] for force in e.system.forces)
        friction = -derivative(e.system.dissipation, c.v)
        yield sympy.Add(derivative(e.system.lagrangian, c.q), friction, *forces)


#: Output of equations without multipliers → the system with the mass matrix that it solves.
CANONICAL_SYSTEMS = {"legendre": _legendre}

#: Output of the same → its expressions.
CANONICAL_OUTPUTS = {"momenta": momenta, "momentum_rates": _rates}
