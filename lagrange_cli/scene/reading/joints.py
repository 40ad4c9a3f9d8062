"""Joints that close loops: ``pin``, ``parallel`` and ``weld``, written out as equations.

A pin is an equation for each axis. Two directions lie along one line where two components of their
cross product vanish, in axes in which the third component of the second one is a constant that is
not zero. A weld is a pin and three right angles between axes, x of the one and y of the other and
so on; among the turns that leave these right the one that is none has the largest trace.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lagrange_cli.scene.bodies import ComposedExpression, Vector
from lagrange_cli.scene.joints import Joint
from lagrange_cli.scene.language.expression import Equation, Expression, Node
from lagrange_cli.scene.language.rotations import (
    ONE,
    ZERO,
    called,
    composed,
    minus,
    named,
    product,
    times,
    total,
    transposed,
)
from lagrange_cli.scene.reading.chains import SPACE, Placed
from lagrange_cli.scene.reading.declarations import AXES, component
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.frames import frame_named
from lagrange_cli.scene.reading.helpers import NOTATION, Written
from lagrange_cli.scene.reading.inertia import number_of
from lagrange_cli.scene.reading.interactions import body_pair, flat, place_of
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode
from lagrange_cli.scene.reading.source import Sequence as Items
from lagrange_cli.scene.reading.turns import across_plane, vector_of

_DIRECTION = "[DIRECTION, BODY], or a direction in space"


@dataclass(frozen=True)
class Direction:
    """A direction, in the axes of a frame or of space.

    Attributes
    ----------
    components
        Its components, not all zero.
    frame
        The frame; space has no turns.
    text, frame_name
        How it is written, and the name of the frame, empty for space.
    written
        The components as expressions, none of an axis.
    """

    components: tuple[Node, ...]
    frame: Placed
    text: str
    frame_name: str = ""
    written: tuple[Expression, ...] = ()


def pin(node: Mapping, what: str, reading: Reading) -> Written | None:
    """Read ``{pin: [A, B]}``: the two points coincide."""
    fields = reading.fields(node, what, ("pin", *NOTATION))
    pair = body_pair(fields["pin"], "pin", what, reading)
    if pair is None:
        return None
    return Written(_coincidence(pair, node, reading), Joint("pin", pair))


def _coincidence(pair: tuple[str, str], node: Mapping, reading: Reading) -> tuple[Equation, ...]:
    across = across_plane(reading)
    first, second = ([named(component(axis, end)) for axis in AXES] for end in pair)
    return tuple(
        joint_equation(first[k], second[k], f"{first[k].name} = {second[k].name}", node)
        for k in range(3)
        if k != across
    )


def _pair(node: Mapping, key: str, wanted: str, what: str, reading: Reading) -> Items | None:
    """Read a joint's list of two; None, with a problem, if it is none."""
    fields = reading.fields(node, what, (key, *NOTATION))
    pair = reading.items(fields[key], f"'{key}' of {what}", wanted)
    if pair is not None and len(pair.items) != 2:
        reading.expected(wanted, f"'{key}' of {what}", pair)
        return None
    return pair


def parallel(node: Mapping, what: str, reading: Reading) -> Written | None:
    """Read ``{parallel: [[a, A], [b, B]]}``: two directions lie along one line."""
    pair = _pair(node, "parallel", "two directions [[a, A], [b, B]]", what, reading)
    if pair is None:
        return None
    first, second = (_direction(item, what, reading) for item in pair.items)
    if first is None or second is None:
        return None
    if first.frame_name == second.frame_name:
        reading.problems.add(
            f"both directions of {what} are fixed in {first.frame_name or 'space'}",
            pair.items[1].mark,
            hint="they keep their angle: give directions that turn against each other",
            rule="shape",
        )
        return None
    across = across_plane(reading)
    if across is not None:
        sides = [_in_plane(first, second, across)]
    elif _pivot(first.components)[0] > _pivot(second.components)[0]:
        sides = _along_one_line(second, first)
    else:
        sides = _along_one_line(first, second)
    words = f"{first.text} of {first.frame_name or 'space'} is parallel to {second.text}"
    equations = tuple(
        joint_equation(side, ZERO, f"{words} of {second.frame_name or 'space'}, {k}", node)
        for k, side in enumerate(sides, 1)
    )
    parts = (first.text, first.frame_name, second.text, second.frame_name)
    joint = Joint("parallel", parts, constants=(*first.written, *second.written))
    return Written(equations, joint)


def _direction(node: SourceNode, what: str, reading: Reading) -> Direction | None:
    """Read ``[DIRECTION, BODY]``, or the DIRECTION alone in space."""
    items = node.items if isinstance(node, Items) else ()
    if len(items) != 2:
        return read_direction(node, "parallel", what, reading)
    direction = read_direction(items[0], "parallel", what, reading)
    frame = frame_named(items[1], what, reading)
    if direction is None or frame is None:
        return None
    return replace(direction, frame=frame[1], frame_name=frame[0])


