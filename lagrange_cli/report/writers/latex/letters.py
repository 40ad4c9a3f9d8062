"""Letters of mathematics in LaTeX: symbols, their macros, texts of a scene within sentences."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from lagrange_cli.latex_allowlist import with_formulas
from lagrange_cli.notation.layout import width
from lagrange_cli.notation.printers.latex import LatexPrinter, latex_number
from lagrange_cli.notation.printers.typeset import WIDEST_PART
from lagrange_cli.notation.symbols import latex_name, latex_text, multiplier_symbol, split_name
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.report.letters import Letters
from lagrange_cli.report.ranges import latex_ranges

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.forms import Range

_MACRO = re.compile(r"\\[A-Za-z]+")

_DIGITS = ["Zero", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine"]
_DOTS = ("", r"[\dot]", r"[\ddot]")


@dataclass(frozen=True)
class Macros:
    """The macros of a document.

    Attributes
    ----------
    written
        Name → what the scene says that it prints as.
    defined
        What a macro stands for, with ``#1`` for its dots → the macro.
    """

    written: Mapping[str, str]
    defined: dict[str, str] = field(default_factory=dict)

    def name(self, name: str, order: int = 0, latex: str | None = None) -> str:
        """Return a name with dots over it: ``\\symtheta[\\dot]``."""
        override = latex or self.written.get(multiplier_symbol(name))
        meaning = latex_name(name, 1, override).replace(r"\dot{", "#1{", 1)
        if meaning not in self.defined:
            self.defined[meaning] = self._free(name, is_letter=bool(override))
        return self.defined[meaning] + _DOTS[order]

    def _free(self, name: str, *, is_letter: bool) -> str:
        """Return a macro that no other symbol has; words begin as words do, to stand apart."""
        letters = "".join(map(_spelled, multiplier_symbol(name)))
        opening = "sym" if is_letter or split_name(name).is_letter else "word"
        macro = rf"\{opening}{letters}"
        while macro in self.defined.values():
            macro += "X"
        return macro

    def definitions(self, stem: str, body: Iterable[str]) -> list[str]:
        """Definitions of what stands in a body, which leave alone what is defined already."""
        used = set(_MACRO.findall("\n".join(body)))
        return [
            f"% Letters of the symbols. Those that {stem}-symbols.tex defines, or your preamble"
            " before, stay.",
            rf"\InputIfFileExists{{{stem}-symbols}}{{}}{{}}",
            *(
                rf"\providecommand{{{m}}}[1][]{{{meaning}}}"
                for meaning, m in self.defined.items()
                if m in used
            ),
        ]


def _spelled(character: str) -> str:
    """Return a character of a name in letters, which are all that a macro may have."""
    if character.isascii() and character.isdigit():
        return _DIGITS[int(character)]
    if character.isascii():
        return character if character.isalpha() else ""
    return "U" + "".join(_DIGITS[int(d)] for d in str(ord(character)))


class MacroPrinter(LatexPrinter):
    """LaTeX with a macro for each symbol."""

    word_openings: tuple[str, ...] = (*LatexPrinter.word_openings, r"\word")

    def __init__(self, macros: Macros, widest: float = WIDEST_PART) -> None:
        super().__init__(widest)
        self._macros = macros

    def name(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return self._macros.name(name, order, latex)


_UNIT = re.compile(
    r"(?P<space>[\s*·.]+)|(?P<power>\^(?:\((?P<grouped>[+-]?\d+)\)|(?P<exponent>[+-]?\d+)))"
    r"|(?P<over>/)|(?P<word>[A-Za-zµμΩ°%]+)|(?P<one>1)|(?P<paren>[()])"
)


def unit_latex(text: str) -> str:
    """Write a unit in upright letters: ``kg*m^2/s`` as kg m²/s; other text as it is."""
    shown, position = [], 0
    text = text.strip().replace("**", "^")
    while position < len(text):
        match = _UNIT.match(text, position)
        if match is None:
            return latex_text(text)
        position = match.end()
        shown.append(_unit_part(match))
    return f"${''.join(shown)}$" if shown else ""


def _unit_part(match: re.Match[str]) -> str:
    kind = match.lastgroup
    if match["power"]:
        return f"^{{{match['grouped'] or match['exponent']}}}"
    if kind == "space":
        return r"\,"
    if kind == "word":
        return rf"\text{{{latex_text(match['word'])}}}"
    return match[0]


#: Columns of a matrix of amsmath, unless a document asks for more.
_MOST_COLUMNS = 10


class LatexLetters(Letters):
    """Letters of mathematics in LaTeX."""

    cross_product = r" \times "
    dot_product = r" \cdot "
    virtual_work = r"\delta W"
    comma = r",\quad "
    at_least_sign = r"\ge"
    at_most_sign = r"\le"
    imaginary = r"\mathrm{i}"

    def __init__(self, equations: Equations | None = None, macros: Macros | None = None) -> None:
        super().__init__(equations)
        self._printer = LatexPrinter() if macros is None else MacroPrinter(macros)

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

    def partial(self, symbol: str, by: str) -> str:
        return rf"\frac{{\partial {symbol}}}{{\partial {by}}}"

    def bracket(self, first: str, second: str) -> str:
        return rf"\lbrace {first}, {second}\rbrace"

    def rate(self, symbol: str) -> str:
        return rf"\frac{{\mathrm{{d}}}}{{\mathrm{{d}} t}} {symbol}"

    def differential(self, symbol: str) -> str:
        return rf"\frac{{\mathrm{{d}} {symbol}}}{{\mathrm{{d}} t}}"

    def virtual(self, symbol: str) -> str:
        return rf"\delta {symbol}"

    def square(self, symbol: str) -> str:
        return f"{symbol}^{{2}}"

    def routhian(self) -> str:
        return r"\mathcal{R}"

    def size(self, symbol: str) -> str:
        return f"|{symbol}|"

    def below(self, letter: str, index: str) -> str:
        return f"{letter}_{{{index}}}"

    def total(self, index: str, body: str) -> str:
        return rf"\sum_{{{index}}} {body}"

    def times(self, first: str, second: str) -> str:
        return rf"{first} \, {second}"

    def at_least(self, symbol: str) -> str:
        return rf"{symbol} \ge 0"

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

    def unit(self, text: str) -> str:
        return unit_latex(text)

    def digits(self, text: str) -> str:
        sign = "-" if text.startswith("-") else ""
        return sign + latex_number(text.removeprefix("-"))
