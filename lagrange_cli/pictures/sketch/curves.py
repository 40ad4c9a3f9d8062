"""Curves on which constraints keep particles, traced by steps along the tangent and Newton's
method.

A curve in a plane satisfies one equation, a curve in space two; a surface is shown by its sections
through the particle.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.pictures.sketch.configurations import Function

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.mechanics.depiction import StatedRelation
    from lagrange_cli.pictures.sketch.configurations import Configurations

    Array: TypeAlias = NDArray[np.float64]

#: A map from a place, shape (3,), to values, shape (m,), and their gradients, shape (m, 3).
Relations: TypeAlias = "Callable[[Array], tuple[Array, Array]]"

#: Steps across the bodies of a picture, and steps of one curve.
STEPS_ACROSS, _MOST_STEPS = 40, 700
#: Points of the path of an angle.
_AROUND = 96
#: Largest residual of a point of a curve, as a distance relative to the size.
_ON_CURVE = 1e-9
#: Cosine of the sharpest turn between two steps: a sharper one is a corner, where a curve ends.
_SHARPEST = 0.8


@dataclass(frozen=True)
class Restraint:
    """A constraint of the scene as it acts on one particle, everything else held at the start.

    Attributes
    ----------
    relation
        The constraint.
    particle
        Number of the particle.
    at
        φ, shape (1,), and its gradient, shape (1, 3), by the particle's place.
    """

    relation: StatedRelation
    particle: int
    at: Relations


@dataclass(frozen=True)
class Curve:
    """A polyline in space.

    Attributes
    ----------
    points
        Shape (P, 3).
    closed
        True if its end is its beginning.
    """

    points: Array
    closed: bool = False


def restraints(
    configurations: Configurations, axes: Sequence[int], rods: Collection[frozenset[int]]
) -> list[Restraint]:
    """Find the constraints that act on one particle along ``axes``, but those of ``rods``.

    A constraint between several bodies that move acts on the particle that has two names in it: a
    wedge that lies still holds the block on it.
    """
    owners: dict[str, list[tuple[int, int]]] = {}
    for number, components in enumerate(configurations.components):
        for axis, name in enumerate(components):
            owners.setdefault(name, []).append((number, axis))
    known = configurations.symbol_values(0)
    restraints = []
    for relation in configurations.depiction.relations:
        names = [s.name for s in relation.expression.free_symbols]
        bodies = frozenset(body for name in names for body, _ in owners.get(name, ()))
        if not all(name in known for name in names) or bodies in rods:
            continue
        particle = _restrained(configurations, names, owners, axes)
        # A boundary may hold a point of a body, too.
        if particle is not None and (particle < configurations.particles or relation.one_sided):
            at = _held(configurations, relation, particle)
            restraints.append(Restraint(relation, particle, at))
    return restraints


def _restrained(
    configurations: Configurations,
    names: Sequence[str],
    owners: dict[str, list[tuple[int, int]]],
    axes: Sequence[int],
) -> int | None:
    """The body that a constraint over these names acts on, None if that is none alone."""
    others = {c.name for c in configurations.equations.system.coordinates} - owners.keys()
    if not others.isdisjoint(names):
        return None
    held_points: dict[int, int] = {}
    for name in names:
        for body, axis in owners.get(name, ()):
            if np.ptp(configurations.places[:, body, axis]) > 1e-9 * configurations.size:
                held_points[body] = held_points.get(body, 0) + 1
            elif body < configurations.particles and axis in axes:
                held_points.setdefault(body, 1)
    least = 2 if len(held_points) > 1 else 1
    bodies = [body for body, count in held_points.items() if count >= least]
    return bodies[0] if len(bodies) == 1 else None


def _held(configurations: Configurations, relation: StatedRelation, particle: int) -> Relations:
    known = configurations.symbol_values(0)
    symbols = sorted(relation.expression.free_symbols, key=lambda s: s.name)
    function = Function([relation.expression], symbols)
    components = configurations.components[particle]
    numbers = np.array([known[s.name] for s in symbols])
    inputs = [(k, components.index(s.name)) for k, s in enumerate(symbols) if s.name in components]
    columns, axes = np.array(inputs).T

    def at(place: Array) -> tuple[Array, Array]:
        numbers[columns] = place[axes]
        value, slopes = function.with_gradient(numbers.tolist())
        gradient = np.zeros((1, 3))
        gradient[0, axes] = slopes[columns]
        return np.array([value]), gradient

    return at


def plane_through(place: Array, normal: Array) -> Relations:
    """Return the plane through a place as an equation."""
    return lambda point: (np.array([normal @ (point - place)]), normal[None, :])


def both(*relations: Relations) -> Relations:
    """Return several equations as one system."""

    def at(place: Array) -> tuple[Array, Array]:
        values, gradients = zip(*(relation(place) for relation in relations), strict=True)
        return np.concatenate(values), np.concatenate(gradients)

    return at


def nearest(relations: Relations, place: Array, size: float) -> Array | None:
    """Return the place near another one at which equations hold, None if Newton finds none."""
    nearest = _nearest(relations, place, size)
    return None if nearest is None else nearest[0]


def _nearest(relations: Relations, place: Array, size: float) -> tuple[Array, Array] | None:
    """Return the place, and the gradients there."""
    try:
        for _ in range(30):
            values, gradients = relations(place)
            steep = np.linalg.norm(gradients, axis=1)
            if steep.min() > 0 and (np.abs(values) <= _ON_CURVE * size * steep).all():
                return place, gradients
            place = place - np.linalg.lstsq(gradients, values, rcond=1e-9)[0]
    except (DomainError, np.linalg.LinAlgError):
        pass
    return None


def traced(
    relations: Relations, start: Array, window: tuple[Array, Array], size: float
) -> Curve | None:
    """Trace the curve that two equations leave, through a place on it and within a window.

    Its steps are a part of ``size``. Returns None if the equations leave no curve there.
    """
    at_start = _nearest(relations, start, size)
    tangent = None if at_start is None else _tangent(at_start[1])
    if tangent is None:
        return None
    ahead, closed = _followed(relations, start, tangent, window, size)
    if closed:
        return Curve(np.array([start, *ahead, start]), closed=True)
    behind, _ = _followed(relations, start, -tangent, window, size)
    points = np.array([*reversed(behind), start, *ahead])
    return Curve(points) if len(points) > 2 else None


def _followed(
    relations: Relations, start: Array, tangent: Array, window: tuple[Array, Array], size: float
) -> tuple[list[Array], bool]:
    """Follow a curve one way: its points, and whether it has come back to its start."""
    step = size / STEPS_ACROSS
    points: list[Array] = []
    place = start
    for number in range(_MOST_STEPS):
        nearest = _nearest(relations, place + step * tangent, size)
        if nearest is None or not 0.5 * step < np.linalg.norm(nearest[0] - place) < 1.5 * step:
            break
        following, turned = nearest[0], _tangent(nearest[1], tangent)
        if turned is None or turned @ tangent < _SHARPEST:
            break
        if (following < window[0]).any() or (following > window[1]).any():
            break
        place, tangent = following, turned
        if number > 4 and np.linalg.norm(place - start) < 0.6 * step:
            return points, True
        points.append(place)
    return points, False


def _tangent(gradients: Array, along: Array | None = None) -> Array | None:
    """The direction that two gradients leave, None if they leave more; nearest to ``along``."""
    tangent = np.cross(gradients[0], gradients[1])
    length = np.linalg.norm(tangent)
    steep = np.linalg.norm(gradients, axis=1)
    if length <= 1e-9 * steep[0] * steep[1] or length == 0:
        return None
    tangent = tangent / (length if along is None or tangent @ along >= 0 else -length)
    return np.asarray(tangent)


def path(
    configurations: Configurations,
    number: int,
    particle: int,
    near: tuple[Array, Array],
    far: tuple[Array, Array],
) -> Curve | None:
    """Trace the places to which one coordinate takes a particle from the start.

    The path of an angle is drawn whole if it lies in the window ``far``; of another one the part
    in ``near``.
    """
    start = configurations.places[0, particle]
    if configurations.equations.system.coordinates[number].is_angle:
        turns = np.linspace(0, 2 * np.pi, _AROUND + 1)
        try:
            points = np.array([configurations.turned(number, a)[particle] for a in turns])
        except DomainError:
            return None
        back = np.abs(points[-1] - start).max() <= _ON_CURVE * configurations.size
        if back and (points >= far[0]).all() and (points <= far[1]).all():
            return Curve(points, closed=True)
    step = configurations.size / STEPS_ACROSS
    sides = [_led(configurations, number, particle, sign, near, step) for sign in (-1, 1)]
    points = np.array([*reversed(sides[0]), start, *sides[1]])
    return Curve(points) if len(points) > 2 else None


def _led(
    configurations: Configurations,
    number: int,
    particle: int,
    sign: int,
    window: tuple[Array, Array],
    step: float,
) -> list[Array]:
    """Return places of a particle as one coordinate changes one way, about a step apart."""
    points: list[Array] = []
    place, shift = configurations.places[0, particle], 0.0
    rate = 1e-2 * float(np.ptp(configurations.q[:, number]))
    while len(points) < _MOST_STEPS:
        for _ in range(60):
            try:
                moved = configurations.turned(number, shift + sign * rate)[particle]
            except DomainError:
                return points
            distance = float(np.linalg.norm(moved - place))
            if 0.5 * step <= distance <= 1.5 * step:
                break
            rate *= 2.0 if distance == 0 else min(2.0, max(0.2, step / distance))
        else:
            return points
        if (moved < window[0]).any() or (moved > window[1]).any():
            return points
        shift, place = shift + sign * rate, moved
        points.append(place)
    return points
