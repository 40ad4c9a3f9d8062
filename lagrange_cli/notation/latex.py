"""Expressions as LaTeX mathematics: ``\\frac{1}{2} M (\\dot{r}^{2} + r^{2} \\dot{\\theta}^{2})``.

Widths are in columns of half an em, near enough to break lines by.
"""

from __future__ import annotations

import re
from dataclasses import replace

from lagrange_cli.notation.layout import FACTOR_DEPTH, Piece, break_lines, joined, prefixed, width
from lagrange_cli.notation.one_line import OneLinePrinter, argument_list, group
from lagrange_cli.notation.symbols import latex_name, split_name
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplayRoot,
    DisplaySum,
    DisplaySymbol,
    factors_of,
)

#: Function of the scene language → its macro; ``exp`` and ``abs`` have forms of their own.
LATEX_FUNCTIONS = {
    **{name: rf"\{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")},
    **{name: rf"\{name}" for name in ("exp", "min", "max")},
    **{f"a{name}": rf"\arc{name}" for name in ("sin", "cos", "tan")},
    **{f"a{name}": rf"\operatorname{{ar{name}}}" for name in ("sinh", "cosh", "tanh")},
    **{name: rf"\operatorname{{{name}}}" for name in ("atan2", "abs")},
    "sign": r"\operatorname{sgn}",
    "log": r"\ln",
}

_NAMED_POWERS = frozenset(("sin", "cos", "tan", "sinh", "cosh", "tanh"))

#: What stands before a quantity whose rate is meant.
_RATE = r"\frac{\mathrm{d}}{\mathrm{d} t}"

_WIDE = frozenset("mwABCDEFGHKLMNOPQRTUVWXYZ")

#: Beginnings of names of several letters.
_WORDS = (r"\mathrm{", r"\dot{\mathrm{", r"\ddot{\mathrm{", r"\text{")

#: Width of the widest part that is put over or under a line or under a root. Set by hand.
_WIDEST_PART = 44
#: Width of the widest exponent of e; wider ones are arguments of exp. Set by hand.
_WIDEST_EXPONENT = 14


class LatexPrinter(OneLinePrinter):
    """Fractions, roots and upright functions; parentheses as tall as they need be."""

    times = " "
    times_width = 0.4
    sign_width = 2.5
    lead = r"{}\cdot "
    pi = r"\pi"

    def number(self, node: DisplayNumber) -> str:
        if node.literal is not None:
            return latex_number(node.literal)
        if node.denominator == 1:
            return str(node.numerator)
        return rf"\frac{{{node.numerator}}}{{{node.denominator}}}"

    def digits(self, node: DisplayNumber) -> list[Piece]:
        text = self.number(node)
        over = max(len(str(node.numerator)), len(str(node.denominator))) + 0.6
        return [Piece(text, over if text.startswith(r"\frac") else len(text))]

    def symbol(self, name: str, order: int = 0) -> str:
        return latex_name(name, order)

    def atom(self, node: DisplaySymbol) -> list[Piece]:
        text = latex_name(node.name, node.order, node.latex)
        return [Piece(text, _symbol_width(node))]

    def separator(self, before: DisplayNode, after: str) -> str:
        if after[0].isdigit() or after.startswith(r"\frac{"):
            return r" \cdot "
        if after.startswith(_WORDS) or _is_word(before):
            return r" \, "
        bare = isinstance(before, DisplayCall) and before.function in _NAMED_POWERS
        return r" \, " if bare and not after.startswith(("(", "\\b", "\\l", "\\B")) else self.times

    def group(self, pieces: list[Piece]) -> list[Piece]:
        """Parentheses that fit: taller ones around fractions and other parentheses.

        A group with fractions that may need breaking cannot use \\left and
        \\right, which must stand on one line.
        """
        text = joined(pieces)
        if r"\frac" in text or r"\sqrt" in text:
            if width(pieces) <= _WIDEST_PART:
                return [Piece(rf"\left( {text} \right)", width(pieces) + 3)]
            return group(pieces, r"\Bigl( ", r" \Bigr)")
        if r"\bigl(" in text or r"\Bigl(" in text:
            return group(pieces, r"\Bigl( ", r" \Bigr)")
        return group(pieces, r"\bigl( ", r" \bigr)") if "(" in text else group(pieces)

    def rate(self, node: DisplayNode) -> list[Piece]:
        inner = self.pieces(node)
        if width(inner) <= _WIDEST_PART:
            return [Piece(rf"{_RATE} \left( {joined(inner)} \right)", width(inner) + 5)]
        return prefixed(group(inner, r"\Bigl( ", r" \Bigr)"), f"{_RATE} ", 2)

    def fraction(self, node: DisplayNode) -> list[Piece]:
        """A fraction; factors that move, and long ones, stand beside it."""
        assert isinstance(node, DisplayFraction)
        below = _stacked(self.pieces(node.denominator))
        inside, beside = self._split(node.numerator)
        above = _stacked(self.pieces(inside[0]) if len(inside) == 1 else self.factors(inside))
        quotient = Piece(
            rf"\frac{{{above.text or '1'}}}{{{below.text}}}",
            max(above.width, below.width) + 1,
        )
        return [quotient, *(self._beside(self.factors(beside)) if beside else [])]

    def _beside(self, pieces: list[Piece]) -> list[Piece]:
        """Further factors after a fraction."""
        head = replace(pieces[0], separator=" ", lead=self.lead, depth=FACTOR_DEPTH)
        return [head, *pieces[1:]]

    def _split(
        self, numerator: DisplayNode
    ) -> tuple[tuple[DisplayNode, ...], tuple[DisplayNode, ...]]:
        """Factors over the line and factors beside the fraction."""
        factors = factors_of(numerator)
        moving = tuple(f for f in factors if f.traits.level >= Dependence.VELOCITY)
        still = tuple(f for f in factors if f.traits.level < Dependence.VELOCITY)
        if not moving or all(isinstance(f, DisplayNumber) for f in still):
            moving, still = (), factors
        if width(self.factors(still)) <= _WIDEST_PART:
            return still, moving
        sums = tuple(f for f in still if isinstance(f, DisplaySum))
        return tuple(f for f in still if not isinstance(f, DisplaySum)), sums + moving

    def call(self, node: DisplayCall, power: str, *, closed: bool) -> list[Piece]:
        arguments = [self.pieces(a) for a in node.arguments]
        if node.function == "exp" and not power:
            inner = joined(arguments[0])
            if width(arguments[0]) <= _WIDEST_EXPONENT and r"\frac" not in inner:
                return [Piece(rf"\mathrm{{e}}^{{{inner}}}", 1 + 0.7 * width(arguments[0]))]
        if node.function == "abs" and width(arguments[0]) <= _WIDEST_PART:
            return [Piece(rf"\left| {joined(arguments[0])} \right|", width(arguments[0]) + 1)]
        name = _function_name(node) + power
        size = len(node.function) + 0.5 + (1 if power else 0)
        if node.function in _NAMED_POWERS and not closed and _is_bare(node.arguments[0]):
            return prefixed(arguments[0], name + " ", size)
        return prefixed(self.group(argument_list(arguments)), name, size)

    def takes_power(self, node: DisplayCall, exponent: DisplayNode) -> bool:
        return (
            node.function in _NAMED_POWERS
            and isinstance(exponent, DisplayNumber)
            and exponent.denominator == 1
        )

    def enclosed_call(self, node: DisplayCall) -> list[Piece]:
        body = self.call(node, "", closed=False)
        return body if body[0].text.startswith(r"\left|") else self.group(body)

    def root(self, node: DisplayRoot) -> list[Piece]:
        body = _stacked(self.pieces(node.radicand))
        return [Piece(rf"\sqrt{{{body.text}}}", body.width + 2)]

    def exponent(self, node: DisplayNode) -> str:
        if isinstance(node, DisplayNumber) and node.literal is None and node.denominator != 1:
            return f"^{{{node.numerator}/{node.denominator}}}"
        return f"^{{{joined(self.pieces(node))}}}"

    def exponent_width(self, exponent: str) -> float:
        return 0.8 * len(re.sub(r"\\[A-Za-z]+|[{}^\s]", "", exponent))


