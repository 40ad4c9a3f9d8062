"""Expressions as mathematics that is typeset: fractions, roots, upright functions.

LaTeX and Typst spell the same parts differently. Widths are in columns of half an em, near enough
to break lines by.
"""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace

from lagrange_cli.notation.layout import FACTOR_DEPTH, Piece, break_lines, joined, prefixed, width
from lagrange_cli.notation.printers.one_line import OneLinePrinter, argument_list, group
from lagrange_cli.notation.symbols import split_name
from lagrange_cli.notation.tree import (
    Dependence,
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
    is_rate,
)
from lagrange_cli.scene.language.expression import CONDITIONS, PIECEWISE

#: Functions whose power stands at the name, and whose argument needs no parentheses where it is
#: one letter.
NAMED_POWERS = frozenset(("sin", "cos", "tan", "sinh", "cosh", "tanh"))

#: Width of the widest part of a page that is put over or under a line or under a root. Set by
#: hand.
WIDEST_PART = 44
#: Width that is left beside a root for its factors.
_BESIDE_ROOT = 4
#: Width of the widest exponent of e; wider ones are arguments of exp. Set by hand.
_WIDEST_EXPONENT = 14

#: Relation → the one that holds where it does not.
_OPPOSITES = {">=": "<", "<": ">=", ">": "<=", "<=": ">"}

_WIDE = frozenset("mwABCDEFGHKLMNOPQRTUVWXYZ")