def read_direction(node: SourceNode, key: str, what: str, reading: Reading) -> Direction | None:
    """Read ``x``, ``y`` or ``z``, or three components that are not all zero."""
    across = across_plane(reading)
    vector: Vector | None = None
    if isinstance(node, Scalar) and node.text in AXES:
        units: tuple[Node, ...] = tuple(ONE if node.text == axis else ZERO for axis in AXES)
        text = node.text
    elif isinstance(node, Items):
        vector = vector_of(node, key, what, reading)
        if vector is None:
            return None
        units = tuple(part.node for part in vector)
        text = f"({', '.join(map(flat, vector))})"
    else:
        reading.expected(f"a direction: x, y, z or [x, y, z], or {_DIRECTION}", what, node)
        return None
    if all(number_of(part) == 0 for part in units):
        reading.problems.add("this direction has no length", node.mark, rule="direction")
        return None
    if across is not None and number_of(units[across]) != 0:
        reading.problems.add(
            f"the direction {text} of {what} leaves the plane of the scene",
            node.mark,
            hint=f"in this plane its {AXES[across]} entry is 0",
            rule="plane",
        )
        return None
    return Direction(units, SPACE, text, written=vector or ())


def _in_plane(first: Direction, second: Direction, across: int) -> Node:
    """Return the cross product of two directions of a plane, over the angle between their axes."""
    i, j = (k for k in range(3) if k != across)
    (a, b), (c, d) = ([e.components[i], e.components[j]] for e in (first, second))
    angle = _angle_between(first.frame, second.frame)
    crossed = total([product(b, c), minus(product(a, d))])
    along = total([product(a, c), product(b, d)])
    return total([product(along, called("sin", angle)), product(crossed, called("cos", angle))])


def _angle_between(first: Placed, second: Placed) -> Node:
    """Return the angle by which the axes of the first are turned against those of the second.

    Both have one turn at most, in the sense of the plane: its first axis to its second.
    """
    return total([first.last.angle, minus(second.last.angle)])


def _pivot(components: Sequence[Node]) -> tuple[int, int]:
    """Return the number of a component that is not zero; a number comes before an expression."""
    ranks = []
    for k, part in enumerate(components):
        value = number_of(part)
        ranks.append((2 if value == 0 else int(value is None), k))
    return min(ranks)


def _along_one_line(first: Direction, second: Direction) -> list[Node]:
    """Return two components of a cross product, in the axes of the second direction."""
    relative = composed(transposed(second.frame.last.rotation), first.frame.last.rotation)
    turned = times(relative, first.components)
    fixed = second.components
    k = _pivot(fixed)[1]
    return [
        total([product(turned[i], fixed[k]), minus(product(turned[k], fixed[i]))])
        for i in range(3)
        if i != k
    ]


def weld(node: Mapping, what: str, reading: Reading) -> Written | None:
    """Read ``{weld: [A, B]}``: the axes of two frames coincide, and their origins."""
    pair = _pair(node, "weld", "two frames or bodies [A, B]", what, reading)
    if pair is None:
        return None
    ends = [frame_named(item, what, reading) for item in pair.items]
    if ends[0] is None or ends[1] is None:
        return None
    (name, first), (second_name, second) = ends[0], ends[1]
    if name == second_name:
        reading.problems.add("'weld' needs two different ends", pair.items[1].mark, rule="shape")
        return None
    across = across_plane(reading)
    places = zip(AXES, first.origin, second.origin, strict=True)
    equations = [
        joint_equation(a, b, f"{axis} of the origins of {name} and {second_name}", node)
        for k, (axis, a, b) in enumerate(places)
        if k != across
    ]
    if across is None:
        turn = composed(transposed(first.last.rotation), second.last.rotation)
        sides, closed = [turn[1], turn[5], turn[6]], total([*turn[0::4]])
    else:
        angle = _angle_between(first, second)
        sides, closed = [called("sin", angle)], called("cos", angle)
    equations += [
        joint_equation(side, ZERO, f"turn {k} of {name} against {second_name}", node)
        for k, side in enumerate(sides, 1)
    ]
    positive = ComposedExpression(closed, f"turns of {what}", place_of(node), exact=False)
    return Written(tuple(equations), Joint("weld", (name, second_name), positive=positive))


def joint_equation(left: Node, right: Node, text: str, node: Mapping) -> Equation:
    """Return an equation that a joint at a node stands for, with its text."""
    place = place_of(node)
    one, two = (ComposedExpression(side, text, place, exact=False) for side in (left, right))
    return Equation(one, two, text, place)
