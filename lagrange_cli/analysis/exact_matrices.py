"""M, C and K at an equilibrium in closed form, for few coordinates without closures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.analysis.values import Equilibrium, ExactMatrices
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import cancelled, factored_form

if TYPE_CHECKING:
    from lagrange_cli.analysis.rest_system import RestSystem

# The budget; all set by hand.

#: Coordinates of M, C, K, and of A and B, which hold the inverse of M.
_MATRICES, _STATE_SPACE = 10, 3
#: Operations of the forcing, and of an entry.
_OPERATIONS, _LONGEST = 1_500, 60
#: Operations of an entry at the equilibrium, before it is simplified.
_PLACED = 300

_Rows = tuple[tuple[sp.Expr, ...], ...]


def exact_matrices(system: RestSystem, at: Equilibrium) -> ExactMatrices | None:
    """Linearize in closed form; None beyond the budget, or at a place known in numbers alone."""
    equations = system.equations
    coordinates = equations.coordinates
    operations = sum(sp.count_ops(f) for f in equations.forcing)
    if at.exact is None or equations.closures or len(coordinates) > _MATRICES:
        return None
    if operations > _OPERATIONS:
        return None
    pairs = zip(coordinates, at.exact, strict=True)
    still = {c.v: sp.S.Zero for c in coordinates}
    place = {c.q: value for c, value in pairs}

    def here(expression: sp.Expr) -> sp.Expr:
        # Momenta hold the coordinates: their roots and angles come last.
        written = expression.xreplace(still)
        if not system.inputs.keys().isdisjoint(written.free_symbols):
            written = cancelled(written.xreplace(system.inputs))
        written = written.xreplace(place)
        return factored_form(cancelled(written)) if sp.count_ops(written) <= _PLACED else sp.nan

    def by(symbols: Sequence[sp.Symbol]) -> _Rows:
        slopes = [[derivative(f, s) for s in symbols] for f in equations.forcing]
        return tuple(tuple(here(-entry) for entry in row) for row in slopes)

    mass = tuple(tuple(here(entry) for entry in row) for row in equations.mass_matrix)
    damping = by([c.v for c in coordinates])
    stiffness = by([c.q for c in coordinates])
    entries = [e for rows in (mass, damping, stiffness) for row in rows for e in row]
    if any(sp.count_ops(e) > _LONGEST or e.has(sp.zoo, sp.nan) for e in entries):
        return None
    inputs = by([u.symbol for u in equations.inputs])
    return ExactMatrices(mass, damping, stiffness, *_first_order(mass, damping, stiffness, inputs))


def _first_order(
    mass: _Rows, damping: _Rows, stiffness: _Rows, inputs: _Rows
) -> tuple[_Rows | None, _Rows | None]:
    """Solve for accelerations: A and B; None where they are long."""
    n = len(mass)
    if n > _STATE_SPACE:
        return None, None
    inverse = sp.Matrix(mass).inv("ADJ")
    below = [-inverse * sp.Matrix(m) for m in (stiffness, damping)]
    driven = -inverse * sp.Matrix(n, len(inputs[0]), lambda i, j: inputs[i][j])
    blocks = [[factored_form(cancelled(e)) for e in matrix] for matrix in (*below, driven)]
    if any(sp.count_ops(e) > _LONGEST for block in blocks for e in block):
        return None, None
    zeros = (sp.S.Zero,) * n
    units = tuple((*zeros[:i], sp.S.One, *zeros[i + 1 :]) for i in range(n))
    stiff, damped = (tuple(tuple(b[i * n : (i + 1) * n]) for i in range(n)) for b in blocks[:2])
    width = len(inputs[0])
    lower = tuple(tuple(blocks[2][i * width : (i + 1) * width]) for i in range(n))
    return (
        (*(zeros + unit for unit in units), *(s + d for s, d in zip(stiff, damped, strict=True))),
        (*((sp.S.Zero,) * width for _ in range(n)), *lower),
    )
