"""Momenta ∂L/∂q̇ as they are printed, and the equations that print as the rate of one.

The equation of a conserved momentum reads ``d/dt p = 0``. One whose momentum is not linear in
velocities, as m γ ṙ of a relativistic particle, reads ``d/dt p − ∂L/∂q + ∂D/∂q̇ − Q = 0``: its
accelerations make a long sum, which no book prints (Landau and Lifshitz, *The Classical Theory of
Fields*, 4th ed., section 17).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.factor import factored, grouped_sum, letter_below
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.dynamics.textbook_form import Rows, RowSystem
from lagrange_cli.mechanics.equations import RateForm, ShownEquation
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.sparse import ExpressionRow

#: Terms that a momentum or a remainder may be multiplied out to for collection.
_TERM_BUDGET = 400

#: Length in print of ``d/dt``: a fraction.
_RATE_LENGTH = 2


def terms_by_symbol(expr: sp.Expr) -> dict[sp.Symbol, list[sp.Expr]]:
    """The terms of a sum that hold each of its symbols."""
    holding: dict[sp.Symbol, list[sp.Expr]] = {}
    for term in sp.Add.make_args(expr):
        for symbol in symbols_in(term):
            holding.setdefault(symbol, []).append(term)
    return holding


def momentum_of(derivation: Uncertified, velocity: sp.Symbol, terms: Sequence[sp.Expr]) -> sp.Expr:
    """∂L/∂q̇: M q̇ plus terms from parts of L that are not quadratic in velocities.

    ``terms`` are those of L that hold the velocity.
    """
    velocities = [c.v for c in derivation.reduced.coordinates]
    whole = _collect(sp.Add(*(derivative(t, velocity) for t in terms)), velocities)
    return _with_integers(whole, frozenset(velocities))


def _collect(expr: sp.Expr, velocities: Sequence[sp.Symbol]) -> sp.Expr:
    expanded = expand_terms(expr, _TERM_BUDGET)
    if expanded is None:
        return expr
    terms = collected_terms(expanded)
    if not all(symbols_in(t).isdisjoint(velocities) for t in terms):
        return grouped_sum(terms, velocities)
    return factored(terms)


def _with_integers(whole: sp.Expr, velocities: frozenset[sp.Symbol]) -> sp.Expr:
    """Write ``½ ρ² (2 m φ̇ + q B)`` as ``m ρ² φ̇ + ½ q B ρ²``; leave other products."""
    number, product = whole.as_coeff_Mul(rational=True)
    sums = [f for f in sp.Mul.make_args(product) if f.is_Add]
    if number.q == 1 or len(sums) != 1:
        return whole
    multiples = [t for t in sums[0].args if (number * t.as_coeff_Mul(rational=True)[0]).q == 1]
    is_mixed = len({symbols_in(t).isdisjoint(velocities) for t in sums[0].args}) == 2
    if not multiples or not is_mixed:
        return whole
    return sp.Add(*(whole.xreplace({sums[0]: t}) for t in sums[0].args))


def as_rates(
    derivation: Uncertified, shown: Sequence[ShownEquation], conserved: Mapping[str, sp.Expr]
) -> tuple[ShownEquation, ...]:
    """Print equations as rates of momenta where that is shorter.

    Parameters
    ----------
    shown
        The equation of each coordinate.
    conserved
        Conserved momenta as they are printed, by coordinate; where their equations are plain sums
        of accelerations, they stay as they are.
    """
    rates = _Rates(derivation, conserved)
    return tuple(rates.form(row, whole) for row, whole in enumerate(shown))


class _Rates:
    """Equations of a derivation as rates of momenta."""

    def __init__(self, derivation: Uncertified, conserved: Mapping[str, sp.Expr]) -> None:
        self.derivation = derivation
        self.conserved = conserved
        self.coordinates = derivation.reduced.coordinates
        self.velocities = frozenset(c.v for c in self.coordinates)
        self.accelerations = frozenset(c.a for c in self.coordinates)

    def form(self, row: int, shown: ShownEquation) -> ShownEquation:
        """Return an equation with the rate that prints in its place, unchanged if there is none."""
        momentum = self.conserved.get(shown.coordinate)
        inertia = [c for c, factor in shown.terms if factor in self.accelerations]
        if momentum is not None:
            if len(inertia) == len(shown.terms):
                return shown
            rate = RateForm(momentum)
        elif all(symbols_in(c).isdisjoint(self.velocities) for c in inertia):
            return shown
        else:
            velocity = self.coordinates[row].v
            momentum = momentum_of(self.derivation, velocity, self._holding.get(velocity, []))
            rate = RateForm(momentum, tuple(self._remainders.groups(row)))
        length = self._length([(rate.momentum, sp.S.One), *rate.remainder]) + _RATE_LENGTH
        if self._length(shown.terms) <= length:
            return shown
        terms = shown.terms if shown.divided_by == 1 else tuple(self._undivided.groups(row))
        return ShownEquation(shown.coordinate, terms, sp.S.One, rate)

    def _length(self, terms: Iterable[tuple[sp.Expr, sp.Expr]]) -> int:
        """Length of a sum in print, each power of a named expression that of a letter's."""
        products = [[e.xreplace(self._letters) for e in term if e != 1] for term in terms]
        return sum(printed_length(e) for product in products for e in product) + len(products) - 1

    @cached_property
    def _letters(self) -> dict[sp.Expr, sp.Expr]:
        """Bases of named powers, and the same without denominators, with letters in their place."""
        letters: dict[sp.Expr, sp.Expr] = {}
        for expression in self._undivided.system.named:
            base = expression.as_base_exp()[0]
            if base.is_Add:
                letter, below = sp.Dummy(positive=True), letter_below(base) or sp.S.One
                above = sp.Add(*(term * below for term in base.args))
                letters |= {above: below * letter, -above: -below * letter, base: letter}
        return letters

    @cached_property
    def _holding(self) -> dict[sp.Symbol, list[sp.Expr]]:
        return terms_by_symbol(self.derivation.lagrangian)

    @cached_property
    def _undivided(self) -> Rows:
        return Rows(RowSystem.of(self.derivation))

    @cached_property
    def _remainders(self) -> Rows:
        """Rows of what stands beside the rates of momenta, −∂L/∂q + ∂D/∂q̇ − Q − Σ λ·gradient."""
        forces = [self._forces(row) for row in range(len(self.coordinates))]
        still = [ExpressionRow(len(forces), {}) for _ in forces]
        return Rows(replace(self._undivided.system, mass_matrix=still, forcing=forces))

    def _forces(self, row: int) -> Sequence[sp.Expr]:
        """Return terms of ∂L/∂q − ∂D/∂q̇ + Q."""
        coordinate, derivation = self.coordinates[row], self.derivation
        whole = sp.Add(
            *(derivative(term, coordinate.q) for term in self._holding.get(coordinate.q, [])),
            -derivative(derivation.dissipation, coordinate.v),
            *(force.generalized[row] for force in derivation.forces),
        )
        expanded = expand_terms(whole, _TERM_BUDGET)
        return sp.Add.make_args(whole) if expanded is None else collected_terms(expanded)
