"""Expressions in the scene language, so that printed ones can be read back.

Plain ASCII text uses the same form.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.notation.build import display
from lagrange_cli.notation.layout import Piece, columns, joined, prefixed
from lagrange_cli.notation.one_line import OneLinePrinter, argument_list, group
from lagrange_cli.notation.symbols import DOT_WORDS, multiplier_symbol
from lagrange_cli.notation.tree import (
    DisplayCall,
    DisplayNode,
    DisplayNumber,
    DisplayRoot,
    DisplaySymbol,
)
from lagrange_cli.notation.vocabulary import vocabulary

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations


class ScenePrinter(OneLinePrinter):
    """``(M + m)*ddot(r) - M*r*dot(theta)^2 + m*g``."""

    at_least = ">="

    def symbol(self, name: str, order: int = 0) -> str:
        return f"{DOT_WORDS[order]}({name})" if order else multiplier_symbol(name)

    def call(self, node: DisplayCall, power: str, *, closed: bool) -> list[Piece]:
        name = node.function + "'" * (node.order or 0)
        return _applied(name, [self.pieces(a) for a in node.arguments])

    def takes_power(self, node: DisplayCall, exponent: DisplayNode) -> bool:
        return False

    def enclosed_call(self, node: DisplayCall) -> list[Piece]:
        return self.call(node, "", closed=True)

    def root(self, node: DisplayRoot) -> list[Piece]:
        return _applied("sqrt", [self.pieces(node.radicand)])

    def exponent(self, node: DisplayNode) -> str:
        simple = isinstance(node, DisplaySymbol) or (
            isinstance(node, DisplayNumber) and node.denominator == 1
        )
        inner = joined(self.pieces(node))
        return f"^{inner}" if simple else f"^({inner})"


def _applied(function: str, arguments: list[list[Piece]]) -> list[Piece]:
    return prefixed(group(argument_list(arguments)), function, columns(function))


def to_scene_language(expression: Expr, equations: Equations) -> str:
    """Print an expression over the equations' symbols so that it reads back the same.

    Raises
    ------
    InternalError
        It holds what the scene language cannot say.
    """
    return ScenePrinter().inline(display(expression, vocabulary(equations)))
