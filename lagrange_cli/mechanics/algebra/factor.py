"""Common factors and shorter products of sums, for textbook forms."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping, Sequence

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import (
    Splitter,
    TermSum,
    collected_terms,
    python_rational,
    rational_content,
    sympy_rational,
)
from lagrange_cli.mechanics.algebra.expand import expand_terms
from lagrange_cli.mechanics.algebra.hyperbolic import shorten_hyperbolic
from lagrange_cli.mechanics.algebra.polynomials import cancelled, factored_form
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.algebra.squares import binomial_square, normalize_square_signs

_ONE = sp.Integer(1)

#: Terms that a sum may be multiplied out to while a shorter form is sought. Set by hand.
_TERM_BUDGET = 200
#: Most terms of a sum that is tried for a shorter form. Set by hand.
_SHORT_TERMS = 12
#: Most symbols of such a sum. Set by hand.
_SHORT_SYMBOLS = 4
#: Most operations of a sum with denominators that is put over one. Set by hand.
_SHORT_OPERATIONS = 24


def common_factor(terms: list[sp.Expr]) -> sp.Expr:
    """Find the greatest common monomial of terms, with the positive content of their numbers."""
    if not terms:
        return _ONE
    numbers = []
    common: dict[sp.Expr, sp.Expr] | None = None
    for term in terms:
        number, product = term.as_coeff_Mul(rational=True)
        numbers.append(python_rational(number))
        powers = _powers(product)
        common = powers if common is None else _shared(common, powers)
    number = sympy_rational(rational_content(numbers))
    product = sp.Mul(*(b**e for b, e in (common or {}).items()))
    return scaled(number, product)


def scaled(number: sp.Rational, product: sp.Expr) -> sp.Expr:
    """Multiply by a number that SymPy would distribute over a sum; keep the sum a factor."""
    if product.is_Add and number != 1:
        return sp.Mul(number, product, evaluate=False)
    return number * product


def _shared(
    first: dict[sp.Expr, sp.Expr], second: dict[sp.Expr, sp.Expr]
) -> dict[sp.Expr, sp.Expr]:
    """Find powers common to two products: of two exponents of one sign the nearer to zero."""
    shared = {}
    for base, exponent in first.items():
        second_exponent = second.get(base)
        if second_exponent is not None and (second_exponent > 0) == (exponent > 0):
            shared[base] = min(exponent, second_exponent, key=abs)
    return shared


def _powers(product: sp.Expr) -> dict[sp.Expr, sp.Expr]:
    """Map each base to its nonzero rational exponent."""
    powers: dict[sp.Expr, sp.Expr] = {}
    for factor in sp.Mul.make_args(product):
        base, exponent = factor.as_base_exp()
        if factor.is_number or not exponent.is_Rational:
            powers[factor] = _ONE
        else:
            powers[base] = exponent
    powers.pop(_ONE, None)
    return powers


def holds_powers(product: sp.Expr, powers: Mapping[sp.Expr, sp.Expr]) -> bool:
    """Tell whether a product holds powers of some bases, or higher ones of the same signs."""
    own = product.as_powers_dict()
    return all(
        b in own and own[b].is_Integer and own[b] * e > 0 and abs(own[b]) >= abs(e)
        for b, e in powers.items()
    )


def factored(terms: list[sp.Expr]) -> sp.Expr:
    """Write the sum of terms as a product: common monomial times a shorter form of the rest."""
    if len(terms) == 1:
        return terms[0]
    if not terms:
        return sp.S.Zero
    number, common = common_factor(terms).as_coeff_Mul(rational=True)
    if all(t.could_extract_minus_sign() for t in terms):
        number = -number
    inner = _shorter_form(sp.Add(*(t / common / number for t in terms)))
    product = scaled(number, common * inner)
    if common == 1 and inner.is_Add and any(map(_is_fraction, terms)):
        # R² + h²/(4 π²) rather than ¼ (4 R² + h²/π²): the fraction stays one.
        return min(sp.Add(*terms), product, key=printed_length)
    return product


def _is_fraction(term: sp.Expr) -> bool:
    """Tell whether a product has a denominator beside a number."""
    return any(not p.is_Rational for p in sp.Mul.make_args(sp.fraction(term)[1]))


def _shorter_form(expr: sp.Expr) -> sp.Expr:
    """Write ``l² + 2 l x + x²`` as ``(l + x)²``, ``1 + x²/(l² − x²)`` as ``l²/(l² − x²)``.

    Tried for short sums that are rational in symbols; kept only if a shorter product results.
    """
    if not expr.is_Add or len(expr.args) > _SHORT_TERMS:
        return expr
    if expr.has(sp.sinh):
        return shorten_hyperbolic(expr)
    symbols = sorted(expr.free_symbols, key=str)
    divided = _has_divided_sum(expr)
    if len(symbols) > _SHORT_SYMBOLS or (len(expr.args) < 3 and not divided):
        return expr
    if divided:
        expr = _by_denominator(expr)
        if not expr.is_Add or sp.count_ops(expr) > _SHORT_OPERATIONS:
            return expr
    if not symbols or not expr.is_rational_function(*symbols):
        return binomial_square(expr)
    if not all(a.is_Rational or a.is_Symbol for a in _leaves(expr)):
        return expr
    product = normalize_square_signs(_one_fraction(expr) if divided else factored_form(expr))
    return expr if product.is_Add or sp.count_ops(product) >= sp.count_ops(expr) else product


def _by_denominator(expr: sp.Expr) -> sp.Expr:
    """Gather terms over the same denominator, and factor their numerators."""
    groups: dict[sp.Expr, list[sp.Expr]] = {}
    for term in expr.args:
        below = [f for f in sp.Mul.make_args(term) if f.is_Pow and f.exp.is_negative]
        groups.setdefault(sp.Mul(*below), []).append(term / sp.Mul(*below))
    return sp.Add(*(factored(numerator) * below for below, numerator in groups.items()))


def _one_fraction(expr: sp.Expr) -> sp.Expr:
    numerator, denominator = sp.fraction(cancelled(expr))
    if denominator.could_extract_minus_sign():
        numerator, denominator = -numerator, -denominator
    return factored_form(numerator) / denominator


def _has_divided_sum(expr: sp.Expr) -> bool:
    return any(
        f.is_Pow and f.exp.is_negative and f.base.is_Add
        for term in expr.args
        for f in sp.Mul.make_args(term)
    )


def _leaves(expr: sp.Expr) -> Iterator[sp.Expr]:
    return (a for a in sp.preorder_traversal(expr) if not a.args)


def tidy(expr: sp.Expr, masses: frozenset[sp.Expr] = frozenset()) -> sp.Expr:
    """Collect the sums of an expression, under roots too, if that makes them shorter."""
    if not expr.is_Add and not expr.is_Mul and not (expr.is_Pow and expr.exp.is_Rational):
        return expr
    parts = [tidy(a, masses) for a in expr.args]
    is_same = all(map(operator.is_, parts, expr.args))
    whole = expr if is_same else expr.func(*parts)
    if expr.is_Add:
        return _collected_if_shorter(whole, masses)
    return sp.Add(*collected_terms([whole])) if _has_tangent(whole) else whole


def _has_tangent(product: sp.Expr) -> bool:
    """Tell whether a product holds tan u beside cos u, which are sin u."""
    functions = {f.as_base_exp()[0] for f in sp.Mul.make_args(product)}
    return any(f.func is sp.tan and sp.cos(f.args[0]) in functions for f in functions)


def _collected_if_shorter(expr: sp.Expr, masses: frozenset[sp.Expr]) -> sp.Expr:
    if all(map(_is_linear_term, expr.args)) or _have_own_angles(expr.args):
        return expr
    expanded = expand_terms(expr, _TERM_BUDGET)
    if expanded is None:
        return expr
    total = TermSum(Splitter(masses))
    total.add_all(e for e in expanded if e != 0)
    terms = total.collected()
    if len(terms) < min(len(sp.Add.make_args(expr)), len(expanded)):
        return factored(terms)
    return expr


def _have_own_angles(terms: Sequence[sp.Expr]) -> bool:
    """Tell whether each term is one sine or cosine, of which no two are alike, times symbols."""
    factors = [sp.Mul.make_args(term) for term in terms]
    others = [f for own in factors for f in own if not (f.is_Symbol or f.is_Rational)]
    return (
        all(f.func in (sp.sin, sp.cos) for f in others)
        and len(others) == len(terms) == len(set(others))
        and all(any(f.is_Function for f in own) for own in factors)
    )


def _is_linear_term(term: sp.Expr) -> bool:
    """Tell whether a term is a symbol with a number, of which a sum holds each once."""
    return term.is_Symbol or bool(
        term.is_Mul and len(term.args) == 2 and term.args[0].is_Rational and term.args[1].is_Symbol
    )
