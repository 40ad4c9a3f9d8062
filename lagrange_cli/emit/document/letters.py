"""Letters of formats that documents are written in, and texts of a scene in these formats.

Of the scene's equations and units nothing is interpreted beyond tokens, and every token is printed
from a table or escaped, so that no text of a scene acts as a command.
"""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.steps.letters import Letters
from lagrange_cli.notation.symbols import multiplier_symbol
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.notation.typeset import TypesetPrinter
from lagrange_cli.notation.vocabulary import latex_overrides

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.forms import Range

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[^\W\d]\w*(?:\[[\w, +-]*\])?)"
    r"|(?P<sign>\*\*|>=|<=|[-+*/^()=,]))"
)

#: Kind and text.
_Token: TypeAlias = tuple[str, str]

_DOTS = {"dot": 1, "ddot": 2}
_OPERATORS = frozenset(("sqrt", "norm", "sum", *_DOTS))


@dataclass(frozen=True)
class SceneTextSpelling:
    """Spelling of the scene language in one format, beyond the format's printer.

    Attributes
    ----------
    printer
        Prints names, numbers and functions.
    over, at_least, at_most
        Signs of a division on the line, ≥, and ≤.
    operator
        Function of the scene language whose argument is no formula, as ``{}``.
    """

    printer: TypesetPrinter
    over: str
    at_least: str
    at_most: str
    operator: str

    def formula(self, text: str, names: Mapping[str, str]) -> str | None:
        """Write an equation or expression of the scene language; None for any other text.

        ``names``: LaTeX of names that do not print as their letters.
        """
        tokens = _tokens(text)
        return None if tokens is None else "".join(self._shown(tokens, names)).strip()

    def _shown(self, tokens: list[_Token], names: Mapping[str, str]) -> Iterator[str]:
        index = 0
        while index < len(tokens):
            kind, token = tokens[index]
            index += 1
            if token in ("^", "**"):
                end = self._operand_end(tokens, index)
                inner = tokens[index:end]
                if len(inner) > 2 and inner[0][1] == "(" and inner[-1][1] == ")":
                    inner = inner[1:-1]
                yield self.printer.raised("".join(self._shown(inner, names)).strip())
                index = end
            elif token in _DOTS and _is_of_a_name(tokens, index):
                name = tokens[index + 1][1]
                yield self.printer.name(name, _DOTS[token], names.get(name))
                index += 3
            else:
                yield self._one(kind, token, names)

    def _operand_end(self, tokens: list[_Token], start: int) -> int:
        """Return the end of the exponent at ``start``: a sign, then a token or group."""
        end, depth = start, 0
        while end < len(tokens):
            token = tokens[end][1]
            end += 1
            depth += (token == "(") - (token == ")")
            calls = end < len(tokens) and tokens[end][1] == "(" and token in self.printer.functions
            if depth <= 0 and token not in "+-" and not calls:
                break
        return end

    def _one(self, kind: str, token: str, names: Mapping[str, str]) -> str:
        if kind == "number":
            return self.printer.decimal(token)
        if kind == "sign":
            shown = {"*": self.printer.thin.strip(), "/": self.over}
            shown |= {">=": self.at_least, "<=": self.at_most}
            return token if token in "()" else f" {shown.get(token, token)} ".replace(" ,", ",")
        if token in self.printer.functions:
            return self.printer.functions[token]
        if token in _OPERATORS:
            return self.operator.format(token)
        if token == "pi":
            return self.printer.pi
        return self.printer.name(token, 0, names.get(token))


def _tokens(text: str) -> list[_Token] | None:
    """Return the tokens; None if the text is not in the scene language."""
    tokens, position = [], 0
    while text[position:].strip():
        token = _TOKEN.match(text, position)
        if token is None or token.lastgroup is None:
            return None
        tokens.append((token.lastgroup, token[token.lastgroup]))
        position = token.end()
    return tokens


def _is_of_a_name(tokens: list[_Token], start: int) -> bool:
    """Say whether a name between parentheses begins at ``start``."""
    group = tokens[start : start + 3]
    return [token for _, token in group[::2]] == ["(", ")"] and group[1][0] == "name"


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
        """Return the scene's LaTeX of a name; the name of a multiplier is ``lambda(rod)``."""
        return self.written.get(multiplier_symbol(name))

    @abstractmethod
    def upright(self, phrase: str) -> str:
        """Return words of the program within a formula."""

    @abstractmethod
    def typed(self, text: str) -> str:
        """Return a text typed on a command line, within a sentence."""

    @abstractmethod
    def statement(self, text: str) -> str:
        """Return an equation or inequality as the scene writes it, within a sentence."""

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
