"""Expressions of the scene language over the symbols of certified equations."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import sympy as sp

from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.symbols.convert import to_sympy, total_derivative
from lagrange_cli.scene.language.expression import Expression


def interpret(
    equations: Equations,
    expression: Expression,
    further: Mapping[str, sp.Expr] = MappingProxyType({}),
) -> sp.Expr:
    """An expression of the scene language over the symbols of ``equations``.

    Names are coordinates, parameters, inputs, Cartesian names, abbreviations, multipliers;
    ``dot`` and ``ddot`` are total time derivatives. ``further`` gives names of momenta.

    Raises
    ------
    InputError
        Located: an unknown name, or a value that is not a finite real number.
    """
    meanings: dict[str, sp.Expr] = {**further, "t": equations.t}
    meanings.update((name, expr) for name, expr in equations.abbreviations)
    for particle in equations.particles:
        for axis, position in zip("xyz", particle.position, strict=True):
            meanings[f"{axis}_{particle.name}"] = position
    multipliers = [c.multiplier for c in equations.pushing]
    meanings.update((multiplier.name, multiplier) for multiplier in multipliers)
    meanings.update((c.name, c.position) for c in equations.cartesian_names)
    meanings.update((p.name, p.symbol) for p in equations.parameters)
    meanings.update((u.name, u.symbol) for u in equations.inputs)
    meanings.update((c.name, c.q) for c in equations.coordinates)
    chain = [(c.q, c.v) for c in equations.coordinates]
    chain += [(c.v, c.a) for c in equations.coordinates]
    return to_sympy(
        expression,
        meanings.get,
        lambda expr: total_derivative(expr, equations.t, chain),
        {f.name: f for f in equations.functions},
    )
