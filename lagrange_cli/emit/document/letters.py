"""Letters of formats that documents are written in: those of steps, and texts of a scene."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.emit.steps.letters import Letters
from lagrange_cli.notation.symbols import multiplier_symbol
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.notation.vocabulary import latex_overrides

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.forms import Range


class DocumentLetters(Letters):
    """Letters of a format that documents are written in.

    ``at_most_sign`` and ``imaginary`` are ≤ and the imaginary unit.
    """

    at_most_sign: str
    imaginary: str

    def __init__(self, equations: Equations) -> None:
        #: LaTeX of the names that the scene says how to print.
        self.written: Mapping[str, str] = latex_overrides(equations)

    def override(self, name: str) -> str | None:
        """LaTeX of a name, as letters have it: that of a multiplier is ``lambda(rod)``."""
        return self.written.get(multiplier_symbol(name))

    @abstractmethod
    def upright(self, phrase: str) -> str:
        """Words of the program within a formula."""

    @abstractmethod
    def typed(self, text: str) -> str:
        """What is typed on a command line, within a sentence."""

    @abstractmethod
    def statement(self, text: str) -> str:
        """An equation or inequality as the scene writes it, within a sentence."""

    @abstractmethod
    def unit(self, text: str) -> str:
        """A unit, within a sentence."""

    @abstractmethod
    def value(self, number: float, literal: str | None = None) -> str:
        """A value, as the scene wrote it if that is known."""

    @abstractmethod
    def bold(self, letter: str, order: int = 0) -> str:
        """A vector or matrix, with its dots."""

    @abstractmethod
    def matrix(self, rows: Sequence[Sequence[str]]) -> str:
        """A matrix of formulas."""

    @abstractmethod
    def room(self, node: DisplayNode) -> float:
        """Columns of half an em that an expression takes."""

    @abstractmethod
    def at_least(self, of: str) -> str:
        """``of ≥ 0``."""

    @abstractmethod
    def differential(self, of: str) -> str:
        """A total time derivative as one fraction."""

    @abstractmethod
    def size(self, of: str) -> str:
        """The magnitude of a vector."""

    @abstractmethod
    def ranges(self, ranges: Sequence[Range]) -> str:
        """The values of indices: ``i, j = 1, …, n``."""
