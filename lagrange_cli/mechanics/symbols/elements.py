"""Elements of families converted to SymPy once for all that differ in names alone."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from operator import attrgetter

import sympy as sp

from lagrange_cli.mechanics.algebra.templates import Element, Shape
from lagrange_cli.scene.language.expression import (
    FUNCTIONS,
    TIME_DERIVATIVES,
    Call,
    Expression,
    walk,
)
from lagrange_cli.scene.language.templates import shape_of

#: Parts of the longest shape that is kept.
_LONGEST = 200


class ConvertedElements:
    """Conversions by the shape of the syntax tree, and by the order and kind of the symbols."""

    def __init__(self) -> None:
        self._shapes: dict[Hashable, Shape] = {}

    def converted(
        self,
        expression: Expression,
        symbol: Callable[[str], sp.Symbol | None],
        convert: Callable[[], sp.Expr],
    ) -> tuple[sp.Expr, Element | None]:
        """Convert an expression, by ``convert`` if none of its shape has been.

        ``symbol`` gives those of names that stand for one. With any others the expression is
        converted anew, and is no element.
        """
        shape, names = shape_of(expression.node)
        written = [s for s in map(symbol, names) if s is not None and s.is_Symbol]
        if len(shape) > _LONGEST or not 1 < len(written) == len(names):
            return convert(), None
        symbols = tuple(sorted(set(written), key=attrgetter("name")))
        place = {s: k for k, s in enumerate(symbols)}
        key = shape, *[place[s] for s in written], *[s.is_positive for s in symbols]
        if key in self._shapes:
            known = self._shapes[key]
            element = Element(known.template.over(symbols), known, symbols)
            return element.expr, element
        expr = convert()
        if not all(_is_plain(part) for part in walk(expression.node) if isinstance(part, Call)):
            return expr, None
        self._shapes[key] = Shape(expr, symbols)
        return expr, Element(expr, self._shapes[key], symbols)


def _is_plain(call: Call) -> bool:
    """Say whether nothing but the arguments of a function stands in its value."""
    return call.function in FUNCTIONS and call.function not in TIME_DERIVATIVES
