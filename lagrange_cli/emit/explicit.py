"""Accelerations in closed form, where the mass matrix couples at most two at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["coupled_blocks", "explicit_accelerations"]

#: Larger coupled systems are left as M q̈ = f: their closed forms fill pages.
_LARGEST_SOLVED = 2


def coupled_blocks(equations: Equations) -> list[list[int]]:
    """Groups of coordinates (indices, ascending) whose accelerations are coupled."""
    blocks: list[list[int]] = []
    placed: set[int] = set()
    for start in range(len(equations.coordinates)):
        if start in placed:
            continue
        block, pending = {start}, [start]
        while pending:
            row = equations.mass_matrix[pending.pop()]
            fresh = [j for j, entry in enumerate(row) if entry != 0 and j not in block]
            block.update(fresh)
            pending.extend(fresh)
        placed |= block
        blocks.append(sorted(block))
    return blocks


def explicit_accelerations(equations: Equations) -> tuple[sympy.Expr | None, ...]:
    """q̈ over (q, v, t), one for each coordinate; None where more than two are coupled.

    Single ones are f/M, pairs follow Cramer's rule; common factors cancel.
    """
    mass, forcing = equations.mass_matrix, equations.forcing
    solved: list[sympy.Expr | None] = [None] * len(equations.coordinates)
    for block in coupled_blocks(equations):
        if len(block) == 1:
            (i,) = block
            solved[i] = _quotient(forcing[i], mass[i][i])
        elif len(block) == _LARGEST_SOLVED:
            i, j = block
            determinant = mass[i][i] * mass[j][j] - mass[i][j] * mass[j][i]
            solved[i] = _quotient(mass[j][j] * forcing[i] - mass[i][j] * forcing[j], determinant)
            solved[j] = _quotient(mass[i][i] * forcing[j] - mass[j][i] * forcing[i], determinant)
    return tuple(solved)


def _quotient(numerator: sympy.Expr, denominator: sympy.Expr) -> sympy.Expr:
    return sympy.factor_terms(numerator) / sympy.factor_terms(denominator)
