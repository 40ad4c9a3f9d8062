"""What sections of a document are written with; notes the abbreviations that they hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.emit.document.letters import DocumentLetters
from lagrange_cli.emit.steps.sections import Formula
from lagrange_cli.emit.steps.writer import Writer
from lagrange_cli.notation.build import display, display_sum
from lagrange_cli.notation.tree import DisplayNode, abbreviations_in
from lagrange_cli.notation.vocabulary import Vocabulary, unabbreviated, vocabulary

if TYPE_CHECKING:
    from sympy import Expr


@dataclass(frozen=True)
class DocumentWriter(Writer):
    """Writes labels and rows of a document.

    Attributes
    ----------
    letters
        Letters of the format.
    abbreviating
        True if the scene's abbreviations stand for their expressions.
    abbreviated
        Names of the abbreviations that what was written so far holds.
    """

    letters: DocumentLetters
    abbreviating: bool = True
    abbreviated: set[str] = field(default_factory=set)

    @cached_property
    def words(self) -> Vocabulary:
        """Display names of all symbols; steps are written without abbreviations."""
        abbreviating = self.abbreviating and self.equations.steps is None
        return vocabulary(self.equations, abbreviating=abbreviating)

    def tree(self, expression: Expr) -> DisplayNode:
        """An expression as it is displayed."""
        return self.noted(display(expression, self.words))

    def noted(self, node: DisplayNode) -> DisplayNode:
        """The same tree, whose abbreviations are noted."""
        if self.words.named:
            self.abbreviated.update(abbreviations_in(node))
        return node

    def total(self, label: str, parts: Sequence[Expr]) -> Formula:
        """``label = Σ parts``, the parts in their order."""
        return Formula(label, (self.noted(display_sum(parts, self.words)),))

    def abbreviations(self) -> list[Formula]:
        """What the abbreviations stand for that were written, those of these among them."""
        rows: list[Formula] = []
        for name, expression in reversed(self.equations.abbreviations):
            if name in self.abbreviated:
                node = self.noted(display(expression, unabbreviated(name, self.words)))
                rows.insert(0, Formula(self.letters.symbol(name), (node,)))
        return rows
