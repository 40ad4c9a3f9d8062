"""Distances between configurations, and coordinates that give the same configuration.

Angles a turn apart are one angle where all forces say so; with polar coordinates (r, φ) and
(−r, φ + π) are one place. Configurations are compared by the places of particles, and by the
coordinates that no place shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.values import DIGITS, Equilibrium, Mpf
from lagrange_cli.mechanics.elements.motion import QuaternionParts
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate

#: Difference, relative to 1 and to the values, below which configurations are one: an angle that is
#: a root of its cosine keeps half of its digits.
_SAME = mpf(10) ** -20


def distance(system: RestSystem, first: Sequence[Mpf], second: Sequence[Mpf]) -> Mpf:
    """Measure the largest difference between two configurations but for free coordinates."""
    numbers = range(len(system.equations.system.coordinates))
    pairs = [(k, first[k], second[k]) for k in numbers if k not in system.free]
    return _difference(system, pairs)


def _difference(system: RestSystem, pairs: Sequence[tuple[int, Mpf, Mpf]]) -> Mpf:
    """Find the largest difference of coordinates of these numbers, relative to 1 and to them."""
    largest = mpf(0)
    for k, a, b in pairs:
        gap = abs(a - b)
        if k in system.periodic:
            largest = max(largest, abs(gap - 2 * mpmath.pi * mpmath.nint(gap / (2 * mpmath.pi))))
        else:
            largest = max(largest, gap / max(1, abs(a)))
    return largest


def without_contained(
    coordinates: Sequence[Coordinate], points: Sequence[Equilibrium]
) -> list[Equilibrium]:
    """Keep closed forms that no other one contains, by its free coordinates or fewer conditions.

    Of equal ones the first stays.
    """
    symbols = {c.name: c.q for c in coordinates}
    kept_points: list[Equilibrium] = []
    for place, point in enumerate(points):
        later = (p for p in points[place + 1 :] if not _contains(symbols, point, p))
        if not any(_contains(symbols, whole, point) for whole in (*kept_points, *later)):
            kept_points.append(point)
    return kept_points


def _contains(symbols: Mapping[str, sp.Symbol], whole: Equilibrium, part: Equilibrium) -> bool:
    """Say whether a closed form is another one, with its free coordinates at some values."""
    if whole.exact is None or part.exact is None:
        return False
    if not set(whole.conditions) <= set(part.conditions) or not set(part.free) <= set(whole.free):
        return False
    values = dict(zip(symbols, part.exact, strict=True))
    chosen = {symbols[name]: values[name] for name in whole.free}
    return tuple(e.xreplace(chosen) for e in whole.exact) == part.exact


def without_opposites(equations: Equations, points: Sequence[Equilibrium]) -> list[Equilibrium]:
    """Keep one of two closed forms that differ by the sign of a quaternion: q and −q are one turn.

    It is the one whose first part that is not 0 is positive, where it is among them.
    """
    places = {c.q: k for k, c in enumerate(equations.system.coordinates)}
    quaternions = [
        [places[part] for part in turn.parts]
        for particle in equations.system.particles
        for turn in (particle.turning.turns if particle.turning else ())
        if isinstance(turn, QuaternionParts) and set(turn.parts) <= places.keys()
    ]
    distinct: dict[object, Equilibrium] = {}
    for point in points:
        turned = list(point.exact or ())
        for numbers in quaternions if turned else ():
            first = next((turned[k] for k in numbers if turned[k] != 0), None)
            if first is not None and first.could_extract_minus_sign():
                for k in numbers:
                    turned[k] = -turned[k]
        key = (tuple(turned), point.conditions, point.free)
        if key not in distinct or tuple(turned) == point.exact:
            distinct[key] = point
    return list(distinct.values())


def without_repeats(system: RestSystem, points: Sequence[Equilibrium]) -> list[Equilibrium]:
    """Keep the first of several equilibria with the same configuration."""
    distinct: list[tuple[Equilibrium, list[Mpf] | None]] = []
    shown = _Places(system)
    for point in points:
        places = shown.at(point)
        if not any(shown.is_same(point, places, *known) for known in distinct):
            distinct.append((point, places))
    return [point for point, _ in distinct]


def is_turned(
    system: RestSystem, first: Equilibrium, second: Equilibrium, turn: Mapping[sp.Symbol, Mpf]
) -> bool:
    """Say whether an equilibrium puts all particles where another one does, turned by angles.

    ``turn``: values of angles that are no coordinates of the system, beside those it has them at.
    """
    places = _Places(system).at(first)
    turned = _Places(replace(system, known={**system.known, **turn}))
    return turned.is_same(first, places, second, turned.at(second))


class _Places:
    """Positions of all particles, by which configurations are compared."""

    def __init__(self, system: RestSystem) -> None:
        self.system = system
        equations = system.equations
        still = {equations.system.t: sp.S.Zero}
        self.positions = [
            x.xreplace(still)
            for particle in equations.system.particles
            for point in particle.material_points
            for x in point
        ]
        symbols = set().union(*(x.free_symbols for x in self.positions))
        # Windings of a torsion spring show in no place.
        self.others = [
            k
            for k, c in enumerate(equations.system.coordinates)
            if k not in system.free
            and (c.q not in symbols or (c.is_angle and k not in system.periodic))
        ]

    def _is_within(self, point: Equilibrium, continuum: Equilibrium) -> bool:
        """Say whether a point agrees with a continuum but for the free coordinates of that."""
        if not set(point.free) <= set(continuum.free):
            return False
        pairs = [
            (k, a, b)
            for k, (a, b) in enumerate(
                zip(point.position or (), continuum.position or (), strict=True)
            )
            if self.system.equations.system.coordinates[k].name not in continuum.free
        ]
        return bool(_difference(self.system, pairs) < _room(point, continuum))

    def at(self, point: Equilibrium) -> list[Mpf] | None:
        """Evaluate the places; None if they have no values."""
        if point.position is None:
            return None
        coordinates = self.system.equations.system.coordinates
        pairs = zip(coordinates, point.position, strict=True)
        known = {**self.system.known, **{c.q: x for c, x in pairs}}
        with mpmath.workdps(DIGITS):
            try:
                return evaluate(self.positions, known)
            except (DomainError, KeyError):
                return None

    def is_same(
        self,
        point: Equilibrium,
        places: list[Mpf] | None,
        known: Equilibrium,
        known_places: list[Mpf] | None,
    ) -> bool:
        """Say whether an equilibrium is a known one, or lies in its continuum."""
        if point.position is None or known.position is None:
            same = point.exact == known.exact
            return same and point.conditions == known.conditions
        if self._is_within(point, known):
            return True
        if not places or not known_places:
            return False
        room = _room(point, known)
        unplaced = [(k, point.position[k], known.position[k]) for k in self.others]
        near = all(
            abs(a - b) < room * max(1, abs(a)) for a, b in zip(places, known_places, strict=True)
        )
        return near and _difference(self.system, unplaced) < room


def _room(first: Equilibrium, second: Equilibrium) -> Mpf:
    """Return the difference, relative to 1 and to values, below which two equilibria are one."""
    return max(_SAME, mpf(first.uncertainty) + mpf(second.uncertainty))
