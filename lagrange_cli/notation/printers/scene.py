"""Display trees in the language of scenes, which plain ASCII text has, too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from lagrange_cli.notation.layout import Piece, columns, joined, prefixed
from lagrange_cli.notation.printers.one_line import OneLinePrinter, argument_list, group, solid
from lagrange_cli.notation.symbols import DOT_WORDS, multiplier_symbol
from lagrange_cli.notation.tree import (
    DisplayCall,
    DisplayNode,
    DisplayNumber,
    DisplayRange,
    DisplayRate,
    DisplayRoot,
    DisplaySeries,
    DisplaySymbol,
)
from lagrange_cli.scene.language.expression import CONDITIONS


class ScenePrinter(OneLinePrinter):
    """``(M + m)*ddot(r) - M*r*dot(theta)^2 + m*g``."""

    at_least = ">="
    relations: ClassVar = {relation: relation for relation in CONDITIONS}

    def symbol(self, name: str, order: int = 0) -> str:
        return f"{DOT_WORDS[order]}({name})" if order else multiplier_symbol(name)

    def call(self, node: DisplayCall, power: str, *, closed: bool) -> list[Piece]:
        name = node.function + "'" * (node.order or 0)
        return _applied(name, self.arguments(node))

    def takes_power(self, node: DisplayCall, exponent: DisplayNode) -> bool:
        return False

    def enclosed_call(self, node: DisplayCall) -> list[Piece]:
        return self.call(node, "", closed=True)

    def series(self, node: DisplayNode) -> list[Piece]:
        """Return a sum, or two beside each other where an index is left out between them."""
        assert isinstance(node, DisplaySeries)
        parts = _without_exceptions(node.ranges)
        sums = [[self.pieces(node.body), *(solid(_range(r)) for r in part)] for part in parts]
        first, *others = [_applied("sum", arguments) for arguments in sums]
        for more in others:
            head = replace(more[0], separator=" + ", lead="+ ", width=more[0].width + 3, depth=0)
            first = [*first, head, *more[1:]]
        return self.group(first) if others else first

    def sigma(self, ranges: Sequence[DisplayRange]) -> tuple[str, float]:
        text = ", ".join(map(_range, ranges))
        return text, columns(text)

    def root(self, node: DisplayRoot) -> list[Piece]:
        return _applied("sqrt", [self.pieces(node.radicand)])

    def rate(self, node: DisplayRate) -> list[Piece]:
        return _applied(DOT_WORDS[1], [self.pieces(node.quantity)])

    def exponent(self, node: DisplayNode) -> str:
        simple = isinstance(node, DisplaySymbol) or (
            isinstance(node, DisplayNumber) and node.denominator == 1
        )
        inner = joined(self.pieces(node))
        return f"^{inner}" if simple else f"^({inner})"


def _range(index: DisplayRange) -> str:
    return f"{index.letter}={index.first}..{index.last}"


def _without_exceptions(ranges: Sequence[DisplayRange]) -> list[tuple[DisplayRange, ...]]:
    """Return ranges before and after what an index is not equal to."""
    if not ranges:
        return [()]
    head, *others = ranges
    heads = [head]
    if head.besides:
        before, after = f"{head.besides}-1", f"{head.besides}+1"
        heads = [replace(head, last=before), replace(head, first=after)]
    return [(h, *tail) for h in heads for tail in _without_exceptions(others)]


def _applied(function: str, arguments: list[list[Piece]]) -> list[Piece]:
    return prefixed(group(argument_list(arguments)), function, columns(function))
