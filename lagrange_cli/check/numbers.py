"""Numbers that expectations are written as."""

from __future__ import annotations

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics import interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene.language.expression import Expression


def number_of(equations: Equations, expression: Expression) -> float:
    """Evaluate an expression in parameters.

    Raises
    ------
    InputError
        Located: a parameter lacks its value, or it is no real number.
    """
    known = {p.symbol: p.value for p in equations.parameters if p.value is not None}
    value = interpret(equations, expression).subs(known)
    if value.free_symbols:
        names = ", ".join(sorted(symbol.name for symbol in value.free_symbols))
        raise InputError(
            Problem(f"no value is known for {names}", expression.mark(), rule="no-value")
        )
    if not value.is_real:
        raise InputError(Problem("this is no real number", expression.mark(), rule="no-value"))
    return float(value)
