"""Symbols of canonical momenta, which are independent of the velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate


@dataclass(frozen=True)
class Momentum:
    """The momentum of a coordinate, p = ∂L/∂q̇.

    Attributes
    ----------
    coordinate
        Its coordinate.
    name, symbol
        ``p_theta``, and the symbol of that name.
    expression
        Its value over (q, v, t).
    """

    coordinate: Coordinate
    name: str
    symbol: sp.Symbol
    expression: sp.Expr


def momenta(
    equations: Equations, coordinates: Sequence[Coordinate], expressions: Sequence[sp.Expr]
) -> tuple[Momentum, ...]:
    """Name the momenta of some coordinates: p_NAME, or P_NAME if the scene uses such a name."""
    letter = momentum_letter(equations)
    names = [f"{letter}_{c.name}" for c in coordinates]
    return tuple(
        Momentum(c, name, sp.Symbol(name, real=True), expression)
        for c, name, expression in zip(coordinates, names, expressions, strict=True)
    )


def with_momenta(equations: Equations) -> Equations:
    """Add the momenta of all coordinates to the outputs, behind those of the scene."""
    coordinates = equations.system.coordinates
    slopes = [derivative(equations.system.lagrangian, c.v) for c in coordinates]
    named = momenta(equations, coordinates, slopes)
    further = ((momentum.name, momentum.expression) for momentum in named)
    return replace(
        equations, system=replace(equations.system, outputs=(*equations.system.outputs, *further))
    )


def momentum_letter(equations: Equations) -> str:
    """Return the first of p, P, pp, PP, … whose names of momenta are free in the scene."""
    taken = {p.name for p in equations.system.parameters} | {
        x.name for x in equations.system.external
    }
    taken |= {c.name for c in equations.system.coordinates} | {
        c.name for c in equations.system.cartesian_names
    }
    taken |= {
        name for name, _ in (*equations.presentation.abbreviations, *equations.system.outputs)
    }
    names = [c.name for c in equations.system.coordinates]
    letters = (letter * size for size in count(1) for letter in "pP")
    return next(x for x in letters if taken.isdisjoint(f"{x}_{name}" for name in names))
