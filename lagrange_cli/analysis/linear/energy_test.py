"""The energy along the one null direction of a degenerate K, by its terms of higher order.

The coordinate that moves most along the null direction is s. The other equations of equilibrium
give the others as power series of s, term by term (the reduction of Lyapunov and Schmidt); what is
left of the first one is the derivative of the reduced energy W(s), whose first term decides.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.linear.linearize import DIGITS, LinearSystem
from lagrange_cli.analysis.values import Equilibrium, Mpf
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lagrange_cli.analysis.equilibria.rest_system import RestSystem

# The budget, in counts: terms of higher order and of more coordinates grow beyond any patience.

#: Highest order of W′ that is looked at.
_ORDER = 9
#: Coordinates, and operations of one derivative.
_COORDINATES, _OPERATIONS = 4, 20_000
#: Part of its terms below which a coefficient is rounding.
_ROUNDING = mpf(10) ** -20


class EnergyTest(Enum):
    """The outcome: a strict minimum, none, or not decided."""

    MINIMUM = auto()
    NONE = auto()
    FLAT = auto()


def reduced_energy(system: RestSystem, at: Equilibrium, linear: LinearSystem) -> EnergyTest:
    """Say whether the energy has a minimum along the null direction of K.

    The other directions are positive, there are no closures, and no coordinate is free.
    """
    n = len(system.equations.system.coordinates)
    assert at.position is not None
    if n > _COORDINATES:
        return EnergyTest.FLAT
    with mpmath.workdps(DIGITS):
        lead = _leading(linear)
        try:
            return _Series(system, at.position, linear, lead).decide()
        except DomainError:
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
    """Power series of the other coordinates in the leading one."""

    def __init__(
        self, system: RestSystem, position: tuple[Mpf, ...], linear: LinearSystem, lead: int
    ) -> None:
        self.s = sp.Dummy("s", real=True)
        coordinates = system.equations.system.coordinates
        self.others = [k for k in range(len(coordinates)) if k != lead]
        self.terms = {
            k: [sp.Dummy(f"c{k}_{j}", real=True) for j in range(1, _ORDER + 1)] for k in self.others
        }
        places = {c.q: sp.Dummy(c.name, real=True) for c in coordinates}
        self.known: dict[sp.Symbol, Mpf] = dict(system.known)
        self.known |= {places[c.q]: x for c, x in zip(coordinates, position, strict=True)}
        curve = {coordinates[lead].q: places[coordinates[lead].q] + self.s}
        for k in self.others:
            q = coordinates[k].q
            series = (term * self.s**j for j, term in enumerate(self.terms[k], 1))
            curve[q] = sp.Add(places[q], *series)
        self.slopes = {k: -force.xreplace(curve) for k, force in enumerate(system.forces)}
        self.lead = lead
        rows = [[linear.stiffness[i, j] for j in self.others] for i in self.others]
        self.inverse = mpmath.inverse(mpmath.matrix(rows)) if rows else None

    def decide(self) -> EnergyTest:
        """Decide by the first term of W′ that does not vanish."""
        for order in range(1, _ORDER + 1):
            self.slopes = {k: derivative(e, self.s) for k, e in self.slopes.items()}
            if max(sp.count_ops(e) for e in self.slopes.values()) > _OPERATIONS:
                return EnergyTest.FLAT
            self._extend(order)
            value, size = self._at_zero(self.slopes[self.lead])
            if abs(value) > _ROUNDING * size:
                rises = order % 2 == 1 and value > 0
                return EnergyTest.MINIMUM if rises else EnergyTest.NONE
        return EnergyTest.FLAT

    def _extend(self, order: int) -> None:
        """Find the coefficients of s^order, for which the other equations hold to that order."""
        for k in self.others:
            self.known[self.terms[k][order - 1]] = mpf(0)
        if self.inverse is None:
            return
        levels = mpmath.matrix([self._at_zero(self.slopes[k])[0] for k in self.others])
        coefficients = self.inverse * levels / mpmath.factorial(order)
        for k, value in zip(self.others, coefficients, strict=True):
            self.known[self.terms[k][order - 1]] = -value

    def _at_zero(self, expression: sp.Expr) -> tuple[Mpf, Mpf]:
        """Evaluate at s = 0: the value, and the size of its terms."""
        still: Mapping[sp.Symbol, sp.Expr] = {self.s: sp.S.Zero}
        numbers = evaluate(sp.Add.make_args(expression.xreplace(still)), self.known)
        return mpmath.fsum(numbers), mpmath.fsum(map(abs, numbers))
