"""Sparse L D Lᵀ of the multipliers of a large system: order, bandwidth and layout.

If M is diagonal, accelerations leave M a = f + Σ λ·gradient one by one, and the multipliers solve S
λ = r with S = Φ M⁻¹ Φᵀ: symmetric, positive definite, and zero between closures that have no
coordinate in common. S = L D Lᵀ is computed without pivoting (as stable as Cholesky's method;
Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed., ch. 10). The pattern of L is
known beforehand. Elimination fills a band alone, and chains, nets and trusses have narrow ones, in
the order of the scene or in that of Cuthill and McKee reversed (Proc. 24th ACM National Conference,
1969, 157; George and Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981,
chapter 4). The order of least degree (George and Liu, *SIAM Review* 31 (1989) 1) fills far less for
nets; its columns of L with one pattern are supernodes, which are dense rectangles (Ng and Peyton,
*SIAM J. Sci. Comput.* 14 (1993) 1034).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from heapq import heapify, heappop, heappush

#: Fewer unknowns than this are solved together, with pivoting.
FEWEST_UNKNOWNS = 30

#: Bands as narrow as this are taken without looking for another order.
_NARROW = 4

#: Operations of a band in the time of one operation of supernodes.
_SPEED_OF_BAND = 2

#: Part of the numbers of a supernode that may be zeros for the sake of its rectangle.
_ZEROS = 0.25

#: Supernodes of fewer columns are merged whatever zeros that stores.
_FEWEST_COLUMNS = 3


def elimination_order(coordinates: Sequence[Iterable[int]]) -> tuple[int, ...]:
    """Order closures for the narrower band: as they are, or by Cuthill and McKee, reversed.

    Parameters
    ----------
    coordinates
        The coordinates of each closure.
    """
    neighbours = couplings(coordinates)
    natural = tuple(range(len(neighbours)))
    narrowed = tuple(reversed(_cuthill_mckee(neighbours)))
    return min(natural, narrowed, key=lambda order: _width(neighbours, order))


def bandwidth(coordinates: Sequence[Iterable[int]]) -> int:
    """Largest distance between closures that have a coordinate in common."""
    return _width(couplings(coordinates), range(len(coordinates)))


def operations_of_band(m: int, width: int) -> int:
    """Operations that solve for m multipliers: those of the band, and of substitution."""
    return m * (width * (width + 1) + 4 * width + 2)


def is_banded(n: int, m: int, width: int) -> bool:
    """Tell whether a band saves operations for n accelerations and m multipliers."""
    size = n + m
    return size >= FEWEST_UNKNOWNS and operations_of_band(m, width) < 2 * size**3 // 3


def couplings(coordinates: Sequence[Iterable[int]]) -> list[list[int]]:
    """List for each closure the others that share a coordinate with it."""
    at: dict[int, list[int]] = {}
    for k, row in enumerate(coordinates):
        for j in row:
            at.setdefault(j, []).append(k)
    neighbours: list[set[int]] = [set() for _ in coordinates]
    for sharing in at.values():
        for k in sharing:
            neighbours[k].update(sharing)
    return [sorted(others - {k}) for k, others in enumerate(neighbours)]


def _width(neighbours: Sequence[Sequence[int]], order: Sequence[int]) -> int:
    place = {k: position for position, k in enumerate(order)}
    distances = (abs(place[k] - place[j]) for k, row in enumerate(neighbours) for j in row)
    return max(distances, default=0)


def _cuthill_mckee(neighbours: Sequence[Sequence[int]]) -> list[int]:
    """Order nodes level by level from an end of the graph, those of few neighbours first."""
    order: list[int] = []
    left = set(range(len(neighbours)))
    while left:
        start = min(left, key=lambda k: (len(neighbours[k]), k))
        start = _levels(neighbours, start)[-1]
        component = _levels(neighbours, start)
        order += component
        left.difference_update(component)
    return order


def _levels(neighbours: Sequence[Sequence[int]], start: int) -> list[int]:
    """List all nodes that are connected with one, in the order of the distance from it."""
    reached, seen = [start], {start}
    for k in reached:
        new = [j for j in neighbours[k] if j not in seen]
        reached += sorted(new, key=lambda j: (len(neighbours[j]), j))
        seen.update(new)
    return reached


@dataclass(frozen=True)
class BandFactors:
    """L D Lᵀ of a band: rows from the diagonal on to ``width`` columns right of it.

    ``order``: the closures, first to last.
    """

    order: tuple[int, ...]
    width: int

    @property
    def numbers(self) -> int:
        """Numbers of the matrix."""
        return len(self.order) * (self.width + 1)

    @property
    def workspace_size(self) -> int:
        """Size of the workspace, which begins with x."""
        return 2 * len(self.order)

    @property
    def operations(self) -> int:
        return operations_of_band(len(self.order), self.width)

    def place(self, row: int, column: int) -> int:
        """Index an entry of the lower triangle, by positions in the order."""
        return column * (self.width + 1) + row - column


@dataclass(frozen=True)
class Update:
    """The update of a later supernode by an earlier one.

    Attributes
    ----------
    source
        Number of the earlier supernode.
    first, last
        Its rows from ``first`` to before ``last`` are columns of the later one.
    rows
        Rows of the later one at which its rows from ``first`` on stand.
    """

    source: int
    first: int
    last: int
    rows: tuple[int, ...]


@dataclass(frozen=True)
class Supernode:
    """Neighbouring columns of L with nonzeros in the same rows.

    Attributes
    ----------
    first, columns
        Position of the first column, and number of columns.
    rows
        Positions of nonzeros, ascending; they begin with the columns themselves.
    start
        Index of the first number; columns follow each other, each with as many as rows.
    updates
        Updates by earlier supernodes.
    """

    first: int
    columns: int
    rows: tuple[int, ...]
    start: int
    updates: tuple[Update, ...]


@dataclass(frozen=True)
class SupernodalFactors:
    """L D Lᵀ by dense rectangles.

    ``order``: the closures, first to last.
    """

    order: tuple[int, ...]
    nodes: tuple[Supernode, ...]

    @property
    def numbers(self) -> int:
        """Numbers of the matrix."""
        return sum(node.columns * len(node.rows) for node in self.nodes)

    @property
    def workspace_size(self) -> int:
        """Numbers of workspace: x, reciprocals of the pivots, and a column."""
        return 2 * len(self.order) + max(len(node.rows) for node in self.nodes)

    @property
    def operations(self) -> int:
        """Operations that solve for the multipliers."""
        return sum(_operations_of_node(self.nodes, node) for node in self.nodes)

    @cached_property
    def _places(self) -> dict[tuple[int, int], int]:
        return {
            (row, node.first + k): node.start + k * len(node.rows) + i
            for node in self.nodes
            for k in range(node.columns)
            for i, row in enumerate(node.rows[k:], k)
        }

    def place(self, row: int, column: int) -> int:
        """Index an entry of the lower triangle, by positions in the order."""
        return self._places[row, column]


Factors = BandFactors | SupernodalFactors


def choose_factorization(coordinates: Sequence[Iterable[int]]) -> Factors:
    """Choose band or supernodes, whichever is cheaper, from the coordinates of each closure."""
    coordinates = [tuple(row) for row in coordinates]
    order = elimination_order(coordinates)
    band = BandFactors(order, bandwidth([coordinates[k] for k in order]))
    if band.width <= _NARROW:
        return band
    nodes = supernodes(couplings(coordinates))
    return nodes if _SPEED_OF_BAND * nodes.operations < band.operations else band


def supernodes(touching: Sequence[Iterable[int]]) -> SupernodalFactors:
    """Make supernodes in an order of least degree, from the coordinates of each closure."""
    order, filled = _least_degree(touching)
    order, filled = _children_first(order, filled)
    spans = _merged(filled)
    nodes: list[Supernode] = []
    start = 0
    for first, last, below in spans:
        rows = (*range(first, last), *below)
        nodes.append(Supernode(first, last - first, rows, start, ()))
        start += (last - first) * len(rows)
    return SupernodalFactors(tuple(order), tuple(_updated(nodes)))


def _least_degree(touching: Sequence[Iterable[int]]) -> tuple[list[int], list[list[int]]]:
    """Eliminate the node of least degree first.

    Returns the order, and the nodes that each touched then, by positions in the order.
    """
    left = [set(others) for others in touching]
    heap = [(len(others), k) for k, others in enumerate(left)]
    heapify(heap)
    order: list[int] = []
    filled: list[set[int]] = []
    done: set[int] = set()
    while heap:
        degree, k = heappop(heap)
        if k in done or degree != len(left[k]):
            continue
        done.add(k)
        order.append(k)
        filled.append(left[k])
        for j in left[k]:
            left[j] |= left[k]
            left[j] -= {j, k}
            heappush(heap, (len(left[j]), j))
    place = {k: position for position, k in enumerate(order)}
    return order, [sorted(place[j] for j in others) for others in filled]


def _children_first(order: list[int], filled: list[list[int]]) -> tuple[list[int], list[list[int]]]:
    """Reorder an elimination so that columns of one pattern are neighbours.

    The order is that of the elimination tree, in which the parent of a column is the first column
    that it touches.
    """
    children: list[list[int]] = [[] for _ in order]
    roots: list[int] = []
    for k, rows in enumerate(filled):
        (children[rows[0]] if rows else roots).append(k)
    postorder: list[int] = []
    stack = roots[::-1]
    while stack:
        k = stack.pop()
        postorder.append(k)
        stack.extend(children[k])
    postorder.reverse()
    place = {k: position for position, k in enumerate(postorder)}
    return [order[k] for k in postorder], [sorted(place[j] for j in filled[k]) for k in postorder]


def _merged(filled: Sequence[Sequence[int]]) -> list[tuple[int, int, Sequence[int]]]:
    """List first column, the column after the last, and the rows of each supernode."""
    spans: list[tuple[int, int, Sequence[int]]] = []
    zeros = 0
    for k, rows in enumerate(filled):
        if spans:
            first, last, below = spans[-1]
            columns = last - first
            if below and below[0] == k:
                more = zeros + columns * (len(rows) + 1 - len(below))
                size = (columns + 1) * (columns + 1 + len(rows))
                if more <= _ZEROS * size or columns < _FEWEST_COLUMNS:
                    spans[-1] = first, k + 1, rows
                    zeros = more
                    continue
        spans.append((k, k + 1, rows))
        zeros = 0
    return spans


def _updated(nodes: Sequence[Supernode]) -> list[Supernode]:
    """Return the supernodes with the updates by earlier ones."""
    owner = {
        column: number
        for number, node in enumerate(nodes)
        for column in range(node.first, node.first + node.columns)
    }
    updates: list[list[Update]] = [[] for _ in nodes]
    for source, node in enumerate(nodes):
        first = node.columns
        while first < len(node.rows):
            target = owner[node.rows[first]]
            last = first
            while last < len(node.rows) and owner[node.rows[last]] == target:
                last += 1
            at = {row: i for i, row in enumerate(nodes[target].rows)}
            rows = tuple(at[row] for row in node.rows[first:])
            updates[target].append(Update(source, first, last, rows))
            first = last
    pairs = zip(nodes, updates, strict=True)
    return [replace(node, updates=tuple(received)) for node, received in pairs]


def _operations_of_node(nodes: Sequence[Supernode], node: Supernode) -> int:
    """Operations that a supernode takes: updates, elimination, and substitution."""
    total, height = 0, len(node.rows)
    for update in node.updates:
        source = nodes[update.source]
        for k in range(update.first, update.last):
            total += (len(source.rows) - k) * (2 * source.columns + 1) + source.columns
    for k in range(node.columns):
        # Reciprocal of the pivot; columns right of it; ratios; forward and backward.
        later = sum(2 * (height - j) + 1 for j in range(k + 1, node.columns))
        total += 2 + later + 5 * (height - k - 1) + 1
    return total
