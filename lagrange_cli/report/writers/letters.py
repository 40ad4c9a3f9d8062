"""Labels and general formulas of steps in the letters of a format: ``∂x/∂θ``, ``δr``, ``Σ``."""

from __future__ import annotations

from abc import ABC, abstractmethod

from lagrange_cli.errors import escape_controls
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.tree import DisplayNode


class Letters(ABC):
    """Letters of one format.

    ``dot_product`` and ``virtual_work`` are the sign between two vectors and δW, ``at_most_sign``
    is ≤, ``comma`` stands between formulas of one display.
    """

    comma = ", "
    at_most_sign = "≤"
    dot_product: str
    virtual_work: str

    @abstractmethod
    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        """Return a name of the scene, or one like it, with its dots."""

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

    def prose(self, text: str) -> str:
        """Return a title or description of a scene, which may hold formulas between dollars."""
        return self.words(text)

    def group(self, body: str) -> str:
        """Return a sum that is a factor."""
        return f"({body})"


class UnicodeLetters(Letters):
    """Letters of a terminal."""

    dot_product = " · "
    virtual_work = "δW"

    def __init__(self, *, lowered: bool = False) -> None:
        self._printer: OneLinePrinter = UnicodePrinter(lowered=lowered)

    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return self._printer.symbol(name, order)

    def vector(self, letter: str, order: int = 0) -> str:
        return self.symbol(f"{letter}_i", order)

    def partial(self, symbol: str, by: str) -> str:
        return f"∂{symbol}/∂{by}"

    def bracket(self, first: str, second: str) -> str:
        return f"{{{first}, {second}}}"

    def rate(self, symbol: str) -> str:
        return f"d/dt {symbol}"

    def virtual(self, symbol: str) -> str:
        return f"δ{symbol}"

    def square(self, symbol: str) -> str:
        return f"{symbol}²"

    def routhian(self) -> str:
        return "ℛ"

    def below(self, letter: str, index: str) -> str:
        return f"{letter}_{index}"

    def total(self, index: str, body: str) -> str:
        return f"Σ_{index} {body}"

    def times(self, first: str, second: str) -> str:
        return f"{first} {second}"

    def named(self, name: str) -> str:
        return escape_controls(name)

    def formula(self, node: DisplayNode) -> str:
        return self._printer.inline(node)

    def number(self, value: float) -> str:
        return f"{value:.0e}" if value else "0"

    def inline(self, formula: str) -> str:
        return formula

    def words(self, text: str) -> str:
        return escape_controls(text)


class AsciiLetters(UnicodeLetters):
    """Letters of seven bits, those of the scene language."""

    at_most_sign = "<="
    dot_product = " . "
    virtual_work = "delta(W)"

    def __init__(self) -> None:
        self._printer = ScenePrinter()

    def partial(self, symbol: str, by: str) -> str:
        return f"d({symbol})/d({by})"

    def virtual(self, symbol: str) -> str:
        return f"delta({symbol})"

    def square(self, symbol: str) -> str:
        return f"{symbol}^2"

    def routhian(self) -> str:
        return "Routhian"

    def total(self, index: str, body: str) -> str:
        return f"sum_{index} {body}"

    def times(self, first: str, second: str) -> str:
        return f"{first}*{second}"
