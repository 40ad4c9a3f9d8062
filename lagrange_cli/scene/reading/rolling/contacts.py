"""Bodies on surfaces: ``touch`` and ``roll``, written out as equations.

A sphere of radius R about the origin c of its body touches a plane at c − R n, a disk with the
axis a at c − R f, where f is the unit vector along n − (n·a) a. It rolls without slip where this
point of the body has the velocity of the plane there (H. Goldstein, C. Poole and J. Safko,
Classical Mechanics, 3rd ed. 2002, section 1.3), along n by the rate of the distance alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
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
    named,
    product,
    quotient,
    square,
    times,
    total,
)
from lagrange_cli.scene.reading.chains import NO_VECTOR, SPACE, Placed
from lagrange_cli.scene.reading.declarations import AXES, component
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.frames import frame_named, placed_against
from lagrange_cli.scene.reading.helpers import NOTATION, Written, is_unit
from lagrange_cli.scene.reading.inertia import number_of
from lagrange_cli.scene.reading.interactions import flat, helper_part, known_body, place_of
from lagrange_cli.scene.reading.joints import Direction, joint_equation, read_direction
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode
from lagrange_cli.scene.reading.source import Sequence as Items
from lagrange_cli.scene.reading.turns import across_plane, vector_of

_KEYS = ("radius", "axis", "on")


@dataclass(frozen=True)
class _Plane:
    """A plane, at rest or fixed in a frame.

    Attributes
    ----------
    point, normal
        A point of it and its unit normal.
    tangents
        Unit vectors in it, at right angles; one in the plane of a scene.
    frame
        The frame that it moves with; space if it is at rest in the axes of these vectors.
    parts
        Texts of the point and of the normal, and the name of the frame.
    written
        Expressions that it is given by.
    """

    point: Nodes
    normal: Nodes
    tangents: Sequence[Nodes]
    frame: Placed
    parts: tuple[str, ...]
    written: tuple[Expression, ...] = ()

    @property
    def in_space(self) -> _Plane:
        """The plane with its vectors along the axes of space instead of those of its frame."""
        frame = self.frame
        tangents = [times(frame.last.rotation, tangent) for tangent in self.tangents]
        normal = times(frame.last.rotation, self.normal)
        return replace(self, point=frame.place(self.point), normal=normal, tangents=tangents)

    @property
    def at_rest(self) -> _Plane:
        """The plane as its own frame sees it."""
        return replace(self, frame=SPACE)


@dataclass(frozen=True)
class _Contact:
    """A body that touches a plane.

    Attributes
    ----------
    body, name
        The frame of the body, and its name.
    plane
        The plane.
    radius
        Its radius.
    up
        Unit vector from the point of contact to the centre.
    height
        Component of that along the normal.
    written
        The radius, and expressions that the axis and the plane are given by.
    """

    body: Placed
    name: str
    plane: _Plane
    radius: Expression
    up: Nodes
    height: Node
    written: tuple[Expression, ...]


def touch(node: Mapping, what: str, reading: Reading) -> Written | None:
    """Read ``{touch: BODY, radius: R, axis: y, on: PLANE}``: the lowest point is on the plane."""
    contact = _contact("touch", node, what, reading)
    return (
        None if contact is None else _written("touch", contact, (_touching(contact, node),), node)
    )


def roll(node: Mapping, what: str, reading: Reading) -> Written | None:
    """Read ``{roll: BODY, ...}``: the lowest point is on the plane, and does not slip."""
    contact = _contact("roll", node, what, reading)
    if contact is None:
        return None
    equations = (_touching(contact, node), *_without_slip(contact, node))
    return _written("roll", contact, equations, node)


def _written(
    kind: Literal["touch", "roll"],
    contact: _Contact,
    equations: tuple[Equation, ...],
    node: Mapping,
) -> Written:
    height = contact.height
    positive = None
    if number_of(height) is None and not _is_root(height):
        text = f"height of the centre of {contact.name}"
        positive = ComposedExpression(height, text, place_of(node), exact=False)
    parts = (contact.name, *contact.plane.parts)
    return Written(equations, Joint(kind, parts, contact.radius, positive, contact.written))


def _is_root(node: Node) -> bool:
    return isinstance(node, Call) and node.function == "sqrt"


def _contact(key: str, node: Mapping, what: str, reading: Reading) -> _Contact | None:
    fields = reading.fields(node, what, (key, *_KEYS, *NOTATION), required=(key, "radius", "on"))
    if not {"radius", "on"} <= fields.keys():
        return None
    body = frame_named(fields[key], f"'{key}' of {what}", reading)
    radius = helper_part(fields["radius"], "radius", what, reading)
    if radius is not None and not _is_positive(radius, what, reading):
        return None
    plane = _plane(fields["on"], what, reading)
    axis = _axis(fields.get("axis"), what, reading)
    if body is None or radius is None or plane is None or axis is None:
        return None
    name, placed = body
    if name == plane.parts[-1]:
        reading.problems.add(
            f"the plane of {what} is fixed in '{name}' itself", fields["on"].mark, rule="shape"
        )
        return None
    # In the axes of the plane nothing of its own motion is left.
    against = placed_against(name, plane.parts[-1], reading) if plane.parts[-1] else None
    if against is not None:
        placed, plane = against, plane.at_rest
    elif plane.parts[-1]:
        plane = plane.in_space
    up = _up(placed, _unit_vector(axis.components), plane.normal)
    written = (radius, *axis.written, *plane.written)
    return _Contact(placed, name, plane, radius, *up, written)


def _is_positive(radius: Expression, what: str, reading: Reading) -> bool:
    value = number_of(radius.node)
    if value is None or value > 0:
        return True
    reading.problems.add(
        f"the radius in {what} must be positive, found {radius.text}",
        radius.mark(),
        rule="not-positive",
    )
    return False


def _axis(node: SourceNode | None, what: str, reading: Reading) -> Direction | None:
    """Read the axis of a disk in the axes of its body; that of a sphere has no components."""
    across = across_plane(reading)
    is_across = across is not None and isinstance(node, Scalar) and node.text == AXES[across]
    if node is None or is_across:
        return Direction((), SPACE, "")
    return read_direction(node, "axis", what, reading)


def _unit_vector(components: Nodes) -> tuple[Node, ...]:
    if not components or is_unit(list(components)):
        return tuple(components)
    length = called("sqrt", total([square(part) for part in components]))
    return tuple(quotient(part, length) for part in components)


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
    """Return n·(c − p) = R n·f."""
    plane = contact.plane
    above = [total([c, minus(p)]) for c, p in zip(contact.body.origin, plane.point, strict=True)]
    height = product(contact.radius.node, contact.height)
    return joint_equation(
        dot(plane.normal, above), height, f"{contact.name} touches the plane", node
    )


def _without_slip(contact: _Contact, node: Mapping) -> list[Equation]:
    """Return t·(ċ + ω × (p − c)) = t·(ȯ + Ω × (p − o)) for the tangents t of the plane."""
    arm = [minus(product(contact.radius.node, part)) for part in contact.up]
    of_body = _velocity(contact.body, arm)
    frame = contact.plane.frame
    place = [
        total([c, part, minus(o)])
        for c, part, o in zip(contact.body.origin, arm, frame.origin, strict=True)
    ]
    of_plane = NO_VECTOR if frame is SPACE else _velocity(frame, place)
    return [
        joint_equation(
            dot(tangent, of_body),
            dot(tangent, of_plane),
            f"{contact.name} does not slip along direction {k} of the plane",
            node,
        )
        for k, tangent in enumerate(contact.plane.tangents, 1)
    ]


def _velocity(frame: Placed, arm: Nodes) -> list[Node]:
    """Return the velocity of a point fixed in a frame, at an arm from its origin."""
    crossed = _crossed(frame.last.spin_in_space, arm)
    return [
        total([ZERO if number_of(o) is not None else called("dot", o), part])
        for o, part in zip(frame.origin, crossed, strict=True)
    ]


# Planes.


def _plane(node: SourceNode, what: str, reading: Reading) -> _Plane | None:
    """Read ``{point, normal}``, perhaps ``on`` a frame, or a frame for its xy plane."""
    if isinstance(node, Scalar):
        named_frame = frame_named(node, f"'on' of {what}", reading)
        if named_frame is None or not _stands_across(node, what, reading):
            return None
        name, frame = named_frame
        upward = Direction((ZERO, ZERO, ONE), frame, "z", name)
        return _fixed_plane("", (), upward, reading)
    label = f"'on' of {what}"
    mapping = reading.mapping(node, label, "a plane {point, normal}, or a frame")
    if mapping is None:
        return None
    fields = reading.fields(mapping, label, ("point", "normal", "on"), required=("normal",))
    if "normal" not in fields:
        return None
    on = frame_named(fields["on"], f"'on' of {what}", reading) if "on" in fields else ("", SPACE)
    normal = read_direction(fields["normal"], "normal", what, reading)
    point = _point(fields.get("point"), what, reading, "on" in fields)
    if on is None or normal is None or point is None:
        return None
    fixed = replace(normal, frame=on[1], frame_name=on[0])
    return _fixed_plane(*point, fixed, reading)


def _stands_across(node: Scalar, what: str, reading: Reading) -> bool:
    """Refuse the xy plane of a frame in a scene that moves in it."""
    if across_plane(reading) != 2:
        return True
    reading.problems.add(
        f"the xy plane of '{node.text}' in {what} is the plane of the scene",
        node.mark,
        hint=f"name the normal: {{on: {node.text}, normal: y}}",
        rule="plane",
    )
    return False


def _point(
    node: SourceNode | None, what: str, reading: Reading, in_frame: bool
) -> tuple[str, tuple[Expression, ...]] | None:
    """Read a point by its name, or by its coordinates; the origin if there is none."""
    if node is None:
        return "", ()
    if isinstance(node, Items):
        vector = vector_of(node, "point", what, reading)
        if vector is None:
            return None
        return f"({', '.join(map(flat, vector))})", vector
    if not isinstance(node, Scalar) or in_frame:
        reading.expected("a point [x, y, z]", f"'point' of {what}", node)
        return None
    name = known_body(node, what, "point", reading)
    if name is None:
        return None
    names = [component(axis, name) for axis in AXES]
    return name, tuple(Expression(named(n), n, node.mark, exact=False) for n in names)


def _fixed_plane(
    text: str, point: tuple[Expression, ...], normal: Direction, reading: Reading
) -> _Plane:
    """Return a plane in the axes of its frame."""
    unit = _unit_vector(normal.components)
    return _Plane(
        [part.node for part in point] or NO_VECTOR,
        unit,
        _tangents(unit, across_plane(reading)),
        normal.frame,
        (text, normal.text, normal.frame_name),
        (*point, *normal.written),
    )


def _tangents(normal: Nodes, across: int | None) -> list[tuple[Node, ...]]:
    """Return unit vectors at right angles to a normal and to each other."""
    units: list[tuple[Node, ...]] = [(ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE)]
    if across is not None:
        tangent = _crossed(units[across], normal)
        is_backward = all(isinstance(part, Neg) or is_zero(part) for part in tangent)
        return [tuple(map(minus, tangent)) if is_backward else tangent]
    number = next((k for k in range(3) if number_of(normal[k]) == 1), None)
    if number is not None:
        return [units[k] for k in range(3) if k != number]
    flat_axes = [k for k in range(3) if number_of(normal[k]) == 0]
    if flat_axes:
        first = units[flat_axes[0]]
    else:
        x, y, _ = normal
        length = called("sqrt", total([square(x), square(y)]))
        first = (minus(quotient(y, length)), quotient(x, length), ZERO)
    return [first, _crossed(normal, first)]


def _crossed(left: Nodes, right: Nodes) -> tuple[Node, ...]:
    (a, b, c), (x, y, z) = left, right
    return (
        total([product(b, z), minus(product(c, y))]),
        total([product(c, x), minus(product(a, z))]),
        total([product(a, y), minus(product(b, x))]),
    )
