"""Vectors and matrices of syntax trees: the algebra that composes turns of frames.

Zeros and ones are left out as they arise, so that what is composed of few turns is as short as a
person would write it. Matrices are lists of nine entries by rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Literal, TypeAlias

from lagrange_cli.scene.language.expression import (
    Add,
    Call,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    Span,
)

Nodes: TypeAlias = Sequence[Node]

#: The place of what nobody wrote.
_NOWHERE: Span = (0, 1)

ZERO = Number(Fraction(0), "0", _NOWHERE)
ONE = Number(Fraction(1), "1", _NOWHERE)

IDENTITY: tuple[Node, ...] = (ONE, ZERO, ZERO, ZERO, ONE, ZERO, ZERO, ZERO, ONE)


def whole(number: int) -> Number:
    return Number(Fraction(number), str(number), _NOWHERE)


def is_zero(node: Node) -> bool:
    if isinstance(node, Neg):
        return is_zero(node.operand)
    return isinstance(node, Number) and node.value == 0


def is_atom(node: Node) -> bool:
    """Tell whether a node is a number or a name, perhaps with a sign."""
    if isinstance(node, Neg):
        return is_atom(node.operand)
    return isinstance(node, Number | Name)


def minus(node: Node) -> Node:
    if isinstance(node, Neg):
        return node.operand
    return node if is_zero(node) else Neg(node, _NOWHERE)


def total(terms: Nodes) -> Node:
    """Return the sum of some nodes without those that are zero."""
    present = [term for term in terms if not is_zero(term)]
    if len(present) < 2:
        return present[0] if present else ZERO
    return Add(tuple(map(_signed, present)), _NOWHERE)


def _signed(term: Node) -> tuple[Literal["+", "-"], Node]:
    return ("-", term.operand) if isinstance(term, Neg) else ("+", term)


def product(*factors: Node) -> Node:
    """Return the product of some nodes, signs in front and ones left out."""
    if any(map(is_zero, factors)):
        return ZERO
    sign, parts = 1, []
    for factor in factors:
        if isinstance(factor, Neg):
            sign, factor = -sign, factor.operand
        if not (isinstance(factor, Number) and factor.value == 1):
            parts.append(factor)
    result = parts[0] if len(parts) == 1 else ONE
    if len(parts) > 1:
        result = Mul(tuple(("*", factor) for factor in parts), _NOWHERE)
    return result if sign > 0 else minus(result)


def quotient(node: Node, divisor: Node) -> Node:
    return node if is_zero(node) else Mul((("*", node), ("/", divisor)), _NOWHERE)


def square(node: Node) -> Node:
    return node if is_zero(node) else Pow(node, whole(2), _NOWHERE)


def called(function: str, *arguments: Node) -> Node:
    return Call(function, tuple(arguments), _NOWHERE)


def named(name: str) -> Name:
    return Name(name, _NOWHERE)


def implied_name(stem: str, frame: str) -> str:
    """Name what frames imply: ``omega_1(top)``, ``omega_1(link)[3]`` of an element of a family."""
    base, bracket, indices = frame.partition("[")
    return f"{stem}({base}){bracket}{indices}"


def dot(left: Nodes, right: Nodes) -> Node:
    return total([product(a, b) for a, b in zip(left, right, strict=True)])


def times(matrix: Nodes, vector: Nodes) -> tuple[Node, ...]:
    """Return the product of a matrix and a vector."""
    return tuple(dot(matrix[3 * i : 3 * i + 3], vector) for i in range(3))


def transposed(matrix: Nodes) -> tuple[Node, ...]:
    return tuple(matrix[3 * j + i] for i in range(3) for j in range(3))


def composed(first: Nodes, second: Nodes) -> tuple[Node, ...]:
    """Return the product of two matrices."""
    columns = transposed(second)
    return tuple(
        dot(first[3 * i : 3 * i + 3], columns[3 * j : 3 * j + 3])
        for i in range(3)
        for j in range(3)
    )


def turn(axis: Nodes, angle: Node, *, reverse: bool = False) -> tuple[Node, ...]:
    """Return the matrix of a turn about a unit vector: cos I + sin [n]× + (1 − cos) n nᵀ."""
    cosine, sine = called("cos", angle), called("sin", angle)
    if reverse:
        sine = minus(sine)
    n1, n2, n3 = axis
    crossed = (ZERO, minus(n3), n2, n3, ZERO, minus(n1), minus(n2), n1, ZERO)
    if sum(map(is_zero, axis)) == 2:
        along = next(k for k, part in enumerate(axis) if not is_zero(part))
        diagonal = [ONE if k == along else cosine for k in range(3)]
        return tuple(
            diagonal[k // 4] if k % 4 == 0 else product(crossed[k], sine) for k in range(9)
        )
    versine = total([ONE, minus(cosine)])
    return tuple(
        total(
            [
                cosine if i == j else ZERO,
                product(crossed[3 * i + j], sine),
                product(versine, axis[i], axis[j]),
            ]
        )
        for i in range(3)
        for j in range(3)
    )


def quaternion_matrix(quaternion: Nodes) -> tuple[Node, ...]:
    """Return R of a quaternion with its scalar first, of second degree in its parts.

    It is a rotation where the quaternion has length 1. Of second degree, and not with this put into
    its diagonal, it keeps its axes at right angles where the length is another.
    """
    scalar, *vector = quaternion
    entries = []
    for i in range(3):
        for j in range(3):
            if i == j:
                signed = [square(v) if k == i else minus(square(v)) for k, v in enumerate(vector)]
                entries.append(total([square(scalar), *signed]))
                continue
            crossed = product(scalar, vector[3 - i - j])
            # [q]× has a minus where the column is that after the row.
            if (j - i) % 3 == 1:
                crossed = minus(crossed)
            entries.append(product(whole(2), total([product(vector[i], vector[j]), crossed])))
    return tuple(entries)


def quaternion_spin(quaternion: Nodes, *, in_space: bool) -> tuple[Node, ...]:
    """Return ω of a turning quaternion of length 1: 2 q̄ q̇ along its axes, 2 q̇ q̄ in space."""
    scalar, *vector = quaternion
    rate, *rates = (called("dot", part) for part in quaternion)
    components = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        crossed = [product(vector[j], rates[k]), minus(product(vector[k], rates[j]))]
        terms = [
            product(scalar, rates[i]),
            minus(product(vector[i], rate)),
            *(crossed if in_space else map(minus, crossed)),
        ]
        components.append(product(whole(2), total(terms)))
    return tuple(components)
