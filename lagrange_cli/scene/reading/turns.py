"""Reading turns about axes, and vectors in the axes of a frame.

In a scene with a plane frames turn about the axis across it, and vectors lie in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from lagrange_cli.errors import Mark
from lagrange_cli.scene.bodies import AnyTurn, ComposedExpression, QuaternionTurn, Turn, Vector
from lagrange_cli.scene.joints import Joint
from lagrange_cli.scene.language.expression import Equation, Name
from lagrange_cli.scene.language.rotations import ONE, is_zero, square, total
from lagrange_cli.scene.model import Constraint
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.helpers import PlaneSection
from lagrange_cli.scene.reading.inertia import number_of
from lagrange_cli.scene.reading.interactions import helper_part
from lagrange_cli.scene.reading.source import Mapping as Entries
from lagrange_cli.scene.reading.source import Scalar, Sequence, SourceNode

_THREE = "a list of three entries [x, y, z]"
_FOUR = "a list of four coordinates [q0, q1, q2, q3], q0 the scalar"


def across_plane(reading: Reading) -> int | None:
    """Return the number of the axis across the plane of the scene; None in space."""
    plane: PlaneSection | None = reading.values.get("plane")
    return None if plane is None else plane.across


def vector_of(node: SourceNode, key: str, what: str, reading: Reading) -> Vector | None:
    label = f"'{key}' of {what}"
    sequence = reading.items(node, label, _THREE)
    if sequence is None:
        return None
    if len(sequence.items) != 3:
        reading.expected(_THREE, label, sequence)
        return None
    x, y, z = (helper_part(item, key, what, reading) for item in sequence.items)
    return (x, y, z) if x and y and z else None


def read_turns(node: SourceNode, what: str, reading: Reading) -> tuple[AnyTurn, ...] | None:
    """Read turns: a list, a mapping of one turn, or the angle in the plane of the scene."""
    if isinstance(node, Sequence):
        read = [turn for item in node.items for turn in _entries_of_turn(item, what, reading)]
        turns = [turn for turn in read if turn is not None]
        return tuple(turns) if len(turns) == len(read) else None
    if isinstance(node, Entries):
        read = list(_entries_of_turn(node, what, reading))
        turns = [turn for turn in read if turn is not None]
        if len(turns) > 1:
            reading.problems.add(
                f"the turns of {what} have no order",
                node.mark,
                hint="a mapping has one turn: write a list, turn: [z: a, x: b]",
                rule="shape",
            )
        return tuple(turns) if len(turns) == len(read) == 1 else None
    across = across_plane(reading)
    if across is None:
        reading.expected("a turn about an axis", f"'turn' of {what}", node, "as in turn: {z: phi}")
        return None
    angle = helper_part(node, "turn", what, reading)
    axis = AXES[across]
    return None if angle is None else (Turn(axis, angle, reverse=axis == "y"),)


def _entries_of_turn(node: SourceNode, what: str, reading: Reading) -> Iterator[AnyTurn | None]:
    label = f"'turn' of {what}"
    mapping = reading.mapping(node, label, "a turn about an axis, as {z: phi}")
    if mapping is None:
        yield None
        return
    keys = [key.text for key, _ in mapping.entries]
    if "quaternion" in keys:
        yield _by_quaternion(mapping, what, reading)
    elif "axis" in keys or "angle" in keys:
        yield _about_direction(mapping, what, reading)
    elif not keys:
        reading.expected("a turn about an axis, as {z: phi}", label, mapping)
        yield None
    else:
        for key, value in mapping.entries:
            yield _about_axis(key, value, what, reading)


def _about_axis(key: Scalar, value: SourceNode, what: str, reading: Reading) -> Turn | None:
    if key.text not in AXES:
        reading.unknown_key(key, f"'turn' of {what}", (*AXES, "axis", "angle", "quaternion"))
        return None
    across = across_plane(reading)
    if across is not None and key.text != AXES[across]:
        reading.problems.add(
            f"the turn of {what} about {key.text} leaves the plane of the scene",
            key.mark,
            hint=f"in this plane frames turn about {AXES[across]}: turn: ANGLE",
            rule="plane",
        )
        return None
    angle = helper_part(value, "turn", what, reading)
    return None if angle is None else Turn(key.text, angle)


def _about_direction(node: Entries, what: str, reading: Reading) -> Turn | None:
    label = f"'turn' of {what}"
    fields = reading.fields(node, label, ("axis", "angle"), required=("axis", "angle"))
    if len(fields) < 2:
        return None
    if _leaves_plane(node, what, reading):
        return None
    axis = vector_of(fields["axis"], "axis", what, reading)
    angle = helper_part(fields["angle"], "angle", what, reading)
    if axis is None or angle is None:
        return None
    if all(number_of(part.node) == 0 for part in axis):
        reading.problems.add("this axis has no length", fields["axis"].mark, rule="direction")
        return None
    return Turn(axis, angle)


def _leaves_plane(node: Entries, what: str, reading: Reading) -> bool:
    """Refuse a turn about any axis in a scene with a plane."""
    if across_plane(reading) is None:
        return False
    reading.problems.add(
        f"the turn of {what} leaves the plane of the scene", node.mark, rule="plane"
    )
    return True


def _by_quaternion(node: Entries, what: str, reading: Reading) -> QuaternionTurn | None:
    label = f"'turn' of {what}"
    fields = reading.fields(node, label, ("quaternion",))
    sequence = reading.items(fields["quaternion"], f"'quaternion' of {what}", _FOUR)
    if _leaves_plane(node, what, reading) or sequence is None:
        return None
    parts = [helper_part(item, "quaternion", what, reading) for item in sequence.items]
    read = tuple(part for part in parts if part is not None)
    if len(read) < len(parts):
        return None
    names = {part.node.name for part in read if isinstance(part.node, Name)}
    if len(parts) != 4 or len(names) != 4:
        reading.expected(
            _FOUR,
            f"'quaternion' of {what}",
            sequence,
            "a turn that stays is written {axis: [a, b, c], angle: e}",
        )
        return None
    return QuaternionTurn(read)


def unit_constraint(name: str, mark: Mark, turns: Iterable[AnyTurn]) -> Constraint | None:
    """Return the constraint that keeps the quaternions of a frame at length 1; None without any."""
    quaternions = [turn.parts for turn in turns if isinstance(turn, QuaternionTurn)]
    equations = []
    for parts in quaternions:
        text = " + ".join(f"{part.text}^2" for part in parts) + " = 1"
        squares = total([square(part.node) for part in parts])
        left, right = (ComposedExpression(e, text, mark, exact=False) for e in (squares, ONE))
        equations.append(Equation(left, right, text, mark))
    if not equations:
        return None
    joint = Joint("unit", (name,), quaternions=tuple(p for parts in quaternions for p in parts))
    return Constraint(f"unit_{name}", mark, tuple(equations), joint=joint)


def vector_in_plane(
    key: str, fields: Mapping[str, SourceNode], what: str, reading: Reading
) -> Vector | None:
    """Read a vector at a key; in a plane its component across that is 0."""
    if key not in fields:
        return None
    vector = vector_of(fields[key], key, what, reading)
    across = across_plane(reading)
    if vector is None or across is None or is_zero(vector[across].node):
        return vector
    reading.problems.add(
        f"'{key}' of {what} leaves the plane of the scene",
        vector[across].mark(),
        hint=f"in this plane its {AXES[across]} entry is 0",
        rule="plane",
    )
    return None
