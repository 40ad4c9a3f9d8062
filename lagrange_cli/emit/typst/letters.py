"""Letters of mathematics in Typst, and texts of a scene within sentences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lagrange_cli.emit.document.letters import DocumentLetters
from lagrange_cli.emit.document.scene_text import SceneTextSpelling
from lagrange_cli.emit.family_wording import typst_ranges
from lagrange_cli.notation.layout import width
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.notation.typst import TypstPrinter, balanced, typst_number
from lagrange_cli.notation.typst_symbols import (
    typst_name,
    typst_prose,
    typst_scripted,
    typst_string,
    typst_text,
    typst_unit,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.families.forms import Range

_PRINTER = TypstPrinter()

_STATEMENTS = SceneTextSpelling(
    _PRINTER, over=r"\/", at_least=">=", at_most="<=", operator='op("{}")'
)


class TypstLetters(DocumentLetters):
    """Letters of mathematics in Typst."""

    dot_product = " dot.op "
    virtual_work = "delta W"
    comma = ", quad "
    at_most_sign = "<="
    imaginary = "upright(i)"

    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return typst_name(name, order, latex or self.override(name))

    def vector(self, letter: str, order: int = 0) -> str:
        bold = f"upright(bold({letter}))"
        dots = ["", "dot", "dot.double"][order]
        return f"{dots}({bold})_i" if order else f"{bold}_i"

    def bold(self, letter: str, order: int = 0) -> str:
        dots = ["", "dot", "dot.double"][order]
        known = f"upright(bold({letter}))"
        return f"{dots}({known})" if order else known

    def matrix(self, rows: Sequence[Sequence[str]]) -> str:
        cells = "; ".join(", ".join(row) for row in rows)
        return f"mat({cells})"

    def room(self, node: DisplayNode) -> float:
        return width(_PRINTER.pieces(node))

    def partial(self, of: str, by: str) -> str:
        return f"frac(partial {of}, partial {by})"

    def bracket(self, first: str, second: str) -> str:
        return f"{{{first}, {second}}}"

    def rate(self, of: str) -> str:
        return f"{_PRINTER.ddt} {of}"

    def differential(self, of: str) -> str:
        return f"frac(upright(d) {of}, upright(d) t)"

    def virtual(self, of: str) -> str:
        return f"delta {of}"

    def square(self, of: str) -> str:
        return f"{of}^2"

    def size(self, of: str) -> str:
        return f"abs({of})"

    def below(self, letter: str, index: str) -> str:
        return typst_scripted(letter, "_", index)

    def total(self, index: str, body: str) -> str:
        return f"sum_{index} {body}"

    def times(self, first: str, second: str) -> str:
        return f"{first} thin {second}"

    def at_least(self, of: str) -> str:
        return f"{of} >= 0"

    def named(self, name: str) -> str:
        return typst_string(name)

    def typed(self, text: str) -> str:
        return f"#raw({typst_string(text)})"

    def upright(self, phrase: str) -> str:
        return typst_string(phrase)

    def ranges(self, ranges: Sequence[Range]) -> str:
        return typst_ranges(ranges)

    def formula(self, node: DisplayNode) -> str:
        return _PRINTER.inline(node)

    def number(self, value: float) -> str:
        return typst_number(f"{value:.0e}") if value else "0"

    def inline(self, formula: str) -> str:
        return f"${formula}$"

    def words(self, text: str) -> str:
        return typst_text(text)

    def prose(self, text: str) -> str:
        return typst_prose(text)

    def statement(self, text: str) -> str:
        written = _STATEMENTS.formula(text, self.written)
        return self.words(text) if written is None else self.inline(*balanced([written]))

    def unit(self, text: str) -> str:
        return self.inline(typst_unit(text)) if text.strip() else ""

    def value(self, number: float, literal: str | None = None) -> str:
        text = (literal if literal is not None else repr(number)).removesuffix(".0")
        sign = "-" if text.startswith("-") else ""
        return sign + typst_number(text.removeprefix("-"))
