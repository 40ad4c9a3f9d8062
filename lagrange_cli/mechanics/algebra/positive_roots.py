"""Roots of sums that what is declared positive comes out of, as r of √(r² sin²φ + r² cos²φ)."""

from __future__ import annotations

from collections.abc import Collection

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import Splitter, TermSum
from lagrange_cli.mechanics.algebra.expand import expand_terms
from lagrange_cli.mechanics.algebra.factor import factored

#: Terms that a sum under a root may be multiplied out to. Set by hand.
_TERM_BUDGET = 200


def drawn_from_roots(expr: sp.Expr, positive: Collection[sp.Symbol]) -> sp.Expr:
    """Take the root of the factors of sums that hold one of some positive symbols.

    A root stays as it is if its sum has no factor, or one whose sign is not known.
    """
    if expr.free_symbols.isdisjoint(positive):
        return expr
    roots = (p for p in expr.atoms(sp.Pow) if p.base.is_Add and _is_root(p))
    # Inner roots first: the outer ones then hold what has become of them.
    for root in sorted(roots, key=lambda p: (p.count_ops(), p.sort_key())):
        drawn = _drawn(root) if not root.free_symbols.isdisjoint(positive) else root
        if drawn != root:
            return drawn_from_roots(expr.xreplace({root: drawn}), positive)
    return expr


def _is_root(power: sp.Pow) -> bool:
    return bool(power.exp.is_Rational and power.exp.q != 1)


def _drawn(root: sp.Pow) -> sp.Expr:
    expanded = expand_terms(root.base, _TERM_BUDGET)
    if expanded is None:
        return root
    total = TermSum(Splitter(frozenset()))
    total.add_all(e for e in expanded if e != 0)
    drawn = sp.Pow(factored(total.collected()), root.exp)
    stays = _is_root(drawn) if drawn.is_Pow else False
    return root if stays or drawn.has(sp.Abs) else drawn
