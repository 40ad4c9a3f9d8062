"""Derivatives of positions, taken once for each distinct term.

Positions are sums in which the same terms recur from particle to particle (the links of a chain).
Every term is differentiated once; a component's Jacobian row and convective term are lists of the
derivatives of its terms, so that recurring terms stay recognizable.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import sympy as sp

from lagrange_cli.mechanics.algebra.polynomials import expand_terms, term_count
from lagrange_cli.mechanics.free_symbols import (
    arguments_of,
    is_unknown,
    symbols_in,
    unknown_slope,
)
from lagrange_cli.mechanics.kinks import Cases

_ZERO = sp.Integer(0)
_ONE = sp.Integer(1)

#: The default budget of :class:`Kinematics`. Not tuned.
POSITION_TERMS = 200

#: Most terms of second derivatives of a term. The height of a disk about a slanted axis on a
#: slanted plane is a root of a long sum: it would have 1e5, which take minutes.
_CURVATURE_TERMS = 2_000


#: Most derivatives that are kept, so that common parts of expressions are differentiated once.
_KEPT = 2**15

#: Derivatives of functions of one argument.
_SLOPES: dict[Any, Callable[[sp.Expr], sp.Expr]] = {
    sp.sin: sp.cos,
    sp.cos: lambda x: -sp.sin(x),
    sp.tan: lambda x: 1 + sp.tan(x) ** 2,
    sp.asin: lambda x: 1 / sp.sqrt(1 - x**2),
    sp.acos: lambda x: -1 / sp.sqrt(1 - x**2),
    sp.atan: lambda x: 1 / (1 + x**2),
    sp.sinh: sp.cosh,
    sp.cosh: sp.sinh,
    sp.tanh: lambda x: 1 - sp.tanh(x) ** 2,
    sp.asinh: lambda x: 1 / sp.sqrt(1 + x**2),
    sp.acosh: lambda x: 1 / sp.sqrt(x**2 - 1),
    sp.atanh: lambda x: 1 / (1 - x**2),
    sp.exp: sp.exp,
    sp.log: lambda x: 1 / x,
    sp.Abs: sp.sign,
    sp.sign: lambda x: _ZERO,
    sp.Heaviside: lambda x: _ZERO,
}


@lru_cache(maxsize=_KEPT)
def derivative(expr: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Differentiate an expression, ∂expr/∂symbol, with results in functions of the scene language.

    The rules are written down here since SymPy's general ones cost tenfold and
    bring in functions of their own. The step of min and max is written with
    ``sign``; the impulses of a second derivative, which live on a set of measure
    zero, are left out.
    """
    if symbol not in symbols_in(expr):
        return _ZERO
    if expr == symbol:
        return _ONE
    if expr.is_Add:
        return sp.Add(*(derivative(a, symbol) for a in expr.args))
    if expr.is_Mul:
        return _product_rule(expr.args, symbol)
    if expr.is_Pow and symbol not in symbols_in(expr.exp):
        return expr.exp * expr.base ** (expr.exp - 1) * derivative(expr.base, symbol)
    if expr.func in _SLOPES:
        return _SLOPES[expr.func](expr.args[0]) * derivative(expr.args[0], symbol)
    if isinstance(expr, Cases):
        value, side, strict, otherwise = expr.args
        above, below = (sp.factor_terms(derivative(e, symbol)) for e in (value, otherwise))
        return Cases(above, side, strict, below)
    if is_unknown(expr):
        slopes = [derivative(a, symbol) for a in arguments_of(expr)]
        return sp.Add(*(unknown_slope(expr, k) * s for k, s in enumerate(slopes) if s != 0))
    return _general_derivative(expr, symbol)


def _product_rule(factors: Sequence[sp.Expr], symbol: sp.Symbol) -> sp.Expr:
    terms = []
    for k, factor in enumerate(factors):
        slope = derivative(factor, symbol)
        if slope != 0:
            terms.append(sp.Mul(*factors[:k], slope, *factors[k + 1 :]))
    return sp.Add(*terms)


