"""Templates of texts and trees that differ in the names of elements only.

Helpers of a family are written out to such texts: ``1/2*k*(x[3] - x[4])^2``. If the digits of the
indices become zeros, every part stays at its place: the tree of one text is that of
all others but for the names, which are found in each text at their spans.
"""

from __future__ import annotations

import re
from collections.abc import Hashable

from lagrange_cli.scene.language.expression import (
    SUM,
    Add,
    Call,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    walk,
)
from lagrange_cli.scene.language.families import IndexValues

#: An element's name as families write it.
_ELEMENT = re.compile(r"(?<![A-Za-z0-9_])[A-Za-z_][A-Za-z0-9_]*\[-?[0-9]+(?:,-?[0-9]+)*\]")
_DIGIT = re.compile("[0-9]")


def with_zero_indices(text: str) -> str:
    """Replace every digit of the indices in names of elements by 0."""
    return _ELEMENT.sub(_with_zeros, text)


def _with_zeros(element: re.Match[str]) -> str:
    name, bracket, indices = element[0].partition("[")
    return name + bracket + _DIGIT.sub("0", indices)


def is_template(node: Node, text: str, values: IndexValues) -> bool:
    """Say whether a tree needs nothing written out but the names of elements."""
    return all(_stays(part, text, values) for part in walk(node))


def _stays(node: Node, text: str, values: IndexValues) -> bool:
    if isinstance(node, Name) and node.indices:
        return _ELEMENT.fullmatch(text[slice(*node.span)]) is not None
    if isinstance(node, Name):
        return node.name not in values and text[slice(*node.span)] == node.name
    return not (isinstance(node, Call) and node.function == SUM)


def with_names_of(template: Node, text: str) -> Node:
    """Return the tree of a text that has the template's parts at the same places."""
    match template:
        case Number():
            return template
        case Name():
            return Name(text[slice(*template.span)], template.span)
        case Neg():
            return Neg(with_names_of(template.operand, text), template.span)
        case Add():
            terms = tuple([(sign, with_names_of(term, text)) for sign, term in template.terms])
            return Add(terms, template.span)
        case Mul():
            factors = tuple([(op, with_names_of(factor, text)) for op, factor in template.factors])
            return Mul(factors, template.span)
        case Pow():
            base, exponent = (
                with_names_of(template.base, text),
                with_names_of(template.exponent, text),
            )
            return Pow(base, exponent, template.span)
        case Call():
            arguments = tuple([with_names_of(argument, text) for argument in template.arguments])
            return Call(template.function, arguments, template.span)


def shape_of(node: Node) -> tuple[tuple[Hashable, ...], list[str]]:
    """Return a key shared by trees that differ in names only, and the names in reading order.

    ``pi``, which is a number, belongs to the key.
    """
    parts: list[Hashable] = []
    names: list[str] = []
    stack = [node]
    while stack:
        top = stack.pop()
        if isinstance(top, Name):
            if top.name == "pi":
                parts.append(top.name)
            else:
                parts.append(Name)
                names.append(top.name)
        elif isinstance(top, Number):
            parts += (top.value.numerator, top.value.denominator)
        elif isinstance(top, Add):
            parts += (Add, *[sign for sign, _ in top.terms], None)
            stack += [term for _, term in top.terms[::-1]]
        elif isinstance(top, Mul):
            parts += (Mul, *[operator for operator, _ in top.factors], None)
            stack += [factor for _, factor in top.factors[::-1]]
        elif isinstance(top, Pow):
            parts.append(Pow)
            stack += (top.exponent, top.base)
        elif isinstance(top, Neg):
            parts.append(Neg)
            stack.append(top.operand)
        else:
            parts += (Call, top.function, len(top.arguments))
            stack += top.arguments[::-1]
    return tuple(parts), names
