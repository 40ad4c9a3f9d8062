"""Sections ``frames`` and ``bodies``: what they stand for, and what is refused."""

from __future__ import annotations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import reduce
from lagrange_cli.scene import read_text
from lagrange_cli.scene.bodies import bodies_of
from lagrange_cli.scene.language.expression import Expression, names_in

ROD = (
    "parameters: {m: 1, l: 2}\nplane: xz\nbodies:\n  rod: {turn: theta, mass: m, %s}\n"
    "coordinates: [theta]\n"
)
TOP = (
    "parameters: {m: 1, A: 2}\nbodies:\n  top: {turn: %s, mass: m, inertia: [A, A, A]}\n"
    "coordinates: [a, b, c]\n"
)
CHAIN = (
    "bodies:\n  one: {%s, turn: {z: a}, mass: 1, inertia: [1, 1, 1]}\n"
    "  two: {on: one, at: [1, 0, 0], turn: {x: b}, mass: 1, inertia: [1, 1, 1]}\n"
    "coordinates: [a, b]\n"
)
LOADED = ROD % "inertia: 1" + "forces: {load: %s}\n"

#: Scene, place of the problem (line, column), part of the message.
REFUSALS = {
    "no inertia": (ROD % "centre: [0, 0, l]", (4, 8), "body 'rod' has no 'inertia'"),
    "out of the plane": (
        ROD % "centre: [0, l, 0], inertia: 1",
        (4, 43),
        "'centre' of body 'rod' leaves the plane",
    ),
    "turn out of the plane": (
        ROD.replace("turn: theta", "turn: {x: theta}") % "inertia: 1",
        (4, 16),
        "leaves the plane",
    ),
    "three moments for one": (ROD % "inertia: [1, 2]", (4, 40), "expected one moment of inertia"),
    "inertia without mass": (
        ROD.replace("mass: m", "mass: 0") % "inertia: 1",
        (4, 40),
        "has inertia but no mass",
    ),
    "a shape that is not known": (ROD % "inertia: {bar: l}", (4, 41), "unknown key 'bar'"),
    "a negative length": (ROD % "inertia: {rod: -1}", (4, 46), "a length cannot be negative"),
    "a sphere with an axis": (
        ROD % "inertia: {sphere: 1, axis: x}",
        (4, 58),
        "expected no axis",
    ),
    "an angle without an axis": (TOP % "a", (3, 15), "expected a turn about an axis"),
    "turns without an order": (TOP % "{z: a, x: b}", (3, 15), "have no order"),
    "an axis that is not known": (TOP % "[w: a]", (3, 16), "unknown key 'w'"),
    "an axis without length": (
        TOP % "[{axis: [0, 0, 0], angle: a}]",
        (3, 23),
        "this axis has no length",
    ),
    "a quaternion of three names": (
        TOP % "{quaternion: [a, b, c, a]}",
        (3, 28),
        "expected a list of four coordinates",
    ),
    "a quaternion that stays": (
        TOP % "{quaternion: [1, 0, 0, 0]}",
        (3, 28),
        "expected a list of four coordinates",
    ),
    "an unknown name in a quaternion": (
        TOP % "{quaternion: [a, b, c, d]}",
        (3, 38),
        "'d' in the quaternion of 'top' is no coordinate",
    ),
    "a parameter in a quaternion": (
        TOP % "{quaternion: [a, b, c, A]}",
        (3, 38),
        "'A' in the quaternion of 'top' is no coordinate",
    ),
    "a quaternion in a plane": (
        ROD.replace("turn: theta", "turn: {quaternion: [a, b, c, d]}") % "inertia: 1",
        (4, 15),
        "leaves the plane",
    ),
    "a rate in a turn": (TOP % "{z: dot(a)}", (3, 3), "dot(...) cannot stand in the turns of body"),
    "an unknown name": (TOP % "{z: d}", (3, 19), "unknown name 'd' in body 'top'"),
    "an unknown frame": (CHAIN % "on: base", (2, 13), "unknown frame or body 'base'"),
    "a circle": (CHAIN % "on: two", (2, 13), "frames stand on each other: "),
    "a body and a particle": (
        CHAIN % "at: [0, 0, 0]" + "particles: {one: {mass: 1}}\n",
        (2, 3),
        "'one' is both a particle and a body",
    ),
    "a torque on a coordinate": (
        LOADED % "{on: theta, torque: 1}",
        (6, 21),
        "acts on 'theta', which is no body",
    ),
    "axes of nothing": (
        LOADED % "{on: rod, force: [1, 0, 0], axes: bar}",
        (6, 50),
        "unknown frame or body 'bar' in force 'load'",
    ),
    "the spin of nothing": (
        ROD % "inertia: 1" + "outputs: {w: omega_y(bar)}\n",
        (6, 14),
        "unknown name 'omega_y(bar)'",
    ),
    "moments that change": (
        ROD % "inertia: theta",
        (4, 40),
        "'theta' in the inertia of body 'rod'",
    ),
    "a matrix that is not symmetric": (
        TOP.replace("[A, A, A]", "[[1, 2, 0], [0, 1, 0], [0, 0, 1]]") % "{z: a}",
        (3, 54),
        "is not symmetric",
    ),
}


@pytest.mark.parametrize(("text", "place", "message"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusals_are_located(text: str, place: tuple[int, int], message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_text(text)
    problem = caught.value.problems[0]
    assert message in problem.message
    assert problem.mark is not None
    assert (problem.mark.line, problem.mark.column) == place


@pytest.mark.parametrize(
    ("moments", "message"),
    [("[1, 1, 3]", "exceeds the sum of the others"), ("[-1, 1, 1]", "moment of inertia")],
)
def test_inertia_that_no_body_has_is_refused(moments: str, message: str) -> None:
    text = TOP.replace("[A, A, A]", moments) % "[z: a, x: b, z: c]"
    with pytest.raises(InputError, match=message):
        reduce(read_text(text))


def _names(expression: Expression) -> set[str]:
    return {name.name for name in names_in(expression.node)}


def test_turns_about_one_axis_are_one_turn() -> None:
    text = CHAIN.replace("{x: b}", "{z: b}") % "at: [0, 0, 0]"
    scene = read_text(text)
    meanings = {d.name: d.expression for d in scene.definitions}
    # cos(a + b), not a product of the two rotations.
    assert _names(meanings["R_11(two)"]) == {"a", "b"}
    assert [type(part).__name__ for part in (meanings["R_11(two)"].node,)] == ["Call"]


def test_a_body_without_mass_is_a_frame() -> None:
    text = (CHAIN % "at: [0, 0, 0]").replace("mass: 1, inertia: [1, 1, 1]", "mass: 0", 1)
    assert [body.name for body in bodies_of(read_text(text))] == ["two"]


def test_a_place_that_is_a_bare_name_is_a_coordinate_of_its_own() -> None:
    text = "bodies: {ball: {at: [x, y, z], mass: 1, inertia: {sphere: 1}}}\n"
    assert [c.name for c in reduce(read_text(text)).coordinates] == ["x", "y", "z"]


def test_own_functions_are_not_taken_for_spins() -> None:
    text = (
        "functions: {omega_1: r}\nparticles: {p: {mass: 1, position: [r, 0, 0]}}\n"
        "coordinates: [r]\npotentials: {v: omega_1(r)}\n"
    )
    assert reduce(read_text(text)).account.dof == 1