def _general_derivative(expr: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Differentiate min, max, atan2 and powers with the symbol in the exponent."""
    arguments = expr.args
    if expr.func in (sp.Min, sp.Max):
        # max(a, rest) = (a + rest + |a − rest|)/2
        first, remaining = arguments[0], expr.func(*arguments[1:])
        side = sp.sign(first - remaining) * (1 if expr.func is sp.Max else -1)
        slopes = derivative(first, symbol), derivative(remaining, symbol)
        return (slopes[0] * (1 + side) + slopes[1] * (1 - side)) / 2
    if expr.func is sp.atan2:
        y, x = arguments
        area = x * derivative(y, symbol) - y * derivative(x, symbol)
        return area / (x**2 + y**2)
    base, exponent = expr.as_base_exp()
    grown = (
        derivative(exponent, symbol) * sp.log(base)
        if base != sp.E
        else derivative(exponent, symbol)
    )
    return expr * (grown + exponent * derivative(base, symbol) / base)


class Kinematics:
    """Jacobian parts and convective terms of positions r(q, t).

    Parameters
    ----------
    positions
        Symbol of a component → r(q, t).
    q, v, t
        Symbols of coordinates, velocities and time.
    budget
        Terms that one position component, or a derivative of one, may be multiplied out to; a
        longer one is differentiated as it stands.
    """

    def __init__(
        self,
        positions: Mapping[sp.Symbol, sp.Expr],
        q: Sequence[sp.Symbol],
        v: Sequence[sp.Symbol],
        t: sp.Symbol,
        budget: int = POSITION_TERMS,
    ) -> None:
        self._positions = positions
        self._t = t
        self._budget = budget
        self._v = dict(zip(q, v, strict=True))
        self._number = {symbol: j for j, symbol in enumerate(q)}
        self._gradients: dict[sp.Expr, dict[sp.Symbol, list[sp.Expr]]] = {}
        self._convective: dict[sp.Expr, list[sp.Expr]] = {}

    def _terms(self, symbol: sp.Symbol) -> Sequence[sp.Expr]:
        position = self._positions[symbol]
        return expand_terms(position, self._budget) or sp.Add.make_args(position)

    def _gradient(self, term: sp.Expr) -> dict[sp.Symbol, list[sp.Expr]]:
        """Differentiate a term: symbol → terms of ∂term/∂q or ∂term/∂t, zero ones absent."""
        if term not in self._gradients:
            derivatives = {s: derivative(term, s) for s in self._variables(term)}
            gradient = {s: self._parts(e) for s, e in derivatives.items()}
            if self._is_long(gradient):
                gradient = {s: _summands(e) for s, e in derivatives.items()}
            self._gradients[term] = gradient
        return self._gradients[term]

    def _is_long(self, gradient: Mapping[sp.Symbol, list[sp.Expr]]) -> bool:
        """Tell whether the parts of a gradient have too many terms in their derivatives."""
        parts = max(gradient.values(), key=len, default=[])
        if len(parts) < 2:
            return False
        slopes = (derivative(parts[0], s) for s in self._variables(parts[0]))
        number = sum(map(len, gradient.values()))
        return number * sum(map(term_count, slopes)) > _CURVATURE_TERMS

    def _parts(self, expr: sp.Expr) -> list[sp.Expr]:
        if expr == 0:
            return []
        return expand_terms(expr, self._budget) or _summands(expr)

    def _variables(self, term: sp.Expr) -> list[sp.Symbol]:
        present = symbols_in(term)
        variables = sorted((s for s in present if s in self._number), key=self._number.__getitem__)
        return [*variables, self._t] if self._t in present else variables

    def jacobian(self, symbol: sp.Symbol) -> dict[int, list[sp.Expr]]:
        """Give the row ∂r/∂q: coordinate number → terms, zero ones absent."""
        rows: dict[int, list[sp.Expr]] = {}
        for term in self._terms(symbol):
            for s, parts in self._gradient(term).items():
                if s != self._t:
                    rows.setdefault(self._number[s], []).extend(parts)
        return rows

    def velocity(self, symbol: sp.Symbol) -> list[sp.Expr]:
        """List the terms of ṙ = Σ ∂r/∂q·v + ∂r/∂t."""
        return [
            part if s == self._t else part * self._v[s]
            for term in self._terms(symbol)
            for s, parts in self._gradient(term).items()
            for part in parts
        ]

    def convective(self, symbol: sp.Symbol) -> list[sp.Expr]:
        """List the terms of γ, the part of r̈ without accelerations."""
        return [g for term in self._terms(symbol) for g in self._convective_terms(term)]

    def _convective_terms(self, term: sp.Expr) -> list[sp.Expr]:
        if term not in self._convective:
            terms: list[sp.Expr] = []
            for s, parts in self._gradient(term).items():
                rate = self._rate(s)
                for part in parts:
                    for second, seconds in self._gradient(part).items():
                        terms.extend(p * rate * self._rate(second) for p in seconds)
            self._convective[term] = terms
        return self._convective[term]

    def _rate(self, symbol: sp.Symbol) -> sp.Expr:
        return sp.Integer(1) if symbol == self._t else self._v[symbol]


def _summands(expr: sp.Expr) -> list[sp.Expr]:
    return [] if expr == 0 else list(sp.Add.make_args(expr))
