"""Surfaces that bodies touch: planes, spheres and cylinders, at rest or fixed in a frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from lagrange_cli.scene.language.expression import Expression, Neg, Node
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
from lagrange_cli.scene.reading.frames import frame_named
from lagrange_cli.scene.reading.helpers import is_unit
from lagrange_cli.scene.reading.inertia import number_of
from lagrange_cli.scene.reading.interactions import flat, helper_part, known_body
from lagrange_cli.scene.reading.joints import Direction, read_direction
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode
from lagrange_cli.scene.reading.source import Sequence as Items
from lagrange_cli.scene.reading.turns import across_plane, vector_of

_SHAPES: tuple[Literal["sphere", "cylinder"], ...] = ("sphere", "cylinder")


@dataclass(frozen=True)
class Plane:
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
        ``plane``, texts of the point and of the normal, and the name of the frame.
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
    def in_space(self) -> Plane:
        """The plane with its vectors along the axes of space instead of those of its frame."""
        frame = self.frame
        tangents = [times(frame.last.rotation, tangent) for tangent in self.tangents]
        normal = times(frame.last.rotation, self.normal)
        return replace(self, point=frame.place(self.point), normal=normal, tangents=tangents)

    @property
    def at_rest(self) -> Plane:
        """The plane as its own frame sees it."""
        return replace(self, frame=SPACE)


@dataclass(frozen=True)
class Round:
    """A sphere or a circular cylinder, at rest or fixed in a frame.

    Attributes
    ----------
    shape
        Which of the two; in the plane of a scene both are a circle.
    radius
        Its radius.
    is_inside
        True if bodies touch it from inside.
    point
        The centre, or a point of the axis.
    axis
        Unit vector along the axis of a cylinder; of a sphere the y axis of its frame.
    is_ball, is_flat
        True of a sphere in space; of a circle in the plane of a scene.
    frame
        The frame that it moves with; space if it is at rest in the axes of these vectors.
    parts
        Its shape and side, the texts of its radius, point and axis, and the name of the frame.
    written
        Expressions that it is given by.
    """

    shape: Literal["sphere", "cylinder"]
    radius: Expression
    is_inside: bool
    point: Nodes
    axis: Nodes
    is_ball: bool
    is_flat: bool
    frame: Placed
    parts: tuple[str, ...]
    written: tuple[Expression, ...] = ()

    @property
    def in_space(self) -> Round:
        """The surface with its vectors along the axes of space instead of those of its frame."""
        axis = times(self.frame.last.rotation, self.axis)
        return replace(self, point=self.frame.place(self.point), axis=axis)

    @property
    def at_rest(self) -> Round:
        """The surface as its own frame sees it."""
        return replace(self, frame=SPACE)

    def away(self, place: Nodes) -> Nodes:
        """Return the vector to a place from the centre, or at right angles from the axis."""
        arm = [total([c, minus(p)]) for c, p in zip(place, self.point, strict=True)]
        if self.is_ball:
            return arm
        number = next((k for k in range(3) if number_of(self.axis[k]) == 1), None)
        if number is not None:
            return [ZERO if k == number else part for k, part in enumerate(arm)]
        along = dot(self.axis, arm)
        return [
            total([part, minus(product(a, along))]) for part, a in zip(arm, self.axis, strict=True)
        ]


#: What a body touches.
Surface: TypeAlias = Plane | Round


def read_surface(node: SourceNode, what: str, reading: Reading) -> Surface | None:
    """Read a plane ``{point, normal}``, a frame for its xy plane, a sphere or a cylinder."""
    if isinstance(node, Scalar):
        return _plane_of_frame(node, what, reading)
    label = f"'on' of {what}"
    mapping = reading.mapping(
        node, label, "a plane {point, normal}, a sphere, a cylinder, or a frame"
    )
    if mapping is None:
        return None
    keys = [key.text for key, _ in mapping.entries]
    shape = next((shape for shape in _SHAPES if shape in keys), None)
    if shape is not None:
        return _round(shape, mapping, what, reading)
    return _plane(mapping, what, reading)


def _plane_of_frame(node: Scalar, what: str, reading: Reading) -> Plane | None:
    named_frame = frame_named(node, f"'on' of {what}", reading)
    if named_frame is None or not _stands_across(node, what, reading):
        return None
    name, frame = named_frame
    upward = Direction((ZERO, ZERO, ONE), frame, "z", name)
    return _fixed_plane("", (), upward, reading)


def _plane(mapping: Mapping, what: str, reading: Reading) -> Plane | None:
    label = f"'on' of {what}"
    fields = reading.fields(mapping, label, ("point", "normal", "on"), required=("normal",))
    if "normal" not in fields:
        return None
    on = frame_named(fields["on"], label, reading) if "on" in fields else ("", SPACE)
    normal = read_direction(fields["normal"], "normal", what, reading)
    point = _point(fields.get("point"), what, reading, "on" in fields)
    if on is None or normal is None or point is None:
        return None
    fixed = replace(normal, frame=on[1], frame_name=on[0])
    return _fixed_plane(*point, fixed, reading)


def _round(
    shape: Literal["sphere", "cylinder"], mapping: Mapping, what: str, reading: Reading
) -> Round | None:
    """Read ``{sphere: R}`` or ``{cylinder: R, axis}``, with ``inside``, ``point`` and ``on``."""
    label = f"'on' of {what}"
    across = across_plane(reading)
    needs_axis = shape == "cylinder" and across is None
    fields = reading.fields(
        mapping,
        label,
        (shape, "inside", "point", "on", *(("axis",) if needs_axis else ())),
        required=(shape, *(("axis",) if needs_axis else ())),
    )
    if shape not in fields or (needs_axis and "axis" not in fields):
        return None
    radius = helper_part(fields[shape], shape, what, reading)
    is_inside = (
        reading.boolean(fields["inside"], f"'inside' of {what}") if "inside" in fields else False
    )
    on = frame_named(fields["on"], label, reading) if "on" in fields else ("", SPACE)
    point = _point(fields.get("point"), what, reading, "on" in fields)
    axis = Direction((ZERO, ONE, ZERO), SPACE, "y")
    if across is not None:
        axis = Direction(tuple(ONE if k == across else ZERO for k in range(3)), SPACE, AXES[across])
    read_axis = read_direction(fields["axis"], "axis", what, reading) if needs_axis else axis
    if radius is None or is_inside is None or on is None or point is None or read_axis is None:
        return None
    if not is_positive(radius, what, reading):
        return None
    text, place = point
    side = "inside" if is_inside else "outside"
    return Round(
        shape,
        radius,
        is_inside,
        [part.node for part in place] or NO_VECTOR,
        unit_vector(read_axis.components),
        shape == "sphere" and across is None,
        across is not None,
        on[1],
        (shape, side, radius.text, text, read_axis.text, on[0]),
        (radius, *place, *read_axis.written),
    )


def is_positive(radius: Expression, what: str, reading: Reading) -> bool:
    """Tell whether a radius may be positive; report one that is a number and is not."""
    value = number_of(radius.node)
    if value is None or value > 0:
        return True
    reading.problems.add(
        f"the radius in {what} must be positive, found {radius.text}",
        radius.mark(),
        rule="not-positive",
    )
    return False


def unit_vector(components: Nodes) -> tuple[Node, ...]:
    """Divide a vector by its length."""
    if not components or is_unit(list(components)):
        return tuple(components)
    length = called("sqrt", total([square(part) for part in components]))
    return tuple(quotient(part, length) for part in components)


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
) -> Plane:
    """Return a plane in the axes of its frame."""
    unit = unit_vector(normal.components)
    return Plane(
        [part.node for part in point] or NO_VECTOR,
        unit,
        _tangents(unit, across_plane(reading)),
        normal.frame,
        ("plane", text, normal.text, normal.frame_name),
        (*point, *normal.written),
    )


def _tangents(normal: Nodes, across: int | None) -> list[tuple[Node, ...]]:
    """Return unit vectors at right angles to a normal and to each other."""
    units: list[tuple[Node, ...]] = [(ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE)]
    if across is not None:
        tangent = crossed(units[across], normal)
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
    return [first, crossed(normal, first)]


def crossed(left: Nodes, right: Nodes) -> tuple[Node, ...]:
    """Return the cross product of two vectors."""
    (a, b, c), (x, y, z) = left, right
    return (
        total([product(b, z), minus(product(c, y))]),
        total([product(c, x), minus(product(a, z))]),
        total([product(a, y), minus(product(b, x))]),
    )
