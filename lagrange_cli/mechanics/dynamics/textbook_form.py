"""The textbook form of the equations of motion.

Terms are ordered by ddot, dot, none, multipliers. A common factor is divided out when it is
a number, a mass or a ``positive`` parameter, since that can never hide
anything. The equation of a cyclic coordinate is left as it is: it reads
ṗ = 0 with the momentum that is reported beside it. A coordinate is divided out
only where the scene's ``expect`` writes the equation so, since that hides a
singular point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp

from lagrange_cli.mechanics.algebra.factor import common_factor, factored, scaled
from lagrange_cli.mechanics.algebra.group_by_velocity import group_by_velocities, positional_groups
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.sparse import entries

#: Tells whether the equation with this residual is one that ``expect`` writes.
_IsExpected = Callable[[sp.Expr], bool]


def shown_equations(
    derivation: Uncertified, conserving: Sequence[bool], asked: _IsExpected | None
) -> tuple[ShownEquation, ...]:
    """Textbook form of every equation.

    Parameters
    ----------
    conserving
        For each equation, true if it is a conservation law and stays undivided.
    asked
        Tells whether ``expect`` asks for a residual; None if it asks for none.
    """
    rows = _Rows(derivation)
    return tuple(_shown(rows, row, whole, asked) for row, whole in enumerate(conserving))


def _shown(rows: _Rows, row: int, cyclic: bool, asked: _IsExpected | None) -> ShownEquation:
    name = rows.derivation.reduced.coordinates[row].name
    groups = rows.groups(row)
    whole = _without_fractions(common_factor([c for c, _ in groups]), groups)
    divisor = _harmless(whole, rows.parameters, cyclic)
    if asked is not None and not cyclic and (whole / divisor).free_symbols:
        candidate = ShownEquation(name, _divided(groups, whole), whole)
        if asked(candidate.residual):
            return candidate
    return ShownEquation(name, _divided(groups, divisor), divisor)


def _without_fractions(whole: sp.Expr, groups: Sequence[tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
    """The common factor, which divides by ½ only where the first term has such a number too.

    ``I θ̈ + ½ k x`` is no better as ``2 I θ̈ + k x``.
    """
    number, factor = whole.as_coeff_Mul(rational=True)
    if number.q == 1:
        return whole
    first = common_factor(list(sp.Add.make_args(groups[0][0]))).as_coeff_Mul(rational=True)[0]
    return whole if first.q > 1 else scaled(sp.Integer(number.p), factor)


class _Rows:
    """Rows of a derivation, with symbols and orders that each row needs."""

    def __init__(self, derivation: Uncertified) -> None:
        self.derivation = derivation
        reduced = derivation.reduced
        self.parameters = frozenset(reduced.names.parameters.values())
        self.order = {c.v: k for k, c in enumerate(reduced.coordinates)}
        #: (entry of the gradient, multiplier) of the closures and gaps, by coordinate.
        self.pushes: list[list[tuple[sp.Expr, sp.Symbol]]] = [[] for _ in reduced.coordinates]
        for closure in derivation.pushing:
            for j, entry in entries(closure.gradient).items():
                self.pushes[j].append((entry, closure.multiplier))

    def groups(self, row: int) -> list[tuple[sp.Expr, sp.Expr]]:
        """(coefficient, factor) in display order."""
        coordinates = self.derivation.reduced.coordinates
        inertia = self.derivation.mass_matrix[row].nonzero
        terms = [(entry, coordinates[k].a) for k, entry in inertia.items()]
        forces = [-f for f in self.derivation.forcing[row]]
        present = {s for term in forces for s in term.free_symbols if s in self.order}
        for monomial, cofactors in group_by_velocities(
            forces, sorted(present, key=self.order.__getitem__)
        ):
            if monomial != 1:
                terms.append((factored(cofactors), monomial))
            else:
                moving = [c for c in cofactors if c.free_symbols & present]
                free = [c for c in cofactors if not c.free_symbols & present]
                terms.extend((c, sp.Integer(1)) for c in moving)
                terms.extend((c, sp.Integer(1)) for c in positional_groups(free, self.parameters))
        terms.extend((-entry, multiplier) for entry, multiplier in self.pushes[row])
        return [(c, f) for c, f in terms if c != 0]


def _harmless(whole: sp.Expr, parameters: frozenset[sp.Symbol], cyclic: bool) -> sp.Expr:
    """The part of a common factor that is never zero: numbers, masses, positive parameters."""
    if cyclic:
        return sp.Integer(1)
    number, symbolic = whole.as_coeff_Mul(rational=True)
    factors = [
        f for f in sp.Mul.make_args(symbolic) if f.is_positive and f.free_symbols <= parameters
    ]
    return scaled(number, sp.Mul(*factors))


def _divided(
    groups: Sequence[tuple[sp.Expr, sp.Expr]], divisor: sp.Expr
) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
    if divisor == 1:
        return tuple(groups)
    return tuple(_quotient(c, f, divisor) for c, f in groups)


def _quotient(coefficient: sp.Expr, factor: sp.Expr, divisor: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    number, product = coefficient.as_coeff_Mul(rational=True)
    by_number, by_product = divisor.as_coeff_Mul(rational=True)
    value = product / by_product
    scale = number / by_number
    parts = value.args if value.is_Add else ()
    if any(part.as_coeff_Mul(rational=True)[0].q > 1 for part in parts):
        return sp.Add(*(scale * part for part in parts)), factor
    return scaled(scale, value), factor
