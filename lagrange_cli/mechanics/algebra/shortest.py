"""Shortest ways to write the sums of an equation, chosen by their length in print.

Every way holds the same terms: gathered by the functions in them, by moving factors, or by their
parameters; then products that share a sum are put together. Coefficients try the other forms of
squares of sines and cosines. Each way is built once, without search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from operator import attrgetter
from typing import NamedTuple

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.factor import common_factor, factored, scaled
from lagrange_cli.mechanics.algebra.polynomials import expand_terms, factored_form
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.free_symbols import symbols_in

#: Most terms of a sum that is written in other ways. This and the budgets below keep the search
#: quick; longer sums stay as collected. None is tuned.
_MOST_TERMS = 40
#: Most terms of a sum that is tried for other forms of squares.
_SHORT_TERMS = 12
#: Terms that squares of sines and cosines may be multiplied out to.
_TERM_BUDGET = 40

#: Most terms and most letters of a sum that is tried for factors.
_FACTOR_TERMS = 6
_FACTOR_SYMBOLS = 3

#: Most sums and terms whose results are kept.
_KEPT = 2**12

#: Functions that count as moving factors; others, roots and denominators scale a term.
_HEADS = (sp.sin, sp.cos, sp.tan, sp.sinh, sp.cosh, sp.exp)


def shortest_groups(
    terms: Sequence[sp.Expr], constants: frozenset[sp.Symbol], brackets: Sequence[sp.Expr] = ()
) -> list[sp.Expr]:
    """Gather terms without velocities, in the way that is shortest in print.

    Parameters
    ----------
    constants
        Symbols of parameters.
    brackets
        Sums that stay together where the terms hold a multiple of them.

    Returns
    -------
    list
        Products with the same sum as the terms: ``m g (l + x) sin θ``, ``k (1 - l0/r) x``,
        ``(k + k2) x1``.
    """
    if len(terms) < 2:
        return list(terms)

    ways = [_by_function(terms, constants)]
    if len(terms) <= _MOST_TERMS:
        ways += _both_ways(terms, constants)
        bracketed = _bracketed(terms, brackets)
        ways += _both_ways(bracketed, constants) if bracketed != list(terms) else []
        # Of ways of one length the first is taken: k (r - r0) rather than k r - k r0.
        shifted = [b for b in brackets if any(symbols_in(a) <= constants for a in b.args)]
        written = _bracketed(terms, shifted)
        ways[:0] = _both_ways(written, constants) if written != list(terms) else []
    return min((joined(way) for way in ways), key=_length)


def _both_ways(terms: Sequence[sp.Expr], constants: frozenset[sp.Symbol]) -> list[list[sp.Expr]]:
    """Gather terms by their moving factors, and by their parameters."""
    return [_gathered(terms, constants, key) for key in (_head, _parameters)]


def shortest_coefficient(
    whole: sp.Expr, constants: frozenset[sp.Symbol], brackets: Sequence[sp.Expr] = ()
) -> sp.Expr:
    """Write the sum in a coefficient in the way that is shortest in print.

    ``brackets`` are sums of parameters that are sought in it: ``5 r² + 2 (R + a)²``.
    """
    number, product = whole.as_coeff_Mul(rational=True)
    sums = [f for f in sp.Mul.make_args(product) if f.is_Add]
    if len(sums) != 1 or len(sums[0].args) > _SHORT_TERMS:
        return whole
    inner = sums[0]
    forms = [*_forms(inner, constants), *_in_brackets(inner, brackets)]
    best = min([inner, *forms], key=printed_length)
    if best is inner:
        return whole
    return scaled(number, sp.Mul(*(best if f is inner else f for f in sp.Mul.make_args(product))))


def _forms(expr: sp.Expr, constants: frozenset[sp.Symbol]) -> Iterator[sp.Expr]:
    """Yield the forms of a sum: coefficients collected, squares of sines and cosines rewritten."""
    yield sp.Add(*_gathered(expr.args, constants, _head))
    squares = [p.base for p in expr.atoms(sp.Pow) if p.exp == 2]
    arguments = {f.args[0] for f in squares if isinstance(f, (sp.sin, sp.cos))}
    for u in sorted(arguments, key=sp.default_sort_key):
        for rule in _square_rules(u):
            terms = expand_terms(expr.xreplace(rule), _TERM_BUDGET)
            if terms is not None:
                yield sp.Add(*_gathered(collected_terms(terms), constants, _head))


def _in_brackets(expr: sp.Expr, brackets: Sequence[sp.Expr]) -> Iterator[sp.Expr]:
    """Yield a sum over each bracket in place of the bracket's first letter."""
    for bracket in brackets:
        letter = next((t for t in bracket.args if t.is_Symbol), None)
        if letter is None or not symbols_in(bracket) <= symbols_in(expr):
            continue
        whole = sp.Dummy()
        terms = expand_terms(expr.xreplace({letter: whole + letter - bracket}), _TERM_BUDGET)
        if terms is not None:
            yield sp.Add(*collected_terms(terms)).xreplace({whole: bracket})


