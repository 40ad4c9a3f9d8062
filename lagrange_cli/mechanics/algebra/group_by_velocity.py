"""Grouping of terms by their monomials in velocities, as books write equations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy as sp

from lagrange_cli.mechanics.algebra.factor import factored


def group_by_velocities(
    terms: Iterable[sp.Expr], velocities: Sequence[sp.Symbol]
) -> list[tuple[sp.Expr, list[sp.Expr]]]:
    """Group terms: (monomial in velocities, cofactors), highest degree first, then by coordinate.

    Velocities under a function or in a denominator stay in the cofactor.
    """
    number = {v: k for k, v in enumerate(velocities)}
    groups: dict[tuple[tuple[int, int], ...], tuple[sp.Expr, list[sp.Expr]]] = {}
    for term in terms:
        powers: list[tuple[int, int]] = []
        cofactor = []
        for factor in sp.Mul.make_args(term):
            base, exponent = factor.as_base_exp()
            if base in number and exponent.is_Integer and exponent > 0:
                powers.append((number[base], int(exponent)))
            else:
                cofactor.append(factor)
        key = tuple(sorted(powers))
        if key not in groups:
            groups[key] = (sp.Mul(*(velocities[k] ** p for k, p in key)), [])
        # Factors of a product in canonical order stay in canonical order.
        groups[key][1].append(sp.Mul(*cofactor, evaluate=False) if powers else term)
    order = sorted(groups, key=lambda key: (-sum(p for _, p in key), key))
    return [groups[key] for key in order]


def grouped_sum(terms: Iterable[sp.Expr], velocities: Sequence[sp.Symbol]) -> sp.Expr:
    """Gather each velocity monomial's cofactors, and put a common factor in front."""
    parts = [
        factored(cofactors) * monomial
        for monomial, cofactors in group_by_velocities(terms, velocities)
    ]
    return factored(parts)