class TypesetPrinter(OneLinePrinter):
    """Printer of a language of typeset mathematics.

    Attributes
    ----------
    widest
        Width of the widest part that is put over or under a line or under a root.
    functions
        Function of the scene language → its name; ``exp`` and ``abs`` have forms of their own.
    ddt
        What stands before a quantity whose rate is meant.
    dot, thin
        Text between a factor and a number, and between a factor and a word.
    tall
        Parentheses around fractions that may stand on several lines.
    brackets, comma, unequal
        Parentheses around anything else, what stands between arguments and between indices that
        are not equal.
    applied, applied_to_letter
        Text between a function and its parentheses, and before an argument without them.
    number_openings, ratio_opening, root_opening, sum_opening, bars_opening, cases_opening,
    word_openings, group_openings
        Beginnings of numbers, of fractions, of roots, of sums over indices, of absolute values,
        of cases, of names of several letters, of parentheses.
    """

    times = " "
    times_width = 0.4
    sign_width = 2.5

    functions: Mapping[str, str]
    ddt: str
    dot: str
    thin: str
    tall: tuple[str, str]
    brackets = "(", ")"
    comma = ", "
    unequal: str
    applied = ""
    applied_to_letter = " "
    number_openings: tuple[str, ...] = tuple("0123456789")
    ratio_opening: str
    root_opening: str
    sum_opening: str
    bars_opening: str
    cases_opening: str
    word_openings: tuple[str, ...]
    group_openings: tuple[str, ...]

    def __init__(self, widest: float = WIDEST_PART) -> None:
        super().__init__()
        self.widest = widest

    # -- spelling -----------------------------------------------------------------

    @abstractmethod
    def name(self, name: str, order: int = 0, latex: str | None = None) -> str:
        """Return a name with dots over it; ``latex`` is what the scene gives for it."""

    @abstractmethod
    def function(self, node: DisplayCall) -> str:
        """Return the name of a function of the scene, with its primes."""

    @abstractmethod
    def decimal(self, literal: str) -> str:
        """Return a decimal as the scene wrote it."""

    def integer(self, number: int) -> str:
        """Return a whole number."""
        return str(number)

    @abstractmethod
    def ratio(self, above: str, below: str) -> str:
        """Return a fraction."""

    @abstractmethod
    def radical(self, body: str) -> str:
        """Return a square root."""

    @abstractmethod
    def stack(self, lines: Sequence[str]) -> str:
        """Return a part of a fraction or root on several lines."""

    @abstractmethod
    def big_sum(self, under: str, over: str) -> str:
        """Return the sign of a sum with relations under and an end over it, empty for nothing."""

    @abstractmethod
    def fenced(self, body: str) -> str:
        """Parentheses on one line, as tall as what they hold."""

    @abstractmethod
    def magnitude(self, body: str) -> str:
        """Return an absolute value."""

    @abstractmethod
    def cases(self, rows: Sequence[tuple[str, Sequence[str]]]) -> str:
        """Return values below each other, each with the conditions under which it holds."""

    @abstractmethod
    def exponential(self, exponent: str) -> str:
        """Return a power of e."""

    @abstractmethod
    def slashed(self, node: DisplayNumber) -> str:
        """Return a fraction as an exponent."""

    @abstractmethod
    def raised(self, exponent: str) -> str:
        """Return an exponent, with its sign of exponentiation."""

    # -- structure ------------------------------------------------------------------

    def number(self, node: DisplayNumber) -> str:
        if node.literal is not None:
            return self.decimal(node.literal)
        if node.denominator == 1:
            return self.integer(node.numerator)
        return self.ratio(self.integer(node.numerator), self.integer(node.denominator))

    def digits(self, node: DisplayNumber) -> list[Piece]:
        text = self.number(node)
        over = max(len(str(node.numerator)), len(str(node.denominator))) + 0.6
        is_ratio = text.startswith(self.ratio_opening)
        return [Piece(text, over if is_ratio else self.columns(text))]

    def symbol(self, name: str, order: int = 0) -> str:
        return self.name(name, order)

    def atom(self, node: DisplaySymbol) -> list[Piece]:
        if node.spelled:
            return [Piece(node.name, self.spelled_width(node.name))]
        return [Piece(self.name(node.name, node.order, node.latex), _symbol_width(node))]

    def spelled_width(self, text: str) -> float:
        """Return the width of a symbol that is in the letters of the format."""
        words = _UPRIGHT.fullmatch(text)
        if words is not None:
            return len(words[1])
        return 1.2 * len(re.sub(r"\\?[A-Za-z.]{2,}|[{}_^\s]", "x", text))

    def separator(self, before: DisplayNode, after: str) -> str:
        if after.startswith((*self.number_openings, self.ratio_opening)):
            return self.dot
        if after.startswith(self.word_openings) or _is_word(before):
            return self.thin
        bare = isinstance(before, DisplayCall) and before.function in NAMED_POWERS
        return self.thin if bare and not after.startswith(self.group_openings) else self.times

    def group(self, pieces: list[Piece]) -> list[Piece]:
        """Parentheses that fit: taller ones around fractions and sums."""
        text = joined(pieces)
        tall = self.ratio_opening, self.root_opening, self.sum_opening, self.cases_opening
        if not any(opening in text for opening in tall):
            return self.plain(pieces)
        if width(pieces) <= self.widest:
            return [Piece(self.fenced(text), width(pieces) + 3)]
        return group(pieces, *self.tall)

    def plain(self, pieces: list[Piece]) -> list[Piece]:
        """Parentheses without fractions between them."""
        return group(pieces, *self.brackets)

    def rate(self, node: DisplayRate) -> list[Piece]:
        inner = self.pieces(node.quantity)
        if width(inner) <= self.widest:
            return [Piece(f"{self.ddt} {self.fenced(joined(inner))}", width(inner) + 5)]
        return prefixed(group(inner, *self.tall), f"{self.ddt} ", 2)

    def fraction(self, node: DisplayNode) -> list[Piece]:
        """Return a fraction; factors that move, and long ones, stand beside it."""
        assert isinstance(node, DisplayFraction)
        if isinstance(node.numerator, DisplaySeries):
            inverse = self.ratio(self.integer(1), joined(self.pieces(node.denominator)))
            return [Piece(inverse, 3), *self._beside(self.series(node.numerator))]
        below = self._stacked(self.pieces(node.denominator), self.widest)
        inside, outside = self._split(node.numerator)
        factors = self.pieces(inside[0]) if len(inside) == 1 else self.factors(inside)
        above = self._stacked(factors, self.widest)
        quotient = self.ratio(above.text or self.integer(1), below.text)
        head = Piece(quotient, max(above.width, below.width) + 1)
        return [head, *(self._beside(self.factors(outside)) if outside else [])]

    def _beside(self, pieces: list[Piece]) -> list[Piece]:
        """Further factors after a fraction."""
        head = replace(pieces[0], separator=self.times, lead=self.lead, depth=FACTOR_DEPTH)
        return [head, *pieces[1:]]

    def _split(
        self, numerator: DisplayNode
    ) -> tuple[tuple[DisplayNode, ...], tuple[DisplayNode, ...]]:
        """Return factors over the line and factors beside the fraction."""
        factors = factors_of(numerator)
        moving = tuple(f for f in factors if _stands_beside(f))
        still = tuple(f for f in factors if not _stands_beside(f))
        if not moving or all(isinstance(f, DisplayNumber) for f in still):
            moving, still = (), factors
        if width(self.factors(still)) <= self.widest:
            return still, moving
        sums = tuple(f for f in still if isinstance(f, DisplaySum))
        return tuple(f for f in still if not isinstance(f, DisplaySum)), sums + moving

    def is_open(self, node: DisplayNode) -> bool:
        is_cases = isinstance(node, DisplayCall) and node.function == PIECEWISE
        return is_cases or super().is_open(node)

    def _cases(self, node: DisplayCall) -> list[Piece]:
        """Return the values in cases. Each row says, too, that no condition before it holds."""
        rows: list[tuple[str, list[str]]] = []
        missed: list[str] = []
        widest = 0.0
        for piece in node.arguments:
            conditions, value = list(missed), piece
            if isinstance(piece, DisplayCall) and piece.function in CONDITIONS:
                value, relation = piece.arguments[0], piece.function
                conditions.append(joined(self.condition(piece)))
                missed.append(joined(self.condition(piece, _OPPOSITES[relation])))
                widest = max(widest, width(self.pieces(value)) + width(self.condition(piece)))
            rows.append((joined(self.pieces(value)), conditions))
        return [Piece(self.cases(rows), widest + 5)]

    def call(self, node: DisplayCall, power: str, *, closed: bool) -> list[Piece]:
        if node.function == PIECEWISE:
            return self._cases(node)
        arguments = [self.pieces(a) for a in node.arguments]
        if node.function == "exp" and not power:
            inner = joined(arguments[0])
            if width(arguments[0]) <= _WIDEST_EXPONENT and self.ratio_opening not in inner:
                return [Piece(self.exponential(inner), 1 + 0.7 * width(arguments[0]))]
        if node.function == "abs" and width(arguments[0]) <= self.widest:
            return [Piece(self.magnitude(joined(arguments[0])), width(arguments[0]) + 1)]
        if is_rate(node):
            return [Piece(self.name(node.function, node.order or 0, node.latex), 1.5)]
        known = node.order is None
        name = self.functions[node.function] if known else self.function(node)
        name = self.superscript(name, power) if power else name
        size = len(node.function) + 0.5 + (1 if power else 0)
        if node.function in NAMED_POWERS and not closed and _is_bare(node.arguments[0]):
            return prefixed(arguments[0], name + self.applied_to_letter, size)
        body = self.group(argument_list(arguments, self.comma))
        return prefixed(body, name + self.applied, size)

    def takes_power(self, node: DisplayCall, exponent: DisplayNode) -> bool:
        return (
            node.function in NAMED_POWERS
            and isinstance(exponent, DisplayNumber)
            and exponent.denominator == 1
        )

    def enclosed_call(self, node: DisplayCall) -> list[Piece]:
        body = self.call(node, "", closed=False)
        return body if body[0].text.startswith(self.bars_opening) else self.group(body)

    def sigma(self, ranges: Sequence[DisplayRange]) -> tuple[str, float]:
        text, size = "", 0.0
        named = {r.after for r in ranges}
        for index in ranges:
            if index.letter in named:
                continue
            under, over = self._condition(index), ""
            if not (index.after or (index.besides and index.is_whole)):
                low = f"{index.letter} = {index.first}"
                under, over = f"{low}, {under}" if under else low, index.last
            text += self.big_sum(under, over) + " "
            size += max(3.0, 0.7 * len(under))
        return text, size

    def _condition(self, index: DisplayRange) -> str:
        """Return the condition under the sign of a sum whose ends need not be said."""
        if index.after:
            return f"{index.after} < {index.letter}"
        return f"{index.letter} {self.unequal} {index.besides}" if index.besides else ""

    def root(self, node: DisplayRoot) -> list[Piece]:
        body = self._stacked(self.pieces(node.radicand), self.widest - _BESIDE_ROOT)
        return [Piece(self.radical(body.text), body.width + 2)]

    def exponent(self, node: DisplayNode) -> str:
        if isinstance(node, DisplayNumber) and node.literal is None and node.denominator != 1:
            return self.raised(self.slashed(node))
        return self.raised(joined(self.pieces(node)))

    def _stacked(self, pieces: list[Piece], widest: float) -> Piece:
        """A part of a fraction or a root in one piece: on several lines where it is too wide."""
        if width(pieces) <= widest:
            return Piece(joined(pieces), width(pieces))
        lines = break_lines(pieces, widest, widest - 2)
        return Piece(self.stack([line.text for line in lines]), widest)


