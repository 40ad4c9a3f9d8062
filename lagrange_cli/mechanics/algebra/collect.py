"""Collection of like terms in sums of products, as in a textbook.

Every term is split into a number, a mass, a trigonometric monomial and other
powers. Terms that differ only in number or mass are gathered, so that
``m1 l² + m2 l²`` becomes ``(m1 + m2) l²``; then sin² + cos² = 1 and the
addition theorems are applied wherever they shorten the sum. The work is
linear in terms times trigonometric factors of one; nothing searches.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import sympy as sp

from lagrange_cli.mechanics.algebra.arithmetic import monomial
from lagrange_cli.mechanics.algebra.identities import (
    Rational,
    TrigFactor,
    TrigMonomial,
    Weights,
    shorten_trigonometric,
)
from lagrange_cli.mechanics.algebra.polynomials import expand_terms

_ZERO = sp.Integer(0)
_ONE = sp.Integer(1)
_MINUS_ONE = sp.Integer(-1)

#: Most functions of angles that are kept: sines and cosines of the differences of 256 coordinates.
_KEPT = 2**17

#: Largest denominator that is cleared as content of a sum: 9.81 = 981/100 stays.
_LARGEST_DENOMINATOR = 4
#: sin, cos and tan as powers of sin and cos.
_TRIGONOMETRIC = {
    sp.sin: (("sin", 1),),
    sp.cos: (("cos", 1),),
    sp.tan: (("sin", 1), ("cos", -1)),
}
#: The number of arguments of sin and cos, as SymPy keeps it.
_ONE_ARGUMENT = sp.FiniteSet(1)


#: Pairs of a base and its exponent.
Powers: TypeAlias = frozenset[tuple[sp.Expr, sp.Expr]]


class TermParts(NamedTuple):
    """A term taken apart: ``number · mass · Π base^exponent · trigonometric monomial``.

    Attributes
    ----------
    number
        Its rational factor.
    mass
        Its mass, 1 if it has none.
    powers
        Base and exponent of all other factors.
    trig
        Trigonometric factor → power.
    """

    number: Rational
    mass: sp.Expr
    powers: Powers
    trig: dict[TrigFactor, int]

    def renamed(self, rename: Callable[[sp.Expr], sp.Expr]) -> TermParts:
        """Exchange symbols, none of them a mass, in a way that keeps their order."""
        powers = frozenset((rename(base), rename(exponent)) for base, exponent in self.powers)
        trig = {(name, rename(argument)): power for (name, argument), power in self.trig.items()}
        return TermParts(self.number, self.mass, powers, trig)


class Splitter:
    """Takes terms apart, each distinct one once.

    Parameters
    ----------
    masses
        Symbols that are gathered as common weights.
    """

    def __init__(self, masses: frozenset[sp.Expr] = frozenset()) -> None:
        self.masses = masses
        self._known: dict[sp.Expr, TermParts] = {}
        #: Powers of two factors and a mass → number and powers of their product.
        self._products: dict[tuple[Powers, Powers, sp.Expr], tuple[Rational, Powers]] = {}
        self._factors: dict[Powers, list[sp.Expr]] = {}
        #: Sums of masses that count as one mass, and the masses in them.
        self._sums: dict[sp.Expr, Weights] = {}
        #: Order of first appearance: the canonical order within a monomial.
        self.rank: dict[TrigFactor, int] = {}

    def split(self, term: sp.Expr) -> TermParts:
        """Take a term that is not a sum apart."""
        if term not in self._known:
            self._known[term] = self._split(term)
        return self._known[term]

    def _split(self, term: sp.Expr) -> TermParts:
        number: Rational = 1
        mass = _ONE
        powers: dict[sp.Expr, sp.Expr] = {}
        trig: dict[TrigFactor, int] = {}
        for factor in sp.Mul.make_args(term):
            if factor.is_Rational:
                number = python_rational(factor)
                continue
            if mass is _ONE and factor in self.masses:
                mass = factor
                continue
            base, power = factor.as_base_exp()
            if base.func is sp.sign and power.is_Integer:
                power %= 2  # sign² = 1 but at a single point
            if base.func in _TRIGONOMETRIC and power.is_Integer and power.is_positive:
                for name, sign in _TRIGONOMETRIC[base.func]:
                    key = (name, base.args[0])
                    trig[key] = trig.get(key, 0) + sign * int(power)
            else:
                powers[base] = powers.get(base, _ZERO) + power
        return TermParts(
            number, mass, frozenset(powers.items()), {k: p for k, p in trig.items() if p}
        )

    def product(self, a: sp.Expr, b: sp.Expr) -> TermParts:
        """Take ``a·b`` apart without forming the product."""
        first, second = self.split(a), self.split(b)
        mass, further = first.mass, second.mass
        if mass is _ONE:
            mass, further = further, _ONE
        key = first.powers, second.powers, further
        if key not in self._products:
            self._products[key] = _product_of_powers(*key)
        number, powers = self._products[key]
        trig = dict(first.trig)
        for factor, exponent in second.trig.items():
            trig[factor] = trig.get(factor, 0) + exponent
        if 0 in trig.values():
            trig = {k: p for k, p in trig.items() if p}
        return TermParts(first.number * second.number * number, mass, powers, trig)

    def factors(self, powers: Powers) -> list[sp.Expr]:
        """List powers as expressions."""
        if powers not in self._factors:
            self._factors[powers] = [_power(base, exponent) for base, exponent in powers]
        return self._factors[powers]

    def as_one(self, weights: Weights) -> Weights:
        """Write the sum of several masses as a single weight."""
        number, mass = _weight_sum(weights)
        if mass.is_Add:
            self._sums[mass] = {m: _exact_quotient(c, number) for m, c in weights.items()}
        return {mass: number}

    def taken_apart(self, weights: Weights) -> Weights:
        """Undo :meth:`as_one`: sums of masses as the masses in them."""
        separate: Weights = {}
        for mass, count in weights.items():
            for m, c in self._sums.get(mass, {mass: 1}).items():
                separate[m] = separate.get(m, 0) + count * c
        return separate

    def canonical(self, trig: dict[TrigFactor, int]) -> TrigMonomial:
        """Sort the factors of a monomial into a tuple."""
        if len(trig) < 2:
            return tuple(trig.items())
        rank = self.rank
        if len(trig) == 2:
            first, second = trig.items()
            is_first = rank.setdefault(first[0], len(rank)) < rank.setdefault(second[0], len(rank))
            return (first, second) if is_first else (second, first)
        ordered = sorted([(rank.setdefault(item[0], len(rank)), item) for item in trig.items()])
        return tuple([item for _, item in ordered])


class TermSum:
    """A sum of terms, collected as in the docstring of the module.

    Parameters
    ----------
    splitter
        Shared between sums whose terms recur.
    """

    def __init__(self, splitter: Splitter | None = None) -> None:
        self._splitter = splitter or Splitter()
        self._groups: dict[Powers, dict[TrigMonomial, Weights]] = {}

    def add(self, term: sp.Expr, weights: Weights | None = None) -> None:
        """Add ``term``, which must not be a sum, times Σ number·mass of ``weights`` (default 1)."""
        self._add(self._splitter.split(term), weights)

    def add_product(self, a: sp.Expr, b: sp.Expr, weights: Weights | None = None) -> None:
        """Add ``a·b``, neither of them a sum, times ``weights``."""
        self._add(self._splitter.product(a, b), weights)

    def add_parts(self, parts: TermParts) -> None:
        """Add a term that has been taken apart."""
        self._add(parts, None)

    def add_all(self, terms: Iterable[sp.Expr]) -> None:
        for term in terms:
            self.add(term)

    def _add(self, split: TermParts, weights: Weights | None) -> None:
        trig = self._splitter.canonical(split.trig)
        group = self._groups.setdefault(split.powers, {})
        into = group.setdefault(trig, {})
        if not weights:
            into[split.mass] = into.get(split.mass, 0) + split.number
            return
        if split.mass is not _ONE:
            apart = self._splitter.taken_apart(weights)
            weights = {split.mass if m is _ONE else split.mass * m: c for m, c in apart.items()}
        for mass, count in weights.items():
            into[mass] = into.get(mass, 0) + split.number * count

    def collected(self) -> list[sp.Expr]:
        """List the terms after collection; masses that share a monomial appear as one sum."""
        return list(self._collect())

    def _collect(self) -> Iterator[sp.Expr]:
        for powers, group in self._groups.items():
            if len({mass for weights in group.values() for mass in weights}) > 1:
                for trig, weights in group.items():
                    group[trig] = self._splitter.taken_apart(weights)
            shorten_trigonometric(group, self._splitter.canonical)
            factors = self._splitter.factors(powers)
            for trig, weights in group.items():
                number, mass = _weight_sum(weights)
                if number != 0:
                    yield monomial(sympy_rational(number), [mass, *factors, *trig_factors(trig)])


def _product_of_powers(first: Powers, second: Powers, mass: sp.Expr) -> tuple[Rational, Powers]:
    """Multiply powers and a mass (1 for none); powers of rational numbers are factored out."""
    number: Rational = 1
    powers = dict(first)
    if mass is not _ONE:
        powers[mass] = powers.get(mass, _ZERO) + 1
    for base, power in second:
        total = powers.get(base, _ZERO) + power
        if base.func is sp.sign and total.is_Integer:
            total %= 2
        if base.is_Rational and total.is_Integer:
            number *= python_rational(base**total)
            total = _ZERO
        if total == 0:
            powers.pop(base, None)
        else:
            powers[base] = total
    return number, frozenset(powers.items())


def collected_terms(terms: Iterable[sp.Expr]) -> list[sp.Expr]:
    """Collect the terms of a sum; zeros among them are left out."""
    total = TermSum()
    total.add_all(e for e in terms if e != 0)
    return total.collected()


def fewest_terms(expr: sp.Expr, budget: int) -> list[sp.Expr] | None:
    """Multiply an expression out, and collect its terms if that leaves fewer, as sin² + cos² does.

    None if more than ``budget`` terms would result.
    """
    terms = expand_terms(expr, budget)
    return None if terms is None else min(terms, collected_terms(terms), key=len)


def trig_factors(trig: TrigMonomial) -> list[sp.Expr]:
    """List the factors of a monomial; sin/cos of one argument becomes tan."""
    if all(power > 0 for _, power in trig):
        return [_power(_function(*factor), power) for factor, power in trig]
    powers = dict(trig)
    factors = []
    for (name, argument), power in trig:
        tangents = min(powers.get(("sin", argument), 0), -powers.get(("cos", argument), 0))
        if tangents > 0:
            power += tangents if name == "cos" else -tangents
            if name == "sin":
                factors.append(sp.tan(argument) ** tangents)
        factors.append(_power(_function(name, argument), power))
    return factors


def _power(base: sp.Expr, exponent: int | sp.Expr) -> sp.Expr:
    return base if exponent == 1 else base**exponent


@lru_cache(maxsize=_KEPT)
def _function(name: str, argument: sp.Expr) -> sp.Expr:
    """Build sin or cos; for a sum of plain symbols SymPy has nothing to evaluate."""
    function = sp.sin if name == "sin" else sp.cos
    plain = argument.is_Symbol or (argument.is_Add and all(map(_is_signed_symbol, argument.args)))
    if not plain:
        return function(argument)
    # SymPy's own constructor spends most of its time on the number of arguments.
    value = sp.Expr.__new__(function, argument)
    value.nargs = _ONE_ARGUMENT
    return value


def _is_signed_symbol(expr: sp.Expr) -> bool:
    """Tell whether an expression is a symbol or its negative."""
    if expr.is_Mul and len(expr.args) == 2 and expr.args[0] is _MINUS_ONE:
        expr = expr.args[1]
    return bool(expr.is_Symbol)


def _weight_sum(weights: Weights) -> tuple[Rational, sp.Expr]:
    """Write Σ number·mass as (content, sum), so that −2 m1 − 2 m2 = −2 (m1 + m2)."""
    present = {m: c for m, c in weights.items() if c}
    if len(present) < 2:
        for mass, count in present.items():
            return count, mass
        return 0, _ONE
    content = rational_content(present.values())
    if all(c < 0 for c in present.values()):
        content = -content
    shares = {m: _exact_quotient(c, content) for m, c in present.items()}
    return content, sp.Add(*(m if c == 1 else m * sympy_rational(c) for m, c in shares.items()))


def _exact_quotient(a: Rational, b: Rational) -> Rational:
    """Divide a by b; return an int if the quotient is one."""
    if a == b:
        return 1
    quotient = Fraction(a) / Fraction(b)
    return quotient.numerator if quotient.denominator == 1 else quotient


def python_rational(number: sp.Rational) -> Rational:
    """Convert a SymPy rational to a Python number, whose arithmetic is much faster."""
    p, q = int(number.p), int(number.q)
    return p if q == 1 else Fraction(p, q)


@lru_cache
def sympy_rational(number: Rational) -> sp.Rational:
    """Convert a Python rational to a SymPy number."""
    return sp.Rational(number.numerator, number.denominator)


def rational_content(numbers: Iterable[Rational]) -> Rational:
    """Find the largest positive rational of which every number is a multiple (1 of none).

    Fractions are cleared only up to quarters: decimals such as 9.81 stay themselves.
    """
    nonzero = [n for n in numbers if n != 0]
    denominator = math.lcm(*(n.denominator for n in nonzero))
    if not nonzero or denominator > _LARGEST_DENOMINATOR:
        return 1
    numerator = math.gcd(*(n.numerator for n in nonzero))
    return numerator if denominator == 1 else Fraction(numerator, denominator)
