"""Common factors, shorter products, and groups of terms by velocities, for textbook forms."""

from __future__ import annotations

import itertools
import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import (
    Splitter,
    TermSum,
    collected_terms,
    python_rational,
    rational_content,
    sympy_rational,
)
from lagrange_cli.mechanics.algebra.polynomials import cancelled, expand_terms, factored_form
from lagrange_cli.mechanics.algebra.printed_length import printed_length

_ONE = sp.Integer(1)

#: Terms that a sum may be multiplied out to while a shorter form is sought. This and the budgets
#: below keep the search quick; longer ones stay as they are. None is tuned.
_TERM_BUDGET = 200
#: Most terms of a sum that is tried for a shorter form.
_SHORT_TERMS = 12
#: Most symbols of such a sum.
_SHORT_SYMBOLS = 4
#: Most operations of a sum with denominators that is put over one.
_SHORT_OPERATIONS = 24
#: Terms that a sum with hyperbolic functions may be multiplied out to.
_HYPERBOLIC_TERMS = 40


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


def alike_oriented(products: Sequence[sp.Expr], written: Iterable[sp.Expr]) -> list[sp.Expr]:
    """Write sums among the factors of products that are negatives of each other as one of them.

    That is the one among sums that are ``written``, or the first.
    """
    oriented: dict[sp.Expr, sp.Expr] = {}
    for whole in written:
        if whole not in oriented:
            oriented[-whole] = whole
    return [_oriented(product, oriented) for product in products]


def _oriented(product: sp.Expr, oriented: dict[sp.Expr, sp.Expr]) -> sp.Expr:
    """Turn the sums of a product to those that are known; ``oriented`` is the negative of each."""
    number, others = product.as_coeff_Mul(rational=True)
    factors = []
    for factor in sp.Mul.make_args(others):
        base, exponent = factor.as_base_exp()
        if base.is_Add and exponent.is_Integer and base in oriented:
            factor = oriented[base] ** exponent
            number = -number if exponent % 2 else number
        elif base.is_Add:
            oriented.setdefault(-base, base)
        factors.append(factor)
    return scaled(number, sp.Mul(*factors))


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
    exponents = product.as_powers_dict()
    return all(
        b in exponents
        and exponents[b].is_Integer
        and exponents[b] * e > 0
        and abs(exponents[b]) >= abs(e)
        for b, e in powers.items()
    )


def letter_below(whole: sp.Add) -> sp.Expr | None:
    """Find the denominator of a sum, if that is a power of one letter."""
    powers = {f for term in whole.args for f in sp.Mul.make_args(term) if f.is_Pow}
    below = [1 / f for f in powers if f.exp.is_Integer and f.exp < 0 and f.base.is_Symbol]
    return below[0] if len(below) == 1 else None


def factored(terms: list[sp.Expr]) -> sp.Expr:
    """Write the sum of terms as common monomial times a shorter form of the cofactor."""
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
    if not all(a.is_Rational or a.is_Symbol for a in sp.preorder_traversal(expr) if not a.args):
        return expr
    product = normalize_square_signs(_one_fraction(expr) if divided else factored_form(expr))
    return expr if product.is_Add or sp.count_ops(product) >= sp.count_ops(expr) else product


def _by_denominator(expr: sp.Expr) -> sp.Expr:
    """Gather terms over the same denominator, and factor their numerators."""
    groups: dict[sp.Expr, list[sp.Expr]] = {}
    for term in expr.args:
        below = [f for f in sp.Mul.make_args(term) if _is_divisor(f)]
        groups.setdefault(sp.Mul(*below), []).append(term / sp.Mul(*below))
    return sp.Add(*(factored(numerator) * below for below, numerator in groups.items()))


def _one_fraction(expr: sp.Expr) -> sp.Expr:
    numerator, denominator = sp.fraction(cancelled(expr))
    if denominator.could_extract_minus_sign():
        numerator, denominator = -numerator, -denominator
    return factored_form(numerator) / denominator


def _has_divided_sum(expr: sp.Expr) -> bool:
    return any(
        _is_divisor(f) and f.base.is_Add for term in expr.args for f in sp.Mul.make_args(term)
    )


def _is_divisor(factor: sp.Expr) -> bool:
    """Tell whether a factor divides: with powers as u^(π - 4), u^(4 - π) stands uncancelled."""
    return bool(factor.is_Pow and factor.exp.is_Rational and factor.exp.is_negative)


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
    """Tell whether each term is one sine or cosine times symbols, and no two of these are equal."""
    factors = [sp.Mul.make_args(term) for term in terms]
    others = [
        f for term_factors in factors for f in term_factors if not (f.is_Symbol or f.is_Rational)
    ]
    return (
        all(f.func in (sp.sin, sp.cos) for f in others)
        and len(others) == len(terms) == len(set(others))
        and all(any(f.is_Function for f in term_factors) for term_factors in factors)
    )


def _is_linear_term(term: sp.Expr) -> bool:
    """Tell whether a term is a symbol or a rational number times one."""
    return term.is_Symbol or bool(
        term.is_Mul and len(term.args) == 2 and term.args[0].is_Rational and term.args[1].is_Symbol
    )


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
    for choice in itertools.product((False, True), repeat=len(pairs)):
        rules = {}
        for (s, c, sign), swapped in zip(pairs, choice, strict=True):
            # cosh² = 1 + sinh²; cos² = 1 − sin².
            rules[c**2 if swapped else s**2] = 1 + sign * s**2 if swapped else sign * (c**2 - 1)
        terms = expand_terms(expr.xreplace(rules), _HYPERBOLIC_TERMS)
        if terms is not None:
            yield sp.Add(*terms)


def _arguments(expr: sp.Expr, *functions: type[sp.Expr]) -> list[sp.Expr]:
    first, second = ({f.args[0] for f in expr.atoms(function)} for function in functions)
    return sorted(first & second, key=sp.default_sort_key)


def binomial_square(expr: sp.Expr) -> sp.Expr:
    """Write ``R² + 2 R a cos θ + a² cos² θ`` as ``(R + a cos θ)²``; leave others."""
    if len(expr.args) != 3:
        return expr
    for k, mixed in enumerate(expr.args):
        first, second = (_root(term) for j, term in enumerate(expr.args) if j != k)
        if first is None or second is None:
            continue
        product = 2 * first * second
        if mixed in (product, -product):
            return (first + second if mixed == product else first - second) ** 2
    return expr


def _root(term: sp.Expr) -> sp.Expr | None:
    """Take the square root of a product of even powers; None of others."""
    powers = [f.as_base_exp() for f in sp.Mul.make_args(term)]
    if any(b.is_number or not (e.is_Integer and e % 2 == 0) for b, e in powers):
        return None
    return sp.Mul(*(b ** (e / 2) for b, e in powers))


def normalize_square_signs(product: sp.Expr) -> sp.Expr:
    """Write ``(a − R)²`` as ``(R − a)²``, so that an even power has one form."""
    turned = [f for f in sp.Mul.make_args(product) if _is_turned(f)]
    return product.xreplace({f: (-f.base) ** f.exp for f in turned}) if turned else product


def _is_turned(factor: sp.Expr) -> bool:
    if not (factor.is_Pow and factor.base.is_Add and factor.exp.is_Integer):
        return False
    return bool(factor.exp % 2 == 0 and factor.base.could_extract_minus_sign())


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