def _square_rules(u: sp.Expr) -> Iterator[dict[sp.Expr, sp.Expr]]:
    s, c = sp.sin(u) ** 2, sp.cos(u) ** 2
    yield {s: 1 - c}
    yield {c: 1 - s}
    double = sp.cos(2 * u)
    yield {s: (1 - double) / 2, c: (1 + double) / 2}


def _bracketed(terms: Sequence[sp.Expr], brackets: Sequence[sp.Expr]) -> list[sp.Expr]:
    """Put together the terms that are a multiple of a bracket: ``k (y - l0)``."""
    remaining = list(terms)
    present = frozenset[sp.Symbol]().union(*map(symbols_in, terms))
    for bracket in brackets:
        if not symbols_in(bracket) <= present:
            continue
        first, *others = _ordered_terms(bracket)
        divisors = _bases(first)
        for term in remaining:
            if not divisors <= _bases(term):
                continue
            cofactor = term / first
            if all(cofactor * bracket_term in remaining for bracket_term in others):
                members = [term, *(cofactor * bracket_term for bracket_term in others)]
                number, product = cofactor.as_coeff_Mul(rational=True)
                remaining = [t for t in remaining if t not in members]
                remaining.append(scaled(number, product * bracket))
                break
    return remaining


@lru_cache(maxsize=_KEPT)
def _ordered_terms(bracket: sp.Expr) -> list[sp.Expr]:
    return sorted(bracket.args, key=sp.default_sort_key, reverse=True)


@lru_cache(maxsize=_KEPT)
def _bases(term: sp.Expr) -> frozenset[sp.Expr]:
    """Collect the bases of the powers in a product."""
    return frozenset(f.as_base_exp()[0] for f in sp.Mul.make_args(term) if not f.is_Number)


# -- ways to gather terms -----------------------------------------------------


class _Parts(NamedTuple):
    """The factors of a term: parameters, moving factors, and factors that scale it.

    Attributes
    ----------
    parameters
        Factors of parameters alone.
    head
        Powers of coordinates, trigonometric functions and such.
    tail
        All others: denominators, roots.
    """

    parameters: sp.Expr
    head: sp.Expr
    tail: sp.Expr


_head, _parameters = attrgetter("head"), attrgetter("parameters")


@lru_cache(maxsize=_KEPT)
def _parts(term: sp.Expr, constants: frozenset[sp.Symbol]) -> _Parts:
    parameters, heads, tails = [], [], []
    for f in sp.Mul.make_args(term):
        base, exponent = f.as_base_exp()
        is_power = exponent.is_Integer and exponent.is_positive
        if symbols_in(f) <= constants:
            parameters += [] if f.is_Rational else [f]
        elif isinstance(f, sp.exp) or (is_power and (base.is_Symbol or isinstance(base, _HEADS))):
            heads.append(f)
        else:
            tails.append(f)
    return _Parts(sp.Mul(*parameters), sp.Mul(*heads), sp.Mul(*tails))


