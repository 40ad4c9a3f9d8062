"""Rods that violate the triangle inequality: one longer than a path of others.

The triangle inequality proves that such a set of distances contradicts itself,
where a search for a configuration only fails to find one.
"""

from __future__ import annotations

import contextlib
import heapq
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentError, InputError, Problem
from lagrange_cli.mechanics.elimination.eliminate import StatedEquation
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.rank import RANK_TOLERANCE
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import quoted

#: Most rods of a path that a message names again: one line of a terminal.
_LISTED = 6


@dataclass(frozen=True)
class _Rod:
    """A distance between two bodies.

    Attributes
    ----------
    stated
        Its constraint; None between points at rest.
    ends
        Numbers of the bodies.
    """

    stated: StatedEquation | None
    ends: tuple[int, int]
    length: mpf


def overlong_rod_error(
    names: Names, stated: Sequence[StatedEquation], reference: Mapping[sp.Symbol, mpf]
) -> InputError | None:
    """Refuse a rod with a shorter path of rods between its ends; None if there is none.

    Parameters
    ----------
    reference
        Values of the parameters; distances that hold others are left out.
    """
    rods = [rod for s in stated if (rod := _rod(names, s, reference)) is not None]
    rods += _fixed(names, {end for rod in rods for end in rod.ends}, reference)
    conflict = _overlong(rods)
    return None if conflict is None else _refusal(names, *conflict, rods)


def _overlong(rods: Sequence[_Rod]) -> tuple[_Rod, list[_Rod]] | None:
    """Find the longest rod that is longer than a path of others, and this path."""
    rods_at: dict[int, list[_Rod]] = {}
    for rod in rods:
        for end in rod.ends:
            rods_at.setdefault(end, []).append(rod)
    for rod in sorted(rods, key=lambda r: -r.length):
        path = _shortest_path(rods_at, rod)
        if path and sum(r.length for r in path) < rod.length * (1 - RANK_TOLERANCE):
            return rod, path
    return None


def _fixed(
    names: Names, ends: Collection[int], reference: Mapping[sp.Symbol, mpf]
) -> Iterator[_Rod]:
    """Yield distances between massless points at constant positions."""
    constants = {p: reference[p] for p in names.parameters.values() if p in reference}
    placed = {}
    for k in sorted(ends):
        place = [names.given.get(s, s) for s in names.body_symbols[k]]
        if all(e.free_symbols <= constants.keys() for e in place):
            with contextlib.suppress(DomainError):
                placed[k] = evaluate(place, constants)
    for a, b in combinations(placed, 2):
        square = sum((x - y) ** 2 for x, y in zip(placed[a], placed[b], strict=True))
        yield _Rod(None, (a, b), mpmath.sqrt(square))


def _rod(names: Names, stated: StatedEquation, reference: Mapping[sp.Symbol, mpf]) -> _Rod | None:
    ends = None if stated.one_sided else _ends(names, stated.left)
    if ends is None:
        return None
    try:
        (square,) = evaluate([stated.right], reference)
    except (DomainError, KeyError):
        return None
    return _Rod(stated, ends, mpmath.sqrt(square)) if square >= 0 else None


def _ends(names: Names, expr: sp.Expr) -> tuple[int, int] | None:
    """Find the two bodies whose squared distance an expression is; None if it is none."""
    present = expr.free_symbols
    bodies = [k for k, body in enumerate(names.body_symbols) if set(body) <= present]
    for a, b in permutations(bodies[:2], 2):
        apart = zip(names.body_symbols[a], names.body_symbols[b], strict=True)
        if expr == sp.Add(*((x - y) ** 2 for x, y in apart)):
            return min(a, b), max(a, b)
    return None


def _shortest_path(rods_at: Mapping[int, Sequence[_Rod]], around: _Rod) -> list[_Rod]:
    """Find the shortest path between the ends of a rod (Dijkstra); empty if none is shorter.

    Parameters
    ----------
    rods_at
        The rods that end at each body.
    """
    start, end = around.ends
    reached: set[int] = set()
    queue: list[tuple[mpf, int, int, list[_Rod]]] = [(mpf(0), 0, start, [])]
    pushed = 0
    while queue and queue[0][0] < around.length:
        distance, _, body, path = heapq.heappop(queue)
        if body == end:
            return path
        if body in reached:
            continue
        reached.add(body)
        for rod in rods_at[body]:
            if rod is not around:
                far_end = rod.ends[0] if rod.ends[1] == body else rod.ends[1]
                pushed += 1
                heapq.heappush(queue, (distance + rod.length, pushed, far_end, [*path, rod]))
    return []


def _refusal(names: Names, rod: _Rod, path: Sequence[_Rod], rods: Sequence[_Rod]) -> InputError:
    stated = [r.stated for r in (*path, rod) if r.stated is not None]
    named = quoted([s.constraint for s in stated])
    ends = " and ".join(f"'{names.bodies[k].name}'" for k in rod.ends)
    reach = f"{float(sum(r.length for r in path)):.6g}"
    length = f"{float(rod.length):.6g}"
    verb = "reaches" if len(path) == 1 else "reach"
    *first, last = (_called(names, r) for r in path)
    others = f"{', '.join(first)} and {last}" if first else last
    if len(first) > _LISTED:
        others = f"the {len(path)} others"
    are = "are" if rod.stated is None else "are to be"
    contradict = "contradict" if len(stated) > 1 else "contradicts"
    plural = "s" if len(stated) > 1 else ""
    opponent = "each other" if len(stated) > 1 else "the points"
    return InconsistentError(
        Problem(
            f"constraint{plural} {named} {contradict} {opponent}: {ends} {are} {length} apart,"
            f" where {others} {verb} {reach} at most",
            stated[-1].equation.mark(),
            hint=_hint(names, rod, path, rods),
            rule="inconsistent",
        )
    )


def _hint(names: Names, rod: _Rod, path: Sequence[_Rod], rods: Sequence[_Rod]) -> str:
    """Give the lengths that a rod can have beside the others, one of them as a snippet."""
    changed, most = rod, sum((r.length for r in path), mpf(0))
    longest = max(path, key=lambda r: r.length)
    least = max(2 * longest.length - most, mpf(0))
    if rod.stated is None:
        changed = max(path, key=_preference)
        others = most - changed.length
        least, most = rod.length - others, rod.length + others
    assert changed.stated is not None
    name = changed.stated.constraint
    hint = f"'{name}' can be {float(least):.6g} to {float(most):.6g} long"
    chosen = f"{float(most - (most - least) / 10):.2g}"
    tried = [replace(r, length=mpf(chosen)) if r is changed else r for r in rods]
    if not name.isidentifier() or not least < mpf(chosen) < most or _overlong(tried):
        return hint
    a, b = (_in_a_list(names.bodies[k].name) for k in changed.ends)
    return f"{hint}:\n{name}: {{distance: [{a}, {b}], equals: {chosen}}}"


def _in_a_list(name: str) -> str:
    """Quote a name for a YAML list if needed: an element of a family has brackets."""
    return name if name.isidentifier() else f'"{name}"'


def _preference(rod: _Rod) -> tuple[bool, bool, mpf]:
    """Rank rods: stated ones before others, then those with a line of their own, then long ones."""
    stated = rod.stated is not None
    has_line = rod.stated is not None and rod.stated.constraint.isidentifier()
    return stated, has_line, rod.length


def _called(names: Names, rod: _Rod) -> str:
    if rod.stated is not None:
        return f"'{rod.stated.constraint}'"
    a, b = (names.bodies[k].name for k in rod.ends)
    return f"the way from '{a}' to '{b}'"
