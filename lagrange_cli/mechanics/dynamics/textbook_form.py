"""The textbook form of the equations of motion.

Terms are ordered by ddot, dot, none, multipliers. A common factor is divided out when it is
a number, holds no coordinate, or only those that are declared positive, since that can never hide
anything: where it is zero the mass matrix is singular. The equation of a cyclic coordinate is left
as it is unless it is a plain sum of accelerations: it reads ṗ = 0 with the momentum that is
reported beside it, and is printed so where its terms are longer. Any other coordinate is divided
out only where the scene's ``expect`` writes the equation so, since that hides a singular point.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.factor import (
    alike_oriented,
    common_factor,
    factored,
    group_by_velocities,
    holds_powers,
    scaled,
)
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.algebra.rate_sums import RateSum, over_rate_sums
from lagrange_cli.mechanics.algebra.shortest import shortest_coefficient, shortest_groups
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.mechanics.system import Closure, Coordinate

#: Functions that are never zero.
_POSITIVE = (sp.exp, sp.cosh)

#: Largest common denominator of numbers that is multiplied out, and the same where none of the
#: numbers becomes greater than it: beyond, fractions read better. Not tuned.
_MOST_PARTS = 60
_LARGEST_NUMBER = 100

#: Terms of a row beyond which its coefficients stay as they are: such an equation fills a page, and
#: shorter coefficients would not make it readable. Not tuned.
_MOST_FORCES = 100

#: Sums of the scene that are looked for among the terms of an equation, each a pass over all of
#: them; scenes that a person writes have fewer.
_MOST_BRACKETS = 20

#: Terms that an equation without its roots may have.
_CLEARED_TERMS = 40

#: Tells whether the equation with this residual is one that ``expect`` writes.
_IsExpected = Callable[[sp.Expr], bool]


@dataclass(frozen=True)
class RowSystem:
    """The rows M a = f + Σ λ·gradient.

    Attributes
    ----------
    coordinates
        Those of the rows.
    constants
        Symbols of parameters, and other symbols that do not move.
    mass_matrix, forcing
        Rows of M, and the terms of each f.
    pushing
        Equations with a multiplier; gradients have an entry for each row.
    sums
        Sums that the scene wrote, as their terms.
    apart
        Symbols whose terms stay as they are.
    named
        Expressions that have a name in the scene.
    rate_sums
        Sums of a velocity and what drives it, as ``φ̇ + ω``.
    """

    coordinates: tuple[Coordinate, ...]
    constants: frozenset[sp.Symbol]
    mass_matrix: Sequence[ExpressionRow]
    forcing: Sequence[Sequence[sp.Expr]]
    pushing: Sequence[Closure] = ()
    sums: Sequence[tuple[sp.Expr, ...]] = ()
    apart: frozenset[sp.Symbol] = frozenset()
    named: Sequence[sp.Expr] = ()
    rate_sums: Sequence[RateSum] = ()

    @classmethod
    def of(cls, derivation: Uncertified) -> RowSystem:
        """Return the equations of motion of a derivation."""
        names = derivation.reduced.names
        return cls(
            derivation.reduced.coordinates,
            frozenset(names.parameters.values()),
            derivation.mass_matrix,
            derivation.forcing,
            derivation.pushing,
            derivation.sums,
            named=[derivation.reduced.convert(e) for _, e in names.abbreviations()],
            rate_sums=derivation.rate_sums,
        )


def shown_equations(
    derivation: Uncertified,
    conserving: Sequence[bool],
    asked: _IsExpected | None,
    decimals: Collection[Fraction] = (),
) -> tuple[ShownEquation, ...]:
    """Textbook form of every equation.

    Parameters
    ----------
    conserving
        For each equation, true if it is a conservation law and stays undivided.
    asked
        Tells whether ``expect`` asks for a residual; None if it asks for none.
    decimals
        Numbers that the scene wrote as decimals, which are no fractions.
    """
    rows = Rows(RowSystem.of(derivation), frozenset(decimals))
    return tuple(_shown(rows, row, whole, asked) for row, whole in enumerate(conserving))


def shown_rows(system: RowSystem, decimals: Collection[Fraction] = ()) -> tuple[ShownEquation, ...]:
    """Textbook form of the equations of a system that is not a derivation's."""
    rows = Rows(system, frozenset(decimals))
    return tuple(_shown(rows, row, False, None) for row in range(len(system.coordinates)))