def _stands_beside(factor: DisplayNode) -> bool:
    """Tell whether a factor stands beside a fraction: what moves, and sums over indices."""
    return isinstance(factor, DisplaySeries) or factor.traits.level >= Dependence.VELOCITY


#: Words in upright letters, in LaTeX and in Typst.
_UPRIGHT = re.compile(r"(?:\\text\{|\")(.*)[}\"]")


def _symbol_width(node: DisplaySymbol) -> float:
    if node.latex is not None:
        return 1.2 * len(re.sub(r"\\[A-Za-z]+|[{}_^\s]", "x", node.latex))
    parts = split_name(node.name)
    letter = 1.8 if parts.base in _WIDE else 1.2
    base = letter if parts.is_letter else len(parts.base)
    return base + 0.8 * sum(map(len, parts.subscripts))


def _is_word(node: DisplayNode) -> bool:
    base = node.base if isinstance(node, DisplayPower) else node
    return isinstance(base, DisplaySymbol) and not _is_letter(base)


def _is_letter(symbol: DisplaySymbol) -> bool:
    return symbol.spelled or symbol.latex is not None or split_name(symbol.name).is_letter


def _is_bare(node: DisplayNode) -> bool:
    """Return an argument that needs no parentheses: a letter, or a number times one."""
    if isinstance(node, DisplayProduct) and len(node.factors) == 2:
        number, letter = node.factors
        return isinstance(number, DisplayNumber) and number.denominator == 1 and _is_bare(letter)
    if isinstance(node, DisplayPi):
        return True
    return isinstance(node, DisplaySymbol) and _is_letter(node)
