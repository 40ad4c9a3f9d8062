"""Expressions as readable Unicode text: ``½ M (ṙ² + r² θ̇²)``."""

from __future__ import annotations

from collections.abc import Sequence
from unicodedata import normalize

from lagrange_cli.notation.layout import Piece, columns, joined, prefixed
from lagrange_cli.notation.printers.one_line import OneLinePrinter, argument_list, group, solid
from lagrange_cli.notation.symbols import above, below, split_name, text_name, with_indices_below
from lagrange_cli.notation.tree import (
    DisplayCall,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayRange,
    DisplayRoot,
    DisplaySymbol,
    factors_of,
    is_rate,
)

#: Characters of fractions by what else would be written: ``1/2``.
_VULGAR = {normalize("NFKC", c).replace("⁄", "/"): c for c in "½⅓⅔¼¾⅕⅖⅗⅘⅙⅚⅛⅜⅝⅞"}

_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")

#: Functions whose power stands at the name, and whose argument needs no
#: parentheses where it is one letter.
_NAMED_POWERS = frozenset(("sin", "cos", "tan", "sinh", "cosh", "tanh"))


class UnicodePrinter(OneLinePrinter):
    """Greek letters, dots, superscripts; factors stand side by side.

    Parameters
    ----------
    lowered
        Indices stand below the line, as on pages with families: ``uᵢ₊₁``, ``u₂``.
    """

    times = " "
    lead = "· "
    over = " / "
    pi = "π"

    def __init__(self, *, lowered: bool = False) -> None:
        super().__init__()
        self.lowered = lowered

    def number(self, node: DisplayNumber) -> str:
        plain = super().number(node)
        return _VULGAR.get(plain, plain)

    def symbol(self, name: str, order: int = 0) -> str:
        text = text_name(name, order)
        return with_indices_below(text) if self.lowered else text

    def sigma(self, ranges: Sequence[DisplayRange]) -> tuple[str, float]:
        text = "".join(f"{_sigma(index)} " for index in _conditions(ranges))
        return text, columns(text)

    def separator(self, before: DisplayNode, after: str) -> str:
        return " · " if after[0].isdigit() else self.times

    def product(self, node: DisplayNode) -> list[Piece]:
        """Return a product; a part without its own sign divides at the end: ``m l² / 12``."""
        head, *others = factors_of(node)
        if not isinstance(head, DisplayNumber) or head.numerator != 1:
            return super().product(node)
        if "/" not in self.number(head):
            return super().product(node)
        return [*self.factors(tuple(others)), *self.divided(solid(str(head.denominator)))]

    def call(self, node: DisplayCall, power: str, *, closed: bool) -> list[Piece]:
        arguments = self.arguments(node)
        if node.function == "abs":
            return group(arguments[0], "|", "|")
        if is_rate(node):
            return solid(self.symbol(node.function, node.order or 0))
        name = _function_name(node) + power
        if node.function in _NAMED_POWERS and not closed and _is_letter(node.arguments[0]):
            name += "" if power else " "
            return prefixed(arguments[0], name, columns(name))
        return prefixed(group(argument_list(arguments)), name, columns(name))

    def enclosed_call(self, node: DisplayCall) -> list[Piece]:
        body = self.call(node, "", closed=False)
        return body if node.function == "abs" else self.group(body)

    def takes_power(self, node: DisplayCall, exponent: DisplayNode) -> bool:
        return node.function in _NAMED_POWERS and _is_natural(exponent)

    def root(self, node: DisplayRoot) -> list[Piece]:
        radicand = node.radicand
        if isinstance(radicand, DisplayNumber) and radicand.denominator == 1:
            return solid("√" + self.number(radicand))
        return prefixed(group(self.pieces(radicand)), "√", 1)

    def exponent(self, node: DisplayNode) -> str:
        if _is_natural(node):
            return joined(self.pieces(node)).translate(_SUPERSCRIPTS)
        if isinstance(node, DisplayNumber) and node.literal is None:
            return f"^({node.numerator}/{node.denominator})"
        inner = joined(self.pieces(node))
        return f"^{inner}" if isinstance(node, DisplaySymbol) else f"^({inner})"


def _conditions(ranges: Sequence[DisplayRange]) -> list[DisplayRange]:
    """Return the indices that get a sign of their own: of pairs i < j only the second."""
    named = {r.after for r in ranges}
    return [r for r in ranges if r.letter not in named]


def _sigma(index: DisplayRange) -> str:
    """``Σᵢ₌₁ⁿ``, ``Σᵢ<ⱼ``, ``Σⱼ≠ᵢ``; with brackets where Unicode lacks a letter."""
    condition = f"{index.after}<{index.letter}" if index.after else ""
    if index.besides and index.is_whole:
        condition = f"{index.letter}≠{index.besides}"
    if condition:
        return "Σ" + (below(condition) or f"[{condition}]")
    exception = f",{index.letter}≠{index.besides}" if index.besides else ""
    low, high = below(f"{index.letter}={index.first}{exception}"), above(index.last)
    if low is None or high is None:
        return f"Σ[{index.letter}={index.first}..{index.last}{exception}]"
    return f"Σ{low}{high}"


def _is_natural(node: DisplayNode) -> bool:
    return isinstance(node, DisplayNumber) and node.denominator == 1 and node.literal is None


def _is_letter(node: DisplayNode) -> bool:
    return isinstance(node, DisplayPi) or (
        isinstance(node, DisplaySymbol) and split_name(node.name).is_letter
    )


def _function_name(node: DisplayCall) -> str:
    """Return the name of a function, with Greek letters and primes for one of the scene."""
    if node.order is None:
        return "ln" if node.function == "log" else node.function
    return text_name(node.function) + ("′" * node.order).replace("′′", "″")
