"""The writer of sections on a form of the equations, with names of the momenta."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.notation.build import display, display_sum
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.notation.vocabulary import Vocabulary, with_symbols
from lagrange_cli.report.contents.steps.writer import Writer
from lagrange_cli.report.inlines import Label, Sentence, Text, say, symbol
from lagrange_cli.report.tree import Formula

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.analysis.forms.momenta import Momentum
    from lagrange_cli.mechanics.findings import Certificate


@dataclass(frozen=True)
class FormWriter(Writer):
    """Writes labels and rows of a form.

    Attributes
    ----------
    vocabulary
        Display names of the symbols.
    noted
        Takes note of the abbreviations in a tree, and returns it.
    """

    _: KW_ONLY
    vocabulary: Vocabulary
    noted: Callable[[DisplayNode], DisplayNode]

    @cached_property
    def words(self) -> Vocabulary:
        """Display names of all symbols."""
        return self.vocabulary

    def tree(self, expression: Expr) -> DisplayNode:
        """Return an expression as it is displayed."""
        return self.noted(display(expression, self.words))

    def total(self, label: Text, parts: Sequence[Expr]) -> Formula:
        """``label = Σ parts``, the parts in their order; 0 without parts."""
        return Formula(label, (self.noted(display_sum(parts or (_zero(),), self.words)),))

    def knowing(self, momenta: Sequence[Momentum]) -> FormWriter:
        """Return the writer with names of momenta."""
        return replace(self, vocabulary=with_momenta(self.words, momenta))

    def naming(self, names: Mapping[Symbol, str]) -> FormWriter:
        """Return the writer with names of quantities."""
        further = [(symbol, name, None) for symbol, name in names.items()]
        return replace(self, vocabulary=with_symbols(self.words, further))

    def also(self, symbol: Symbol, name: str) -> FormWriter:
        """Return the writer with one further letter."""
        return replace(self, vocabulary=with_symbols(self.words, [(symbol, name, None)]))

    def momentum(self, momentum: Momentum, order: int = 0) -> Label:
        """Return the letter of a momentum, with its dots."""
        return symbol(momentum.name, order, momentum_latex(momentum))


def with_momenta(words: Vocabulary, momenta: Sequence[Momentum]) -> Vocabulary:
    """Return names of momenta beside those of other symbols."""
    return with_symbols(words, [(m.symbol, m.name, momentum_latex(m)) for m in momenta])


def momentum_latex(momentum: Momentum) -> str | None:
    """LaTeX of a momentum whose coordinate has some in the scene; None for that of its name."""
    latex = momentum.coordinate.latex
    return None if latex is None else f"{momentum.name[0]}_{{{latex}}}"


def _zero() -> Expr:
    import sympy

    zero: Expr = sympy.S.Zero
    return zero


def certified(certificate: Certificate) -> Sentence:
    """``Compared at 8 states with Lagrange's equations, to 30 digits.``"""
    return say.counted(
        certificate.points,
        "Compared at {count} state with Lagrange's equations, to {digits} digits.",
        "Compared at {count} states with Lagrange's equations, to {digits} digits.",
        digits=certificate.digits,
    )
