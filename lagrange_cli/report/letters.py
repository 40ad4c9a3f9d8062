"""Labels and general formulas in the letters of a format: ``∂x/∂θ``, ``δr``, ``Σ``, units.

Of the scene's units nothing is interpreted beyond tokens, and every token is printed from a table
or escaped, so that no text of a scene acts as a command.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.notation.symbols import multiplier_symbol
from lagrange_cli.notation.tree import DisplayNode

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.forms import Range


class Letters(ABC):
    """Letters of one format.

    ``cross_product`` and ``dot_product`` are signs between two vectors, ``virtual_work`` is δW,
    ``at_least_sign`` and ``at_most_sign`` are ≥ and ≤, ``imaginary`` is the imaginary unit,
    ``comma`` stands between formulas of one display, and ``minus`` before a formula that is
    negative.
    """

    comma = ", "
    at_least_sign = "≥"
    at_most_sign = "≤"
    imaginary = "i"
    minus = "-"
    cross_product: str
    dot_product: str
    virtual_work: str

    def __init__(self, equations: Equations | None = None) -> None:
        #: LaTeX of the names that the scene says how to print.
        self.written: Mapping[str, str] = {}
        if equations is not None:
            from lagrange_cli.notation.vocabulary import latex_overrides  # imports SymPy

            self.written = latex_overrides(equations)

    def override(self, name: str) -> str | None:
        """Return the scene's LaTeX of a name; the name of a multiplier is ``lambda(rod)``."""
        return self.written.get(multiplier_symbol(name))

    @abstractmethod
    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        """Return a name of the scene, or one like it, with its dots."""

    def scene_name(self, name: str) -> str:
        """Return a name by which results have a value: ``x``, or ``dot(x)`` for its rate."""
        for order, opening in enumerate(("dot(", "ddot("), 1):
            if name.startswith(opening):
                return self.symbol(name[len(opening) : -1], order)
        return self.named(name) if "(" in name else self.symbol(name)

    @abstractmethod
    def vector(self, letter: str, order: int = 0) -> str:
        """Return a vector of particle i."""

    @abstractmethod
    def partial(self, symbol: str, by: str) -> str:
        """Return a partial derivative."""

    @abstractmethod
    def bracket(self, first: str, second: str) -> str:
        """Return a Poisson bracket."""

    @abstractmethod
    def rate(self, symbol: str) -> str:
        """Return a total time derivative."""

    @abstractmethod
    def virtual(self, symbol: str) -> str:
        """Return a virtual displacement."""

    @abstractmethod
    def square(self, symbol: str) -> str:
        """Return the square of a symbol."""

    @abstractmethod
    def routhian(self) -> str:
        """Return the letter of Routh's function where the scene has an R of its own."""

    @abstractmethod
    def below(self, letter: str, index: str) -> str:
        """Return a letter with a symbol as its index."""

    def entry(self, letter: str, row: int, column: int) -> str:
        """Return an entry of a matrix."""
        return self.below(letter, f"{row},{column}")

    @abstractmethod
    def total(self, index: str, body: str) -> str:
        """Return a sum over an index."""

    @abstractmethod
    def times(self, first: str, second: str) -> str:
        """Return a product."""

    @abstractmethod
    def named(self, name: str) -> str:
        """Return a term of the scene, by its name, as a label."""

    @abstractmethod
    def formula(self, node: DisplayNode) -> str:
        """Return an expression on one line."""

    @abstractmethod
    def number(self, value: float) -> str:
        """Return a small number, in one digit."""

    @abstractmethod
    def inline(self, formula: str) -> str:
        """Return a formula within a sentence."""

    @abstractmethod
    def words(self, text: str) -> str:
        """Text of a scene within a sentence."""

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
    def digits(self, text: str) -> str:
        """Return a number in decimals, with all of its digits."""

    def value(self, number: float, literal: str | None = None) -> str:
        """Return a value, as the scene wrote it if that is known."""
        return self.digits((repr(number) if literal is None else literal).removesuffix(".0"))

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

    def prose(self, text: str) -> str:
        """Return a title or description of a scene, which may hold formulas between dollars."""
        return self.words(text)

    def group(self, body: str) -> str:
        """Return a sum that is a factor."""
        return f"({body})"
