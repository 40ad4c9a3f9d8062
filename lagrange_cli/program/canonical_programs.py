"""Functions of emitted code that lead from velocities to momenta and back, and momenta's rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.program.program import Program, build_program

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

#: Functions of the canonical equations, which only others call.
CANONICAL_PARTS = frozenset({"momenta", "legendre", "momentum_rates"})


def canonical_programs(
    equations: Equations, velocities: Sequence[Expr] | None = None
) -> dict[str, Program]:
    """Function of :data:`CANONICAL_PARTS` → program, of equations without multipliers.

    Parameters
    ----------
    velocities
        Velocities over coordinates and momenta, these by the symbols of the velocities; None where
        the mass matrix gives them.
    """
    if velocities is None:
        legendre = build_program(equations, ["legendre"], loops=False)
    else:
        named = zip((c.name for c in equations.coordinates), velocities, strict=True)
        asked = replace(equations, outputs=tuple(named))
        legendre = build_program(asked, ["outputs"], loops=False)
    return {
        "momenta": build_program(equations, ["momenta"], loops=False),
        "legendre": legendre,
        "momentum_rates": build_program(equations, ["momentum_rates"], loops=False),
    }
