"""Vectors and tensors of expressions that stay as they are built, sharing their parts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from decimal import Decimal
from typing import Any, TypeAlias

import sympy as sp

from lagrange_cli.mechanics.elements.tree import ENTRIES

Vector: TypeAlias = tuple[sp.Expr, sp.Expr, sp.Expr]

_ZERO, _ONE, _MINUS = sp.S.Zero, sp.S.One, sp.S.NegativeOne
NO_VECTOR: Vector = (_ZERO, _ZERO, _ZERO)

_PLACE = ((0, 3, 4), (3, 1, 5), (4, 5, 2))


class Shared:
    """Sums and products that stay as they are built, each of the same operands one object.

    SymPy would put a sum within a sum into one, so that all frames' sums grew with their place.
    """

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], tuple[sp.Expr, tuple[sp.Expr, ...]]] = {}

    def _built(self, kind: type[sp.Expr], operands: tuple[sp.Expr, ...]) -> sp.Expr:
        key = (kind, *map(id, operands))
        if key not in self._known:
            # The operands are kept, so that their ids stay their own.
            self._known[key] = kind(*operands, evaluate=False), operands
        return self._known[key][0]

    def add(self, *terms: sp.Expr) -> sp.Expr:
        """Return a sum without terms that are zero."""
        present = tuple(term for term in terms if term is not _ZERO)
        if len(present) < 2:
            return present[0] if present else _ZERO
        if all(term.is_Number for term in present):
            return sp.Add(*present)
        return self._built(sp.Add, present)

    def multiply(self, *factors: sp.Expr) -> sp.Expr:
        """Return a product without factors that are one, with its number in front."""
        number, parts = _ONE, list[sp.Expr]()
        for factor in factors:
            if factor.is_Number:
                number *= factor
            elif factor.is_Mul and factor.args[0] is _MINUS:
                number = -number
                parts += factor.args[1:]
            else:
                parts.append(factor)
        if number is _ZERO or not parts:
            return sp.sympify(number)
        whole = (number, *parts) if number is not _ONE else tuple(parts)
        return whole[0] if len(whole) == 1 else self._built(sp.Mul, whole)

    def minus(self, term: sp.Expr) -> sp.Expr:
        return self.multiply(_MINUS, term)

    def total(self, vectors: Iterable[Vector]) -> Vector:
        listed = list(vectors)
        x, y, z = (self.add(*(v[k] for v in listed)) for k in range(3))
        return x, y, z

    def scaled(self, factor: sp.Expr, vector: Vector) -> Vector:
        x, y, z = (self.multiply(factor, part) for part in vector)
        return x, y, z

    def dot(self, a: Vector, b: Vector) -> sp.Expr:
        return self.add(*(self.multiply(x, y) for x, y in zip(a, b, strict=True)))

    def cross(self, a: Vector, b: Vector) -> Vector:
        x, y, z = (
            self.add(self.multiply(a[i], b[j]), self.minus(self.multiply(a[j], b[i])))
            for i, j in ((1, 2), (2, 0), (0, 1))
        )
        return x, y, z

    def times(self, tensor: Sequence[sp.Expr], vector: Vector) -> Vector:
        """Return a symmetric tensor times a vector."""
        x, y, z = (
            self.add(*(self.multiply(tensor[_PLACE[i][j]], vector[j]) for j in range(3)))
            for i in range(3)
        )
        return x, y, z

    def moved(self, moment: Vector, step: Vector) -> list[sp.Expr]:
        """Return (m·d) 1 − (m dᵀ + d mᵀ)/2, of a point mass with the first moment m at d."""
        products = [[self.multiply(a, b) for b in step] for a in moment]
        tensor = []
        for i, j in ENTRIES:
            if i == j:
                tensor.append(self.add(*(products[k][k] for k in range(3) if k != i)))
            else:
                tensor.append(self.minus(products[i][j]))
        return tensor

    def moved_both(self, moment: Vector, doubled: Vector, step: Vector) -> list[sp.Expr]:
        """Return the change of a tensor about an origin at −d, with M d + m as ``doubled``."""
        first = [[self.multiply(a, b) for b in step] for a in doubled]
        second = [[self.multiply(a, b) for b in step] for a in moment]
        tensor = []
        for i, j in ENTRIES:
            if i == j:
                parts = [p[k][k] for k in range(3) if k != i for p in (first, second)]
                tensor.append(self.add(*parts))
            else:
                tensor.append(self.minus(self.add(first[i][j], second[j][i])))
        return tensor


class NumberVectors(Shared):
    """The same sums and products of decimals."""

    def add(self, *terms: Any) -> Any:
        """Return the sum."""
        return sum(terms, Decimal(0))

    def multiply(self, *factors: Any) -> Any:
        """Return the product."""
        return math.prod(factors, start=Decimal(1))

    def minus(self, term: Any) -> Any:
        """Return the opposite."""
        return -term
