"""Joints in words: what they join, and which of their equations restrict nothing further."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.report.inlines import Count, Inline, Listed, Plain, Written, say, symbol

if TYPE_CHECKING:
    from lagrange_cli.mechanics.findings import ConstraintLine


def joint_remarks(line: ConstraintLine) -> Iterator[Written]:
    """Count equations of a joint that restrict nothing further; those of lengths do not count."""
    if line.joint[0] == "unit":
        yield say("not counted")
        return
    count = Count(len(line.equations))
    if line.idle:
        yield say.counted(
            line.idle,
            "{count} of {equations} equations redundant",
            "{count} of {equations} equations redundant",
            equations=count,
        )
    if line.satisfied:
        yield say.counted(
            line.satisfied,
            "{count} of {equations} equations satisfied by the definitions",
            "{count} of {equations} equations satisfied by the definitions",
            equations=count,
        )


def joint_statement(joint: Sequence[str]) -> Written:
    """Say what a joint joins, by its kind and its parts."""
    kind, *parts = joint
    if kind == "unit":
        return say("the quaternion of {body} has length 1", body=Plain(parts[0]))
    first, second, *further = (Plain(part) for part in parts)
    if kind == "pin":
        return say("{first} coincides with {second}", first=first, second=second)
    if kind == "weld":
        return say("{first} is fixed to {second}", first=first, second=second)
    if kind == "parallel":
        direction, frame = further
        return say(
            "{first} is parallel to {second}",
            first=_direction_of(first, second),
            second=_direction_of(direction, frame),
        )
    shape, *surface = parts[1:]
    if shape != "plane":
        return _on_round(kind, first, shape, surface)
    plane = _plane_of(surface)
    if kind == "touch":
        return say("{body} touches the plane {plane}", body=first, plane=plane)
    return say("{body} rolls without slip on the plane {plane}", body=first, plane=plane)


def _on_round(kind: str, body: Plain, shape: str, parts: Sequence[str]) -> Written:
    """Say on which side of a sphere or cylinder a body is, and where that stands."""
    side, radius, point, axis, frame = parts
    words: dict[str, Written] = {"body": body, "radius": Plain(radius)}
    words["side"] = say("from inside") if side == "inside" else say("from outside")
    if shape == "sphere":
        words["point"] = _direction_of(Plain(point or "(0, 0, 0)"), Plain(frame))
        if kind == "touch":
            return say("{body} touches the sphere of radius {radius} about {point} {side}", **words)
        return say(
            "{body} rolls without slip on the sphere of radius {radius} about {point} {side}",
            **words,
        )
    words["axis"] = _direction_of(Plain(axis), Plain(frame))
    if point:
        through = say("through {point}", point=Plain(point))
        words["axis"] = Listed((words["axis"], through), between=" ")
    if kind == "touch":
        return say("{body} touches the cylinder of radius {radius} about {axis} {side}", **words)
    return say(
        "{body} rolls without slip on the cylinder of radius {radius} about {axis} {side}", **words
    )


def reaction_of_joint(role: Sequence[str]) -> Written:
    """Say what the multiplier of one of a joint's equations is."""
    kind, first, *further = role
    body = Plain(first)
    if kind == "unit":
        return say("keeps the quaternion of {body} at length 1 and is no force", body=body)
    if kind == "part":
        return say("part of the force of the surface on {body}", body=body)
    if kind in ("normal", "friction"):
        is_plane = further == ["plane"]
        return _force_of_plane(kind, body) if is_plane else _force_of_surface(kind, body)
    if kind == "torque":
        ends = [Plain(part) for part in (first, *further) if part]
        if len(ends) == 1:
            return say("torque on {body}", body=ends[0])
        return say("torque between {first} and {second}", first=ends[0], second=ends[1])
    second, axis = further
    return say(
        "force on {first} along {axis}, the opposite one on {second}",
        first=body,
        axis=Inline(symbol(axis)),
        second=Plain(second),
    )


def _force_of_plane(kind: str, body: Plain) -> Written:
    if kind == "normal":
        return say("force of the plane on {body} along its normal", body=body)
    return say("friction on {body} along the plane", body=body)


def _force_of_surface(kind: str, body: Plain) -> Written:
    if kind == "normal":
        return say("force of the surface on {body} along its normal", body=body)
    return say("friction on {body} along the surface", body=body)


def _direction_of(direction: Plain, frame: Plain) -> Written:
    if not frame.text:
        return direction
    return say("{direction} of {body}", direction=direction, body=frame)


def _plane_of(parts: Sequence[str]) -> Written:
    """Describe a plane by its point, its normal, and the frame in which they are fixed."""
    point, normal, frame = parts
    words = say("with the normal {normal}", normal=_direction_of(Plain(normal), Plain(frame)))
    if not point:
        return words
    return Listed((say("through {point}", point=Plain(point)), words), between=" ")
