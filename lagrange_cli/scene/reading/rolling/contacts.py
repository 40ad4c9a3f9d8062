"""Bodies on surfaces: ``touch`` and ``roll``, written out as equations.

A sphere of radius R about the origin c of its body touches a plane at c − R n, a disk with the
axis a at c − R f, where f is the unit vector along n − (n·a) a. It touches a sphere or a cylinder
at c − R n as well, where n is ±d/|d|, outwards or inwards, and d the vector to c from the centre or
the axis. It rolls without slip where this point of the body has the velocity of the surface there
(H. Goldstein, C. Poole and J. Safko, Classical Mechanics, 3rd ed. 2002, section 1.3), along n by
the rate of the distance alone. On a sphere that is said along the y axis e of its frame and along
e × n, which is enough unless n lies along e. No two directions span the tangents everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from lagrange_cli.scene.bodies import ComposedExpression
from lagrange_cli.scene.joints import Joint
from lagrange_cli.scene.language.expression import Call, Equation, Expression, Neg, Node
from lagrange_cli.scene.language.rotations import (
    ONE,
    ZERO,
    Nodes,
    called,
    dot,
    is_zero,
    minus,
    product,
    quotient,
    square,
    times,
    total,
)
from lagrange_cli.scene.reading.chains import NO_VECTOR, SPACE, Placed
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.frames import frame_named, placed_against
from lagrange_cli.scene.reading.helpers import NOTATION, Written
from lagrange_cli.scene.reading.inertia import number_of
from lagrange_cli.scene.reading.interactions import helper_part, place_of
from lagrange_cli.scene.reading.joints import Direction, joint_equation, read_direction
from lagrange_cli.scene.reading.rolling.surfaces import (
    Plane,
    Round,
    Surface,
    crossed,
    is_positive,
    read_surface,
    unit_vector,
)
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode
from lagrange_cli.scene.reading.turns import across_plane

_KEYS = ("radius", "axis", "on")

_NO_AXIS = Direction((), SPACE, "")


@dataclass(frozen=True)
class _Contact:
    """A body that touches a surface.

    Attributes
    ----------
    body, name
        The frame of the body, and its name.
    surface
        The surface.
    radius
        Its radius.
    up
        Unit vector from the point of contact to the centre of the body.
    sides
        Distance of the centre from the surface, and what it is when they touch.
    height
        Component of ``up`` along the normal of the surface.
    axis
        The axis of a disk; of a sphere, and across the plane of a scene, it has no components.
    """

    body: Placed
    name: str
    surface: Surface
    radius: Expression
    up: Nodes
    sides: tuple[Node, Node]
    height: Node = ONE
    axis: Direction = _NO_AXIS

    @property
    def shape(self) -> str:
        return "plane" if isinstance(self.surface, Plane) else self.surface.shape


def touch(node: Mapping, what: str, reading: Reading) -> Written | None:
    """Read ``{touch: BODY, radius: R, axis: y, on: SURFACE}``: the nearest point is on it."""
    contact = _contact("touch", node, what, reading)
    if contact is None:
        return None
    return _written("touch", contact, [_touching(contact, node)], node, reading)


def roll(node: Mapping, what: str, reading: Reading) -> Written | None:
    """Read ``{roll: BODY, ...}``: the nearest point is on the surface, and does not slip."""
    contact = _contact("roll", node, what, reading)
    if contact is None:
        return None
    equations = [_touching(contact, node), *_without_slip(contact, node)]
    return _written("roll", contact, equations, node, reading)


def _written(
    kind: Literal["touch", "roll"],
    contact: _Contact,
    equations: list[Equation],
    node: Mapping,
    reading: Reading,
) -> Written:
    height, surface = contact.height, contact.surface
    positive = None
    if number_of(height) is None and not _is_root(height):
        text = f"height of the centre of {contact.name}"
        positive = ComposedExpression(height, text, place_of(node), exact=False)
    radii = (contact.radius,) if isinstance(surface, Plane) else (contact.radius, surface.radius)
    parts, constants = (
        (contact.name, *surface.parts),
        (contact.radius, *contact.axis.written, *surface.written),
    )
    joint = Joint(kind, parts, radii, positive, constants, _round(contact, across_plane(reading)))
    return Written(tuple(equations), joint)


def _round(contact: _Contact, across: int | None) -> tuple[Literal["disk", "sphere"], int] | None:
    """Return the shape that touches, and its axis; in a plane it is a disk about ``across``."""
    if not contact.axis.components:
        return ("sphere", 2) if across is None else ("disk", across)
    axes = [k for k, part in enumerate(contact.axis.components) if not is_zero(part)]
    return ("disk", axes[0]) if len(axes) == 1 else None


def _is_root(node: Node) -> bool:
    return isinstance(node, Call) and node.function == "sqrt"


def _contact(key: str, node: Mapping, what: str, reading: Reading) -> _Contact | None:
    fields = reading.fields(node, what, (key, *_KEYS, *NOTATION), required=(key, "radius", "on"))
    if not {"radius", "on"} <= fields.keys():
        return None
    body = frame_named(fields[key], f"'{key}' of {what}", reading)
    radius = helper_part(fields["radius"], "radius", what, reading)
    if radius is not None and not is_positive(radius, what, reading):
        return None
    surface = read_surface(fields["on"], what, reading)
    axis = _axis(fields.get("axis"), what, reading)
    if body is None or radius is None or surface is None or axis is None:
        return None
    name, placed = body
    frame = surface.parts[-1]
    if name == frame:
        reading.problems.add(
            f"the {surface.parts[0]} of {what} is fixed in '{name}' itself",
            fields["on"].mark,
            rule="shape",
        )
        return None
    # In the axes of the surface nothing of its own motion is left.
    against = placed_against(name, frame, reading) if frame else None
    if against is not None:
        placed, surface = against, surface.at_rest
    elif frame:
        surface = surface.in_space
    if isinstance(surface, Plane):
        return _on_plane(placed, name, surface, radius, axis)
    if axis.components:
        reading.problems.add(
            f"a disk touches planes alone, and {what} has a {surface.shape}",
            fields["axis"].mark,
            hint="leave 'axis' out for a sphere",
            rule="shape",
        )
        return None
    return _on_round(placed, name, surface, radius)


def _on_plane(
    body: Placed,
    name: str,
    plane: Plane,
    radius: Expression,
    axis: Direction,
) -> _Contact:
    """Return the contact n·(c − p) = R n·f."""
    up, height = _up(body, unit_vector(axis.components), plane.normal)
    above = [total([c, minus(p)]) for c, p in zip(body.origin, plane.point, strict=True)]
    sides = dot(plane.normal, above), product(radius.node, height)
    return _Contact(body, name, plane, radius, up, sides, height, axis)


def _on_round(body: Placed, name: str, surface: Round, radius: Expression) -> _Contact:
    """Return the contact |d| − a = R from outside, a − |d| = R from inside."""
    away = surface.away(body.origin)
    distance = called("norm", *(part for part in away if not is_zero(part)))
    large, small = surface.radius.node, radius.node
    if surface.is_inside:
        whole, gap = total([large, minus(small)]), total([large, minus(distance)])
        away = [minus(part) for part in away]
    else:
        whole, gap = total([large, small]), total([distance, minus(large)])
    up = [quotient(part, whole) for part in away]
    return _Contact(body, name, surface, radius, up, (gap, small))


def _axis(node: SourceNode | None, what: str, reading: Reading) -> Direction | None:
    """Read the axis of a disk in the axes of its body; that of a sphere has no components."""
    across = across_plane(reading)
    is_across = across is not None and isinstance(node, Scalar) and node.text == AXES[across]
    if node is None or is_across:
        return _NO_AXIS
    return read_direction(node, "axis", what, reading)


def _up(body: Placed, axis: Nodes, normal: Nodes) -> tuple[Nodes, Node]:
    """Return the unit vector to the centre of a body from its point that is lowest over a plane.

    Its component along the normal stands beside it. Where an axis of the disk's plane lies along
    the other plane whatever the coordinates are, the one across it points up, and no root is
    needed. Turns about the axis of the disk are left out.
    """
    along = times(body.last.rotation, axis) if axis else NO_VECTOR
    cosine = dot(normal, along)
    if is_zero(cosine):
        return normal, ONE
    number = next((k for k in range(3) if number_of(axis[k]) == 1), None)
    if number is not None:
        spins = body.last.axis == number and len(body.stages) > 1
        rotation = body.stages[-2].rotation if spins else body.last.rotation
        first, second = (rotation[k::3] for k in range(3) if k != number)
        for up, across in ((first, second), (second, first)):
            if is_zero(dot(normal, across)):
                height = dot(normal, up)
                if isinstance(height, Neg):  # an axis that points down
                    return [minus(part) for part in up], minus(height)
                return up, height
    tilted = [total([n, minus(product(cosine, a))]) for n, a in zip(normal, along, strict=True)]
    length = called("sqrt", total([ONE, minus(square(cosine))]))
    return tuple(quotient(part, length) for part in tilted), length


def _touching(contact: _Contact, node: Mapping) -> Equation:
    return joint_equation(*contact.sides, f"{contact.name} touches the {contact.shape}", node)


def _without_slip(contact: _Contact, node: Mapping) -> Iterator[Equation]:
    """Write no slip along each tangent of a surface."""
    surface = contact.surface
    if isinstance(surface, Plane):
        slips = _slips_on_plane(contact, surface)
    else:
        slips = _slips_on_round(contact, surface)
    for k, (of_body, of_surface) in enumerate(slips, 1):
        text = f"{contact.name} does not slip along direction {k} of the {contact.shape}"
        yield joint_equation(of_body, of_surface, text, node)


def _slips_on_plane(contact: _Contact, plane: Plane) -> Iterator[tuple[Node, Node]]:
    """Return the sides of t·(ċ + ω × (p − c)) = t·(ȯ + Ω × (p − o)) for the tangents t."""
    arm = [minus(product(contact.radius.node, part)) for part in contact.up]
    of_body = _velocity(contact.body, arm)
    frame = plane.frame
    place = [
        total([c, part, minus(o)])
        for c, part, o in zip(contact.body.origin, arm, frame.origin, strict=True)
    ]
    of_plane = NO_VECTOR if frame is SPACE else _velocity(frame, place)
    for tangent in plane.tangents:
        yield dot(tangent, of_body), dot(tangent, of_plane)


def _slips_on_round(contact: _Contact, surface: Round) -> Iterator[tuple[Node, Node]]:
    """Return the sides of t·ċ − R ω·(n × t) = t·(ȯ + Ω × (c − o)) − R Ω·(n × t).

    n × t is written without the squares that n × (e × n) has.
    """
    body, frame, radius = contact.body, surface.frame, contact.radius.node
    arm = [total([c, minus(o)]) for c, o in zip(body.origin, frame.origin, strict=True)]
    of_body = _velocity(body, NO_VECTOR)
    of_surface = NO_VECTOR if frame is SPACE else _velocity(frame, arm)
    for tangent, moment in _tangents(contact, surface):
        sides = [
            total([dot(tangent, velocity), minus(product(radius, dot(spin, moment)))])
            for velocity, spin in (
                (of_body, body.last.spin_in_space),
                (of_surface, frame.last.spin_in_space),
            )
        ]
        yield sides[0], sides[1]


def _tangents(contact: _Contact, surface: Round) -> Iterator[tuple[Nodes, Nodes]]:
    """Yield tangents t with n × t: in the plane of a scene one, along the circle."""
    axis, up = surface.axis, contact.up
    across = crossed(axis, up)
    if not surface.is_ball:
        yield across, axis
        if not surface.is_flat:
            yield axis, [minus(part) for part in across]
        return
    along = dot(axis, up)
    yield across, [total([e, minus(product(along, n))]) for e, n in zip(axis, up, strict=True)]
    yield axis, [minus(part) for part in across]


def _velocity(frame: Placed, arm: Nodes) -> list[Node]:
    """Return the velocity of a point fixed in a frame, at an arm from its origin."""
    turning = crossed(frame.last.spin_in_space, arm)
    return [
        total([ZERO if number_of(o) is not None else called("dot", o), part])
        for o, part in zip(frame.origin, turning, strict=True)
    ]
