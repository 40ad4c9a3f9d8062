"""Expressions as readable Unicode text: ``½ M (ṙ² + r² θ̇²)``."""

from __future__ import annotations

from unicodedata import normalize

from lagrange_cli.notation.layout import Piece, columns, joined, prefixed
from lagrange_cli.notation.one_line import OneLinePrinter, argument_list, group, solid
from lagrange_cli.notation.symbols import split_name, text_name
from lagrange_cli.notation.tree import (
    DisplayCall,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayRoot,
    DisplaySymbol,
    factors_of,
)

#: Characters of fractions by what else would be written: ``1/2``.
_VULGAR = {normalize("NFKC", c).replace("⁄", "/"): c for c in "½⅓⅔¼¾⅕⅖⅗⅘⅙⅚⅛⅜⅝⅞"}

_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")

#: Functions whose power stands at the name, and whose argument needs no
#: parentheses where it is one letter.
_NAMED_POWERS = frozenset(("sin", "cos", "tan", "sinh", "cosh", "tanh"))


class UnicodePrinter(OneLinePrinter):
    """Greek letters, dots, superscripts; factors stand side by side."""

    times = " "
    lead = "· "
    over = " / "
    pi = "π"

    def number(self, node: DisplayNumber) -> str:
        plain = super().number(node)
        return _VULGAR.get(plain, plain)

    def symbol(self, name: str, order: int = 0) -> str:
        return text_name(name, order)

    def separator(self, before: DisplayNode, after: str) -> str:
        return " · " if after[0].isdigit() else self.times

    def product(self, node: DisplayNode) -> list[Piece]:
        """A number that has no sign of its own divides at the end: ``5 m l² / 12``."""
        head, *others = factors_of(node)
        if not isinstance(head, DisplayNumber) or "/" not in self.number(head):
            return super().product(node)
        above = others if head.numerator == 1 else [_integer(head), *others]
        return [*self.factors(tuple(above)), *self.divided(solid(str(head.denominator)))]

    def call(self, node: DisplayCall, power: str, *, closed: bool) -> list[Piece]:
        name = _function_name(node) + power
        arguments = [self.pieces(a) for a in node.arguments]
        if node.function in _NAMED_POWERS and not closed and _is_letter(node.arguments[0]):
            name += "" if power else " "
            return prefixed(arguments[0], name, columns(name))
        return prefixed(group(argument_list(arguments)), name, columns(name))

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


def _integer(number: DisplayNumber) -> DisplayNumber:
    return DisplayNumber(number.numerator, 1, number.traits)


def _is_natural(node: DisplayNode) -> bool:
    return isinstance(node, DisplayNumber) and node.denominator == 1 and node.literal is None


def _is_letter(node: DisplayNode) -> bool:
    return isinstance(node, DisplayPi) or (
        isinstance(node, DisplaySymbol) and split_name(node.name).is_letter
    )


def _function_name(node: DisplayCall) -> str:
    """The name of a function, with Greek letters and primes for one of the scene."""
    if node.order is None:
        return "ln" if node.function == "log" else node.function
    return text_name(node.function) + ("′" * node.order).replace("′′", "″")
