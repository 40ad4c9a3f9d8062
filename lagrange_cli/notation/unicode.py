"""Expressions as readable Unicode text: ``½ M (ṙ² + r² θ̇²)``."""

from __future__ import annotations

from lagrange_cli.notation.layout import Piece, joined, prefixed
from lagrange_cli.notation.one_line import LinearPrinter, columns, group, listed, solid
from lagrange_cli.notation.symbols import split_name, text_name
from lagrange_cli.notation.tree import Atom, Call, Node, Number, Pi, Root, factors_of

__all__ = ["FormulaPrinter"]

_VULGAR = {
    (1, 2): "½",
    (1, 3): "⅓",
    (2, 3): "⅔",
    (1, 4): "¼",
    (3, 4): "¾",
    (1, 5): "⅕",
    (2, 5): "⅖",
    (3, 5): "⅗",
    (4, 5): "⅘",
    (1, 6): "⅙",
    (5, 6): "⅚",
    (1, 8): "⅛",
    (3, 8): "⅜",
    (5, 8): "⅝",
    (7, 8): "⅞",
}

_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")

#: How each function of the scene language is written.
CALLS = {
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "asin": "asin",
    "acos": "acos",
    "atan": "atan",
    "atan2": "atan2",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
    "asinh": "asinh",
    "acosh": "acosh",
    "atanh": "atanh",
    "exp": "exp",
    "log": "ln",
    "abs": "abs",
    "sign": "sign",
    "min": "min",
    "max": "max",
}

#: Functions whose power stands at the name, and whose argument needs no
#: parentheses where it is one letter.
_NAMED_POWERS = frozenset(("sin", "cos", "tan", "sinh", "cosh", "tanh"))


class FormulaPrinter(LinearPrinter):
    """Greek letters, dots, superscripts; factors stand side by side."""

    times = " "
    lead = "· "
    over = " / "

    def number(self, node: Number) -> str:
        if node.literal is not None:
            return node.literal
        if node.denominator == 1:
            return str(node.numerator)
        plain = f"{node.numerator}/{node.denominator}"
        return _VULGAR.get((node.numerator, node.denominator), plain)

    def symbol(self, name: str, order: int = 0) -> str:
        return text_name(name, order)

    def pi(self) -> str:
        return "π"

    def separator(self, before: Node, after: str) -> str:
        return " · " if after[0].isdigit() else self.times

    def product(self, node: Node) -> list[Piece]:
        """A number that has no sign of its own divides at the end: ``5 m l² / 12``."""
        head, *others = factors_of(node)
        if not isinstance(head, Number) or "/" not in self.number(head):
            return super().product(node)
        above = others if head.numerator == 1 else [_integer(head), *others]
        return [*self.factors(tuple(above)), *self.divided(solid(str(head.denominator)))]

    def call(self, node: Call, power: str, *, closed: bool) -> list[Piece]:
        name = CALLS[node.function] + power
        arguments = [self.pieces(a) for a in node.arguments]
        if node.function in _NAMED_POWERS and not closed and _is_letter(node.arguments[0]):
            name += "" if power else " "
            return prefixed(arguments[0], name, columns(name))
        return prefixed(group(listed(arguments)), name, columns(name))

    def takes_power(self, node: Call, exponent: Node) -> bool:
        return node.function in _NAMED_POWERS and _is_natural(exponent)

    def root(self, node: Root) -> list[Piece]:
        radicand = node.radicand
        if isinstance(radicand, Number) and radicand.denominator == 1:
            return solid("√" + self.number(radicand))
        return prefixed(group(self.pieces(radicand)), "√", 1)

    def exponent(self, node: Node) -> str:
        if _is_natural(node):
            return joined(self.pieces(node)).translate(_SUPERSCRIPTS)
        if isinstance(node, Number) and node.literal is None:
            return f"^({node.numerator}/{node.denominator})"
        inner = joined(self.pieces(node))
        return f"^{inner}" if isinstance(node, Atom) else f"^({inner})"


def _integer(number: Number) -> Number:
    return Number(number.numerator, 1, number.traits)


def _is_natural(node: Node) -> bool:
    return isinstance(node, Number) and node.denominator == 1 and node.literal is None


def _is_letter(node: Node) -> bool:
    return isinstance(node, Pi) or (isinstance(node, Atom) and split_name(node.name).is_letter)
