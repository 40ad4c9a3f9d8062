"""Short forms of quotients and roots of sums, within a budget of terms."""

from __future__ import annotations

from collections.abc import Collection

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import Splitter, TermSum, collected_terms
from lagrange_cli.mechanics.algebra.factor import factored, tidy
from lagrange_cli.mechanics.algebra.polynomials import (
    cancelled,
    common_divisor,
    expand_terms,
    factored_form,
    has_more_nodes,
    term_count,
)
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.free_symbols import symbols_in

# Budgets that keep the search for a short form quick; beyond them an expression
# stays as it is. None is tuned.

#: Nodes of an expression that is put over one denominator, which takes longer than linear time:
#: seconds from 100,000 on. Forces of shipped scenes have up to 1,600.
_NODES = 10_000
#: Terms that a numerator may be multiplied out to.
_TERM_BUDGET = 200
#: Terms of a numerator and a denominator that are searched for common factors.
_FACTOR_TERMS = 16
#: Terms of a sum that is tried for factors although nothing can be cancelled.
_SHORT = 6


def shortened(expr: sp.Expr) -> sp.Expr:
    """Put an expression over one denominator, collect sums and cancel common factors.

    Returned unchanged beyond the budgets of nodes and terms, and if the result is no shorter.
    """
    if has_more_nodes(expr, _NODES):
        return expr
    numerator, denominator = sp.fraction(sp.together(expr))
    if term_count(numerator) > _TERM_BUDGET or term_count(denominator) > _TERM_BUDGET:
        return expr
    numerator, denominator = _collected(numerator), _collected(denominator)
    short = _cancelled(numerator, denominator)
    return min((short, tidy(expr)), key=sp.count_ops)


def _collected(expr: sp.Expr) -> sp.Expr:
    return factored(collected_terms(expand_terms(expr, _TERM_BUDGET) or (expr,)))


def _cancelled(numerator: sp.Expr, denominator: sp.Expr) -> sp.Expr:
    """Write a quotient in lowest terms, its numerator as a product."""
    if term_count(numerator) + term_count(denominator) > _FACTOR_TERMS:
        return numerator / denominator
    if _rooted(numerator) or _rooted(denominator):
        return numerator / denominator
    if term_count(denominator) == 1 and not 1 < term_count(numerator) <= _SHORT:
        return numerator / denominator  # common monomials have cancelled
    above, below = numerator, denominator
    if denominator != 1:
        above, below = sp.fraction(cancelled(numerator / denominator))
    candidates = [_collected(above) / _collected(below), numerator / denominator]
    candidates += [factored_form(_collected(above)) / factored_form(_collected(below))]
    return min(candidates, key=sp.count_ops)


def _rooted(expr: sp.Expr) -> bool:
    """Say whether there are powers that polynomials do not have."""
    return any(not p.exp.is_Integer for p in expr.atoms(sp.Pow))


def divided_termwise(expr: sp.Expr, constants: Collection[sp.Symbol]) -> sp.Expr:
    """Write ``(a φ0 + (R + a) (θ - θ0))/a`` as ``φ0 + (1 + R/a) (θ - θ0)``.

    Only a sum over parameters is divided, and only where that is shorter in print.
    """
    numerator, denominator = sp.fraction(expr)
    if not numerator.is_Add or not denominator.free_symbols <= {*constants}:
        return expr
    divided = sp.Add(*(_divided(term, denominator) for term in numerator.args))
    return divided if printed_length(divided) < printed_length(expr) else expr


def _divided(term: sp.Expr, divisor: sp.Expr) -> sp.Expr:
    """Divide a product, within the sum among its factors that holds the divisor as a term."""
    factors = sp.Mul.make_args(term)
    holding = [f for f in factors if f.is_Add and divisor in f.args]
    if not holding:
        return term / divisor
    inner = sp.Add(*(part / divisor for part in holding[0].args))
    return sp.Mul(*(inner if f is holding[0] else f for f in factors))


def length_factor(components: tuple[sp.Expr, ...]) -> sp.Expr | None:
    """Find c with components = c · (a direction of constant length); None if there is none."""
    present = [e for e in components if e != 0]
    if not present:
        return sp.Integer(0)
    if len(present) == 1:
        return present[0]
    if sum(map(term_count, present)) > _FACTOR_TERMS or any(map(_rooted, present)):
        return None
    common = common_divisor([sp.fraction(sp.together(e))[0] for e in present])
    directions = [shortened(e / common) for e in present]
    square = shortened(sp.Add(*(e**2 for e in directions)))
    if term_count(square) > _SHORT:
        return None
    root = sp.sqrt(factored_form(square))
    return None if root.has(sp.sin, sp.cos) else shortened(common * root)


def drawn_from_roots(expr: sp.Expr, positive: Collection[sp.Symbol]) -> sp.Expr:
    """Take the root of the factors of sums that hold one of some positive symbols.

    A root stays as it is if its sum has no factor, or one whose sign is not known.
    """
    if symbols_in(expr).isdisjoint(positive):
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
