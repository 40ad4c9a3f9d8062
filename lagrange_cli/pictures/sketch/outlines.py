"""Outlines of rigid bodies: rods, disks, spheres, cylinders and boxes in their places.

An outline is spanned by vectors that turn with the body, half extents from its centre of mass, so
that lines of all its shapes are sums of them with fixed factors. Some lines are those of the view:
the circle of a sphere, and the sides of a cylinder.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.pictures.sketch.configurations import Function
from lagrange_cli.pictures.sketch.findings import SAME, Findings, Link
from lagrange_cli.pictures.sketch.sketch import StrokeKind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.mechanics.depiction import BodyOutline
    from lagrange_cli.pictures.sketch.configurations import Configurations

    Array: TypeAlias = NDArray[np.float64]

_TURNS = np.linspace(0, 2 * np.pi, 49)
_RIM = np.stack([np.cos(_TURNS), np.sin(_TURNS)], axis=1)
_FLAT, _TOP, _BOTTOM = (np.column_stack([_RIM, np.full(len(_RIM), z)]) for z in (0, 1, -1))

#: Edges of a cube: pairs of corners that differ in one coordinate.
_EDGES = [
    np.array([a, b], dtype=float)
    for a, b in product(product((-1, 1), repeat=3), repeat=2)
    if a < b and sum(x != y for x, y in zip(a, b, strict=True)) == 1
]

#: Factors of the spans along each line of a shape, shape (P, spans).
FACTORS: dict[str | None, Sequence[Array]] = {
    None: (),
    "rod": (np.array([[-1.0], [1.0]]),),
    "disk": (_RIM, np.array([[0.0, 0.0], [1.0, 0.0]])),
    "sphere": (_FLAT,),
    "cylinder": (_TOP, _BOTTOM, np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]])),
    "box": _EDGES,
}


@dataclass(frozen=True)
class DrawnOutline:
    """The outline of a body at one configuration.

    Attributes
    ----------
    particle
        Number of the body.
    kind
        Its shape.
    spans
        Vectors that span it, shape (spans, 3).
    """

    particle: int
    kind: str | None
    spans: Array

    def lines(self, centre: Array, matrix: Array) -> Iterator[tuple[StrokeKind, Array]]:
        """Yield its lines in space, for a view by a matrix of shape (2, 3)."""
        stroke: StrokeKind = "rod" if self.kind == "rod" else "body"
        for factors in FACTORS[self.kind]:
            yield stroke, centre + factors @ self.spans
        if self.kind == "sphere":
            radius = float(np.linalg.norm(self.spans[0]))
            yield stroke, centre + radius * _RIM @ np.linalg.pinv(matrix).T
        if self.kind == "cylinder":
            for side in self._sides(matrix):
                yield stroke, centre + side

    def _sides(self, matrix: Array) -> Iterator[Array]:
        """Yield the lines along which a cylinder is seen from the side, if it is."""
        first, second, along = self.spans @ matrix.T
        cosine, sine = (float(a[0] * along[1] - a[1] * along[0]) for a in (first, second))
        if np.hypot(cosine, sine) <= SAME * float(self.spans[0] @ self.spans[0]):
            return
        turn = np.arctan2(sine, cosine)
        for angle in (turn, turn + np.pi):
            rim = np.cos(angle) * self.spans[0] + np.sin(angle) * self.spans[1]
            yield np.array([rim + self.spans[2], rim - self.spans[2]])


class Outlines:
    """The outlines of the rigid bodies of a scene, at any configuration."""

    def __init__(self, configurations: Configurations) -> None:
        self._configurations = configurations
        equations = configurations.equations
        numbers = {p.name: k for k, p in enumerate(equations.system.particles)}
        self.bodies = [
            (numbers[body.name], body) for body in configurations.depiction.bodies if body.spans
        ]
        inputs = [*(c.q for c in equations.system.coordinates), equations.system.t]
        spans = [e for _, body in self.bodies for span in body.spans for e in span]
        self._values = list(configurations.values.values())
        self._function = Function(spans, [*inputs, *configurations.values])

    def shown(self) -> list[Array]:
        """Return all lines of the bodies at the start in space, which a picture has to hold."""
        known = self._configurations
        outlines = self.at(known.q[0], float(known.times[0]))
        flat = np.eye(3)[:2]
        return [
            line
            for outline in outlines
            for _, line in outline.lines(known.places[0, outline.particle], flat)
        ]

    def at(self, q: Array, t: float) -> list[DrawnOutline]:
        """Return the outlines at a configuration."""
        if not self.bodies:
            return []
        spans = self._function([*q, t, *self._values]).reshape(-1, 3)
        drawn, begin = [], 0
        for number, body in self.bodies:
            end = begin + len(body.spans)
            drawn.append(DrawnOutline(number, body.kind, spans[begin:end]))
            begin = end
        return drawn


def body_links(known: Findings) -> Iterator[Link]:
    """Yield lines of bodies from their origins to what stands on them, or to their centres.

    Origins on other bodies are noted: they have no ground of their own.
    """
    configurations = known.configurations
    origins = {body.name: _origin(configurations, body) for body in configurations.depiction.bodies}
    for body in configurations.depiction.bodies:
        start = origins[body.name]
        if body.base is not None:
            known.on_bodies.add(start)
        attached = [origins[b.name] for b in configurations.depiction.bodies if b.base == body.name]
        first_point = configurations.particles
        points = enumerate(configurations.depiction.points, first_point)
        attached += [number for number, point in points if point.on == body.name]
        ends = list(_apart(known, [start, *attached]))[1:]
        centre = configurations.names.index(body.name)
        if not attached and known.distances(start, centre).max() > SAME * configurations.size:
            ends = [centre]
        for end in ends:
            yield Link("rod", (start, end), stated=True)


def _origin(configurations: Configurations, body: BodyOutline) -> int:
    """Return the number of the particle or point at the origin of a body."""
    particles = configurations.equations.system.particles
    places = [p.position for p in particles]
    places += [point.position for point in configurations.depiction.points]
    return places.index(body.origin)


def _apart(known: Findings, numbers: Sequence[int]) -> Iterator[int]:
    """Yield bodies of some that are at other places than those before them."""
    before: list[int] = []
    for number in numbers:
        near = (
            known.distances(number, k).max() <= SAME * known.configurations.size for k in before
        )
        if not any(near):
            before.append(number)
            yield number
