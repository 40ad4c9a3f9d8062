"""Bandwidth reduction: closures in an order in which their multipliers' matrix is a narrow band.

If M is diagonal, accelerations leave M a = f + Σ λ·gradient one by one, and
the multipliers solve S λ = r with S = Φ M⁻¹ Φᵀ: symmetric, positive definite,
and zero between closures that have no coordinate in common. Elimination fills
a band alone. Chains, nets and trusses have narrow ones, in the order of the
scene or in that of Cuthill and McKee reversed (Proc. 24th ACM National
Conference, 1969, 157; George and Liu, Computer Solution of Large Sparse
Positive Definite Systems, 1981, chapter 4).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

#: Fewer unknowns than this are solved together, with pivoting.
FEWEST_UNKNOWNS = 30


def elimination_order(coordinates: Sequence[Iterable[int]]) -> tuple[int, ...]:
    """The order of closures with the narrower band: as they are, or Cuthill and McKee's reversed.

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
    """Tell whether the band is worth it for n accelerations and m multipliers."""
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
    """Level by level from an end of the graph, those of few neighbours first."""
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
    """All that are connected with one, in the order of the distance from it."""
    reached, seen = [start], {start}
    for k in reached:
        new = [j for j in neighbours[k] if j not in seen]
        reached += sorted(new, key=lambda j: (len(neighbours[j]), j))
        seen.update(new)
    return reached
