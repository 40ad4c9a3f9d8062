"""Numerical values of parameters, masses, initial values and other numbers of a scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator
from fractions import Fraction
from functools import lru_cache

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.symbols.convert import to_sympy
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.scene.bodies import bodies_of
from lagrange_cli.scene.language.bounds import require_bounded
from lagrange_cli.scene.language.expression import Expression, names_in
from lagrange_cli.scene.language.templates import shape_of
from lagrange_cli.scene.language.tokens import MAX_EXPONENT, ExpressionError
from lagrange_cli.scene.model import Particle, Scene

#: Digits of numbers for arithmetic wider than that of doubles; quadruple has 34.
DECIMAL_DIGITS = 40

#: Digits beyond those asked for that factors of a product carry.
_GUARD = 10

#: Most factors whose values are kept: elements of a family share factors.
_KEPT = 2**12

#: Relative to the largest moment, the sum of two that counts as equal to it: that of a flat body.
_ROUNDING = 1e-9

#: Least magnitude of a scene's constants.
_LEAST = mpf(10) ** -MAX_EXPONENT


class ParameterValues:
    """Exact values of the parameters that have one.

    Attributes
    ----------
    exact
        Name → exact number (a SymPy expression without symbols).

    Raises
    ------
    InputError
        Located: values in a circle, a ``positive`` parameter or a mass that is not
        positive, a value beyond double precision.
    """

    def __init__(self, scene: Scene) -> None:
        self._written = {p.name: p for p in scene.parameters}
        self.exact: dict[str, sp.Expr] = {}
        self._open: list[str] = []
        #: ``id`` of an expression → the expression, which keeps it, and its value.
        self._known: dict[int, tuple[Expression, sp.Expr | None]] = {}
        #: Shapes that are bounded, with their names that have values.
        self._bounded: set[Hashable] = set()
        for name in self._written:
            self._resolve(name)
        for expression in scene.expressions():
            self._require_bounded(expression)
        for name, parameter in self._written.items():
            value = self.exact.get(name)
            if parameter.value is not None and parameter.positive and value is not None:
                self._require_positive(parameter.value, value, f"parameter '{name}'")

    @staticmethod
    def _require_positive(written: Expression, value: sp.Expr, what: str) -> None:
        if not value.is_positive:
            raise InputError(
                Problem(
                    f"{what} must be positive, found {written.text}",
                    written.mark(),
                    rule="not-positive",
                )
            )

    def _resolve(self, name: str) -> sp.Expr | None:
        """Give a parameter's value; None if it, or a parameter in its value, has none."""
        parameter = self._written.get(name)
        if name in self.exact or parameter is None or parameter.value is None:
            return self.exact.get(name)
        if name in self._open:
            cycle = " -> ".join([*self._open[self._open.index(name) :], name])
            raise InputError(
                Problem(f"parameters go in a circle: {cycle}", parameter.mark, rule="cycle")
            )
        self._open.append(name)
        value = self.number(parameter.value)
        self._open.pop()
        if value is not None:
            self.exact[name] = value
        return value

    def number(self, expression: Expression) -> sp.Expr | None:
        """Evaluate an expression in parameters exactly; None if one of them has no value."""
        if id(expression) not in self._known:
            self._known[id(expression)] = expression, self._number(expression)
        return self._known[id(expression)][1]

    def _number(self, expression: Expression) -> sp.Expr | None:
        missing: list[str] = []

        def lookup(name: str) -> sp.Expr | None:
            if name not in self._written:
                return None
            value = self._resolve(name)
            if value is None:
                missing.append(name)
                return sp.Integer(1)
            return value

        for name in names_in(expression.node):
            lookup(name.name)
        self._require_bounded(expression)
        value = to_sympy(expression, lookup)
        if missing:
            return None
        if not _magnitude(value) < 10**308:
            raise InputError(
                Problem(
                    f"'{expression.text}' is beyond double precision",
                    expression.mark(),
                    rule="too-large",
                )
            )
        return value

    def _require_bounded(self, expression: Expression) -> None:
        """Refuse an expression that grows too large once parameters have their values."""
        shape, names = shape_of(expression.node)
        known = [name if name in self.exact else None for name in names]
        key = shape, *known
        if key in self._bounded:
            return
        values = {n: _rational_or_float(self.exact[n]) for n in known if n is not None}
        try:
            require_bounded(expression.node, values)
        except ExpressionError as error:
            raise error.located(expression.mark(error.span)) from None
        self._bounded.add(key)

    def float(self, expression: Expression) -> float | None:
        """Round an expression's value to a double; None if a parameter has no value."""
        value = self.number(expression)
        return None if value is None else nearest_double(value)


def stated_values(
    scene: Scene, convert: Callable[[Expression], sp.Expr]
) -> Iterator[tuple[str, sp.Expr]]:
    """Yield values of parameters that the scene states in other parameters.

    ``convert``: makes a SymPy expression over the symbols of names.
    """
    parameters = {p.name for p in scene.parameters}
    for p in scene.parameters:
        names = () if p.value is None else names_in(p.value.node)
        if p.value is not None and not parameters.isdisjoint(name.name for name in names):
            yield p.name, convert(p.value)


