"""Letters of formats that documents are written in, and texts of a scene in these formats.

Of the scene's units nothing is interpreted beyond tokens, and every token is printed from a table
or escaped, so that no text of a scene acts as a command.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.notation.symbols import multiplier_symbol
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.notation.vocabulary import latex_overrides
from lagrange_cli.report.writers.letters import Letters

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.forms import Range


class DocumentLetters(Letters):
    """Letters of a format that documents are written in.

    ``at_least_sign``, ``at_most_sign`` and ``imaginary`` are ≥, ≤ and the imaginary unit.
    """

    at_least_sign: str
    at_most_sign: str
    imaginary: str

    def __init__(self, equations: Equations) -> None:
        #: LaTeX of the names that the scene says how to print.
        self.written: Mapping[str, str] = latex_overrides(equations)

    def override(self, name: str) -> str | None:
        """Return the scene's LaTeX of a name; the name of a multiplier is ``lambda(rod)``."""
        return self.written.get(multiplier_symbol(name))

    @abstractmethod
    def upright(self, phrase: str) -> str:
        """Return words of the program within a formula."""

    @abstractmethod
    def typed(self, text: str) -> str:
        """Return a text typed on a command line, within a sentence."""

    @abstractmethod
    def unit(self, text: str) -> str:
        """Return a unit, within a sentence."""

    @abstractmethod
    def value(self, number: float, literal: str | None = None) -> str:
        """Return a value, as the scene wrote it if that is known."""

    @abstractmethod
    def bold(self, letter: str, order: int = 0) -> str:
        """Return a vector or matrix, with its dots."""

    @abstractmethod
    def matrix(self, rows: Sequence[Sequence[str]]) -> str:
        """Return a matrix of formulas."""

    @abstractmethod
    def room(self, node: DisplayNode) -> float:
        """Return columns of half an em that an expression takes."""

    @abstractmethod
    def at_least(self, symbol: str) -> str:
        """Return ``formula ≥ 0``."""

    @abstractmethod
    def differential(self, symbol: str) -> str:
        """Return a total time derivative as one fraction."""

    @abstractmethod
    def size(self, symbol: str) -> str:
        """Return the magnitude of a vector."""

    @abstractmethod
    def ranges(self, ranges: Sequence[Range]) -> str:
        """Return the values of indices: ``i, j = 1, …, n``."""
