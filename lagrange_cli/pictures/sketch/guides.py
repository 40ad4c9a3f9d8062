"""The curves of a picture: constraints on single particles, boundaries, paths of coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.pictures.sketch.curves import (
    STEPS_ACROSS,
    Curve,
    Relations,
    Restraint,
    both,
    nearest,
    path,
    plane_through,
    restraints,
    traced,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.pictures.sketch.findings import Findings
    from lagrange_cli.pictures.sketch.view import View

    Array: TypeAlias = NDArray[np.float64]
    Window: TypeAlias = tuple[Array, Array]

#: Half the window of curves beside the bodies, and of closed ones, relative to the size.
_NEAR, _FAR = 0.45, 1.6
#: Most curves of a picture.
_MOST_CURVES = 24


@dataclass(frozen=True)
class Guide:
    """A curve with what it belongs to.

    Attributes
    ----------
    name
        Name of the constraint, or of the coordinate whose path it is.
    particle
        Number of the particle.
    curve
        The curve.
    outside
        For a one-sided constraint the direction in which it is violated, shape (3,); else None.
    """

    name: str
    particle: int
    curve: Curve
    outside: Array | None = None


@dataclass(frozen=True)
class Frame:
    """The window in space within which curves are drawn.

    Attributes
    ----------
    low, high
        Corners of a box around the bodies.
    size
        Its largest extent, or another length if it has none.
    """

    low: Array
    high: Array
    size: float

    def window(self, part: float) -> Window:
        return self.low - part * self.size, self.high + part * self.size


def frame_of(known: Findings, count: int = 1) -> Frame:
    """Find a box around the bodies in the first configurations, and around the origin where they
    are at one place."""
    places = known.places[:count].reshape(-1, 3)
    extent = float(np.ptp(places, axis=0).max())
    far = float(np.abs(places).max())
    if extent < 1e-9 * far:
        places = np.concatenate([places, np.zeros((1, 3))])
        extent = far
    return Frame(places.min(axis=0), places.max(axis=0), extent or 1.0)


def guides(known: Findings, view: View, frame: Frame) -> list[Guide]:
    """Find the curves of a picture, each once."""
    drawn: list[Guide] = []
    for guide in _all_guides(known, view, frame):
        if len(drawn) < _MOST_CURVES and not any(
            _alike(guide, partner, frame) for partner in drawn
        ):
            drawn.append(guide)
    return drawn


def _all_guides(known: Findings, view: View, frame: Frame) -> Iterator[Guide]:
    rods = {frozenset(link.ends) for link in known.links if link.kind == "rod" and link.stated}
    drawn = {link.constraint for link in known.links if link.constraint}
    stated = restraints(known.configurations, view.axes, rods)
    stated = [r for r in stated if r.relation.name not in drawn]
    # The circle on which a bar leads its end is no wire.
    stated = [r for r in stated if r.particle not in known.barred or r.relation.one_sided]
    bilateral = [r for r in stated if not r.relation.one_sided]
    for restraint in stated:
        partners = [r for r in bilateral if r.particle == restraint.particle]
        if view.is_flat or restraint not in partners:
            yield from _restraint_guides(known, restraint, None, view, frame)
        elif restraint is partners[0]:
            partner = partners[1] if len(partners) > 1 else None
            yield from _restraint_guides(known, restraint, partner, view, frame)
    restrained = {restraint.particle for restraint in bilateral}
    if known.configurations.particles <= _MOST_CURVES:
        for particle in range(known.configurations.particles):
            if particle not in restrained:
                yield from _path_guides(known, particle, frame)


def _alike(one: Guide, second: Guide, frame: Frame) -> bool:
    """Tell whether one curve lies on another."""
    if (one.outside is None) != (second.outside is None):
        return False
    marks = one.curve.points[[0, len(one.curve.points) // 2, -1]]
    apart = np.linalg.norm(second.curve.points[:, None] - marks[None], axis=2).min(axis=0)
    return bool(apart.max() < 1.2 / STEPS_ACROSS * frame.size)  # an end may be a step farther


# Constraints.


def _restraint_guides(
    known: Findings, restraint: Restraint, partner: Restraint | None, view: View, frame: Frame
) -> Iterator[Guide]:
    """Curves of a constraint: of one that holds through the particle, of a gap at the nearest
    place where it closes."""
    place = known.places[0, restraint.particle]
    one_sided = restraint.relation.one_sided
    try:
        start = nearest(restraint.at, place, frame.size)
        gradient = None if start is None else restraint.at(start)[1][0]
    except DomainError:
        return
    if start is None or gradient is None:
        return
    steep = float(np.linalg.norm(gradient))
    seen = float(np.linalg.norm(gradient[list(view.axes)]))
    farthest = 3 * frame.size if one_sided else 1e-6 * frame.size
    if not seen > 1e-9 * steep > 0 or np.linalg.norm(start - place) > farthest:
        return
    normal = gradient / steep
    if view.is_flat:
        curves = [_framed(both(restraint.at, _flat_plane(start, view)), start, frame)]
    else:
        curves = _in_space(restraint, partner, start, normal, view, frame)
    for curve in curves:
        if curve is not None:
            outside = -normal if one_sided else None
            yield Guide(restraint.relation.name, restraint.particle, curve, outside)


def _flat_plane(start: Array, view: View) -> Relations:
    across = np.ones(3)
    across[list(view.axes)] = 0
    return plane_through(start, across)


def _framed(relations: Relations, start: Array, frame: Frame) -> Curve | None:
    """Trace a curve: the whole if it is closed and not far larger than the rest, else a part."""
    low, high = frame.window(_NEAR)
    window = np.minimum(low, start), np.maximum(high, start)
    part = traced(relations, start, window, frame.size)
    if part is None or (part.closed and len(part.points) > 60):
        return part
    if part.closed:
        return traced(relations, start, window, frame.size / 6)  # a small one in smaller steps
    whole = traced(relations, start, frame.window(_FAR), frame.size)
    return whole if whole is not None and whole.closed else part


def _in_space(
    restraint: Restraint,
    partner: Restraint | None,
    start: Array,
    normal: Array,
    view: View,
    frame: Frame,
) -> list[Curve | None]:
    """The line that two constraints leave, or a piece of a plane, or sections of a surface."""
    if partner is not None:
        return [_framed(both(restraint.at, partner.at), start, frame)]
    if _is_plane(restraint, start, normal, frame):
        return [_patch(start, normal, frame)]
    up = view.matrix[1] * (np.abs(view.matrix[0]) < 1e-12)
    upright = np.cross(up, normal)
    if np.linalg.norm(upright) < 1e-6:
        normals = list(np.eye(3)[np.flatnonzero(up == 0)])
    else:
        normals = [up, upright / np.linalg.norm(upright)]
    return [_framed(both(restraint.at, plane_through(start, n)), start, frame) for n in normals]


def _is_plane(restraint: Restraint, start: Array, normal: Array, frame: Frame) -> bool:
    """Tell whether the gradient has one direction at places around."""
    for shift in (*np.eye(3), np.array([0.7, -0.4, 0.5])):
        try:
            gradient = restraint.at(start + 0.5 * frame.size * shift)[1][0]
        except DomainError:
            return False
        length = float(np.linalg.norm(gradient))
        if length == 0 or np.abs(gradient / length - normal).max() > 1e-9:
            return False
    return True


def _patch(start: Array, normal: Array, frame: Frame) -> Curve:
    """Return a square of a plane around a place, two sides of it along an axis."""
    axis = np.eye(3)[int(np.abs(normal).argmin())]
    first = np.cross(normal, axis)
    first = first / np.linalg.norm(first)
    second = np.cross(normal, first)
    centre = (frame.low + frame.high) / 2
    centre = centre - ((centre - start) @ normal) * normal
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)]
    half = 0.75 * frame.size
    return Curve(np.array([centre + half * (a * first + b * second) for a, b in corners]), True)


# Paths of coordinates.


def _path_guides(known: Findings, particle: int, frame: Frame) -> Iterator[Guide]:
    """The path of a particle that one coordinate alone moves, unless it goes round on a rod."""
    configurations = known.configurations
    coordinates = configurations.equations.system.coordinates
    closed = {k for c in configurations.equations.system.closures for k in c.coordinate_numbers}
    moving = list(known.depends[particle])
    if len(moving) != 1 or moving[0] in closed:
        return
    on_rod = any(particle in link.ends and link.kind == "rod" for link in known.links)
    if (on_rod or _is_beside_its_origin(known, particle)) and not _is_driven(known, particle):
        return
    number = moving[0]
    curve = path(configurations, number, particle, frame.window(_NEAR), frame.window(_FAR))
    if curve is not None and not _is_straight(curve.points):
        yield Guide(coordinates[number].name, particle, curve)


def _is_beside_its_origin(known: Findings, particle: int) -> bool:
    """Tell whether it is the centre of a rigid body whose own lines lead from its origin."""
    origins = {body.name: body.origin for body in known.configurations.depiction.bodies}
    body = known.configurations.equations.system.particles[particle]
    return origins.get(body.name, body.position) != body.position


def _is_driven(known: Findings, particle: int) -> bool:
    """Tell whether a line of given direction holds a particle, which turns as time goes on."""
    configurations = known.configurations
    if not configurations.equations.derivation.facts.rheonomic:
        return False
    ends = [link.ends for link in known.links if link.kind == "rod" and particle in link.ends]
    try:
        later = configurations.moved(configurations.q[0], float(configurations.times[0]) + 0.137)
    except DomainError:
        return False
    for a, b in ends:
        partner = a if b == particle else b
        if known.is_fixed(partner):
            shift = later[particle] - known.places[0, particle]
            return bool(np.abs(shift).max() > 1e-9 * configurations.size)
    return False


def _is_straight(points: Array) -> bool:
    along = points - points[0]
    return bool(np.linalg.matrix_rank(along, tol=1e-7 * np.abs(along).max()) < 2)
