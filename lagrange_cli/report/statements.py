"""Constraints as a book prints them: ``z = a x²``, ``ẋ - a φ̇ sin θ = 0``.

Terms stay in the order of the scene, factors are in that of books.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.notation import ordering
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayNode,
    DisplayRange,
    DisplaySymbol,
    SignedNode,
    factors_of,
)
from lagrange_cli.notation.vocabulary import Vocabulary, latex_overrides
from lagrange_cli.scene.language.expression import (
    FUNCTIONS,
    RANGE,
    SUM,
    TIME_DERIVATIVES,
    Add,
    Call,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    Relation,
    own_function,
)
from lagrange_cli.scene.language.grammar import parse_equation

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_RELATIONS: tuple[Relation, ...] = ("=", "<=", ">=")


class _UnprintableError(Exception):
    """A part of a statement has no printed form beside the one of the scene."""


@dataclass(frozen=True)
class Statement:
    """An equation or inequality of the scene: its sides, and the sign between them."""

    left: DisplayNode
    relation: Relation
    right: DisplayNode


def statement_of(text: str, equations: Equations, words: Vocabulary) -> Statement | None:
    """Return an equation or inequality of the scene as trees; None if it stays as written."""
    functions = {f.name: f.arity for f in equations.system.functions}
    names = {n.name: n for n in words.atoms.values() if n.order == 0}
    try:
        parsed = parse_equation(text, Mark("", 1, 1), relations=_RELATIONS, functions=functions)
        reader = _Reader(text, names, latex_overrides(equations))
        left, right = (ordering.signed(reader.signed(e.node)) for e in (parsed.left, parsed.right))
    except (InputError, _UnprintableError):
        return None
    return Statement(left, parsed.relation, right)


class _Reader:
    """Makes trees of parts of a statement.

    ``names`` are those that equations hold too; ``latex`` is what the scene says that names print
    as.
    """

    def __init__(
        self, text: str, names: Mapping[str, DisplaySymbol], latex: Mapping[str, str]
    ) -> None:
        self._text = text
        self._names = names
        self._latex = latex

    def signed(self, node: Node) -> SignedNode:
        """Return the sign and the tree of a part."""
        match node:
            case Number():
                number = node.value
                literal = node.text if number.denominator != 1 else None
                plain = ordering.number_of(number.numerator, number.denominator, literal)
                return SignedNode(False, plain)
            case Name():
                return SignedNode(False, self._symbol(node))
            case Neg():
                inner = self.signed(node.operand)
                return SignedNode(not inner.negative, inner.node)
            case Add():
                terms = [(sign, self.signed(term)) for sign, term in node.terms]
                signs = [SignedNode(t.negative != (sign == "-"), t.node) for sign, t in terms]
                return SignedNode(False, ordering.sum_of(signs, ordered=True))
            case Mul():
                return self._product(node)
            case Pow():
                power = ordering.power_of(self._whole(node.base), self._whole(node.exponent))
                return SignedNode(False, power)
            case Call():
                return SignedNode(False, self._call(node))
        raise _UnprintableError

    def _whole(self, node: Node) -> DisplayNode:
        return ordering.signed(self.signed(node))

    def _product(self, node: Mul) -> SignedNode:
        negative = False
        above: list[DisplayNode] = []
        below: list[DisplayNode] = []
        for operator, factor in node.factors:
            part = self.signed(factor)
            negative ^= part.negative
            (above if operator == "*" else below).extend(factors_of(part.node))
        product = ordering.product_of(above)
        return SignedNode(negative, ordering.fraction_of(product, ordering.product_of(below)))

    def _symbol(self, node: Name, order: int = 0) -> DisplayNode:
        indices = ",".join(map(self._written, node.indices))
        name = f"{node.name}[{indices}]" if indices else node.name
        if name == "pi" and not order:
            return ordering.pi()
        known = self._names.get(name)
        if known is not None and not order:
            return known
        rank = int(known.traits.text) if known is not None else len(self._names)
        level = Dependence(Dependence.COORDINATE + order)
        return ordering.symbol_of(name, level, rank, order=order, latex=self._latex.get(name))

    def _written(self, node: Node) -> str:
        """Return an index, or an end of a range, without the blanks of the scene."""
        start, end = node.span
        return self._text[start:end].replace(" ", "")

    def _call(self, node: Call) -> DisplayNode:
        if node.function in TIME_DERIVATIVES:
            (argument,) = node.arguments
            if not isinstance(argument, Name):
                raise _UnprintableError
            return self._symbol(argument, TIME_DERIVATIVES[node.function])
        if node.function == SUM:
            return self._series(node)
        arguments = tuple(map(self._whole, node.arguments))
        if node.function == "norm":
            squares = [ordering.power_of(a, ordering.number_of(2)) for a in arguments]
            total = ordering.sum_of([SignedNode(False, s) for s in squares], ordered=True)
            return ordering.root_of(total)
        if node.function == "sqrt":
            return ordering.root_of(arguments[0])
        name = own_function(node.function)
        order = None if node.function in FUNCTIONS else len(node.function) - len(name)
        return ordering.call_of(name, arguments, order, self._latex.get(name))

    def _series(self, node: Call) -> DisplayNode:
        body, *ranges = node.arguments
        shown = []
        for index in ranges:
            if not isinstance(index, Call) or index.function != RANGE:
                raise _UnprintableError
            letter, first, last = map(self._written, index.arguments)
            shown.append(DisplayRange(letter, first, last))
        return ordering.series_of(self._whole(body), tuple(shown))