def _shown(rows: Rows, row: int, cyclic: bool, asked: _IsExpected | None) -> ShownEquation:
    name = rows.system.coordinates[row].name
    groups = rows.groups(row)
    roots = sp.S.One if cyclic else _positive_powers(groups, frozenset(rows.order))
    cleared = rows.regrouped(groups, roots) if roots != 1 else None
    if cleared is not None and _length(cleared) < _length(groups):
        whole = rows.divisor(cleared)
        divisor = rows.harmless(whole, cleared)
        return ShownEquation(name, _divided(cleared, divisor), roots * divisor)
    whole = rows.divisor(groups)
    is_plain = all(factor in rows.accelerations for _, factor in groups)
    divisor = sp.Integer(1) if cyclic and not is_plain else rows.harmless(whole, groups)
    if asked is not None and not cyclic and (whole / divisor).free_symbols:
        candidate = ShownEquation(name, _divided(groups, whole), whole)
        if asked(candidate.residual):
            return candidate
    if any(rows.takes_apart(c, divisor) for c, _ in groups):
        divisor = divisor.as_coeff_Mul(rational=True)[0]
    return ShownEquation(name, _divided(groups, divisor), divisor)


class Rows:
    """Rows of a system, with symbols and orders that each row needs."""

    def __init__(self, system: RowSystem, decimals: frozenset[Fraction] = frozenset()) -> None:
        self.system = system
        self.decimals = decimals
        self.written = [sp.Add(*terms) for terms in system.sums]
        #: Sums with coordinates that the scene wrote, of a few terms.
        self.brackets = [
            sp.Add(*terms)
            for terms in system.sums[:_MOST_BRACKETS]
            if any(t.is_Symbol and t not in system.constants for t in terms)
        ]
        #: Sums of parameters alone.
        self.lengths = [
            sp.Add(*terms)
            for terms in system.sums[:_MOST_BRACKETS]
            if all(symbols_in(t) <= system.constants for t in terms)
        ]
        self.parameters = system.constants
        #: Coordinates, and what moves with them.
        self.moving = frozenset(s for c in system.coordinates for s in (c.q, c.v, c.a))
        self.positive = frozenset(c.q for c in system.coordinates if c.is_positive)
        self.accelerations = frozenset(c.a for c in system.coordinates)
        self.order = {c.v: k for k, c in enumerate(system.coordinates)}
        #: Powers in the products of parameters that have a name: of the reduced mass.
        self.named = [
            product.as_powers_dict()
            for product in system.named
            if product.is_Mul and product.free_symbols <= self.parameters
        ]
        #: (entry of the gradient, multiplier) of the closures and gaps, by coordinate.
        self.pushes: list[list[tuple[sp.Expr, sp.Symbol]]] = [[] for _ in system.coordinates]
        for closure in system.pushing:
            for j, entry in entries(closure.gradient).items():
                self.pushes[j].append((entry, closure.multiplier))

    def groups(self, row: int) -> list[tuple[sp.Expr, sp.Expr]]:
        """(coefficient, factor) in display order."""
        coordinates = self.system.coordinates
        constants = self.parameters
        inertia = self.system.mass_matrix[row].nonzero
        forces = [-f for f in self.system.forcing[row]]

        def coefficient(whole: sp.Expr) -> sp.Expr:
            is_short = len(forces) <= _MOST_FORCES
            return shortest_coefficient(whole, constants, self.lengths) if is_short else whole

        terms = [(coefficient(e), coordinates[k].a) for k, e in inertia.items()]
        forces, sums = over_rate_sums(forces, self.system.rate_sums)
        order = self.order | {w: self.order[rate.velocity] for w, rate in sums.items()}
        present = {s for term in forces for s in term.free_symbols if s in order}
        grouped = group_by_velocities(forces, sorted(present, key=order.__getitem__))
        wholes = {symbol: rate.whole for symbol, rate in sums.items()}
        moving = [(coefficient(factored(c)), m.xreplace(wholes)) for m, c in grouped if m != 1]
        terms += self._linear_together(moving)
        for cofactors in (c for m, c in grouped if m == 1):
            fixed = present | self.system.apart
            terms.extend((c, sp.Integer(1)) for c in cofactors if c.free_symbols & fixed)
            free = [c for c in cofactors if not c.free_symbols & fixed]
            terms.extend(
                (c, sp.Integer(1)) for c in shortest_groups(free, constants, self.brackets)
            )
        terms.extend((-entry, multiplier) for entry, multiplier in self.pushes[row])
        # Velocities stand in coefficients too, where a force is no polynomial in them.
        coefficients = alike_oriented([c.xreplace(wholes) for c, _ in terms], self.written)
        return [(c, f) for c, (_, f) in zip(coefficients, terms, strict=True) if c != 0]

    def _linear_together(
        self, terms: Sequence[tuple[sp.Expr, sp.Expr]]
    ) -> list[tuple[sp.Expr, sp.Expr]]:
        """Put velocities with constant coefficients together if that is shorter: b (ẋ1 - ẋ2)."""
        linear = [(c, f) for c, f in terms if f in self.order and symbols_in(c) <= self.parameters]
        alone = [c * v for c, v in linear]
        products = shortest_groups(alone, self.parameters)
        if len(products) >= len(alone):
            return list(terms)
        together = []
        for product in products:
            moving = [f for f in sp.Mul.make_args(product) if symbols_in(f) & self.order.keys()]
            factor = sp.Mul(*moving)
            together.append((product / factor, factor))
        return [*(pair for pair in terms if pair not in linear), *together]

    def regrouped(
        self, groups: Sequence[tuple[sp.Expr, sp.Expr]], roots: sp.Expr
    ) -> list[tuple[sp.Expr, sp.Expr]] | None:
        """Divide by a product of powers, multiply out and group again; None of long equations."""
        terms = expand_terms(sp.Add(*(part / roots for part in _products(groups))), _CLEARED_TERMS)
        if terms is None:
            return None
        terms = collected_terms(terms)
        regrouped = []
        for c in self.system.coordinates:
            inertia = [t / c.a for t in terms if c.a in symbols_in(t)]
            regrouped += [(factored(inertia), c.a)] if inertia else []
        still = [t for t in terms if symbols_in(t).isdisjoint(self.accelerations)]
        by_rates = group_by_velocities(still, [*self.order])
        return [*regrouped, *((factored(c), f) for f, c in by_rates)]

    def divisor(self, groups: Sequence[tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
        """The common factor of an equation, with the sign of its accelerations.

        Its number is 1/n where that clears the fractions of numbers, which is done where the first
        term has one: ``I θ̈ + ½ k x`` is no better as ``2 I θ̈ + k x``.
        """
        coefficients = [c for c, _ in groups]
        number, factor = common_factor(coefficients).as_coeff_Mul(rational=True)
        factor *= _cleared(coefficients, self.parameters, factor)
        numbers = [n for c, _ in groups for n in _numbers(c)]
        has_fraction = any(n.q > 1 for n in _numbers(groups[0][0])) if groups else False
        lcm = sp.ilcm(*(n.q for n in numbers), 1)
        number = sp.Integer(number.p) if number.q > 1 else number
        integers = [n.p * (lcm // n.q) for n in numbers]
        is_short = lcm <= _MOST_PARTS or all(abs(n) <= _LARGEST_NUMBER for n in integers)
        if has_fraction and is_short and not self._has_decimals(numbers):
            number = sp.Rational(sp.igcd(0, *integers), lcm)
        inertia = [c for c, f in groups if f in self.accelerations]
        turned = inertia and all(_is_negative(c) for c in inertia)
        return scaled(-number if turned else number, factor)

    def harmless(self, whole: sp.Expr, groups: Sequence[tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
        """The part of a common factor whose division hides no motion.

        It is never zero, or holds nothing that moves and is a factor of the accelerations too:
        where it is zero, a row of the mass matrix is, and the equations determine no motion.
        """
        number, symbolic = whole.as_coeff_Mul(rational=True)
        is_inertial = any(f in self.accelerations for _, f in groups)
        factors = []
        for factor in sp.Mul.make_args(symbolic):
            moving = symbols_in(factor) & self.moving
            is_power = factor.as_base_exp()[1].is_positive
            is_positive = factor.is_positive and (
                moving <= self.positive or isinstance(factor, _POSITIVE)
            )
            if is_positive or (is_inertial and is_power and not moving):
                factors.append(factor)
        return scaled(number, sp.Mul(*factors))

    def takes_apart(self, coefficient: sp.Expr, divisor: sp.Expr) -> bool:
        """Tell whether a quotient no longer holds a product that has a name."""
        products = [powers for powers in self.named if holds_powers(coefficient, powers)]
        return any(not holds_powers(coefficient / divisor, powers) for powers in products)

    def _has_decimals(self, numbers: Iterable[sp.Rational]) -> bool:
        return any(Fraction(int(abs(n.p)), int(n.q)) in self.decimals for n in numbers)


def _numbers(coefficient: sp.Expr) -> list[sp.Rational]:
    """The numbers of the terms of a coefficient."""
    number, product = coefficient.as_coeff_Mul(rational=True)
    return [number * part.as_coeff_Mul(rational=True)[0] for part in sp.Add.make_args(product)]


def _is_negative(coefficient: sp.Expr) -> bool:
    """Tell whether a coefficient prints with a minus sign."""
    number, product = coefficient.as_coeff_Mul(rational=True)
    sums = [f for f in sp.Mul.make_args(product) if f.is_Add]
    terms = [a.as_coeff_Mul(rational=True)[0] for a in sums[0].args] if len(sums) == 1 else []
    alone = [a for a in sums[0].args if a.is_Rational] if len(sums) == 1 else []
    turned = bool(terms) and (all(n < 0 for n in terms) or any(n < 0 for n in alone))
    return bool((number < 0) != turned)


def _products(groups: Iterable[tuple[sp.Expr, sp.Expr]]) -> list[sp.Expr]:
    """The terms of an equation as products."""
    return [part * f for c, f in groups for part in sp.Add.make_args(c)]


def _length(groups: Sequence[tuple[sp.Expr, sp.Expr]]) -> int:
    return sum(printed_length(c) + printed_length(f) for c, f in groups)


def _positive_powers(
    groups: Sequence[tuple[sp.Expr, sp.Expr]], velocities: frozenset[sp.Symbol]
) -> sp.Expr:
    """Return the lowest powers of factors that are not zero, where one is a root that moves.

    That is ``(1 + ẏ²)^(-3/2)`` with what stands beside it; 1 if no velocity stands in one.
    """
    products = [dict(map(_power, sp.Mul.make_args(p))) for p in _products(groups)]
    lowest: dict[sp.Expr, sp.Expr] = {}
    for base in {b: None for powers in products for b in powers}:
        exponents = [powers.get(base, sp.S.Zero) for powers in products]
        if not all(e.is_Rational for e in exponents):
            continue
        # A denominator of all terms is not zero where the equation has a meaning.
        below = min(exponents) < 0 or (base.is_Pow and base.exp.is_negative)
        if base.is_positive or (below and len(set(exponents)) == 1):
            lowest[base] = min(exponents)
    if not any(b.is_Add and e < 0 and symbols_in(b) & velocities for b, e in lowest.items()):
        return sp.S.One
    return sp.Mul(*(b**e for b, e in lowest.items()))


def _power(factor: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    base, exponent = factor.as_base_exp()
    return (factor, sp.S.One) if factor.is_Rational else (base, exponent)


def _cleared(
    coefficients: Iterable[sp.Expr], constants: frozenset[sp.Symbol], divided: sp.Expr
) -> sp.Expr:
    """Inverse of the positive sums of parameters that are left as denominators, as m1 + m2."""
    powers: dict[sp.Expr, sp.Expr] = {}
    for coefficient in coefficients:
        for factor in sp.Mul.make_args(coefficient / divided):
            base, exponent = factor.as_base_exp()
            is_sum = base.is_Add and base.is_positive and symbols_in(base) <= constants
            if is_sum and exponent.is_Integer and exponent < 0:
                powers[base] = min(exponent, powers.get(base, exponent))
    return sp.Mul(*(base**exponent for base, exponent in powers.items()))


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
