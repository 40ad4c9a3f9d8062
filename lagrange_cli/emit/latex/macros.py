"""A macro for each symbol, so that a letter is changed at one place."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from lagrange_cli.notation.latex import LatexPrinter
from lagrange_cli.notation.symbols import latex_name, multiplier_symbol, split_name
from lagrange_cli.notation.typeset import WIDEST_PART

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
        """A name with dots over it: ``\\symtheta[\\dot]``."""
        override = latex or self.written.get(multiplier_symbol(name))
        meaning = latex_name(name, 1, override).replace(r"\dot{", "#1{", 1)
        if meaning not in self.defined:
            self.defined[meaning] = self._free(name, is_letter=bool(override))
        return self.defined[meaning] + _DOTS[order]

    def _free(self, name: str, *, is_letter: bool) -> str:
        """A macro that no other symbol has; words begin as words do, to stand apart."""
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
    """A character of a name in letters, which are all that a macro may have."""
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
