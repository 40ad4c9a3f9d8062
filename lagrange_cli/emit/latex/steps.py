"""Sections of a board as LaTeX: sentences, displayed laws, aligned formulas."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

from lagrange_cli.emit.latex.typesetter import LINE, FormulaRow, Typesetter
from lagrange_cli.emit.steps.letters import Letters
from lagrange_cli.emit.steps.sections import Block, Formula, Formulas, Law, Section, Title
from lagrange_cli.notation.latex import LatexPrinter, latex_number
from lagrange_cli.notation.latex_escape import latex_text
from lagrange_cli.notation.layout import Piece, prefixed, suffixed, width
from lagrange_cli.notation.symbols import latex_name
from lagrange_cli.notation.tree import DisplayNode

#: What takes no room of its own in a general formula.
_NO_ROOM = re.compile(r"\\(?:mathbf|mathrm|text|dot|ddot|[dt]?frac)\b|\\,|[{}_^ ]|\\(?=[a-zA-Z])")


class LatexLetters(Letters):
    """Letters of mathematics in LaTeX."""

    dot_product = r" \cdot "
    virtual_work = r"\delta W"

    def symbol(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return latex_name(name, order, latex)

    def vector(self, letter: str, order: int = 0) -> str:
        bold = rf"\mathbf{{{letter}}}"
        dots = ["", r"\dot", r"\ddot"][order]
        return f"{dots}{{{bold}}}_i" if order else f"{bold}_i"

    def partial(self, of: str, by: str) -> str:
        return rf"\frac{{\partial {of}}}{{\partial {by}}}"

    def rate(self, of: str) -> str:
        return rf"\frac{{\mathrm{{d}}}}{{\mathrm{{d}} t}} {of}"

    def virtual(self, of: str) -> str:
        return rf"\delta {of}"

    def square(self, of: str) -> str:
        return f"{of}^{{2}}"

    def below(self, letter: str, index: str) -> str:
        return f"{letter}_{{{index}}}"

    def total(self, index: str, body: str) -> str:
        return rf"\sum_{{{index}}} {body}"

    def times(self, first: str, second: str) -> str:
        return rf"{first} \, {second}"

    def named(self, name: str) -> str:
        return rf"\text{{{latex_text(name)}}}"

    def formula(self, node: DisplayNode) -> str:
        return LatexPrinter().inline(node)

    def number(self, value: float) -> str:
        return latex_number(f"{value:.0e}") if value else "0"

    def inline(self, formula: str) -> str:
        return f"${formula}$"

    def words(self, text: str) -> str:
        return latex_text(text)


def section_lines(setter: Typesetter, section: Section) -> list[str]:
    """The heading of a section and its blocks."""
    return [rf"\section*{{{section.heading}}}", *block_lines(setter, section.blocks)]


def block_lines(setter: Typesetter, blocks: Iterable[Block]) -> list[str]:
    """Blocks without a heading."""
    return [line for block in blocks for line in _block(setter, block)]


def _block(setter: Typesetter, block: Block) -> list[str]:
    if isinstance(block, Formulas):
        return setter.align(formula_rows(setter, block), numbered=block.result)
    if isinstance(block, Law):
        return [rf"\[ {block.text} \]"]
    return ["", block.text] if isinstance(block, Title) else [block.text]


def formula_rows(setter: Typesetter, block: Formulas) -> list[FormulaRow]:
    """Rows of an ``align``, one or more for each formula."""
    return [part for row in block.rows for part in _rows(setter, row)]


def _rows(setter: Typesetter, row: Formula) -> list[FormulaRow]:
    """A formula on one line, or each of its sides on a line where they are too long together."""
    bodies = [setter.tree(node) for node in row.chain]
    if not row.label:
        return [FormulaRow("", suffixed(bodies[0], " = 0", 3))]
    middle = [[Piece(row.middle, _width(row.middle))]] if row.middle else []
    sides = [prefixed(side, "= ", 3) for side in (*middle, *bodies)] or [[Piece("", 0)]]
    whole = [piece for side in sides for piece in (replace(side[0], separator=" "), *side[1:])]
    if width(whole) <= LINE:
        return [FormulaRow(row.label, [replace(whole[0], separator=""), *whole[1:]])]
    labels = [row.label, *("" for _ in sides[1:])]
    last = len(sides) - 1
    return [
        FormulaRow(label, side, ends=number == last)
        for number, (label, side) in enumerate(zip(labels, sides, strict=True))
    ]


def _width(formula: str) -> float:
    """Columns of half an em that a general formula takes, near enough to break lines by."""
    return len(re.sub(r"[a-z]{2,}", "x", _NO_ROOM.sub("", formula)))
