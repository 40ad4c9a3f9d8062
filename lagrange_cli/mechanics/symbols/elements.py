"""Elements of families converted to SymPy once for all that differ in names alone."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter

import sympy as sp

from lagrange_cli.mechanics.algebra.templates import Template
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


@dataclass(frozen=True)
class _First:
    """The first expression of a shape, with its symbols in the order of their names."""

    expr: sp.Expr
    symbols: list[sp.Symbol]

    @cached_property
    def template(self) -> Template:
        return Template(self.expr, self.symbols)


class ConvertedElements:
    """Conversions by the shape of the syntax tree, and by the order and kind of the symbols."""

    def __init__(self) -> None:
        self._firsts: dict[Hashable, _First] = {}

    def converted(
        self,
        expression: Expression,
        symbol: Callable[[str], sp.Symbol | None],
        convert: Callable[[], sp.Expr],
    ) -> sp.Expr:
        """Convert an expression, by ``convert`` where none of its shape has been.

        ``symbol`` gives those of names that stand for one; with any others it is converted anew.
        """
        shape, names = shape_of(expression.node)
        if len(shape) > _LONGEST or len(names) < 2:
            return convert()
        written = [symbol(name) for name in names]
        if not all(s is not None and s.is_Symbol for s in written):
            return convert()
        symbols = sorted(set(written), key=attrgetter("name"))
        place = {s: k for k, s in enumerate(symbols)}
        key = shape, *[place[s] for s in written], *[s.is_positive for s in symbols]
        if key in self._firsts:
            return self._firsts[key].template.over(symbols)
        expr = convert()
        if all(_is_plain(part) for part in walk(expression.node) if isinstance(part, Call)):
            self._firsts[key] = _First(expr, symbols)
        return expr


def _is_plain(call: Call) -> bool:
    """Say whether nothing but the arguments of a function stands in its value."""
    return call.function in FUNCTIONS and call.function not in TIME_DERIVATIVES
