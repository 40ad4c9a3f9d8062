"""Expressions in the scene language, so that printed ones can be read back.

Plain ASCII text uses the same form.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.notation.build import display
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.notation.vocabulary import vocabulary

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.notation.vocabulary import Vocabulary


def to_scene_language(expression: Expr, equations: Equations) -> str:
    """Print an expression over the equations' symbols so that it reads back the same.

    Raises
    ------
    InternalError
        It holds what the scene language cannot say.
    """
    return ScenePrinter().inline(display(expression, vocabulary(equations)))


class ExpressionPrinter:
    """Prints expressions and display trees with one vocabulary, in the language of its printer."""

    def __init__(self, words: Vocabulary, printer: OneLinePrinter) -> None:
        self.words = words
        self._printer = printer

    def __call__(self, expression: Expr) -> str:
        return self.tree(display(expression, self.words))

    def tree(self, node: DisplayNode) -> str:
        return self._printer.inline(node)

    def knowing(self, words: Vocabulary) -> ExpressionPrinter:
        """Return the printer with another vocabulary."""
        return ExpressionPrinter(words, self._printer)
