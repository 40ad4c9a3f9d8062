"""Sums as a lecturer writes them on a line of their own: multiplied out, like terms gathered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import Splitter, TermSum
from lagrange_cli.mechanics.algebra.expand import expand_terms
from lagrange_cli.mechanics.algebra.factor import factored
from lagrange_cli.mechanics.algebra.group_by_velocity import group_by_velocities
from lagrange_cli.mechanics.algebra.shortest import shortest_groups
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced

#: Terms that a line may be multiplied out to; a longer one stays as it was derived.
_TERM_BUDGET = 400


@dataclass(frozen=True)
class Collector:
    """Gathers the terms of sums.

    Attributes
    ----------
    masses
        Symbols that are gathered as weights: ``(m1 + m2) l²``.
    constants
        Parameters.
    rates
        Velocities, then accelerations.
    """

    masses: frozenset[sp.Expr]
    constants: frozenset[sp.Symbol]
    rates: tuple[sp.Symbol, ...]

    @classmethod
    def of(cls, reduced: Reduced) -> Collector:
        return cls(
            frozenset(f for m in reduced.masses for f in m.free_symbols),
            frozenset(reduced.names.parameters.values()),
            (*(c.v for c in reduced.coordinates), *(c.a for c in reduced.coordinates)),
        )

    def collected(self, expr: sp.Expr) -> sp.Expr:
        """The same sum, each product of velocities and accelerations with one coefficient."""
        expanded = expand_terms(expr, _TERM_BUDGET)
        if expanded is None:
            return expr
        total = TermSum(Splitter(self.masses))
        total.add_all(term for term in expanded if term != 0)
        return sp.Add(*self._grouped(total.collected()))

    def _grouped(self, terms: Sequence[sp.Expr]) -> list[sp.Expr]:
        present = {s for term in terms for s in symbols_in(term)}
        rates = [rate for rate in self.rates if rate in present]
        grouped = []
        for product, cofactors in group_by_velocities(terms, rates):
            if product == 1:
                grouped += shortest_groups(cofactors, self.constants)
            else:
                grouped.append(factored(cofactors) * product)
        return grouped
