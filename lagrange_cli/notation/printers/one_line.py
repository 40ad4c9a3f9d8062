"""One-line printing of a display tree, shared by all text formats."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

from lagrange_cli.notation.layout import (
    FACTOR_DEPTH,
    Piece,
    columns,
    deeper,
    joined,
    prefixed,
    suffixed,
    width,
)
from lagrange_cli.notation.tree import (
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplayRange,
    DisplayRate,
    DisplayRoot,
    DisplaySeries,
    DisplaySum,
    DisplaySymbol,
    factors_of,
)
from lagrange_cli.scene.language.expression import CONDITIONS


def solid(text: str) -> list[Piece]:
    return [Piece(text, columns(text))]


def group(pieces: list[Piece], opening: str = "(", closing: str = ")") -> list[Piece]:
    """Return the pieces within parentheses."""
    return suffixed(prefixed(deeper(pieces), opening, 1), closing, 1)


def argument_list(arguments: list[list[Piece]], comma: str = ", ") -> list[Piece]:
    """Return arguments with commas between them, to be broken only after all else."""
    pieces = [
        piece
        for index, argument in enumerate(arguments)
        for piece in (suffixed(argument, comma, 2) if index + 1 < len(arguments) else argument)
    ]
    return deeper(pieces, 3)


class OneLinePrinter(ABC):
    """Printer that walks a tree; subclasses write its parts in their format.

    ``times`` and ``over`` stand between factors and at a division; ``lead``
    begins a line that continues a product. ``times_width`` and ``sign_width``
    are the widths of signs between factors and terms; ``negation`` stands before a negative
    first term; ``at_least`` is the sign of gaps, ``pi`` the number π. ``relations`` are the signs
    in conditions.
    """

    times = "*"
    times_width = 1.0
    sign_width = 3.0
    negation = "-"
    lead = "*"
    over = "/"
    pi = "pi"
    at_least = "\N{GREATER-THAN OR EQUAL TO}"
    relations: ClassVar[Mapping[str, str]] = {
        ">=": "\N{GREATER-THAN OR EQUAL TO}",
        "<=": "\N{LESS-THAN OR EQUAL TO}",
        ">": ">",
        "<": "<",
    }

    def __init__(self) -> None:
        self._rows: dict[type, Callable[[DisplayNode], list[Piece]]] = {
            DisplaySum: self.sum,
            DisplayProduct: self.product,
            DisplayFraction: self.fraction,
            DisplayPower: self.power,
            DisplaySeries: self.series,
        }

    def inline(self, node: DisplayNode) -> str:
        return joined(self.pieces(node))

    def pieces(self, node: DisplayNode) -> list[Piece]:
        row = self._rows.get(type(node))
        return row(node) if row else self.factor(node, closed=False)

    # -- what formats define --------------------------------------------------

    @abstractmethod
    def symbol(self, name: str, order: int = 0) -> str:
        """Return a name with its dots."""

    @abstractmethod
    def call(self, node: DisplayCall, power: str, *, closed: bool) -> list[Piece]:
        """Return a function, to a power (``""``: none) where :meth:`takes_power`.

        ``closed`` asks for parentheses around the argument.
        """

    @abstractmethod
    def takes_power(self, node: DisplayCall, exponent: DisplayNode) -> bool:
        """Tell whether the exponent stands at the function's name (``sin²θ``)."""

    @abstractmethod
    def sigma(self, ranges: Sequence[DisplayRange]) -> tuple[str, float]:
        """Return the signs of a sum over indices, and their width."""

    @abstractmethod
    def root(self, node: DisplayRoot) -> list[Piece]:
        """Return a square root."""

    @abstractmethod
    def exponent(self, node: DisplayNode) -> str:
        """Return an exponent, with its sign of exponentiation."""

    def number(self, node: DisplayNumber) -> str:
        """Return a number, as a factor: as the scene wrote it, or exactly."""
        if node.literal is not None:
            return node.literal
        if node.denominator == 1:
            return str(node.numerator)
        return f"{node.numerator}/{node.denominator}"

    def group(self, pieces: list[Piece]) -> list[Piece]:
        """Return the pieces within parentheses."""
        return group(pieces)

    def rate(self, node: DisplayRate) -> list[Piece]:
        """Return the time derivative of a quantity, not carried out."""
        return prefixed(self.group(self.pieces(node.quantity)), "d/dt ", 5)

    def sign(self, negative: bool) -> tuple[str, str]:
        """Return the sign of a further term: within a line, and at the beginning of one."""
        sign = "-" if negative else "+"
        return f" {sign} ", f"{sign} "

    def superscript(self, base: str, exponent: str) -> str:
        """Return a base, or its end, with its exponent."""
        return base + exponent

    def columns(self, text: str) -> float:
        """Return the width of a printed text."""
        return columns(text)

    # -- structure --------------------------------------------------------------

    def sum(self, node: DisplayNode) -> list[Piece]:
        assert isinstance(node, DisplaySum)
        result: list[Piece] = []
        for term in node.terms:
            body = self.pieces(term.node)
            if not result:
                result.extend(prefixed(body, self.negation, 1) if term.negative else body)
                continue
            separator, lead = self.sign(term.negative)
            head = replace(
                body[0],
                separator=separator,
                lead=lead,
                width=body[0].width + self.sign_width,
                depth=0,
            )
            result.extend((head, *body[1:]))
        return result

    def product(self, node: DisplayNode) -> list[Piece]:
        return self.factors(factors_of(node))

    def factors(self, factors: tuple[DisplayNode, ...]) -> list[Piece]:
        result: list[Piece] = []
        for index, factor in enumerate(factors):
            following = factors[index + 1] if index + 1 < len(factors) else None
            body = self.factor(factor, closed=_opens(following))
            if following is not None and self.is_open(factor):
                body = self.group(body)
            if result:
                separator = self.separator(factors[index - 1], body[0].text)
                body[0] = replace(
                    body[0],
                    separator=separator,
                    lead=self.lead,
                    width=body[0].width + self.times_width,
                    depth=FACTOR_DEPTH,
                )
            result.extend(body)
        return result

    def is_open(self, node: DisplayNode) -> bool:
        """Tell whether a factor takes in what follows it, but for parentheses."""
        return isinstance(node, DisplaySeries)

    def separator(self, before: DisplayNode, after: str) -> str:
        """Text between a factor and the next one."""
        return self.times

    def series(self, node: DisplayNode) -> list[Piece]:
        """Return a sum over indices; what it sums reaches up to the next term."""
        assert isinstance(node, DisplaySeries)
        text, size = self.sigma(node.ranges)
        body = self.pieces(node.body)
        if isinstance(node.body, DisplaySum):
            body = self.group(body)
        return prefixed(body, text, size)

    def factor(self, node: DisplayNode, *, closed: bool) -> list[Piece]:
        """Return a part of a product, in parentheses where it needs them."""
        if isinstance(node, DisplaySeries):
            return self.series(node)
        if isinstance(node, (DisplaySum, DisplayFraction, DisplayProduct)):
            return self.group(self.pieces(node))
        if isinstance(node, DisplayPower):
            return self.power(node, closed=closed)
        if isinstance(node, DisplayCall):
            return self.call(node, "", closed=closed)
        if isinstance(node, DisplayRoot):
            return self.root(node)
        if isinstance(node, DisplayRate):
            return self.rate(node)
        if isinstance(node, DisplayNumber):
            return self.digits(node)
        if isinstance(node, DisplayPi):
            return [Piece(self.pi, self.columns(self.pi))]
        return self.atom(node)

    def digits(self, node: DisplayNumber) -> list[Piece]:
        return solid(self.number(node))

    def atom(self, node: DisplaySymbol) -> list[Piece]:
        return solid(node.name if node.spelled else self.symbol(node.name, node.order))

    def fraction(self, node: DisplayNode) -> list[Piece]:
        assert isinstance(node, DisplayFraction)
        above = node.numerator
        *others, last = factors_of(above)
        if others and isinstance(last, DisplaySeries):
            # What is divided stands before the sign of the sum.
            remainder = replace(node, numerator=_product(others))
            return self.factors((remainder, last))
        compound_above = isinstance(above, (DisplaySum, DisplaySeries))
        numerator = self.group(self.pieces(above)) if compound_above else self.pieces(above)
        below = node.denominator
        compound = isinstance(below, (DisplaySum, DisplayProduct))
        denominator = (
            self.group(self.pieces(below)) if compound else self.factor(below, closed=False)
        )
        return [*numerator, *self.divided(denominator)]

    def divided(self, denominator: list[Piece]) -> list[Piece]:
        head = replace(
            denominator[0],
            separator=self.over,
            lead=self.over.lstrip(),
            width=denominator[0].width + columns(self.over),
            depth=FACTOR_DEPTH,
        )
        return [head, *denominator[1:]]

    def power(self, node: DisplayNode, *, closed: bool = False) -> list[Piece]:
        assert isinstance(node, DisplayPower)
        base, exponent = node.base, self.exponent(node.exponent)
        if isinstance(base, DisplayCall) and self.takes_power(base, node.exponent):
            return self.call(base, exponent, closed=closed)
        if isinstance(base, (DisplaySymbol, DisplayPi)) or (
            isinstance(base, DisplayNumber) and base.denominator == 1 and base.literal is None
        ):
            body = self.factor(base, closed=True)
        elif isinstance(base, DisplayCall):
            # The parentheses of V′(r)² are its own.
            known = base.order is None
            body = self.enclosed_call(base) if known else self.call(base, "", closed=True)
        else:
            body = self.group(self.pieces(base))
        *before, last = body
        text = self.superscript(last.text, exponent)
        return [*before, replace(last, text=text, width=last.width + self.exponent_width(exponent))]

    def exponent_width(self, exponent: str) -> float:
        return self.columns(exponent)

    def arguments(self, node: DisplayCall) -> list[list[Piece]]:
        """Return the arguments of a function; those with a condition in brackets."""
        return [
            group(argument_list([self.pieces(a.arguments[0]), self.condition(a)]), "[", "]")
            if isinstance(a, DisplayCall) and a.function in CONDITIONS
            else self.pieces(a)
            for a in node.arguments
        ]

    def condition(self, piece: DisplayCall, relation: str = "") -> list[Piece]:
        """Return the condition of a piece, or another relation between its sides."""
        _, left, right = map(self.pieces, piece.arguments)
        sign = self.relations[relation or piece.function]
        text = f"{joined(left)} {sign} {joined(right)}"
        return [Piece(text, width(left) + width(right) + 3)]

    def enclosed_call(self, node: DisplayCall) -> list[Piece]:
        """Return a function that a power follows."""
        return self.group(self.call(node, "", closed=False))


def _product(factors: list[DisplayNode]) -> DisplayNode:
    """Some factors of a product, in their order."""
    if len(factors) == 1:
        return factors[0]
    return DisplayProduct(tuple(factors), factors[0].traits)


def _opens(node: DisplayNode | None) -> bool:
    """Tell whether a factor begins with a parenthesis, as an argument would."""
    base = node.base if isinstance(node, DisplayPower) else node
    return isinstance(base, (DisplaySum, DisplayFraction, DisplayProduct))