def _gathered(
    terms: Iterable[sp.Expr], constants: frozenset[sp.Symbol], key: Callable[[_Parts], sp.Expr]
) -> list[sp.Expr]:
    """Gather terms of one key into products; those with key 1 stay.

    Of terms with different denominators or roots only two are put together, one of which has
    none: ``k (1 - l0/r) x``.
    """
    groups: dict[sp.Expr, list[tuple[sp.Expr, _Parts]]] = {}
    for term in terms:
        parts = _parts(term, constants)
        groups.setdefault(key(parts), []).append((term, parts))
    gathered: list[sp.Expr] = []
    for common, pairs in groups.items():
        members = [term for term, _ in pairs]
        tails = {parts.tail for _, parts in pairs}
        is_alike = len(tails) == 1 or (len(tails) == 2 and 1 in tails)
        is_group = common != 1 and len(members) > 1 and is_alike
        gathered += [_product(members)] if is_group else members
    return gathered


def _product(members: list[sp.Expr]) -> sp.Expr:
    """Write a sum as a product whose sum has a positive number: ``k (1 - l0/r) x``."""
    whole = factored(members)
    number, product = whole.as_coeff_Mul(rational=True)
    factors = []
    for f in sp.Mul.make_args(product):
        if f.is_Add and len(f.args) <= _SHORT_TERMS:
            if any(a.is_Rational and a < 0 for a in f.args):
                f, number = sp.Add(*(-a for a in f.args)), -number
            f = _factored_sum(f)
        factors.append(f)
    return scaled(number, sp.Mul(*factors))


def _factored_sum(expr: sp.Expr) -> sp.Expr:
    """Write ``ψ + sin ψ + sin ψ cos ψ + ψ cos ψ`` as ``(ψ + sin ψ) (1 + cos ψ)``; leave others."""
    is_short = 2 < len(expr.args) <= _FACTOR_TERMS and len(expr.free_symbols) <= _FACTOR_SYMBOLS
    product = factored_form(expr) if is_short and expr.has(*_HEADS) else expr
    return product if product.is_Mul else expr


def _by_function(terms: Sequence[sp.Expr], constants: frozenset[sp.Symbol]) -> list[sp.Expr]:
    """Gather terms that share their functions; polynomials only if they share a parameter."""
    groups: dict[sp.Expr, list[sp.Expr]] = {}
    for term in terms:
        functions = [f for f in sp.Mul.make_args(term) if not _is_polynomial(f)]
        groups.setdefault(sp.Mul(*functions), []).append(term)
    grouped: list[sp.Expr] = []
    for function, members in groups.items():
        common = common_factor(members).as_coeff_Mul(rational=True)[1]
        if function != 1 or common.free_symbols & constants:
            grouped.append(factored(members))
        else:
            grouped.extend(members)
    return grouped


def _is_polynomial(factor: sp.Expr) -> bool:
    base, exponent = factor.as_base_exp()
    return bool(factor.is_Rational or (not base.args and exponent.is_Integer and exponent > 0))


def joined(groups: list[sp.Expr], apart: frozenset[sp.Symbol] = frozenset()) -> list[sp.Expr]:
    """Put products together that share a sum: ``k (1 - d/s) (l sin θ - d cos θ)``.

    ``apart``: a sum of these symbols alone is left in its products.
    """
    sharing: dict[sp.Expr, list[sp.Expr]] = {}
    for group in groups:
        for factor in sp.Mul.make_args(group):
            base = factor.as_base_exp()[0]
            is_shared = base.is_Add and not symbols_in(base) <= apart
            if is_shared and factor.as_base_exp()[1].is_positive:
                sharing.setdefault(base, []).append(group)
    for members in sharing.values():
        if len(members) > 1 and all(m in groups for m in members):
            others = [g for g in groups if g not in members]
            return joined([*others, factored(members)], apart)
    return groups


def _length(groups: list[sp.Expr]) -> int:
    return sum(map(printed_length, groups)) + len(groups)
