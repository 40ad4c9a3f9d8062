"""Lines as a lecturer leaves them: multiplied out, like terms gathered, and their rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import Splitter, TermSum
from lagrange_cli.mechanics.algebra.factor import factored, group_by_velocities
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.shortest import shortest_groups
from lagrange_cli.mechanics.dynamics.euler_form import lone_quaternion
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.step_values import rate_symbol, spin_symbol
from lagrange_cli.mechanics.symbols.convert import total_derivative
from lagrange_cli.scene.bodies import bodies_of

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
    speeds, accelerations
        Those of coordinates, then components of ω and ω̇ of bodies by quaternions.
    """

    masses: frozenset[sp.Expr]
    constants: frozenset[sp.Symbol]
    speeds: tuple[sp.Symbol, ...]
    accelerations: tuple[sp.Symbol, ...]

    @classmethod
    def from_scene(cls, reduced: Reduced) -> Collector:
        spins = [
            spin_symbol(body.name, axis)
            for body in bodies_of(reduced.scene)
            for axis in "123"
            if lone_quaternion(body)
        ]
        return cls(
            frozenset(f for m in reduced.masses for f in m.free_symbols),
            frozenset(reduced.names.parameters.values()),
            (*(c.v for c in reduced.coordinates), *spins),
            (*(c.a for c in reduced.coordinates), *(rate_symbol(s.name) for s in spins)),
        )

    @property
    def rates(self) -> tuple[sp.Symbol, ...]:
        """Speeds, then accelerations."""
        return (*self.speeds, *self.accelerations)

    def collected(self, expr: sp.Expr) -> sp.Expr:
        """Collect a sum so that each product of rates and accelerations has one coefficient."""
        expanded = expand_terms(expr, _TERM_BUDGET)
        if expanded is None:
            return expr
        total = TermSum(Splitter(self.masses))
        total.add_all(term for term in expanded if term != 0)
        return sp.Add(*self._grouped(total.collected()))

    def products(self, collected: sp.Expr) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
        """Return the terms of a collected sum as coefficients of products of rates.

        Accelerations are first, as in equations of motion.
        """
        pairs = []
        for product, cofactors in group_by_velocities(sp.Add.make_args(collected), self.rates):
            pairs += [(c, product) for c in cofactors]
        return tuple(sorted(pairs, key=lambda pair: pair[1] not in self.accelerations))

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


def along_motion(reduced: Reduced, expr: sp.Expr) -> sp.Expr:
    """The total time derivative of an expression over q, v, t."""
    chain = [(c.q, c.v) for c in reduced.coordinates] + [(c.v, c.a) for c in reduced.coordinates]
    return total_derivative(expr, reduced.names.t, chain)
