"""Values that options write in the scene language, as further outputs of equations.

Beside each value stand its derivatives by the state, by which errors of a motion become errors of
what is read off it: of crossings of a section, of numbers that a motion is reduced to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations


def output_names(kind: str, number: int, coordinates: int) -> tuple[str, ...]:
    """Names of the outputs of a value: itself, then its 2n derivatives by the state."""
    # No name of a scene has a blank.
    return (f"{kind} {number}", *(f"{kind} {number} by {i}" for i in range(2 * coordinates)))


def with_values(equations: Equations, kind: str, values: Sequence[Expr]) -> Equations:
    """Return equations whose outputs include those of :func:`output_names` for each value."""
    from lagrange_cli.mechanics.algebra.derivatives import derivative

    state = [*(c.q for c in equations.coordinates), *(c.v for c in equations.coordinates)]
    outputs: list[tuple[str, Expr]] = []
    for number, value in enumerate(values):
        names = output_names(kind, number, len(equations.coordinates))
        expressions = [value, *(derivative(value, symbol) for symbol in state)]
        outputs += zip(names, expressions, strict=True)
    return replace(equations, outputs=(*equations.outputs, *outputs))
