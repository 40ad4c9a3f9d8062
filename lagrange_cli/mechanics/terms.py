"""Sums of products, collected the way a textbook does.

Every term is split into a number, a mass, a trigonometric monomial and the
rest. Terms that differ only in number or mass are gathered, so that
``m1 l² + m2 l²`` becomes ``(m1 + m2) l²``; then sin² + cos² = 1 and the
addition theorems are applied wherever they shorten the sum. The work is
linear in the number of terms times the number of trigonometric factors of
one; nothing searches, nothing depends on the machine's speed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeAlias

import sympy as sp

__all__ = ["TermSum", "common_factor", "expand_terms", "factored"]

#: (function, argument) → power, in canonical order of arguments.
TrigMonomial: TypeAlias = tuple[tuple[tuple[str, sp.Expr], int], ...]
#: mass → rational coefficient
Weights: TypeAlias = dict[sp.Expr, sp.Rational]

_ONE = sp.Integer(1)
_ZERO = sp.Integer(0)
_UNIT: Weights = {_ONE: _ONE}


def expand_terms(expr: sp.Expr, budget: int) -> list[sp.Expr] | None:
    """Terms of ``expr`` with products and integer powers of sums multiplied out.

    Returns None when more than ``budget`` terms would come out; they are
    counted beforehand. Arguments of functions and denominators are left alone.
    """
    if _count(expr) > budget:
        return None
    return _expand(expr)


def _count(expr: sp.Expr) -> int:
    if expr.is_Add:
        return sum(_count(a) for a in expr.args)
    if expr.is_Mul:
        product = 1
        for a in expr.args:
            product *= _count(a)
        return product
    if expr.is_Pow and expr.exp.is_Integer and expr.exp.is_positive:
        return int(_count(expr.base) ** min(int(expr.exp), 64))
    return 1


def _expand(expr: sp.Expr) -> list[sp.Expr]:
    if expr.is_Add:
        return [t for a in expr.args for t in _expand(a)]
    if expr.is_Mul:
        return _product([_expand(a) for a in expr.args])
    if expr.is_Pow and expr.exp.is_Integer and expr.exp.is_positive and _count(expr.base) > 1:
        return _product([_expand(expr.base)] * int(expr.exp))
    return [expr]


def _product(factors: list[list[sp.Expr]]) -> list[sp.Expr]:
    terms = [_ONE]
    for factor in factors:
        terms = [sp.Mul(a, b) for a in terms for b in factor]
    return terms


class TermSum:
    """A sum of terms ``number · mass · rest · trigonometric monomial``.

    Parameters
    ----------
    masses
        Symbols that are gathered as common weights.
    """

    def __init__(self, masses: frozenset[sp.Expr] = frozenset()) -> None:
        self.masses = masses
        self._groups: dict[sp.Expr, dict[TrigMonomial, Weights]] = {}

    def add(self, term: sp.Expr, weights: Weights | None = None) -> None:
        """Add ``term``, which must not be a sum, times Σ number·mass of ``weights`` (default 1)."""
        number, weight, rest, trig = self._split(term)
        into = self._groups.setdefault(rest, {}).setdefault(trig, {})
        for mass, count in (weights or _UNIT).items():
            key = weight if mass is _ONE else weight * mass
            into[key] = into.get(key, _ZERO) + number * count

    def add_all(self, terms: Iterable[sp.Expr], weights: Weights | None = None) -> None:
        for term in terms:
            self.add(term, weights)

    def _split(self, term: sp.Expr) -> tuple[sp.Rational, sp.Expr, sp.Expr, TrigMonomial]:
        number, weight = _ONE, _ONE
        rest: list[sp.Expr] = []
        trig: dict[tuple[str, sp.Expr], int] = {}
        for factor in sp.Mul.make_args(term):
            base, power = factor.as_base_exp()
            if factor.is_Rational:
                number = factor
            elif base.func in (sp.sin, sp.cos) and power.is_Integer and power.is_positive:
                trig[(base.func.__name__, base.args[0])] = int(power)
            elif weight is _ONE and factor in self.masses:
                weight = factor
            else:
                rest.append(factor)
        return number, weight, sp.Mul(*rest), _canonical(trig)

    def collected(self) -> list[sp.Expr]:
        """Terms after collection; masses that share a monomial appear as one sum."""
        return list(self._collect())

    def _collect(self) -> Iterator[sp.Expr]:
        for rest, group in self._groups.items():
            _shorten(group)
            for trig, weights in group.items():
                number, mass = _weight_sum(weights)
                if number != 0:
                    yield sp.Mul(number, mass, rest, _monomial(trig))


def _canonical(trig: dict[tuple[str, sp.Expr], int]) -> TrigMonomial:
    if len(trig) < 2:
        return tuple(trig.items())
    return tuple(sorted(trig.items(), key=lambda item: (item[0][1].sort_key(), item[0][0])))


def _monomial(trig: TrigMonomial) -> sp.Expr:
    functions = {"sin": sp.sin, "cos": sp.cos}
    return sp.Mul(*(functions[name](argument) ** power for (name, argument), power in trig))


def _weight_sum(weights: Weights) -> tuple[sp.Rational, sp.Expr]:
    """Σ number·mass as (content, rest), so that −2 m1 − 2 m2 = −2 (m1 + m2)."""
    present = {m: c for m, c in weights.items() if c != 0}
    if len(present) < 2:
        for mass, count in present.items():
            return count, mass
        return _ZERO, _ONE
    content = sp.gcd_list([abs(c) for c in present.values()])
    if all(c < 0 for c in present.values()):
        content = -content
    return content, sp.Add(*(m * (c / content) for m, c in present.items()))


def _shorten(group: dict[TrigMonomial, Weights]) -> None:
    """Apply sin² + cos² = 1 and the addition theorems until none shortens the sum."""
    pending = list(group)
    while pending:
        trig = pending.pop()
        if trig in group and len(group) > 1:
            pending.extend(_shorten_one(group, trig))


def _shorten_one(group: dict[TrigMonomial, Weights], trig: TrigMonomial) -> list[TrigMonomial]:
    """Merge ``trig`` with a partner if there is one; return the monomials to look at again."""
    powers = dict(trig)
    for (name, argument), power in trig:
        if power >= 2:
            other = (_partner(name), argument)
            base = _times(powers, {(name, argument): -2})
            made = _merge(group, trig, _times(base, {other: 2}), base, 1)
            if made is None:
                # X − X cos² = X sin²
                made = _merge(group, base, trig, _times(base, {other: 2}), -1)
            if made is not None:
                return made
    for i, (first, _) in enumerate(trig):
        for second, _ in trig[i + 1 :]:
            made = _addition_theorem(group, trig, powers, first, second)
            if made is not None:
                return made
    return []


def _addition_theorem(
    group: dict[TrigMonomial, Weights],
    trig: TrigMonomial,
    powers: dict[tuple[str, sp.Expr], int],
    first: tuple[str, sp.Expr],
    second: tuple[str, sp.Expr],
) -> list[TrigMonomial] | None:
    """cos a cos b ± sin a sin b = cos(a ∓ b); sin a cos b ± cos a sin b = sin(a ± b)."""
    (f, a), (g, b) = first, second
    if a == b:
        return None
    base = dict(_times(powers, {first: -1, second: -1}))
    partner = _times(base, {(_partner(f), a): 1, (_partner(g), b): 1})
    if partner not in group:
        return None
    for sign in (1, -1):
        if f == g:
            # (cos cos) + sign (sin sin) = cos(a − sign b)
            name, argument = "cos", a - sign * b
            scale = 1 if f == "cos" else sign
        elif f == "sin":
            # (sin a cos b) + sign (cos a sin b) = sin(a + sign b)
            name, argument, scale = "sin", a + sign * b, 1
        else:
            # (cos a sin b) + sign (sin a cos b) = sin(b + sign a)
            name, argument, scale = "sin", b + sign * a, 1
        if argument == 0:
            continue
        if argument.could_extract_minus_sign():
            argument, scale = -argument, scale * (1 if name == "cos" else -1)
        made = _merge(group, trig, partner, _times(base, {(name, argument): 1}), sign, scale)
        if made is not None:
            return made
    return None


def _partner(name: str) -> str:
    return "cos" if name == "sin" else "sin"


def _times(
    powers: dict[tuple[str, sp.Expr], int] | TrigMonomial, change: dict[tuple[str, sp.Expr], int]
) -> TrigMonomial:
    result = dict(powers)
    for key, power in change.items():
        result[key] = result.get(key, 0) + power
    return _canonical({k: p for k, p in result.items() if p})


def _merge(
    group: dict[TrigMonomial, Weights],
    first: TrigMonomial,
    second: TrigMonomial,
    target: TrigMonomial,
    sign: int,
    scale: int = 1,
) -> list[TrigMonomial] | None:
    """Where ``first`` has weight c and ``second`` sign·c, replace both by scale·c·target.

    Masses whose weights do not pair up stay where they are. None if no mass pairs up.
    """
    if first not in group or second not in group:
        return None
    ours, theirs = group[first], group[second]
    common = {
        m: c for m, c in ours.items() if c != 0 and theirs.get(m, _ZERO) == sign * c
    }
    if not common:
        return None
    for source, weights in ((first, ours), (second, theirs)):
        for m in common:
            del weights[m]
        if not weights:
            del group[source]
    into = group.setdefault(target, {})
    for m, c in common.items():
        into[m] = into.get(m, _ZERO) + scale * c
        if into[m] == 0:
            del into[m]
    if not into:
        del group[target]
        return [k for k in (first, second) if k in group]
    return [k for k in (target, first, second) if k in group]


def common_factor(terms: list[sp.Expr]) -> sp.Expr:
    """Greatest common monomial of the terms, with the positive content of their numbers."""
    if not terms:
        return _ONE
    common: dict[sp.Expr, sp.Expr] | None = None
    numbers = []
    for term in terms:
        number, rest = term.as_coeff_Mul(rational=True)
        numbers.append(abs(number))
        powers = _powers(rest)
        if common is None:
            common = powers
        else:
            common = {
                b: min(e, powers[b]) for b, e in common.items() if b in powers
            }
        if not common:
            common = {}
    factors = [b**e for b, e in (common or {}).items()]
    return sp.Mul(sp.gcd_list(numbers), *factors)


def _powers(product: sp.Expr) -> dict[sp.Expr, sp.Expr]:
    """Base → positive rational exponent of each factor."""
    powers: dict[sp.Expr, sp.Expr] = {}
    for factor in sp.Mul.make_args(product):
        base, exponent = factor.as_base_exp()
        if factor.is_number and not factor.is_Symbol:
            base, exponent = factor, _ONE
        if exponent.is_Rational and exponent > 0:
            powers[base] = exponent
        elif not exponent.is_Rational:
            powers[factor] = _ONE
    powers.pop(_ONE, None)
    return powers


#: Numbers of terms between which a polynomial is tried for factors.
_FACTOR_TERMS = range(3, 13)


def factored(terms: list[sp.Expr]) -> sp.Expr:
    """The sum of the terms as a product: common monomial, then polynomial factors of the rest."""
    if len(terms) < 2:
        return sp.Add(*terms)
    common = common_factor(terms)
    inner = _polynomial_factors(sp.Add(*(t / common for t in terms)))
    number, rest = common.as_coeff_Mul(rational=True)
    if rest == 1 and inner.is_Add:
        return inner if number == 1 else sp.Mul(number, inner, evaluate=False)
    return number * (rest * inner)


def _polynomial_factors(expr: sp.Expr) -> sp.Expr:
    """``l² + 2 l x + x²`` as ``(l + x)²``, for short polynomials in symbols only."""
    if not expr.is_Add or len(expr.args) not in _FACTOR_TERMS:
        return expr
    symbols = sorted(expr.free_symbols, key=str)
    if not symbols or len(symbols) > 4 or not expr.is_polynomial(*symbols):
        return expr
    if not all(a.is_Rational or a.is_Symbol for t in expr.args for a in sp.preorder_traversal(t)
               if not a.args):
        return expr
    found = sp.factor(expr)
    return expr if found.is_Add else found
