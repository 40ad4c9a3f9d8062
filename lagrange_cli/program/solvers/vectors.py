"""Vectors, tensors and matrices of three rows of values on a graph, along the axes of space."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.mechanics.elements.tree import ENTRIES
from lagrange_cli.program.graph.value_graph import ONE, ScaledNode, ValueGraph

if TYPE_CHECKING:
    from sympy import Expr

ZERO: ScaledNode = (0, ONE)

Vector: TypeAlias = tuple[ScaledNode, ScaledNode, ScaledNode]
Matrix: TypeAlias = tuple[Vector, Vector, Vector]

NO_VECTOR: Vector = (ZERO, ZERO, ZERO)


class Vectors:
    """Operations on vectors and matrices of three rows."""

    def __init__(self, values: ValueGraph) -> None:
        self.values = values

    def add(self, terms: Iterable[ScaledNode]) -> ScaledNode:
        return self.values.add(terms)

    def multiply(self, a: ScaledNode, b: ScaledNode) -> ScaledNode:
        return self.values.multiply([(a, 1), (b, 1)])

    def over(self, a: ScaledNode, b: ScaledNode) -> ScaledNode:
        """Divide by a number whose reciprocal is a value of its own."""
        return self.multiply(a, self.values.multiply([(b, -1)]))

    def vector(self, components: Sequence[Expr]) -> Vector:
        """Convert expressions."""
        x, y, z = map(self.values.convert, components)
        return x, y, z

    def scaled(self, factor: ScaledNode, vector: Vector) -> Vector:
        x, y, z = (self.multiply(factor, part) for part in vector)
        return x, y, z

    def divided(self, vector: Vector, divisor: ScaledNode) -> Vector:
        return self.scaled(self.values.multiply([(divisor, -1)]), vector)

    def sum(self, a: Vector, b: Vector) -> Vector:
        x, y, z = (self.add(pair) for pair in zip(a, b, strict=True))
        return x, y, z

    def dot(self, a: Vector, b: Vector) -> ScaledNode:
        return self.add([self.multiply(x, y) for x, y in zip(a, b, strict=True)])

    def cross(self, a: Vector, b: Vector) -> Vector:
        x, y, z = (
            self.add([self.multiply(a[i], b[j]), negative(self.multiply(a[j], b[i]))])
            for i, j in ((1, 2), (2, 0), (0, 1))
        )
        return x, y, z

    def times(self, matrix: Matrix, vector: Vector) -> Vector:
        x, y, z = (self.dot(row, vector) for row in matrix)
        return x, y, z

    def crossed(self, vector: Vector, rows: Matrix) -> Matrix:
        """Return the cross products of a vector with the rows of a matrix, as rows."""
        x, y, z = (self.cross(vector, row) for row in rows)
        return x, y, z

    def plus(self, a: Matrix, b: Matrix, *, is_symmetric: bool = False) -> Matrix:
        if is_symmetric:
            return symmetric([self.add([a[i][j], b[i][j]]) for i, j in ENTRIES])
        x, y, z = map(self.sum, a, b)
        return x, y, z

    def less(self, matrix: Matrix, a: Vector, b: Vector, *, is_symmetric: bool = False) -> Matrix:
        """Return a matrix less a bᵀ."""

        def entry(i: int, j: int) -> ScaledNode:
            return self.add([matrix[i][j], negative(self.multiply(a[i], b[j]))])

        if is_symmetric:
            return symmetric([entry(i, j) for i, j in ENTRIES])
        x, y, z = ((entry(i, 0), entry(i, 1), entry(i, 2)) for i in range(3))
        return x, y, z


def negative(value: ScaledNode) -> ScaledNode:
    return -value[0], value[1]


def opposite(vector: Vector) -> Vector:
    x, y, z = map(negative, vector)
    return x, y, z


def cross_matrix(vector: Vector) -> Matrix:
    """Return the matrix that multiplies by a vector from the left, as a cross product."""
    x, y, z = vector
    return (ZERO, negative(z), y), (z, ZERO, negative(x)), (negative(y), x, ZERO)


def transposed(matrix: Matrix) -> Matrix:
    x, y, z = zip(*matrix, strict=True)
    return x, y, z


def symmetric(entries: Sequence[ScaledNode]) -> Matrix:
    """Return the matrix of the entries at :data:`.tree.ENTRIES`."""
    xx, yy, zz, xy, xz, yz = entries
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)
