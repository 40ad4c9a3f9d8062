"""The energy along the one null direction of a degenerate K, by its terms of higher order.

The coordinate that moves most along the null direction is s. The other equations of equilibrium
give the others as power series of s, term by term (the reduction of Lyapunov and Schmidt); what is
left of the first one is the derivative of the reduced energy W(s), whose first term decides. All
coefficients are exact numbers.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.linear.second_order import LinearSystem
from lagrange_cli.analysis.values import DIGITS, Equilibrium, Mpf
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.substitution import has_value
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.zero_test import vanish

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lagrange_cli.analysis.equilibria.rest_system import RestSystem

# The budget, in counts: terms of higher order and of more coordinates grow beyond any patience.

#: Highest order of W′ that is looked at.
_ORDER = 9
#: Coordinates, and operations of one derivative, and of one coefficient.
_COORDINATES, _OPERATIONS, _LONGEST = 4, 20_000, 2_000
#: Part of its terms below which the sign of a coefficient is not known by its numbers.
_ROUNDING = mpf(10) ** -30


class EnergyTest(Enum):
    """The outcome: a strict minimum, none, or not decided."""

    MINIMUM = auto()
    NONE = auto()
    FLAT = auto()


class _UndecidedError(Exception):
    """A coefficient is neither proven to vanish nor seen not to, or is too long."""


def reduced_energy(system: RestSystem, at: Equilibrium, linear: LinearSystem) -> EnergyTest:
    """Say whether the energy has a minimum along the null direction of K.

    The other directions are positive, there are no closures, and no coordinate is free. Values of
    coordinates and parameters must be exact: numbers do not show that a coefficient vanishes.
    """
    coordinates = system.equations.system.coordinates
    symbols = set().union(*(e.free_symbols for e in system.forces)) & system.known.keys()
    if len(coordinates) > _COORDINATES or at.exact is None:
        return EnergyTest.FLAT
    if not symbols <= system.exact_known.keys():
        return EnergyTest.FLAT
    with mpmath.workdps(DIGITS):
        try:
            return _Series(system, at.exact, _leading(linear)).decide()
        except (DomainError, _UndecidedError):
            return EnergyTest.FLAT


def _leading(linear: LinearSystem) -> int:
    """Choose the coordinate without which K is farthest from degenerate."""
    n = linear.stiffness.rows
    if n == 1:
        return 0

    def minor(k: int) -> Mpf:
        others = [i for i in range(n) if i != k]
        rows = [[linear.stiffness[i, j] for j in others] for i in others]
        units = mpmath.fprod(linear.mass[i, i] for i in others)
        return abs(mpmath.det(mpmath.matrix(rows))) / units

    return max(range(n), key=minor)


class _Series:
    """Power series of the other coordinates in the leading one, with exact coefficients."""

    def __init__(self, system: RestSystem, position: tuple[sp.Expr, ...], lead: int) -> None:
        self.s = sp.Dummy("s", real=True)
        coordinates = system.equations.system.coordinates
        self.others = [k for k in range(len(coordinates)) if k != lead]
        self.terms = {
            k: [sp.Dummy(f"c{k}_{j}", real=True) for j in range(1, _ORDER + 1)] for k in self.others
        }
        places = {c.q: sp.Dummy(c.name, real=True) for c in coordinates}
        self.known: dict[sp.Symbol, sp.Expr] = dict(system.exact_known)
        values = [x.xreplace(self.known) for x in position]
        self.known |= {places[c.q]: x for c, x in zip(coordinates, values, strict=True)}
        curve = {coordinates[lead].q: places[coordinates[lead].q] + self.s}
        for k in self.others:
            q = coordinates[k].q
            series = (term * self.s**j for j, term in enumerate(self.terms[k], 1))
            curve[q] = sp.Add(places[q], *series)
        self.slopes = {k: -force.xreplace(curve) for k, force in enumerate(system.forces)}
        self.lead = lead

    def decide(self) -> EnergyTest:
        """Decide by the first term of W′ that does not vanish."""
        for order in range(1, _ORDER + 1):
            self.slopes = {k: derivative(e, self.s) for k, e in self.slopes.items()}
            if max(sp.count_ops(e) for e in self.slopes.values()) > _OPERATIONS:
                return EnergyTest.FLAT
            self._extend(order)
            sign = _sign(self._at_zero(self.slopes[self.lead]))
            if sign:
                rises = order % 2 == 1 and sign > 0
                return EnergyTest.MINIMUM if rises else EnergyTest.NONE
        return EnergyTest.FLAT

    def _extend(self, order: int) -> None:
        """Find the coefficients of s^order, for which the other equations hold to that order.

        They are linear in these, with K of the other coordinates as the factors.
        """
        if not self.others:
            return
        unknown = [self.terms[k][order - 1] for k in self.others]
        equations = [self._at_zero(self.slopes[k]) for k in self.others]
        factors, right = sp.linear_eq_to_matrix(equations, *unknown)
        values = factors.LUsolve(right)
        for symbol, value in zip(unknown, values, strict=True):
            self.known[symbol] = _short(sp.cancel(value))

    def _at_zero(self, expression: sp.Expr) -> sp.Expr:
        """Return the exact value at s = 0, over the coefficients that are not known yet."""
        still: Mapping[sp.Symbol, sp.Expr] = {self.s: sp.S.Zero}
        value = sp.expand(expression.xreplace(still).xreplace(self.known))
        if not has_value(value):
            raise _UndecidedError
        return _short(value)


def _short(value: sp.Expr) -> sp.Expr:
    if sp.count_ops(value) > _LONGEST:
        raise _UndecidedError
    return value


def _sign(value: sp.Expr) -> int:
    """Return the sign of an exact number."""
    terms = evaluate(sp.Add.make_args(value), {})
    number, size = mpmath.fsum(terms), mpmath.fsum(map(abs, terms))
    if abs(number) > _ROUNDING * size:
        return int(mpmath.sign(number))
    if value == 0 or vanish(value):
        return 0
    raise _UndecidedError
