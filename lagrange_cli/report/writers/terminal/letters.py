"""Letters of a terminal: Unicode, and those of seven bits that the scene language has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lagrange_cli.errors import escape_controls
from lagrange_cli.notation.layout import width
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.report.letters import Letters
from lagrange_cli.report.ranges import text_ranges

if TYPE_CHECKING:
    from lagrange_cli.mechanics.families.forms import Range


class UnicodeLetters(Letters):
    """Letters of a terminal."""

    cross_product = " × "
    dot_product = " · "
    virtual_work = "δW"

    def __init__(self, *, lowered: bool = False) -> None:
        super().__init__()
        self._printer: OneLinePrinter = UnicodePrinter(lowered=lowered)

    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return self._printer.symbol(name, order)

    def scene_name(self, name: str) -> str:
        # Options and files have it so.
        return escape_controls(name)

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

    def entry(self, letter: str, row: int, column: int) -> str:
        return f"{letter}[{row},{column}]"

    def total(self, index: str, body: str) -> str:
        return f"Σ_{index} {body}"

    def times(self, first: str, second: str) -> str:
        return f"{first} {second}"

    def named(self, name: str) -> str:
        return escape_controls(name)

    def upright(self, phrase: str) -> str:
        return phrase

    def typed(self, text: str) -> str:
        return text

    def unit(self, text: str) -> str:
        return escape_controls(text)

    def digits(self, text: str) -> str:
        return text

    def bold(self, letter: str, order: int = 0) -> str:
        return self.symbol(letter, order)

    def matrix(self, rows: Sequence[Sequence[str]]) -> str:
        return f"[{'; '.join(', '.join(row) for row in rows)}]"

    def room(self, node: DisplayNode) -> float:
        return width(self._printer.pieces(node))

    def at_least(self, symbol: str) -> str:
        return f"{symbol} {self.at_least_sign} 0"

    def differential(self, symbol: str) -> str:
        return f"d{symbol}/dt"

    def size(self, symbol: str) -> str:
        return f"|{symbol}|"

    def ranges(self, ranges: Sequence[Range]) -> str:
        return text_ranges(ranges, ascii=False)

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

    at_least_sign = ">="
    at_most_sign = "<="
    cross_product = " x "
    dot_product = " . "
    virtual_work = "delta(W)"

    def __init__(self) -> None:
        super().__init__()
        self._printer = ScenePrinter()

    def partial(self, symbol: str, by: str) -> str:
        return f"d({symbol})/d({by})"

    def virtual(self, symbol: str) -> str:
        return f"delta({symbol})"

    def ranges(self, ranges: Sequence[Range]) -> str:
        return text_ranges(ranges, ascii=True)

    def square(self, symbol: str) -> str:
        return f"{symbol}^2"

    def routhian(self) -> str:
        return "Routhian"

    def total(self, index: str, body: str) -> str:
        return f"sum_{index} {body}"

    def times(self, first: str, second: str) -> str:
        return f"{first}*{second}"
