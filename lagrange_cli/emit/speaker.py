"""Expressions of some equations in one language: that of scenes, which can be read back, LaTeX."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.notation.build import display

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr

    from lagrange_cli.notation.one_line import OneLinePrinter
    from lagrange_cli.notation.tree import DisplayNode
    from lagrange_cli.notation.vocabulary import Vocabulary

#: Matrices of more rows are given by their entries.
LARGEST_DENSE = 64


class Speaker:
    """Prints expressions and trees in one language."""

    def __init__(self, words: Vocabulary, printer: OneLinePrinter) -> None:
        self.words = words
        self._printer = printer

    def __call__(self, expression: Expr) -> str:
        return self.tree(display(expression, self.words))

    def tree(self, node: DisplayNode) -> str:
        return self._printer.inline(node)

    def knowing(self, words: Vocabulary) -> Speaker:
        """Speak with further symbols."""
        return Speaker(words, self._printer)


def matrix(rows: Sequence[Sequence[Expr]], say: Speaker) -> list[list[str]] | dict[str, Any]:
    """All entries, or (row, column, entry) of those that are not 0, counted from 0."""
    if len(rows) <= LARGEST_DENSE:
        return [[say(entry) for entry in row] for row in rows]
    terms = [[i, j, say(entry)] for i, row in enumerate(rows) for j, entry in entries(row).items()]
    return {"shape": [len(rows), len(rows)], "entries": terms}
