"""The textbook form of the equations of motion.

Terms are ordered by ddot, dot, none, multipliers. A common factor is divided out when it is
a number, a mass or a ``positive`` parameter, since that can never hide
anything. The equation of a cyclic coordinate is left as it is: it reads
ṗ = 0 with the momentum that is reported beside it. A coordinate is divided out
only where the scene's ``expect`` writes the equation so, since that hides a
singular point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp

from lagrange_cli.mechanics.derivation import Derivation
from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.grouping import by_velocities, positional_groups
from lagrange_cli.mechanics.terms import common_factor, factored, scaled

__all__ = ["shown_equation"]

#: Whether the equation with this residual, divided by this factor, is the one asked for.
Asked = Callable[[sp.Expr], bool]


def shown_equation(
    derivation: Derivation, row: int, cyclic: bool, asked: Asked | None
) -> ShownEquation:
    """Textbook form of one equation.

    Parameters
    ----------
    cyclic
        Whether the equation is a conservation law and stays undivided.
    asked
        Tells whether ``expect`` asks for a given residual; None if it asks for none.
    """
    coordinates = derivation.reduced.coordinates
    parameters = frozenset(derivation.reduced.names.parameters.values())
    name = coordinates[row].name
    groups = _groups(derivation, row, parameters)
    whole = common_factor([c for c, _ in groups])
    divisor = _harmless(whole, parameters, cyclic)
    if asked is not None and not cyclic and (whole / divisor).free_symbols:
        candidate = ShownEquation(name, _divided(groups, whole), whole)
        if asked(candidate.residual):
            return candidate
    return ShownEquation(name, _divided(groups, divisor), divisor)


def _groups(
    derivation: Derivation, row: int, parameters: frozenset[sp.Symbol]
) -> list[tuple[sp.Expr, sp.Expr]]:
    """(coefficient, factor) in display order."""
    coordinates = derivation.reduced.coordinates
    found = [
        (factored(list(terms)), c.a)
        for terms, c in zip(derivation.mass[row], coordinates, strict=True)
        if terms
    ]
    velocities = [c.v for c in coordinates]
    rest = [-f for f in derivation.forcing[row]]
    for monomial, cofactors in by_velocities(rest, velocities):
        if monomial != 1:
            found.append((factored(cofactors), monomial))
        else:
            held = [c for c in cofactors if c.free_symbols & set(velocities)]
            free = [c for c in cofactors if not c.free_symbols & set(velocities)]
            found.extend((c, sp.Integer(1)) for c in held)
            found.extend((c, sp.Integer(1)) for c in positional_groups(free, parameters))
    gradients = ((c.gradient[row], c.multiplier) for c in derivation.closures)
    found.extend((-g, multiplier) for g, multiplier in gradients if g is not sp.S.Zero)
    return [(c, f) for c, f in found if c != 0]


def _harmless(whole: sp.Expr, parameters: frozenset[sp.Symbol], cyclic: bool) -> sp.Expr:
    """The part of a common factor that is never zero: numbers, masses, positive parameters."""
    if cyclic:
        return sp.Integer(1)
    number, rest = whole.as_coeff_Mul(rational=True)
    factors = [f for f in sp.Mul.make_args(rest) if f.is_positive and f.free_symbols <= parameters]
    return scaled(number, sp.Mul(*factors))


def _divided(
    groups: Sequence[tuple[sp.Expr, sp.Expr]], divisor: sp.Expr
) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
    if divisor == 1:
        return tuple(groups)
    return tuple(_quotient(c, f, divisor) for c, f in groups)


def _quotient(coefficient: sp.Expr, factor: sp.Expr, divisor: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    number, rest = coefficient.as_coeff_Mul(rational=True)
    by_number, by_rest = divisor.as_coeff_Mul(rational=True)
    value = rest / by_rest
    scale = number / by_number
    if value.is_Add and scale != 1:
        return sp.Add(*(scale * term for term in value.args)), factor
    return scale * value, factor