def _stacked(pieces: list[Piece]) -> Piece:
    """A part of a fraction or a root in one piece: on several lines where it is too wide."""
    if width(pieces) <= _WIDEST_PART:
        return Piece(joined(pieces), width(pieces))
    lines = break_lines(pieces, _WIDEST_PART, _WIDEST_PART - 2)
    text = r" \\ & \quad {} ".join(line.text for line in lines)
    return Piece(rf"\begin{{aligned}} & {text} \end{{aligned}}", _WIDEST_PART)


def latex_number(literal: str) -> str:
    """A decimal as the scene wrote it: ``9.81``, ``1e-31`` as a power of ten."""
    mantissa, _, exponent = literal.lower().partition("e")
    if not exponent:
        return mantissa
    power = f"10^{{{int(exponent)}}}"
    return power if mantissa in ("1", "1.0", "1.") else rf"{mantissa} \times {power}"


def _symbol_width(node: DisplaySymbol) -> float:
    if node.latex is not None:
        return 1.2 * len(re.sub(r"\\[A-Za-z]+|[{}_^\s]", "x", node.latex))
    parts = split_name(node.name)
    letter = 1.8 if parts.base in _WIDE else 1.2
    base = letter if parts.is_letter else len(parts.base)
    return base + 0.8 * sum(map(len, parts.subscripts))


def _is_word(node: DisplayNode) -> bool:
    base = node.base if isinstance(node, DisplayPower) else node
    return (
        isinstance(base, DisplaySymbol)
        and base.latex is None
        and not split_name(base.name).is_letter
    )


def _is_bare(node: DisplayNode) -> bool:
    """An argument that needs no parentheses: a letter, or a number times one."""
    if isinstance(node, DisplayProduct) and len(node.factors) == 2:
        number, letter = node.factors
        return isinstance(number, DisplayNumber) and number.denominator == 1 and _is_bare(letter)
    if isinstance(node, DisplayPi):
        return True
    return isinstance(node, DisplaySymbol) and (
        node.latex is not None or split_name(node.name).is_letter
    )


def _function_name(node: DisplayCall) -> str:
    """The macro of a function, or the name of one of the scene with its primes."""
    if node.order is None:
        return LATEX_FUNCTIONS[node.function]
    return latex_name(node.function, 0, node.latex) + "'" * node.order
