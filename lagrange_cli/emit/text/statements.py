"""Constraints as a book prints them: ``z = a x²``, ``ẋ - a φ̇ sin θ = 0``.

Terms stay in the order of the scene, factors are in that of books.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lagrange_cli.emit.text.writer import TextWriter
from lagrange_cli.errors import InputError, Mark
from lagrange_cli.notation import ordering
from lagrange_cli.notation.layout import Piece
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayNode,
    DisplaySymbol,
    SignedNode,
    factors_of,
)
from lagrange_cli.scene.language.expression import (
    FUNCTIONS,
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

_RELATIONS: tuple[Relation, ...] = ("=", "<=", ">=")
_SIGNS = {"=": "=", "<=": "≤", ">=": "≥"}
_RATES = {"dot": 1, "ddot": 2}
#: Functions that have no sign of their own in a formula.
_WORDS = frozenset(("norm", "sum", "range"))


class _UnprintableError(Exception):
    """A part of a statement has no printed form beside the one of the scene."""


def statement_pieces(text: str, writer: TextWriter) -> list[Piece] | None:
    """Return an equation or inequality of the scene as a formula; None if it stays as written.

    In ASCII, with indices as letters and with functions that are words it does.
    """
    if isinstance(writer.printer, ScenePrinter):
        return None
    functions = frozenset(f.name for f in writer.equations.system.functions)
    try:
        statement = parse_equation(text, Mark("", 1, 1), relations=_RELATIONS, functions=functions)
        names = {n.name: n for n in writer.words.atoms.values() if n.order == 0}
        sides = [_signed(e.node, names) for e in (statement.left, statement.right)]
    except (InputError, _UnprintableError):
        return None
    left, right = (writer.printer.pieces(ordering.signed(side)) for side in sides)
    sign = _SIGNS[statement.relation]
    head = replace(
        right[0], separator=f" {sign} ", lead=f"  {sign} ", width=right[0].width + 3, depth=0
    )
    return [*left, head, *right[1:]]


def _signed(node: Node, names: Mapping[str, DisplaySymbol]) -> SignedNode:
    """Return the sign and the tree of a part of an expression."""
    match node:
        case Number():
            number = node.value
            literal = node.text if number.denominator != 1 else None
            plain = ordering.number_of(number.numerator, number.denominator, literal)
            return SignedNode(False, plain)
        case Name():
            return SignedNode(False, _symbol(node, names))
        case Neg():
            inner = _signed(node.operand, names)
            return SignedNode(not inner.negative, inner.node)
        case Add():
            terms = [(sign, _signed(term, names)) for sign, term in node.terms]
            signs = [SignedNode(t.negative != (sign == "-"), t.node) for sign, t in terms]
            return SignedNode(False, ordering.sum_of(signs, ordered=True))
        case Mul():
            return _product(node, names)
        case Pow():
            base = ordering.signed(_signed(node.base, names))
            exponent = ordering.signed(_signed(node.exponent, names))
            return SignedNode(False, ordering.power_of(base, exponent))
        case Call():
            return SignedNode(False, _call(node, names))
    raise _UnprintableError


def _product(node: Mul, names: Mapping[str, DisplaySymbol]) -> SignedNode:
    negative = False
    above: list[DisplayNode] = []
    below: list[DisplayNode] = []
    for operator, factor in node.factors:
        part = _signed(factor, names)
        negative ^= part.negative
        (above if operator == "*" else below).extend(factors_of(part.node))
    product = ordering.product_of(above)
    return SignedNode(negative, ordering.fraction_of(product, ordering.product_of(below)))


def _symbol(node: Name, names: Mapping[str, DisplaySymbol], order: int = 0) -> DisplayNode:
    if node.indices:
        raise _UnprintableError
    if node.name == "pi" and not order:
        return ordering.pi()
    known = names.get(node.name)
    if known is not None and not order:
        return known
    rank = int(known.traits.text) if known is not None else len(names)
    level = Dependence(Dependence.COORDINATE + order)
    return ordering.symbol_of(node.name, level, rank, order=order)


def _call(node: Call, names: Mapping[str, DisplaySymbol]) -> DisplayNode:
    if node.function in _RATES:
        (argument,) = node.arguments
        if not isinstance(argument, Name):
            raise _UnprintableError
        return _symbol(argument, names, _RATES[node.function])
    if node.function in _WORDS:
        raise _UnprintableError
    arguments = tuple(ordering.signed(_signed(a, names)) for a in node.arguments)
    if node.function == "sqrt":
        return ordering.root_of(arguments[0])
    name = own_function(node.function)
    order = None if node.function in FUNCTIONS else len(node.function) - len(name)
    return ordering.call_of(name, arguments, order)
