"""Sums in brackets as the scene wrote them, whose order of terms SymPy does not keep."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import sympy as sp

from lagrange_cli.errors import InputError
from lagrange_cli.scene.bodies import ComposedExpression
from lagrange_cli.scene.language.expression import Add, Call, Expression, Mul, Neg, Node, Pow

#: Sums that are looked at: more than a person writes one by one. Further ones, of indexed families,
#: print in textbook order.
_MOST_SUMS = 200

#: Terms of the longest sum whose order is kept: longer ones do not repeat as one factor.
_MOST_TERMS = 6


def written_sums(
    expressions: Iterable[Expression],
    abbreviated: Iterable[Expression],
    convert: Callable[[Expression], sp.Expr],
) -> tuple[tuple[sp.Expr, ...], ...]:
    """List the sums within expressions, each as its terms in the order of the scene.

    Parameters
    ----------
    abbreviated
        Expressions that have a name in the scene, which count as if they stood in brackets.
    convert
        Gives the value of an expression over coordinates.

    Returns
    -------
    tuple
        Sums that begin with a plus sign, without sums among their terms.
    """
    sums: dict[sp.Expr, tuple[sp.Expr, ...]] = {}
    for count, (expression, node) in enumerate(_brackets(expressions, abbreviated)):
        if count == _MOST_SUMS:
            break
        signed = list(_terms(node))
        if len(signed) > _MOST_TERMS:
            continue
        try:
            terms = tuple(sign * convert(replace(expression, node=term)) for sign, term in signed)
        except InputError:
            continue  # It has local names, as the expression of a function of one argument does.
        if terms[0].could_extract_minus_sign():
            continue
        whole = sp.Add(*terms)
        if whole.is_Add and set(whole.args) == set(terms) and len(whole.args) == len(terms):
            sums.setdefault(whole, terms)
    return tuple(sums.values())


def _brackets(
    expressions: Iterable[Expression], abbreviated: Iterable[Expression]
) -> Iterator[tuple[Expression, Add]]:
    """Walk the outermost sums within other operations, and the sums within their terms.

    Nobody wrote those of expressions that frames imply.
    """
    written = [(e, False) for e in expressions if not isinstance(e, ComposedExpression)]
    whole = written + [(e, True) for e in abbreviated]
    for expression, is_inside in whole:
        pending = [(expression.node, is_inside)]
        while pending:
            node, inside = pending.pop()
            if isinstance(node, Add) and inside:
                yield expression, node
            terms = [t for _, t in _terms(node)] if isinstance(node, Add) else [node]
            for term in terms:
                pending.extend((part, True) for part in _parts(term))


def _parts(node: Node) -> Iterator[Node]:
    """The operands of a product, a power or a call."""
    match node:
        case Neg():
            yield node.operand
        case Mul():
            yield from (factor for _, factor in node.factors)
        case Pow():
            yield from (node.base, node.exponent)
        case Call():
            yield from node.arguments


def _terms(node: Node, sign: int = 1) -> Iterator[tuple[int, Node]]:
    """The signed terms of a sum, with sums among them taken apart: ``x - (1 - mu)``."""
    match node:
        case Add():
            for operator, term in node.terms:
                yield from _terms(term, -sign if operator == "-" else sign)
        case Neg():
            yield from _terms(node.operand, -sign)
        case _:
            yield sign, node
