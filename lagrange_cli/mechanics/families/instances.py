"""Values of forms at given indices in 30 digits, which prove forms of families."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.families.elements import Element, Elements, index_at
from lagrange_cli.mechanics.families.forms import Form, Series, assignments
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, evaluate

#: Digits of the arithmetic, and digits in which two values of one expression agree.
_DIGITS = 40
_AGREED = mpf(10) ** -30

_ZERO = mpf(0)
_SEED = 20230817


class UndefinedElementError(LookupError):
    """Raised for a form with an element that the system does not have."""


def random_point(symbols: Sequence[sp.Symbol]) -> dict[sp.Symbol, mpf]:
    """Values between ½ and 3/2, where most functions are defined, of symbols in a fixed order."""
    chance = random.Random(_SEED)
    with mpmath.workdps(_DIGITS):
        return {s: mpf(chance.randrange(10**39)) / 10**39 + mpf(1) / 2 for s in symbols}


class Instances:
    """Values of forms and of expressions at one random state.

    Parameters
    ----------
    elements
        The families.
    point
        The state: symbol → value, of all symbols of the equations.
    """

    def __init__(self, elements: Elements, point: Mapping[sp.Symbol, mpf]) -> None:
        self.elements = elements
        self.point = point
        self._beyond: dict[Element, mpf] = {}
        self._tapes: dict[sp.Expr, tuple[Tape, list[sp.Symbol]]] = {}

    def values(self, expressions: list[sp.Expr]) -> list[mpf | None]:
        """Evaluate expressions of the equations; None where one has no real value here."""
        with mpmath.workdps(_DIGITS):
            try:
                return list(evaluate(expressions, self.point))
            except (DomainError, KeyError):
                return [self._value(e) for e in expressions]

    def _value(self, expression: sp.Expr) -> mpf | None:
        try:
            return evaluate([expression], self.point)[0]
        except (DomainError, KeyError):
            return None

    def holds(self, form: Form, at: Mapping[sp.Symbol, int], value: mpf | None) -> bool:
        """Tell whether a form at given indices has a given value."""
        if value is None:
            return False
        with mpmath.workdps(_DIGITS):
            try:
                ours = self._form(form.expression, form.series, at)
            except (DomainError, UndefinedElementError):
                return False
            return bool(abs(ours - value) <= _AGREED * max(abs(ours), abs(value), 1))

    def _form(
        self,
        expression: sp.Expr,
        series: Mapping[sp.Symbol, Series],
        at: Mapping[sp.Symbol, int],
    ) -> mpf:
        if expression not in self._tapes:
            inputs = sorted(expression.free_symbols, key=str)
            self._tapes[expression] = Tape([expression], inputs), inputs
        tape, inputs = self._tapes[expression]
        values = []
        for symbol in inputs:
            if symbol in series:
                one = series[symbol]
                sums = (self._form(one.body, series, a) for a in assignments(one.ranges, at))
                values.append(sum(sums, _ZERO))
            else:
                values.append(mpf(at[symbol]) if symbol in at else self._symbol(symbol, at))
        return tape.run([(v, _ZERO, _ZERO) for v in values], order=0).values[0]

    def _symbol(self, symbol: sp.Symbol, at: Mapping[sp.Symbol, int]) -> mpf:
        if symbol in self.point:
            return self.point[symbol]
        pattern = self.elements.meanings[symbol]
        element = pattern._replace(places=tuple(index_at(p, at) for p in pattern.places))
        known = self.elements.symbols.get(element)
        if known is not None:
            return self.point[known]
        if element not in self._beyond:
            if element not in self.elements.beyond:
                raise UndefinedElementError(element.name)
            value = self._value(self.elements.beyond[element])
            if value is None:
                raise UndefinedElementError(element.name)
            self._beyond[element] = value
        return self._beyond[element]
