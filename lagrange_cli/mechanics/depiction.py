"""Sources of a picture of a system: points, links, constraints and potentials as stated.

Equations of motion have lost the names in which constraints were written; a picture shows them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

import sympy as sp

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.elements.motion import ElementMotion

    #: A point, the link that holds it, and the relation written over the point's place.
    _Touch: TypeAlias = tuple["PlacedPoint", "BodyLink", "StatedRelation"]


#: Most particles and points of a picture: more are a blot at the size of a page.
MOST_BODIES = 400


@dataclass(frozen=True)
class PlacedPoint:
    """A massless point.

    Attributes
    ----------
    name
        Its name.
    components
        Names of its x, y and z.
    position
        r(q, t), along x, y, z.
    latex
        LaTeX of the scene, None if absent.
    on
        Name of the body that it is fixed to, None for others.
    """

    name: str
    components: tuple[str, str, str]
    position: tuple[Expr, Expr, Expr]
    latex: str | None = None
    on: str | None = None


@dataclass(frozen=True)
class BodyLink:
    """A distance, spring or damper that a helper of the scene states.

    Attributes
    ----------
    kind
        Its key in the scene.
    ends
        Names of two particles or points.
    size
        Length of a distance, stiffness of a spring, coefficient of a damper, over the names of the
        scene.
    """

    kind: Literal["distance", "spring", "damper"]
    ends: tuple[str, str]
    size: Expr


@dataclass(frozen=True)
class StatedRelation:
    """An equation or inequality between positions.

    Attributes
    ----------
    name
        Name of its constraint.
    expression
        φ over Cartesian names, coordinates, parameters and t; φ = 0, or φ ≥ 0.
    one_sided
        True if it is φ ≥ 0.
    """

    name: str
    expression: Expr
    one_sided: bool = False


@dataclass(frozen=True)
class BodyOutline:
    """Vectors over q, t and parameters, along the axes of space, that a rigid body is drawn by.

    Attributes
    ----------
    name
        Name of the body.
    kind
        Its shape; None for moments of inertia.
    spans
        From the centre of mass: to the end of a rod; to the rim of a disk and to that a right
        angle on; the same of a sphere or cylinder, then along its axis to the end; to the middle
        of three faces of a box.
    origin
        Place of its origin.
    base
        Name of the body that it stands on, None for space.
    """

    name: str
    kind: Literal["rod", "disk", "sphere", "cylinder", "box"] | None
    spans: tuple[tuple[Expr, Expr, Expr], ...]
    origin: tuple[Expr, Expr, Expr]
    base: str | None


@dataclass(frozen=True)
class Depiction:
    """Sources of a picture besides the particles.

    Attributes
    ----------
    bodies
        Outlines of rigid bodies.
    points, links, relations
        Points, helpers between two bodies, constraints between positions.
    potentials
        Terms of V by name, over Cartesian names, coordinates, parameters and t; those that hold
        rates are left out.
    """

    bodies: tuple[BodyOutline, ...]
    points: tuple[PlacedPoint, ...]
    links: tuple[BodyLink, ...]
    relations: tuple[StatedRelation, ...]
    potentials: tuple[tuple[str, Expr], ...]

    def completed(
        self, particles: Sequence[ElementMotion], coordinates: Mapping[Symbol, bool]
    ) -> Depiction:
        """Add points of bodies that the scene does not name: their origins, and where they touch.

        ``coordinates`` says of each whether it is an angle.

        A gap that is the place of a particle along an axis and a sinusoid of an angle is that of a
        point of a body about the particle, which turns by the angle in the plane of its motion.
        """
        taken = {particle.position for particle in particles}
        taken |= {point.position for point in self.points}
        joints = []
        for body in self.bodies:
            if body.origin not in taken:
                taken.add(body.origin)
                joints.append(PlacedPoint("", joint_components(body.name), body.origin))
        named = {particle.name for particle in particles} | {point.name for point in self.points}
        touches: dict[StatedRelation, _Touch] = {}
        for relation in (r for r in self.relations if r.name not in named):
            for touch in _touching(relation, particles, coordinates):
                touches[relation] = touch
        return replace(
            self,
            points=(*self.points, *joints, *(point for point, _, _ in touches.values())),
            links=(*self.links, *(link for _, link, _ in touches.values())),
            relations=tuple(touches[r][2] if r in touches else r for r in self.relations),
        )


def joint_components(body: str) -> tuple[str, str, str]:
    """Return names of the place of a body's origin, which no scene can have."""
    return f"x of {body}", f"y of {body}", f"z of {body}"


def _touching(
    relation: StatedRelation,
    particles: Sequence[ElementMotion],
    coordinates: Mapping[Symbol, bool],
) -> Iterator[_Touch]:
    """Yield the point of a turning body by which a gap is that of a particle, if it is one."""
    symbols = {s.name: s for s in relation.expression.free_symbols}
    angles = [q for q, is_angle in coordinates.items() if is_angle and q.name in symbols]
    others = {q.name for q in coordinates if q not in angles}
    for particle in particles if relation.one_sided and len(angles) == 1 else ():
        (angle,) = angles
        moving = [k for k in range(3) if not particle.position[k].is_number]
        axes = [k for k in moving if particle.components[k] in symbols]
        if len(moving) != 2 or len(axes) != 1 or angle in particle.position[axes[0]].free_symbols:
            continue
        height = symbols[particle.components[axes[0]]]
        if not (others - {height.name}).isdisjoint(symbols):
            continue
        slope = sp.diff(relation.expression, height)
        arm = -sp.diff(relation.expression, angle, 2) * slope
        level = sp.expand(relation.expression - slope * height - arm * slope)
        if slope not in (1, -1) or arm == 0 or not level.free_symbols.isdisjoint({angle, height}):
            continue
        # Angles are counted from the first axis of the plane to the second.
        across = sp.diff(arm, angle) * (1 if axes[0] == moving[1] else -1)
        shift = {axes[0]: arm, next(k for k in moving if k != axes[0]): across}
        x, y, z = (place + shift.get(k, 0) for k, place in enumerate(particle.position))
        components = joint_components(f"the touching point of {relation.name}")
        point = PlacedPoint(relation.name, components, (x, y, z))
        length = sp.sqrt(arm**2 + across**2).subs(angle, 0)
        place = sp.Symbol(components[axes[0]], real=True)
        yield (
            point,
            BodyLink("distance", (particle.name, point.name), length),
            replace(relation, expression=slope * place + level),
        )