def _rational_or_float(value: sp.Expr) -> Fraction | float:
    return Fraction(int(value.p), int(value.q)) if value.is_Rational else nearest_double(value)


def _magnitude(value: sp.Expr) -> sp.Expr | Fraction:
    """Give |value|, exact for a rational."""
    if value.is_Rational:
        return abs(Fraction(int(value.p), int(value.q)))
    return math.prod(abs(_factor(f, 15)) for f in sp.Mul.make_args(value))


@lru_cache(maxsize=_KEPT)
def _factor(value: sp.Expr, digits: int) -> sp.Expr:
    """Evaluate a factor of a number, which may be complex."""
    return value.evalf(digits)


def evaluated(value: sp.Expr, digits: int) -> mpf:
    """Evaluate an exact number to ``digits``; 0 if it is smaller than any constant may be.

    The working precision of mpmath has to hold these digits.

    A function of constants can be 10^-(10^17), beside which no number of digits shows a sum.
    """
    if value.is_Integer and abs(value.p) < 2**53:
        return mpf(value.p)
    number = mpf(_factor(value, digits))
    return number if abs(number) > _LEAST else mpf(0)


def evaluated_by_factors(value: sp.Expr, digits: int) -> mpf:
    """Evaluate as :func:`evaluated` does up to its rounding, each factor of a product once."""
    factors = [_factor(f, digits + _GUARD) for f in sp.Mul.make_args(value)]
    if len(factors) == 1 or not all(f.is_Float for f in factors):
        return evaluated(value, digits)
    with mpmath.workdps(digits + _GUARD):
        product = mpmath.fprod(mpf(f) for f in factors)
    with mpmath.workdps(digits):
        return +product if abs(product) > _LEAST else mpf(0)


def decimal(value: mpf) -> str:
    """Write a number with :data:`DECIMAL_DIGITS` digits."""
    return str(mpmath.nstr(value, DECIMAL_DIGITS))


def nearest_double(value: sp.Expr) -> float:
    """Round an exact number to a double, ±inf beyond the range of doubles."""
    try:
        return int(value.p) / int(value.q) if value.is_Rational else float(value.evalf(40))
    except OverflowError:
        return math.copysign(math.inf, 1 if value.is_positive else -1)


def particle_mass(names: Names, values: ParameterValues, particle: Particle) -> sp.Expr:
    """Convert the mass of a particle to an expression over parameters.

    Raises
    ------
    InputError
        It is not constant, or not positive.
    """
    mass = names.convert(particle.mass)
    if not mass.free_symbols <= set(names.parameters.values()):
        raise InputError(
            Problem(
                f"the mass of '{particle.name}' may hold numbers and parameters only",
                particle.mass.mark(),
                rule="mass",
            )
        )
    value = values.number(particle.mass)
    if value is not None and not value.is_positive:
        raise InputError(
            Problem(
                f"the mass of '{particle.name}' must be positive, found {particle.mass.text}"
                + ("" if value.is_Integer and particle.mass.text == str(value) else f" = {value}"),
                particle.mass.mark(),
                hint="a position without mass is written under 'points'",
                rule="mass",
            )
        )
    return mass


def require_positive_radii(scene: Scene, values: ParameterValues) -> None:
    """Refuse radii of bodies that touch a surface unless they are positive, where they are known.

    Raises
    ------
    InputError
        Located at the radius.
    """
    for constraint in scene.constraints:
        for radius in () if constraint.joint is None else constraint.joint.radii:
            value = values.number(radius)
            if value is None or value.is_positive:
                continue
            raise InputError(
                Problem(
                    f"the radius in constraint '{constraint.name}' must be positive,"
                    f" found {radius.text}",
                    radius.mark(),
                    rule="not-positive",
                )
            )


def require_possible_inertia(scene: Scene, values: ParameterValues) -> None:
    """Refuse inertia that no body has, where its numbers are known.

    Principal moments are integrals of sums of two squares: none is negative, and none is larger
    than the two others together.

    Raises
    ------
    InputError
        Located at the inertia.
    """
    for body in bodies_of(scene):
        moments = [values.number(moment) for row in body.inertia for moment in row]
        numbers = [float(sp.N(moment)) for moment in moments if moment is not None]
        if len(numbers) < len(moments):
            continue
        principal = sorted(np.linalg.eigvalsh(np.reshape(numbers, (3, 3))))
        smallest, middle, largest = (float(x) for x in principal)
        least = -_ROUNDING * max(abs(smallest), abs(largest))
        if smallest < least:
            fault = f"a principal moment of inertia of '{body.name}' is {smallest:.6g}"
        elif not body.planar and smallest + middle - largest < least:
            fault = (
                f"no body has the principal moments of inertia {smallest:.6g}, {middle:.6g},"
                f" {largest:.6g} of '{body.name}': the largest exceeds the sum of the others"
            )
        else:
            continue
        hint = "moments are about the centre of mass"
        raise InputError(
            Problem(
                fault,
                body.inertia_mark,
                hint=f"{hint}; those about the origin of the body are written"
                " {about: origin, moments: [...]}",
                rule="inertia",
            )
        )
