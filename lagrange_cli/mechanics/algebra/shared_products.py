"""Recurring products of Jacobian entries in the mass matrix Σ m JᵀJ.

In a chain the same term stands in the positions of all particles beyond a link, so that
few of the products differ. Each different part has a set of components that hold it, as
the bits of a number; the set of a product is the intersection. The work is the number of
different products instead of that number times the number of particles.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import sympy as sp


@dataclass(frozen=True)
class MovingComponent:
    """A Cartesian component of a position.

    Attributes
    ----------
    jacobian
        Coordinate number and terms of ∂r/∂q.
    convective
        Terms of the part of r̈ without accelerations.
    """

    jacobian: Sequence[tuple[int, Sequence[sp.Expr]]]
    convective: Sequence[sp.Expr]


@dataclass(frozen=True)
class _Part:
    """An expression that recurs in the Jacobian of positions.

    Attributes
    ----------
    coordinate
        Its column; −1 for the convective part of r̈.
    expression
        The expression.
    components
        Bit k is set if component k holds it there.
    """

    coordinate: int
    expression: sp.Expr
    components: int


class RecurringProducts:
    """The different products; iteration yields (row, column, factor, factor, components).

    ``column`` −1 is the forcing. ``components`` has the bit k where component k
    holds the product.
    """

    def __init__(self, clusters: Sequence[Sequence[_Part]]) -> None:
        self._clusters = clusters
        self.number = sum(1 for _ in self)

    def __iter__(self) -> Iterator[tuple[int, int, sp.Expr, sp.Expr, int]]:
        for parts in self._clusters:
            moving = [p for p in parts if p.coordinate >= 0]
            convective = [p for p in parts if p.coordinate < 0]
            for i, first in enumerate(moving):
                yield from _squares(first, moving[i:])
                for g in convective:
                    shared = first.components & g.components
                    if shared:
                        yield first.coordinate, -1, first.expression, g.expression, shared


def _squares(
    first: _Part, later: Sequence[_Part]
) -> Iterator[tuple[int, int, sp.Expr, sp.Expr, int]]:
    """Multiply a part by itself and by later ones, for the upper triangle."""
    for second in later:
        shared = first.components & second.components
        if not shared:
            continue
        a, b = (first, second) if first.coordinate <= second.coordinate else (second, first)
        yield a.coordinate, b.coordinate, a.expression, b.expression, shared
        if a.coordinate == b.coordinate and first is not second:
            yield a.coordinate, b.coordinate, b.expression, a.expression, shared


def recurring_products(components: Iterable[MovingComponent]) -> RecurringProducts:
    """Find all products of Jacobian parts with each other and with convective terms."""
    masks: dict[tuple[int, sp.Expr, int], int] = {}
    clusters = _Clusters()
    for number, moving in enumerate(components):
        keys = list(_keys(moving))
        for key in keys:
            masks[key] = masks.get(key, 0) | 1 << number
        clusters.join(keys)
    parts = {key: _Part(key[0], key[1], mask) for key, mask in masks.items()}
    return RecurringProducts([[parts[key] for key in keys] for keys in clusters.sorted(masks)])


def _keys(moving: MovingComponent) -> Iterator[tuple[int, sp.Expr, int]]:
    """Key each part of a component: (coordinate, expression, number of earlier occurrences)."""
    seen: dict[tuple[int, sp.Expr], int] = {}
    rows = [*moving.jacobian, (-1, moving.convective)]
    for coordinate, expressions in rows:
        for expression in expressions:
            before = seen.get((coordinate, expression), 0)
            seen[coordinate, expression] = before + 1
            yield coordinate, expression, before


class _Clusters:
    """Keys that share a component, directly or through others (union–find)."""

    def __init__(self) -> None:
        self._parent: dict[object, object] = {}

    def _root(self, key: object) -> object:
        self._parent.setdefault(key, key)
        while self._parent[key] != key:
            self._parent[key] = self._parent[self._parent[key]]
            key = self._parent[key]
        return key

    def join(self, keys: Sequence[object]) -> None:
        for key in keys:
            self._parent[self._root(key)] = self._root(keys[0])

    def sorted(
        self, keys: Iterable[tuple[int, sp.Expr, int]]
    ) -> list[list[tuple[int, sp.Expr, int]]]:
        """List the clusters, in the order of their first keys."""
        clusters: dict[object, list[tuple[int, sp.Expr, int]]] = {}
        for key in keys:
            clusters.setdefault(self._root(key), []).append(key)
        return list(clusters.values())
