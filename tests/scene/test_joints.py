"""Joints between bodies, and bodies on planes: located refusals of what is wrong in them."""

from __future__ import annotations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive, reduce
from lagrange_cli.scene import read_text

BODIES = """
bodies:
  one: {at: [x, y, z], turn: [z: a, x: b, y: c], mass: 1, inertia: [1, 1, 1]}
frames: {table: {turn: {z: t}}}
points: {p: {on: one, at: [1, 0, 0]}, far: [5, 0, 0]}
constraints: {joint: %s}
coordinates: [x, y, z, a, b, c]
"""
DISK = """
parameters: {R: %s}
bodies:
  disk: {at: [x, y, z], turn: [z: a, x: b, y: c], mass: 1, inertia: [1, 2, 1]}
constraints: {floor: {touch: disk, radius: R, axis: y, on: {normal: z}}}
coordinates: [x, y, a, b, c]
initial: {x: 0, y: 0, a: 0, b: %s, c: 0}
"""
IN_PLANE = """
plane: %s
bodies: {one: {at: [x, %s], turn: a, mass: 1, inertia: 1}}
frames: {slope: {turn: 0.3}}
constraints: {joint: %s}
coordinates: [x, y, a]
"""

#: Joint, column of the caret in line 6, and what is said.
REFUSALS = {
    "a pin of a point with itself": ("{pin: [p, p]}", 32, "needs two different ends"),
    "a pin of one point": ("{pin: [p]}", 28, "expected two particles or points"),
    "a pin of what is not known": ("{pin: [p, q]}", 32, "unknown particle or point 'q' in 'pin'"),
    "a direction without length": (
        "{parallel: [[[0, 0, 0], one], x]}",
        35,
        "this direction has no length",
    ),
    "one direction": ("{parallel: [[x, one]]}", 33, "expected two directions"),
    "a direction of nothing": (
        "{parallel: [[x, two], y]}",
        38,
        "unknown frame or body 'two' in constraint 'joint'",
    ),
    "an axis that is not known": ("{parallel: [[w, one], y]}", 35, "expected a direction"),
    "directions of one body": (
        "{parallel: [[x, one], [y, one]]}",
        44,
        "both directions of constraint 'joint' are fixed in one",
    ),
    "directions in space": ("{parallel: [x, y]}", 37, "are fixed in space"),
    "a weld of a body with itself": ("{weld: [one, one]}", 35, "needs two different ends"),
    "a weld of a point": ("{weld: [one, p]}", 35, "unknown frame or body 'p'"),
    "no radius": ("{touch: one, on: table}", 22, "has no 'radius'"),
    "no plane": ("{touch: one, radius: 1}", 22, "has no 'on'"),
    "a radius of zero": ("{touch: one, radius: 0, on: table}", 43, "must be positive, found 0"),
    "a negative radius": ("{roll: one, radius: -2, on: table}", 42, "must be positive, found -2"),
    "a plane without a normal": (
        "{roll: one, radius: 1, on: {point: far}}",
        49,
        "'on' of constraint 'joint' has no 'normal'",
    ),
    "a normal without length": (
        "{roll: one, radius: 1, on: {normal: [0, 0, 0]}}",
        58,
        "this direction has no length",
    ),
    "a plane of the body itself": (
        "{roll: one, radius: 1, on: one}",
        49,
        "is fixed in 'one' itself",
    ),
    "a point of space in a frame": (
        "{roll: one, radius: 1, on: {on: table, point: far, normal: z}}",
        68,
        "expected a point [x, y, z]",
    ),
    "a radius that moves": ("{touch: one, radius: x, on: table}", 43, "is not constant"),
    "a plane that moves by itself": (
        "{roll: one, radius: 1, on: {normal: [0, sin(t), cos(t)]}}",
        66,
        "'t' in constraint 'joint' is not constant",
    ),
    "a plane through a point that moves": (
        "{roll: one, radius: 1, on: {point: p, normal: z}}",
        57,
        "'x_p' in constraint 'joint' is not constant",
    ),
    "a direction that moves": (
        "{parallel: [[[a, 0, 1], one], z]}",
        36,
        "'a' in constraint 'joint' is not constant",
    ),
    "a sphere without radius": (
        "{roll: one, radius: 1, on: {sphere: 0}}",
        58,
        "must be positive, found 0",
    ),
    "a cylinder without axis": (
        "{roll: one, radius: 1, on: {cylinder: 3}}",
        49,
        "'on' of constraint 'joint' has no 'axis'",
    ),
    "a side that is no answer": (
        "{roll: one, radius: 1, on: {sphere: 3, inside: below}}",
        69,
        "expected true or false",
    ),
    "a disk in a bowl": (
        "{roll: one, radius: 1, axis: y, on: {sphere: 3, inside: true}}",
        51,
        "a disk touches planes alone",
    ),
    "a sphere of the body itself": (
        "{touch: one, radius: 1, on: {sphere: 3, on: one}}",
        50,
        "the sphere of constraint 'joint' is fixed in 'one' itself",
    ),
    "a sphere whose radius moves": (
        "{touch: one, radius: 1, on: {sphere: 3 + t}}",
        63,
        "'t' in constraint 'joint' is not constant",
    ),
    "an unknown helper": ("{glue: [p, far]}", 23, "unknown helper 'glue'"),
}


@pytest.mark.parametrize(("joint", "column", "message"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusals_are_located(joint: str, column: int, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_text(BODIES % joint)
    problem = caught.value.problems[0]
    assert message in problem.message
    assert problem.mark is not None
    assert (problem.mark.line, problem.mark.column) == (6, column)


@pytest.mark.parametrize("value", ["0", "-0.1"])
def test_radii_of_parameters_are_positive(value: str) -> None:
    with pytest.raises(InputError, match="the radius in constraint 'floor' must be positive"):
        reduce(read_text(DISK % (value, "0.2")))


def test_a_disk_that_touches_with_its_highest_point_is_refused() -> None:
    assert derive(read_text(DISK % ("0.5", "0.2"))).system.initial is not None
    with pytest.raises(InputError, match="the highest point of 'disk' touches") as caught:
        derive(read_text(DISK % ("0.5", "2")))
    assert caught.value.problems[0].mark is not None
    assert caught.value.problems[0].mark.line == 5


@pytest.mark.parametrize(
    ("plane", "place", "joint", "message"),
    [
        ("xz", "0, y", "{parallel: [[y, one], x]}", "leaves the plane of the scene"),
        ("xz", "0, y", "{roll: one, radius: 1, on: {normal: y}}", "leaves the plane of the scene"),
        ("xz", "0, y", "{roll: one, axis: z, radius: 1, on: {normal: z}}", None),
        ("xy", "y, 0", "{roll: one, radius: 1, on: slope}", "is the plane of the scene"),
    ],
)
def test_joints_stay_in_the_plane_of_the_scene(
    plane: str, place: str, joint: str, message: str | None
) -> None:
    text = IN_PLANE % (plane, place, joint)
    if message is None:
        read_text(text)
        return
    with pytest.raises(InputError) as caught:
        read_text(text)
    assert message in caught.value.problems[0].message
    assert caught.value.problems[0].mark is not None
    assert caught.value.problems[0].mark.line == 5


def test_joints_hold_equations_of_their_own() -> None:
    scene = read_text(BODIES % "{roll: one, radius: 2, axis: [0, 3, 4], on: table}")
    (constraint,) = scene.constraints
    assert len(constraint.equations) == 3
    assert constraint.joint is not None
    assert constraint.joint.parts == ("one", "plane", "", "z", "table")
