"""Rods, springs and dampers of a picture, and all parts that it shows.

Links are stated by helpers, or hold at all of some feasible configurations: a distance that is the
same, a potential that is that of a spring. What holds at the start alone is not found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.pictures.sketch.angles import find_angles
from lagrange_cli.pictures.sketch.configurations import Configurations, Function, configurations
from lagrange_cli.pictures.sketch.findings import MOST_SOUGHT, MOVES, SAME, Findings, Link
from lagrange_cli.pictures.sketch.guides import Guide, frame_of, guides
from lagrange_cli.pictures.sketch.outlines import Outlines, body_links
from lagrange_cli.pictures.sketch.view import View, gravity, view_of
from lagrange_cli.pictures.sketch.wheels import Wheel, find_wheels

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.mechanics.equations import Equations

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
    """Return pairs of bodies that an equation of the scene is about."""
    configurations = known.configurations
    owners: dict[str, set[int]] = {}
    for number, components in enumerate(configurations.components):
        for name in components:
            owners.setdefault(name, set()).add(number)
    for number, coordinate in enumerate(configurations.equations.system.coordinates):
        if coordinate.name not in owners:
            owners[coordinate.name] = {k for k, on in enumerate(known.depends) if number in on}
    for relation in configurations.depiction.relations:
        owning = [owners[s.name] for s in relation.expression.free_symbols if s.name in owners]
        bodies = sorted(set[int]().union(*owning))
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


def findings(configurations: Configurations) -> Findings:
    """Find the links and angles of some configurations."""
    depends = configurations.depends
    known = Findings(configurations, list(configurations.names), configurations.places, depends)
    known.links += _stated(known)
    known.links += body_links(known)
    find_angles(known)
    known.links[:] = [link for link in known.links if link.stated or not _is_in_a_body(known, link)]
    _add_bars(known)
    known.links += _distances(known)
    known.links += _springs(known)
    known.links += _slack_ropes(known)
    add_ropes(known)
    return known


def _is_in_a_body(known: Findings, link: Link) -> bool:
    """Tell whether a line that was found ends within a rigid body, whose own lines are drawn."""
    return not _bodies(known).isdisjoint(link.ends)


def _bodies(known: Findings) -> set[int]:
    """Return the numbers of rigid bodies."""
    names = {body.name for body in known.configurations.depiction.bodies}
    return {number for number, name in enumerate(known.names) if name in names}


def _stated(known: Findings) -> Iterator[Link]:
    """Return links of helpers; none between bodies that are at one place."""
    numbers = {name: k for k, name in enumerate(known.names)}
    for link in known.configurations.depiction.links:
        ends = numbers[link.ends[0]], numbers[link.ends[1]]
        size = link.size if link.size.is_Symbol else None
        if link.kind == "distance":
            yield Link("rod", ends, size, stated=True)
        else:
            yield Link(link.kind, ends, size, stated=True)


# Bars, distances and springs that no helper states.


def _add_bars(known: Findings) -> None:
    """Add the bars of rigid lines: three bodies on one line that keep their distances.

    A bar goes from the one in the middle to both others, and takes the place of the position
    vectors from which it was found.
    """
    if len(known.names) > MOST_SOUGHT or len(known.places) < 4:
        return
    sliding = set[int]()
    in_bodies = _bodies(known) | known.on_bodies
    others = [number for number in range(len(known.names)) if number not in in_bodies]
    for triple in combinations(others, 3):
        if _is_rigid_line(known, triple):
            middle = min(triple, key=lambda k: max(known.distances(k, j)[0] for j in triple))
            for end in set(triple) - {middle}:
                _add_bar(known, middle, end)
            if any(map(known.is_fixed, triple)):
                known.barred |= {*triple}
            else:
                sliding |= {*triple}
    known.links[:] = [_as_position_vector(known, link, sliding) for link in known.links]


def _as_position_vector(known: Findings, link: Link, sliding: set[int]) -> Link:
    """Return a line from a fixed place to a bar that moves as a position vector: it is no rod."""
    found_rod = link.kind == "rod" and not link.stated
    if found_rod and known.is_fixed(link.ends[0]) and link.ends[1] in sliding:
        return Link("radius", link.ends, link.size)
    return link


def _is_rigid_line(known: Findings, triple: tuple[int, int, int]) -> bool:
    if all(map(known.is_fixed, triple)):
        return False
    if not all(known.constant(a, b) for a, b in combinations(triple, 2)):
        return False
    lengths = sorted(known.distances(a, b)[0] for a, b in combinations(triple, 2))
    return bool(lengths[0] + lengths[1] - lengths[2] <= SAME * lengths[2])


def _add_bar(known: Findings, start: int, end: int) -> None:
    replaced = [k for k in known.links if {*k.ends} == {start, end}]
    if not any(link.stated for link in replaced):
        known.links[:] = [link for link in known.links if link not in replaced]
        size = next((link.size for link in replaced), None)
        known.links.append(Link("rod", (start, end), size, stated=True))


def _distances(known: Findings) -> Iterator[Link]:
    """Return rods of equations between two bodies that keep their distance."""
    owners: dict[str, set[int]] = {}
    for number, components in enumerate(known.configurations.components):
        for name in components:
            owners.setdefault(name, set()).add(number)
    for relation in known.configurations.depiction.relations:
        owning = [owners[s.name] for s in relation.expression.free_symbols if s.name in owners]
        bodies = sorted(set().union(*owning))
        if relation.one_sided or len(bodies) != 2 or known.linked(*bodies):
            continue
        if known.constant(*bodies):
            yield Link("rod", (bodies[0], bodies[1]), stated=True)


def _springs(known: Findings) -> Iterator[Link]:
    """Return springs of potentials α d² + β d + γ of a distance d of two bodies, with α > 0."""
    configurations = known.configurations
    pairs = [ends for angle in known.angles if not angle.projected for ends in [angle.ends]]
    if known.declared <= MOST_SOUGHT:
        pairs += list(combinations(range(known.declared), 2))
    pairs = [ends for ends in dict.fromkeys(pairs) if not _has_spring(known, ends)]
    stated = [link.ends for link in known.links if link.kind == "spring"]
    for values in _potentials(configurations):
        drawn = next((ends for ends in stated if _is_spring(values, known.distances(*ends))), None)
        if drawn is not None:
            stated.remove(drawn)  # that of a spring of a helper, which others may look like
            continue
        ends = next((ends for ends in pairs if _is_spring(values, known.distances(*ends))), None)
        if ends is not None:
            pairs.remove(ends)
            known.links[:] = [
                k for k in known.links if k.kind != "radius" or set(k.ends) != set(ends)
            ]
            yield Link("spring", ends, stated=True)


def _has_spring(known: Findings, ends: tuple[int, int]) -> bool:
    return any(k.kind == "spring" and set(k.ends) == set(ends) for k in known.links)


def _potentials(configurations: Configurations) -> Iterator[Array]:
    """Values of each potential in all configurations; those that hold inputs are left out."""
    known = [configurations.symbol_values(k) for k in range(len(configurations.q))]
    for _, potential in configurations.depiction.potentials:
        symbols = sorted(potential.free_symbols, key=lambda s: s.name)
        if not all(s.name in known[0] for s in symbols):
            continue
        function = Function([potential], symbols)
        try:
            yield np.array([function([v[s.name] for s in symbols])[0] for v in known])
        except DomainError:
            continue


def _is_spring(values: Array, distances: Array) -> bool:
    spread, longest = np.ptp(values), distances.max()
    if len(values) < 6 or spread <= SAME * np.abs(values).max() or longest == 0:
        return False
    d = distances / longest
    if np.ptp(d) < 1e-3:
        return False
    columns = np.stack([d**2, d, np.ones_like(d)], axis=1)
    fit, _, rank, _ = np.linalg.lstsq(columns, values, rcond=1e-13)
    exact = np.abs(columns @ fit - values).max() <= 1e-8 * spread
    stiff = fit[0] * np.ptp(d) ** 2 > 1e-4 * spread
    return bool(rank == 3 and exact and stiff and fit[1] <= MOVES * fit[0])


# Ropes that may be slack.


def _slack_ropes(known: Findings) -> Iterator[Link]:
    """Return ropes of inequalities by which a distance is at most a length."""
    configurations = known.configurations
    relations = [r for r in configurations.depiction.relations if r.one_sided]
    for relation in relations if known.declared <= MOST_SOUGHT else ():
        symbols = sorted(relation.expression.free_symbols, key=lambda s: s.name)
        states = [configurations.symbol_values(k) for k in range(len(configurations.q))]
        if not all(s.name in states[0] for s in symbols):
            continue
        function = Function([relation.expression], symbols)
        numbers = [[state[s.name] for s in symbols] for state in states]
        ends = _ends_of_rope(known, function, numbers, [s.name for s in symbols])
        if ends is None:
            continue
        gaps = np.array([function(row)[0] for row in numbers])
        length = _rope_length(gaps, known.distances(*ends))
        if length is not None:
            sizes = [s for s in symbols if s in configurations.values]
            values = (abs(configurations.values[s] - length) <= SAME * length for s in sizes)
            size = next((s for s, alike in zip(sizes, values, strict=True) if alike), None)
            known.links[:] = [k for k in known.links if k.kind != "radius" or {*k.ends} != {*ends}]
            yield Link("rope", ends, size, True, length, relation.name)


def _ends_of_rope(
    known: Findings, function: Function, numbers: list[list[float]], names: list[str]
) -> tuple[int, int] | None:
    """Return the two bodies of an inequality, or its fixed centre and its body."""
    components = known.configurations.components
    bodies = [k for k, axes in enumerate(components) if not set(axes).isdisjoint(names)]
    if len(bodies) == 2:
        return bodies[0], bodies[1]
    if len(bodies) != 1 or len(numbers) < 6:
        return None
    columns = [names.index(name) if name in names else None for name in components[bodies[0]]]
    weights, sums = np.zeros((3, 3)), np.zeros(3)
    for place, row in zip(known.places[:, bodies[0]], numbers, strict=True):
        slopes = function.with_gradient(row)[1]
        way = np.array([0.0 if k is None else slopes[k] for k in columns])
        across = np.eye(3) - np.outer(way, way) / max(float(way @ way), 1e-300)
        weights, sums = weights + across, sums + across @ place
    centre = np.linalg.lstsq(weights, sums, rcond=1e-12)[0]
    return known.add("", np.tile(centre, (len(numbers), 1))), bodies[0]


def _rope_length(gaps: Array, distances: Array) -> float | None:
    """Return where a gap, which falls with a distance as α d² + β d + γ, is closed."""
    longest = distances.max()
    if len(gaps) < 6 or not longest > 0 or np.ptp(distances) < 1e-3 * longest:
        return None
    d = distances / longest
    columns = np.stack([d**2, d, np.ones_like(d)], axis=1)
    fit, _, rank, _ = np.linalg.lstsq(columns, gaps, rcond=1e-13)
    if rank < 3 or np.abs(columns @ fit - gaps).max() > 1e-8 * np.ptp(gaps):
        return None
    alpha, beta, gamma = np.where(np.abs(fit) > 1e-7 * np.abs(fit).max(), fit, 0.0)
    falls = bool((2 * alpha * d + beta < 0).all())
    closed = [
        float(x.real)
        for x in np.roots([alpha, beta, gamma])
        if abs(x.imag) < SAME and x.real > 0 and 2 * alpha * x.real + beta < 0
    ]
    return float(min(closed) * longest) if falls and closed else None


@dataclass(frozen=True)
class Parts:
    """Parts of a system that a picture shows.

    Attributes
    ----------
    known
        Bodies, links and angles.
    view
        How it is seen.
    curves, wheels
        Curves that hold particles, and bodies that roll.
    outlines
        Shapes of rigid bodies.
    down
        The acceleration of gravity, None without it.
    """

    known: Findings
    view: View
    curves: list[Guide]
    wheels: list[Wheel]
    outlines: Outlines
    down: Array | None


def parts_of(equations: Equations) -> Parts:
    """Find the parts of a system.

    Raises
    ------
    InputError
        There are no particles, too many bodies, or no configuration that could be drawn.
    """
    known = findings(configurations(equations))
    down = gravity(known.configurations)
    wheels = find_wheels(known.configurations, down)
    rims = [
        wheel.rim(known.places[0, wheel.particle], np.linspace(0, 2 * np.pi, 73))
        for wheel in wheels
    ]
    outlines = Outlines(known.configurations)
    view = view_of(known.configurations, down, *rims, *outlines.shown())
    return Parts(known, view, guides(known, view, frame_of(known)), wheels, outlines, down)
