"""Reading turns about axes, and vectors in the axes of a frame.

In a scene with a plane frames turn about the axis across it, and vectors lie in it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from lagrange_cli.scene.bodies import Turn, Vector
from lagrange_cli.scene.language.rotations import is_zero
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.helpers import PlaneSection
from lagrange_cli.scene.reading.inertia import number_of
from lagrange_cli.scene.reading.interactions import helper_part
from lagrange_cli.scene.reading.source import Mapping as Entries
from lagrange_cli.scene.reading.source import Scalar, Sequence, SourceNode

_THREE = "a list of three entries [x, y, z]"


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


def read_turns(node: SourceNode, what: str, reading: Reading) -> tuple[Turn, ...] | None:
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


def _entries_of_turn(node: SourceNode, what: str, reading: Reading) -> Iterator[Turn | None]:
    label = f"'turn' of {what}"
    mapping = reading.mapping(node, label, "a turn about an axis, as {z: phi}")
    if mapping is None:
        yield None
        return
    keys = [key.text for key, _ in mapping.entries]
    if "quaternion" in keys:
        reading.problems.add(
            f"{label} by a quaternion is not known yet",
            mapping.mark,
            hint="three turns reach every orientation; their equations end where the second one"
            " makes the axes of the others the same",
            rule="unsupported",
        )
        yield None
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
        reading.unknown_key(key, f"'turn' of {what}", (*AXES, "axis", "angle"))
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
    if across_plane(reading) is not None:
        reading.problems.add(
            f"the turn of {what} leaves the plane of the scene", node.mark, rule="plane"
        )
        return None
    axis = vector_of(fields["axis"], "axis", what, reading)
    angle = helper_part(fields["angle"], "angle", what, reading)
    if axis is None or angle is None:
        return None
    if all(number_of(part.node) == 0 for part in axis):
        reading.problems.add("this axis has no length", fields["axis"].mark, rule="direction")
        return None
    return Turn(axis, angle)


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
