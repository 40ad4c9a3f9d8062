"""Expressions made of pieces, with factors that do not depend on an index before its Σ."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import sympy as sp

from lagrange_cli.mechanics.algebra.factor import (
    common_factor,
    factored,
    group_by_velocities,
    scaled,
)
from lagrange_cli.mechanics.algebra.shortest import shortest_groups
from lagrange_cli.mechanics.families.elements import Elements, Place
from lagrange_cli.mechanics.families.forms import Form, Range, Series
from lagrange_cli.mechanics.families.merging import Piece


@dataclass
class Gathering:
    """Makes expressions of pieces, with a symbol for each series.

    Attributes
    ----------
    elements
        The families.
    constants
        Symbols that do not move.
    series
        Symbol → series, for all series so far.
    """

    elements: Elements
    constants: frozenset[sp.Symbol]
    series: dict[sp.Symbol, Series] = field(default_factory=dict)

    def energy(self, pieces: Sequence[Piece], left: Sequence[sp.Expr]) -> Form:
        """Add up pieces and terms that belong to no piece."""
        sums: dict[sp.Expr, list[sp.Expr]] = {}
        for outer, symbol in self._sums(pieces, self._by_parameters):
            sums.setdefault(outer, []).append(symbol)
        terms = [
            scaled(number, product * sp.Add(*symbols))
            for outer, symbols in sums.items()
            for number, product in (outer.as_coeff_Mul(rational=True),)
        ]
        return self.form(sp.Add(*terms, *shortest_groups(left, self.constants)))

    def row(self, pieces: Sequence[Piece]) -> list[tuple[sp.Expr, sp.Expr]]:
        """Coefficients and factors of an equation, as :class:`.ShownEquation` has them."""
        sums = [
            (outer, s, self._order(self.series[s].body))
            for outer, s in self._sums(pieces, self._shortest)
        ]
        local = [p.term for p in pieces if not p.ranges]
        accelerations = sorted(self._with_order(local, 2), key=str)
        velocities = sorted(self._with_order(local, 1), key=str)
        terms: list[tuple[sp.Expr, sp.Expr]] = [(o, s) for o, s, order in sums if order == 2]
        others: list[sp.Expr] = []
        by_acceleration: dict[sp.Symbol, list[sp.Expr]] = {a: [] for a in accelerations}
        for term in local:
            present = [a for a in accelerations if a in term.free_symbols]
            (by_acceleration[present[0]] if present else others).append(term)
        terms += [(factored([t / a for t in ts]), a) for a, ts in by_acceleration.items() if ts]
        terms += [(o, s) for o, s, order in sums if order == 1]
        free: list[sp.Expr] = []
        for monomial, cofactors in group_by_velocities(others, velocities):
            if monomial == 1:
                free += cofactors
            else:
                terms.append((factored(cofactors), monomial))
        free += [o * s for o, s, order in sums if order < 1]
        terms += [(t, sp.S.One) for t in shortest_groups(free, self.constants)]
        return terms

    def form(self, expression: sp.Expr) -> Form:
        """An expression with the series in it."""
        return Form(expression, self.series_in([expression]))

    def series_in(self, expressions: Sequence[sp.Expr]) -> dict[sp.Symbol, Series]:
        """Collect the series whose symbols stand in some expressions."""
        symbols = {s for e in expressions for s in e.free_symbols}
        return {s: one for s, one in self.series.items() if s in symbols}

    def _sums(
        self, pieces: Sequence[Piece], product_of: Callable[[list[sp.Expr]], sp.Expr]
    ) -> list[tuple[sp.Expr, sp.Symbol]]:
        """List factors before each Σ with its symbol; summands with the same indices share it."""
        groups: dict[tuple[Range, ...], list[sp.Expr]] = {}
        for piece in pieces:
            if piece.ranges:
                groups.setdefault(piece.ranges, []).append(piece.term)
        return [self._sum(product_of(terms), ranges) for ranges, terms in groups.items()]

    def _shortest(self, terms: list[sp.Expr]) -> sp.Expr:
        return factored(shortest_groups(terms, self.constants))

    def _by_parameters(self, terms: list[sp.Expr]) -> sp.Expr:
        """Factor parameters and numbers out of a sum; moving factors stay as written."""
        number, common = common_factor(terms).as_coeff_Mul(rational=True)
        still = [f for f in sp.Mul.make_args(common) if f.free_symbols <= self.constants]
        if all(t.could_extract_minus_sign() for t in terms):
            number = -number
        common = sp.Mul(*still)
        return scaled(number, common * sp.Add(*(t / common / number for t in terms)))

    def _sum(self, whole: sp.Expr, ranges: tuple[Range, ...]) -> tuple[sp.Expr, sp.Symbol]:
        letters = {r.letter for r in ranges}
        number, product = whole.as_coeff_Mul(rational=True)
        outer: list[sp.Expr] = [number]
        inner: list[sp.Expr] = []
        for factor in sp.Mul.make_args(product):
            (inner if self._depends(factor, letters) else outer).append(factor)
        symbol = sp.Symbol(f"sum({len(self.series)})", real=True)
        self.series[symbol] = Series(sp.Mul(*inner), ranges)
        return sp.Mul(*outer), symbol

    def _depends(self, factor: sp.Expr, letters: set[sp.Symbol]) -> bool:
        """Tell whether a factor holds an index, or an element with it."""
        for symbol in factor.free_symbols:
            element = self.elements.meanings.get(symbol)
            places = element.places if element is not None else ()
            if symbol in letters or any(
                isinstance(p, Place) and p.letter in letters for p in places
            ):
                return True
        return False

    def _order(self, expr: sp.Expr) -> int:
        """The highest derivative in an expression; −1 if it holds no element."""
        elements = [self.elements.element(s) for s in expr.free_symbols]
        return max((e.order for e in elements if e is not None), default=-1)

    def _with_order(self, terms: Sequence[sp.Expr], order: int) -> set[sp.Symbol]:
        return {
            s
            for t in terms
            for s in t.free_symbols
            if (e := self.elements.element(s)) is not None and e.order == order
        }
