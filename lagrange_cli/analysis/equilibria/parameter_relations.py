"""Relations between parameters under which an equation of equilibrium loses its unknowns.

A factor in parameters alone that vanishes is such a relation: the lever's a m g = b F. It is
solved for a parameter, or a function of one, that stands linearly, so that the other equations of
a branch hold it exactly. Facts about signs decide which factors may vanish.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.values import DIGITS, Existence, Mpf
from lagrange_cli.mechanics.algebra.polynomials import cancelled, factored_form
from lagrange_cli.mechanics.elimination.solve_equation import linear_parts
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem

#: Relative size below which a number that decides is rounding.
ROUNDING = mpf(10) ** -30

#: Factors without a sign of a condition that is worth reading.
_MOST_FACTORS = 3


@dataclass(frozen=True)
class ParameterFacts:
    """Values and signs of parameters.

    Attributes
    ----------
    known
        Values of parameters that have one.
    signed
        Symbols with a sign that the scene does not declare, masses and those with values, each
        with a symbol that has it.
    order
        All parameters as the scene declares them.
    """

    known: Mapping[sp.Symbol, Mpf]
    signed: Mapping[sp.Symbol, sp.Symbol] = field(default_factory=dict)
    order: Sequence[sp.Symbol] = ()

    @classmethod
    def of_system(cls, system: RestSystem) -> ParameterFacts:
        """Return what is known of the parameters of a system: values, and masses are positive."""
        symbols = [p.symbol for p in system.equations.system.parameters]
        masses = {p.mass for p in system.equations.system.particles}
        values = {s: 1 if s in masses else system.known.get(s, 0) for s in symbols}
        signed = {s: sp.Dummy(s.name, positive=True) for s, value in values.items() if value > 0}
        signed |= {s: sp.Dummy(s.name, negative=True) for s, value in values.items() if value < 0}
        return cls(system.known, signed, symbols)

    def vanishes(self, expression: sp.Expr) -> bool:
        """Say whether an expression is zero for the values of its parameters."""
        factors = sp.Mul.make_args(expression)
        if len(factors) > 1:
            return any(map(self.vanishes, factors))
        if not expression.free_symbols <= self.known.keys():
            return False
        with mpmath.workdps(DIGITS):
            return all_vanish([expression], self.known)

    def is_nonzero(self, expression: sp.Expr) -> bool:
        """Say whether an expression is proven not to vanish, by its values or by signs."""
        if expression.xreplace(self.signed).is_nonzero:
            return True
        if expression.free_symbols <= self.known.keys():
            return not self.vanishes(expression)
        factors = sp.Mul.make_args(expression)
        if len(factors) > 1:
            return all(map(self.is_nonzero, factors))
        base, exponent = expression.as_base_exp()
        return bool(base != expression and exponent.is_Rational and self.is_nonzero(base))

    def is_positive(self, expression: sp.Expr) -> bool:
        """Say whether an expression is proven positive wherever it has a value."""
        return self.positive_where(expression) == ()

    def is_never_positive(self, expression: sp.Expr) -> bool:
        """Say whether an expression is proven zero or negative wherever it has a value."""
        real = {s: sp.Dummy(s.name, real=True) for s in expression.free_symbols}
        terms = sp.Add.make_args(sp.expand(cancelled(expression)))
        return all(t.xreplace(self.signed).xreplace(real).is_nonpositive for t in terms)

    def positive_where(self, expression: sp.Expr) -> tuple[Existence, ...] | None:
        """Write when an expression is positive, without factors that are; None if it is long."""
        above, below = sp.fraction(factored_form(cancelled(expression)))
        undecided = []
        factors = [*sp.Mul.make_args(above), *(1 / f for f in sp.Mul.make_args(below))]
        for factor in factors:
            base, exponent = factor.as_base_exp()
            is_even = exponent.is_Integer and exponent % 2 == 0
            is_square = is_even and (exponent.is_negative or self.is_nonzero(base))
            if not is_square and not factor.xreplace(self.signed).is_positive:
                undecided.append(base if exponent.is_Integer and exponent % 2 else factor)
        if not undecided:
            return ()
        if len(undecided) > _MOST_FACTORS:
            return None
        terms = sp.Add.make_args(sp.expand(sp.Mul(*undecided)))
        lower = [-term for term in terms if term.could_extract_minus_sign()]
        upper = [term for term in terms if not term.could_extract_minus_sign()]
        return (Existence(factored_form(sp.Add(*lower)), factored_form(sp.Add(*upper)), "<"),)

    def open_symbols(self, expression: sp.Expr) -> list[sp.Symbol] | None:
        """List the parameters of a product of powers that may be zero; None for other products."""
        symbols = []
        for factor in sp.Mul.make_args(expression):
            base = factor.as_base_exp()[0]
            if base.is_Symbol and not self.is_nonzero(base):
                symbols.append(base)
            elif not base.is_Symbol and not self.is_nonzero(factor):
                return None
        return symbols

    def balance(self, expression: sp.Expr) -> Existence:
        """Write ``expression = 0`` with the terms of either sign on one side: ``m g a = b F``."""
        signs: tuple[list[sp.Expr], list[sp.Expr]] = ([], [])
        for term in sp.Add.make_args(sp.expand(expression)):
            signs[bool(term.could_extract_minus_sign())].append(term)
        first, second = sp.Add(*signs[0]), -sp.Add(*signs[1])
        if not (first and second):
            return Existence(first or second, sp.S.Zero, "=")
        left, right = sorted((factored_form(first), factored_form(second)), key=self._place)
        return Existence(left, right, "=")

    def _place(self, side: sp.Expr) -> tuple[bool, int]:
        """Order sides: a power of one parameter first, then by the first parameter declared."""
        is_alone = side.as_base_exp()[0].is_Symbol
        places = [k for k, symbol in enumerate(self.order) if symbol in side.free_symbols]
        return not is_alone, min(places, default=len(self.order))


@dataclass(frozen=True)
class Relation:
    """An expression in parameters that vanishes, solved for a part of it.

    Attributes
    ----------
    part, value
        A parameter, or a function of parameters, and what it equals.
    divisor
        What was divided by.
    """

    part: sp.Expr
    value: sp.Expr
    divisor: sp.Expr

    def applied(self, expression: sp.Expr) -> sp.Expr:
        """Substitute the value."""
        return expression.xreplace({self.part: self.value})

    def is_whole_in(self, expression: sp.Expr) -> bool:
        """Say whether an expression holds parameters of the part nowhere but in it."""
        if self.part.is_Symbol:
            return True
        without = expression.xreplace({self.part: sp.Dummy()})
        return not self.part.free_symbols & without.free_symbols


def solved_relation(expression: sp.Expr, facts: ParameterFacts) -> Relation | None:
    """Solve ``expression = 0`` for what stands linearly; None if there is nothing.

    What has a factor that cannot vanish is preferred, then parameters, then functions of them.
    """
    functions = (sp.sin, sp.cos, sp.tan, sp.exp)
    symbols = [s for s in facts.order if s in expression.free_symbols]
    parts = [*symbols, *sorted(expression.atoms(*functions), key=sp.default_sort_key)]
    relations = []
    for part in parts:
        linear = linear_parts(expression, part)
        if linear is None or part.free_symbols & (linear[0].free_symbols | linear[1].free_symbols):
            continue
        value = cancelled(-linear[1] / linear[0])
        if facts.is_nonzero(linear[0]):
            return Relation(part, value, linear[0])
        if facts.open_symbols(linear[0]) is not None:
            relations.append(Relation(part, value, linear[0]))
    return next(iter(relations), None)


def all_vanish(residuals: Sequence[sp.Expr], at: Mapping[sp.Symbol, Mpf]) -> bool:
    """Say whether sums are rounding beside their terms; False if they have no values."""
    for residual in residuals:
        try:
            terms = evaluate(sp.Add.make_args(residual), at)
        except DomainError:
            return False
        if abs(mpmath.fsum(terms)) > ROUNDING * mpmath.fsum(map(abs, terms)):
            return False
    return True
