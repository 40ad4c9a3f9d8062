"""Conserved quantities at a start that the scene writes in its parameters: p = M R² ω₀."""

from __future__ import annotations

import sympy as sp

from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.findings import Conserved

#: Longest value that is printed within a sentence.
_LONGEST = 30


def value_at_start(equations: Equations, expression: sp.Expr) -> sp.Expr | None:
    """Value of an expression over q, q̇ and t at the start; None if that is not written."""
    system, start = equations.system, dict(equations.derivation.start)
    if not start:
        return None
    time = system.simulate.start
    start[system.t] = sp.Integer(0) if time == 0 else sp.Rational(repr(time))
    value = expression.xreplace(start)
    if not value.free_symbols <= {p.symbol for p in system.parameters}:
        return None
    return min(value, shortened(value), key=printed_length)


def conserved_at_start(equations: Equations) -> list[tuple[Conserved, sp.Expr]]:
    """Return conserved quantities with a short value in the parameters at the start."""
    values = ((c, value_at_start(equations, c.expression)) for c in equations.derivation.conserved)
    return [(c, e) for c, e in values if e is not None and printed_length(e) <= _LONGEST]
