"""Letters of mathematics in LaTeX, and texts of a scene within sentences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lagrange_cli.emit.document.letters import DocumentLetters
from lagrange_cli.emit.family_wording import latex_ranges
from lagrange_cli.emit.latex import words as latex_words
from lagrange_cli.emit.latex.macros import MacroPrinter, Macros
from lagrange_cli.latex_allowlist import with_formulas
from lagrange_cli.notation.latex import LatexPrinter, latex_number
from lagrange_cli.notation.latex_escape import latex_text
from lagrange_cli.notation.layout import width
from lagrange_cli.notation.tree import DisplayNode

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.forms import Range

#: Columns of a matrix of amsmath, unless a document asks for more.
_MOST_COLUMNS = 10


class LatexLetters(DocumentLetters):
    """Letters of mathematics in LaTeX."""

    dot_product = r" \cdot "
    virtual_work = r"\delta W"
    comma = r",\quad "
    at_most_sign = r"\le"
    imaginary = r"\mathrm{i}"

    def __init__(self, equations: Equations, macros: Macros | None = None) -> None:
        super().__init__(equations)
        self._printer = LatexPrinter() if macros is None else MacroPrinter(macros)
        # Macros know by themselves what the scene says.
        self._names = self.written if macros is None else {}

    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return self._printer.name(name, order, latex or self.override(name))

    def vector(self, letter: str, order: int = 0) -> str:
        bold = rf"\mathbf{{{letter}}}"
        dots = ["", r"\dot", r"\ddot"][order]
        return f"{dots}{{{bold}}}_i" if order else f"{bold}_i"

    def bold(self, letter: str, order: int = 0) -> str:
        known = rf"\boldsymbol{{\{letter}}}" if len(letter) > 1 else rf"\mathbf{{{letter}}}"
        dots = ["", r"\dot", r"\ddot"][order]
        return f"{dots}{{{known}}}" if order else known

    def matrix(self, rows: Sequence[Sequence[str]]) -> str:
        lines = [" & ".join(row) for row in rows]
        tall = any(r"\frac" in line for line in lines)
        body = (r" \\[0.5em] " if tall else r" \\ ").join(lines)
        if len(rows[0]) <= _MOST_COLUMNS:
            return rf"\begin{{pmatrix}} {body} \end{{pmatrix}}"
        columns = "c" * len(rows[0])
        return rf"\left(\!\begin{{array}}{{{columns}}} {body} \end{{array}}\!\right)"

    def room(self, node: DisplayNode) -> float:
        return width(self._printer.pieces(node))

    def partial(self, of: str, by: str) -> str:
        return rf"\frac{{\partial {of}}}{{\partial {by}}}"

    def bracket(self, first: str, second: str) -> str:
        return rf"\lbrace {first}, {second}\rbrace"

    def rate(self, of: str) -> str:
        return rf"\frac{{\mathrm{{d}}}}{{\mathrm{{d}} t}} {of}"

    def differential(self, of: str) -> str:
        return rf"\frac{{\mathrm{{d}} {of}}}{{\mathrm{{d}} t}}"

    def virtual(self, of: str) -> str:
        return rf"\delta {of}"

    def square(self, of: str) -> str:
        return f"{of}^{{2}}"

    def size(self, of: str) -> str:
        return f"|{of}|"

    def below(self, letter: str, index: str) -> str:
        return f"{letter}_{{{index}}}"

    def total(self, index: str, body: str) -> str:
        return rf"\sum_{{{index}}} {body}"

    def times(self, first: str, second: str) -> str:
        return rf"{first} \, {second}"

    def at_least(self, of: str) -> str:
        return rf"{of} \ge 0"

    def named(self, name: str) -> str:
        return rf"\text{{{latex_text(name)}}}"

    def typed(self, text: str) -> str:
        return rf"\texttt{{{latex_text(text)}}}"

    def upright(self, phrase: str) -> str:
        return rf"\text{{{phrase}}}"

    def ranges(self, ranges: Sequence[Range]) -> str:
        return latex_ranges(ranges)

    def formula(self, node: DisplayNode) -> str:
        return self._printer.inline(node)

    def number(self, value: float) -> str:
        return latex_number(f"{value:.0e}") if value else "0"

    def inline(self, formula: str) -> str:
        return f"${formula}$"

    def words(self, text: str) -> str:
        return latex_text(text)

    def prose(self, text: str) -> str:
        return with_formulas(text, self.words, self.inline)

    def statement(self, text: str) -> str:
        return latex_words.scene_text_latex(text, self._names, self._printer)

    def unit(self, text: str) -> str:
        return latex_words.unit_latex(text)

    def value(self, number: float, literal: str | None = None) -> str:
        return latex_words.value_latex(number, literal)
