"""Accelerations in closed form, where the mass matrix couples at most two at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.sparse import entries

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Larger coupled systems are left as M q̈ = f: their closed forms fill pages.
_LARGEST_SOLVED = 2


def _coupled_blocks(equations: Equations) -> list[list[int]]:
    """Groups of coordinates (indices, ascending) whose accelerations are coupled."""
    blocks: list[list[int]] = []
    placed: set[int] = set()
    for start in range(len(equations.coordinates)):
        if start in placed:
            continue
        block, pending = {start}, [start]
        while pending:
            row = equations.mass_matrix[pending.pop()]
            fresh = [j for j in entries(row) if j not in block]
            block.update(fresh)
            pending.extend(fresh)
        placed |= block
        blocks.append(sorted(block))
    return blocks


def forcing_with_reactions(equations: Equations) -> list[sympy.Expr]:
    """Right-hand sides f + Σ λ·gradient of M a = f + Σ λ·gradient, one for each coordinate."""
    pairs = zip(equations.forcing, multiplier_terms(equations), strict=True)
    return [sympy.Add(forcing, *terms) for forcing, terms in pairs]


def multiplier_terms(equations: Equations) -> list[list[sympy.Expr]]:
    """Terms λ·gradient of closures and contacts, by coordinate."""
    terms: list[list[sympy.Expr]] = [[] for _ in equations.coordinates]
    for closure in equations.pushing:
        for i, entry in entries(closure.gradient).items():
            terms[i].append(closure.multiplier * entry)
    return terms


def explicit_accelerations(equations: Equations) -> tuple[sympy.Expr | None, ...]:
    """q̈ over (q, v, t) and multipliers, one for each coordinate.

    None if more than two are coupled, or there is no inertia.

    Solved from the shown equations, whose terms are collected as a person
    would: single ones are divided, pairs follow Cramer's rule, and common
    factors cancel.
    """
    solved: list[sympy.Expr | None] = [None] * len(equations.coordinates)
    for block in _coupled_blocks(equations):
        if len(block) > _LARGEST_SOLVED:
            continue
        mass, forcing = _linear_system(equations, block)
        if len(block) == 1 and mass[0][0] == 0:
            continue
        if len(block) == 1:
            (i,) = block
            solved[i] = _quotient(forcing[0], mass[0][0])
        else:
            i, j = block
            determinant = mass[0][0] * mass[1][1] - mass[0][1] * mass[1][0]
            solved[i] = _quotient(mass[1][1] * forcing[0] - mass[0][1] * forcing[1], determinant)
            solved[j] = _quotient(mass[0][0] * forcing[1] - mass[1][0] * forcing[0], determinant)
    return tuple(solved)


def _linear_system(
    equations: Equations, block: list[int]
) -> tuple[list[list[sympy.Expr]], list[sympy.Expr]]:
    """Coefficients of the block's accelerations and the other side, as shown."""
    unknowns = [equations.coordinates[i].a for i in block]
    mass, forcing = [], []
    for i in block:
        terms = equations.shown[i].terms
        mass.append([sympy.Add(*(c for c, factor in terms if factor == a)) for a in unknowns])
        forcing.append(-sympy.Add(*(c * factor for c, factor in terms if factor not in unknowns)))
    return mass, forcing


def _quotient(numerator: sympy.Expr, denominator: sympy.Expr) -> sympy.Expr:
    return sympy.factor_terms(numerator) / sympy.factor_terms(denominator)
