"""Short sums that cosh² − sinh² = 1 makes shorter."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import sympy as sp

from lagrange_cli.mechanics.algebra.expand import expand_terms

#: Terms that a sum may be multiplied out to. Set by hand.
_TERM_BUDGET = 40

_ONE = sp.Integer(1)


def shorten_hyperbolic(expr: sp.Expr) -> sp.Expr:
    """Write ``sin² η cosh² ξ + cos² η sinh² ξ`` as ``sin² η + sinh² ξ``; leave others.

    Of forms with as many terms, take the one with fewer differences, which lose digits.
    """
    return min([expr, *_forms(expr)], key=_cost)


def _cost(form: sp.Expr) -> tuple[int, int, int]:
    terms = sp.Add.make_args(form)
    negative = sum(bool(t.could_extract_minus_sign()) for t in terms)
    return len(terms), negative, int(sp.count_ops(form))


def _forms(expr: sp.Expr) -> Iterator[sp.Expr]:
    """Rewrite squares of one of each pair of functions by the other's, in all combinations."""
    pairs = [(sp.sinh(u), sp.cosh(u), _ONE) for u in _arguments(expr, sp.sinh, sp.cosh)]
    pairs += [(sp.sin(u), sp.cos(u), -_ONE) for u in _arguments(expr, sp.sin, sp.cos)]
    if len(pairs) > 2:
        return
    for choice in product((False, True), repeat=len(pairs)):
        rules = {}
        for (s, c, sign), swapped in zip(pairs, choice, strict=True):
            # cosh² = 1 + sinh²; cos² = 1 − sin².
            rules[c**2 if swapped else s**2] = 1 + sign * s**2 if swapped else sign * (c**2 - 1)
        terms = expand_terms(expr.xreplace(rules), _TERM_BUDGET)
        if terms is not None:
            yield sp.Add(*terms)


def _arguments(expr: sp.Expr, *functions: type[sp.Expr]) -> list[sp.Expr]:
    first, second = ({f.args[0] for f in expr.atoms(function)} for function in functions)
    return sorted(first & second, key=sp.default_sort_key)
