"""Terms of sums with their shapes, which leave indices out.

Two terms have one shape if they differ in a number in front and in the indices of their elements.
Factors and terms, which SymPy orders by name, are ordered here by shape and index, so that the
terms of neighbours ``(u[9] - u[8])^2`` and ``(u[10] - u[9])^2`` are alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import product
from typing import NamedTuple

import sympy as sp

from lagrange_cli.mechanics.families.elements import Element

#: Terms that a sum may be multiplied out to: a family of a hundred elements with pairs has 10,000,
#: and that of the seven joints of an arm, whose rows have as many, is none.
_MOST_TERMS = 20_000
_MOST_TERMS_OF_FEW = 1_000

_ODD = (sp.sin, sp.tan, sp.sinh, sp.tanh, sp.asin, sp.atan, sp.asinh, sp.atanh, sp.sign)
_EVEN = (sp.cos, sp.cosh, sp.Abs)


class Shape(NamedTuple):
    """An expression taken apart.

    Attributes
    ----------
    number
        Number in front, with the signs drawn out of odd functions.
    text
        The expression without it and without indices.
    symbols
        Its elements, in the order in which they stand in the text.
    """

    number: sp.Rational
    text: str
    symbols: tuple[sp.Symbol, ...]


class Term(NamedTuple):
    """A term of a sum.

    Attributes
    ----------
    row
        Indices of the element in whose row it stands; empty in an energy.
    number
        Number in front.
    text, symbols
        Its shape and its elements.
    product
        The term without the number.
    """

    row: tuple[int, ...]
    number: Fraction
    text: str
    symbols: tuple[sp.Symbol, ...]
    product: sp.Expr


class Shapes:
    """Splits expressions into numbers, shapes and elements, each once.

    Parameters
    ----------
    of
        Maps a symbol to its element; None for a symbol of no family.
    symbols
        Number of symbols that are elements; None if it is not known.
    """

    def __init__(
        self, element_of: Callable[[sp.Symbol], Element | None], symbols: int | None = None
    ) -> None:
        self._element = element_of
        self._most_terms = _MOST_TERMS
        if symbols is not None:
            # Each element has three symbols or more; each pair of elements has some terms.
            self._most_terms = min(_MOST_TERMS, max(_MOST_TERMS_OF_FEW, symbols**2 // 4))
        self._known: dict[sp.Expr, Shape] = {}

    def shape_of(self, expr: sp.Expr) -> Shape:
        """Split an expression into number, shape and elements."""
        if expr not in self._known:
            self._known[expr] = self._shape(expr)
        return self._known[expr]

    def terms(self, expr: sp.Expr, row: tuple[int, ...]) -> list[Term] | None:
        """List the terms of a sum whose products are multiplied out.

        Powers of sums and sums without elements stay. None if the terms are too many.
        """
        if self._count(expr) > self._most_terms:
            return None
        terms: dict[tuple[str, tuple[sp.Symbol, ...]], Term] = {}
        for flat in self._flat(expr):
            number, text, symbols = self.shape_of(flat)
            value = Fraction(int(number.p), int(number.q))
            known = terms.get((text, symbols))
            if known is not None:
                # Sums within a sum, as heights of a chain, hold a product more than once.
                value += known.number
            terms[text, symbols] = Term(row, value, text, symbols, flat / number)
        return [term for term in terms.values() if term.number]

    # -- shapes -------------------------------------------------------------------

    def _shape(self, expr: sp.Expr) -> Shape:
        if expr.is_Rational:
            return Shape(expr, "", ())
        if expr.is_Symbol:
            element = self._element(expr)
            if element is None:
                return Shape(sp.S.One, expr.name, ())
            return Shape(sp.S.One, f"{element.family}[]{'.' * element.order}", (expr,))
        if expr.is_Add:
            return self._sum(expr)
        if expr.is_Mul:
            parts = [self.shape_of(a) for a in expr.args]
            number = sp.Mul(*(p.number for p in parts))
            named = self._sorted([p for p in parts if p.text])
            return Shape(number, "*".join(p.text for p in named), _joined(named))
        if expr.is_Pow and not isinstance(expr, sp.exp):
            return self._power(expr)
        return self._call(expr)

    def _call(self, expr: sp.Expr) -> Shape:
        """Shape of a function; the sign of the argument of an odd or even one is drawn out."""
        parts = [self.shape_of(a) for a in expr.args]
        number = sp.S.One
        if len(parts) == 1 and isinstance(expr, (*_ODD, *_EVEN)) and parts[0].number < 0:
            number = -number if isinstance(expr, _ODD) else number
            parts = [parts[0]._replace(number=-parts[0].number)]
        inner = ",".join(f"{p.number}*{p.text}" for p in parts)
        return Shape(number, f"{type(expr).__name__}({inner})", _joined(parts))

    def _sum(self, expr: sp.Expr) -> Shape:
        parts = self._sorted([self.shape_of(a) for a in expr.args])
        sign = sp.S.One if parts[0].number > 0 else sp.S.NegativeOne
        text = " ".join(f"{sign * p.number}*{p.text}" for p in parts)
        return Shape(sign, f"({text})", _joined(parts))

    def _power(self, expr: sp.Expr) -> Shape:
        base, exponent = self.shape_of(expr.base), expr.exp
        if exponent.is_Integer:
            return Shape(base.number**exponent, f"{base.text}^{exponent}", base.symbols)
        above = self.shape_of(exponent)
        text = f"{base.number}*{base.text}^({above.number}*{above.text})"
        return Shape(sp.S.One, text, (*base.symbols, *above.symbols))

    def _sorted(self, parts: list[Shape]) -> list[Shape]:
        """Parts by their text, then by the indices of their elements."""

        def key(part: Shape) -> tuple[str, list[tuple[object, ...]]]:
            elements = map(self._element, part.symbols)
            return part.text, [e.places for e in elements if e is not None]

        return sorted(parts, key=key) if len(parts) > 1 else parts

    # -- products that are multiplied out -------------------------------------------

    def _flat(self, expr: sp.Expr) -> Iterator[sp.Expr]:
        if expr.is_Add:
            for part in expr.args:
                yield from self._flat(part)
        elif expr.is_Mul and any(map(self._opens, expr.args)):
            parts = (tuple(self._flat(f)) if self._opens(f) else (f,) for f in expr.args)
            for factors in product(*parts):
                yield sp.Mul(*factors)
        elif expr != 0:
            yield expr

    def _opens(self, factor: sp.Expr) -> bool:
        """Tell whether a factor is a sum that holds elements."""
        return factor.is_Add and any(map(self._element, factor.free_symbols))

    def _count(self, expr: sp.Expr) -> int:
        if expr.is_Add:
            return sum(map(self._count, expr.args))
        total = 1
        for factor in expr.args if expr.is_Mul else ():
            total *= self._count(factor) if self._opens(factor) else 1
        return total


def _joined(parts: list[Shape]) -> tuple[sp.Symbol, ...]:
    return tuple(s for part in parts for s in part.symbols)
