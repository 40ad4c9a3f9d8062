"""Ropes of a picture, from one body over a pulley, or two, to another.

A rope is drawn where its length is the same in all of some feasible configurations. Pulleys that
the scene does not place stand where the lengths of an equation begin: with ``z1 + z2 = -l`` on
the lines of both weights at z = 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.emit.sketch.findings import MOST_SOUGHT, MOVES, SAME, Findings, Link

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array: TypeAlias = NDArray[np.float64]


def add_ropes(known: Findings) -> None:
    """Find ropes and add them to the links, with the pulleys that they need."""
    if known.declared > MOST_SOUGHT or len(known.places) < 4:
        return
    roped = set[frozenset[int]]()
    for a, b, hub in list(_over_a_pulley(known)):
        roped.add(frozenset((a, b)))
        _add(known, a, hub, b)
    for a, b in _stated_pairs(known):
        if frozenset((a, b)) not in roped and not known.constant(a, b):
            _add_between_lines(known, a, b)


def _over_a_pulley(known: Findings) -> Iterator[tuple[int, int, int]]:
    """Two bodies and a fixed place or point, the sum of whose distances from it is constant."""
    particles = known.configurations.particles
    hubs = [k for k in range(particles, len(known.names)) if known.is_fixed(k)]
    hubs += [k for k in range(particles, known.declared) if not known.is_fixed(k)]
    for hub in hubs:
        bodies = range(particles) if known.is_fixed(hub) else range(known.declared)
        for a, b in combinations(bodies, 2):
            lengths = known.distances(a, hub), known.distances(b, hub)
            if hub not in (a, b) and _is_rope(*lengths):
                yield a, b, hub


def _is_rope(first: Array, second: Array) -> bool:
    """Tell whether two lengths change, and their sum does not."""
    whole = first + second
    changes = np.ptp(first) >= MOVES * whole[0] > 0
    return bool(changes and np.ptp(whole) <= SAME * whole[0])


def _stated_pairs(known: Findings) -> Iterator[tuple[int, int]]:
    """Pairs of bodies that an equation of the scene is about."""
    configurations = known.configurations
    owners: dict[str, set[int]] = {}
    for number, components in enumerate(configurations.components):
        for name in components:
            owners.setdefault(name, set()).add(number)
    for number, coordinate in enumerate(configurations.equations.coordinates):
        if coordinate.name not in owners:
            owners[coordinate.name] = {k for k, on in enumerate(known.depends) if number in on}
    for relation in configurations.depiction.relations:
        held = [owners[s.name] for s in relation.expression.free_symbols if s.name in owners]
        bodies = sorted(set[int]().union(*held))
        if not relation.one_sided and len(bodies) == 2:
            yield bodies[0], bodies[1]


def _add_between_lines(known: Findings, a: int, b: int) -> None:
    """Add the rope of two bodies over fixed places, or those where their lines begin."""
    for first in _pulleys(known, a):
        for second in _pulleys(known, b):
            lengths = _lengths(known, a, first), _lengths(known, b, second)
            if _is_rope(*lengths):
                _add(known, a, known.add("", first), known.add("", second), b)
                return


def _pulleys(known: Findings, body: int) -> list[Array]:
    """Places over which a rope to a body may run, each in all configurations, shape (K, 3)."""
    fixed = [k for k in range(len(known.names)) if k != body and known.is_fixed(k)]
    places = [known.places[:, k] for k in fixed]
    path = known.places[:, body]
    moves = np.ptp(path, axis=0) > SAME * known.configurations.size
    if moves.sum() == 1:
        places.append(np.where(moves, 0.0, path[0]) * np.ones_like(path))
    return places


def _lengths(known: Findings, body: int, place: Array) -> Array:
    lengths: Array = np.linalg.norm(known.places[:, body] - place, axis=1)
    return lengths


def _add(known: Findings, *way: int) -> None:
    """Add a rope from the first of some bodies over the others to the last."""
    pairs = [(a, b) for a, b in pairwise(way) if a != b]
    known.links[:] = [
        link
        for link in known.links
        if link.kind != "radius" or not any({*link.ends} == {*pair} for pair in pairs)
    ]
    # Both ends first: a picture names a rope by its body.
    ends = [(way[0], way[1]), (way[-1], way[-2]), *pairwise(way[1:-1])]
    known.links += [Link("rope", pair) for pair in ends if pair[0] != pair[1]]
