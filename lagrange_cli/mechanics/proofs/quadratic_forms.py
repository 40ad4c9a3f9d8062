"""Equations as quadratic forms over generators, for sum-of-squares proofs.

Every equation becomes Σ fᵢⱼ gᵢ gⱼ = 0 over generators g₀ = 1, g₁, …: symbols, functions of
them, and products of two generators for terms of more than two factors. Relations of
generators are kept beside: sin² + cos² = 1, (√u)² = u, √u ≥ 0, exp u > 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate

# Budgets that keep proofs quick: the work grows with a high power of the number of generators.
# Beyond them no proof is attempted; none is tuned.

#: Terms that an equation may be multiplied out to.
_TERM_BUDGET = 80
#: Generators of all equations.
_GENERATOR_BUDGET = 60
#: Factors of a term.
_DEGREE_BUDGET = 8

QuadraticForm = dict[tuple[int, int], mpf]
"""Coefficients fᵢⱼ, i ≤ j, of a quadratic form over generators."""

_ZERO = mpf(0)
_ONE = mpf(1)

#: Least and largest value of functions that have both.
_RANGES = {
    sp.acos: (sp.Integer(0), sp.pi),
    sp.asin: (-sp.pi / 2, sp.pi / 2),
    sp.atan: (-sp.pi / 2, sp.pi / 2),
    sp.tanh: (-sp.Integer(1), sp.Integer(1)),
}


class FormBudgetError(Exception):
    """Equations beyond the budget of terms, factors or generators."""


@dataclass
class QuadraticForms:
    """Generators, and the forms of equations over them.

    Attributes
    ----------
    constants
        Values of the symbols that have one.
    monomials
        For each generator the symbols and functions that it is the product of, sorted.
    relations
        Forms that are zero whatever the symbols are.
    domains
        Forms that are zero wherever the functions are real.
    """

    constants: Mapping[sp.Symbol, mpf]
    monomials: list[tuple[int, ...]] = field(default_factory=lambda: [()])
    relations: list[QuadraticForm] = field(default_factory=list)
    domains: list[QuadraticForm] = field(default_factory=list)
    _atoms: dict[sp.Expr, tuple[int, ...]] = field(default_factory=dict)
    _products: dict[tuple[int, ...], int] = field(default_factory=dict)

    def form(self, expr: sp.Expr) -> QuadraticForm:
        """Write an expression as a quadratic form.

        Raises
        ------
        TooLargeError
            Too many terms, factors or generators.
        """
        terms = expand_terms(expr, _TERM_BUDGET)
        if terms is None:
            raise FormBudgetError
        coefficients: QuadraticForm = {}
        for term in terms:
            number, factors = self._factors(term)
            pair = self._pair(sorted(factors))
            coefficients[pair] = coefficients.get(pair, _ZERO) + number
        return {pair: x for pair, x in coefficients.items() if x}

    def multiply(self, form: QuadraticForm, generator: int) -> QuadraticForm:
        """Multiply a form by a generator."""
        coefficients: QuadraticForm = {}
        for (i, j), x in form.items():
            factors = [*self.monomials[i], *self.monomials[j], *self.monomials[generator]]
            pair = self._pair(sorted(factors))
            coefficients[pair] = coefficients.get(pair, _ZERO) + x
        return {pair: x for pair, x in coefficients.items() if x}

    def coincidences(self) -> list[QuadraticForm]:
        """List the relations between pairs of generators with the same product."""
        ways: dict[tuple[int, ...], tuple[int, int]] = {}
        differences: list[QuadraticForm] = []
        for j, second in enumerate(self.monomials):
            for i, first in enumerate(self.monomials[: j + 1]):
                product = tuple(sorted((*first, *second)))
                if product in ways:
                    differences.append({ways[product]: _ONE, (i, j): -_ONE})
                ways.setdefault(product, (i, j))
        return differences

    def products_of_two(self) -> None:
        """Make every product of two atoms a generator."""
        singles = [i for i, m in enumerate(self.monomials) if len(m) == 1]
        for k, i in enumerate(singles):
            for j in singles[k:]:
                self._product(tuple(sorted((*self.monomials[i], *self.monomials[j]))))

    def _factors(self, term: sp.Expr) -> tuple[mpf, list[int]]:
        """Split a term into its number and its atoms."""
        number, factors = _ONE, list[int]()
        for factor in sp.Mul.make_args(term):
            if factor.free_symbols <= self.constants.keys():
                number *= self._value(factor)
                continue
            base, exponent = factor.as_base_exp()
            if not (exponent.is_Integer and exponent.is_positive):
                base, exponent = factor, sp.Integer(1)
            factors += self._atom(base) * int(min(exponent, _DEGREE_BUDGET + 1))
        if len(factors) > _DEGREE_BUDGET:
            raise FormBudgetError
        return number, factors

    def _value(self, expr: sp.Expr) -> mpf:
        try:
            return evaluate([expr], {s: self.constants[s] for s in expr.free_symbols})[0]
        except DomainError as error:
            raise FormBudgetError from error

    def _new(self, monomial: tuple[int, ...]) -> int:
        if len(self.monomials) >= _GENERATOR_BUDGET:
            raise FormBudgetError
        self.monomials.append(monomial)
        return len(self.monomials) - 1

    def _atom(self, expr: sp.Expr) -> tuple[int, ...]:
        """Give the generator of a symbol or function; twice that of its root if it has one."""
        if expr not in self._atoms:
            number = self._root()
            rooted = expr.is_nonnegative or expr.func is sp.acosh or _is_root(expr)
            self._atoms[expr] = (number, number) if rooted else (number,)
            self._relate(expr, self._atoms[expr])
        return self._atoms[expr]

    def _root(self) -> int:
        """Add a generator that is no product."""
        number = self._new(())
        self.monomials[number] = (number,)
        return number

    def _relate(self, expr: sp.Expr, atom: tuple[int, ...]) -> None:
        """Add the relation that defines or bounds a function."""
        if expr.func in (sp.sin, sp.cos):
            partner = self._atom((sp.cos if expr.func is sp.sin else sp.sin)(expr.args[0]))
            if partner > atom:
                self._vanish({self._square(atom): _ONE, self._square(partner): _ONE}, -_ONE)
        elif expr.func is sp.cosh:
            self._vanish({self._pair(atom): _ONE, self._positive(): -_ONE}, -_ONE)
        elif expr.func in _RANGES:
            low, high = (mpf(x.evalf(mpmath.mp.dps)) for x in _RANGES[expr.func])
            between = {self._square(atom): -_ONE, self._pair(atom): low + high}
            self._vanish({**between, self._positive(): -_ONE}, -low * high)
        elif expr.func is sp.log:
            self.domains.append(_sum(self.form(expr.args[0]), {self._positive(): -_ONE}))
        elif expr.is_Pow and expr.exp == sp.Rational(1, 2):
            self.domains.append(_sum(self.form(expr.base), {self._square(atom): -_ONE}))
        elif expr.is_Pow and expr.exp.is_Integer and expr.exp.is_negative:
            form = self.form(expr.base**-expr.exp)
            for k in atom:
                form = self.multiply(form, k)
            self.domains.append(_sum(form, {(0, 0): -_ONE}))

    def _vanish(self, form: QuadraticForm, constant: mpf = _ZERO) -> None:
        """Add the relation that a form and a number are zero together."""
        self.relations.append(_sum(form, {(0, 0): constant}))

    def _positive(self) -> tuple[int, int]:
        """Add a square, which represents any number that is not negative."""
        root = self._root()
        return root, root

    def _square(self, atom: tuple[int, ...]) -> tuple[int, int]:
        return self._pair(atom * 2)

    def _pair(self, factors: Sequence[int]) -> tuple[int, int]:
        """Split a product of atoms into two generators; equal atoms are paired first."""
        if len(factors) <= 1:
            return 0, factors[0] if factors else 0
        if len(factors) == 2:
            return factors[0], factors[1]
        pairs, single = [], list(factors)
        for atom in dict.fromkeys(factors):
            while single.count(atom) > 1:
                pairs.append((atom, atom))
                single.remove(atom)
                single.remove(atom)
        half = _halves(pairs, single)
        first, second = (self._product(tuple(sorted(h))) for h in half)
        return min(first, second), max(first, second)

    def _product(self, monomial: tuple[int, ...]) -> int:
        """Give the generator of a product of atoms, related to generators of smaller ones."""
        if len(monomial) <= 1:
            return monomial[0] if monomial else 0
        if monomial not in self._products:
            i, j = self._pair(monomial)
            number = self._new(monomial)
            self._products[monomial] = number
            self.relations.append({(0, number): _ONE, (i, j): -_ONE})
        return self._products[monomial]


def _is_root(expr: sp.Expr) -> bool:
    return bool(expr.is_Pow and expr.exp.is_Rational and expr.exp.q == 2)


def _sum(form: QuadraticForm, addend: QuadraticForm) -> QuadraticForm:
    total = dict(form)
    for pair, x in addend.items():
        total[pair] = total.get(pair, _ZERO) + x
    return {pair: x for pair, x in total.items() if x}


def _halves(pairs: Sequence[tuple[int, int]], single: Sequence[int]) -> tuple[list[int], list[int]]:
    """Split into two products of about the same degree, equal ones if possible."""
    first = [a for a, _ in pairs]
    second = list(first)
    for k, atom in enumerate(single):
        (second if k % 2 else first).append(atom)
    return first, second
