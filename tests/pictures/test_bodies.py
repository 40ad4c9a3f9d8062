"""Rigid bodies in pictures: their outlines against the rotations that the scene writes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lagrange_cli import loads
from lagrange_cli.pages.stage import drawn_equations, stage_of
from lagrange_cli.pictures.sketch.composition import sketch_of
from lagrange_cli.pictures.sketch.displaced import RestingSketch
from lagrange_cli.pictures.sketch.links import parts_of

#: A box on a turned cylinder, a ball at its end, a body with moments alone, a disk and a rod.
TREE = """
parameters: {m: 1, l: 0.4}
bodies:
  base: {turn: {z: q1}, mass: 2, centre: [0, 0, 0.1], inertia: {cylinder: [0.08, 0.2]}}
  arm:
    {on: base, at: [0, 0, 0.2], turn: {y: q2}, mass: m, centre: [l/2, 0, 0],
     inertia: {box: [l, 0.06, 0.08]}}
  wrist: {on: arm, at: [l, 0, 0], mass: m, centre: [0.1, 0, 0.02], inertia: [0.01, 0.02, 0.02]}
  ball: {on: wrist, at: [0.2, 0, 0], mass: 0.5, inertia: {sphere: 0.05}}
  wheel: {on: base, at: [0, 0.3, 0], mass: 0.5, inertia: {disk: 0.1, axis: y}}
  pin: {on: wheel, at: [0.1, 0, 0], mass: 0.1, inertia: {rod: 0.06, axis: x}}
points:
  tip: {on: wrist, at: [0.2, 0, 0.1]}
coordinates: [q1, q2]
potentials: {weight: {gravity: 9.81}}
initial: {q1: 0.5, q2: -0.7}
simulate: {until: 1}
"""


@pytest.fixture(scope="module")
def equations():
    return loads(TREE).derive().equations


def frames(q1: float, q2: float):
    """Rotations of base and arm, and the places of their origins, by SciPy."""
    base = Rotation.from_euler("z", q1)
    return base, base * Rotation.from_euler("y", q2)


#: The plane of x and y.
FLAT = np.eye(3)[:2]


def lines(equations, q, matrix=FLAT):
    """Name → lines of its outline in space."""
    parts = parts_of(equations)
    known = parts.known.configurations
    places = known.drawn(np.array(q), 0.0)
    drawn = parts.outlines.at(np.array(q), 0.0)
    return {
        known.names[outline.particle]: [
            line for _, line in outline.lines(places[outline.particle], matrix)
        ]
        for outline in drawn
    }


@pytest.mark.parametrize("q", [(0.5, -0.7), (-2.0, 1.3)])
def test_outlines_turn_with_their_bodies(equations, q):
    base, arm = frames(*q)
    drawn = lines(equations, q)
    assert set(drawn) == {"base", "arm", "ball", "wheel", "pin"}

    edges = np.array(drawn["arm"])
    corners = arm.inv().apply((edges - [0, 0, 0.2]).reshape(-1, 3)) - [0.2, 0, 0]
    np.testing.assert_allclose(np.abs(corners), np.tile([0.2, 0.03, 0.04], (24, 1)), atol=1e-12)
    lengths = sorted(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1))
    np.testing.assert_allclose(lengths, [0.06] * 4 + [0.08] * 4 + [0.4] * 4, atol=1e-12)

    (rod,) = drawn["pin"]
    ends = base.inv().apply(rod) - [0.1, 0.3, 0]
    np.testing.assert_allclose(ends, [[-0.03, 0, 0], [0.03, 0, 0]], atol=1e-12)

    rim = base.inv().apply(drawn["wheel"][0]) - [0, 0.3, 0]
    np.testing.assert_allclose(np.hypot(rim[:, 0], rim[:, 2]), 0.1, atol=1e-12)
    np.testing.assert_allclose(rim[:, 1], 0, atol=1e-12)


def test_a_ball_is_a_circle_and_a_cylinder_has_sides_in_any_view(equations):
    """The sides are as far from the axis as no other line along it is."""
    angle = 0.4
    views = [np.eye(3)[[1, 2]], np.array([[1, 0.2, 0], [0, -0.3, np.cos(angle)]])]
    for matrix in views:
        drawn = lines(equations, (0.5, -0.7), matrix)
        ball = drawn["ball"][-1] @ matrix.T
        np.testing.assert_allclose(np.linalg.norm(ball - ball[:-1].mean(axis=0), axis=1), 0.05)
        rims, sides = drawn["base"][:2], [side @ matrix.T for side in drawn["base"][-2:]]
        along = (rims[0].mean(axis=0) - rims[1].mean(axis=0)) @ matrix.T
        across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        far = (np.concatenate(rims) @ matrix.T) @ across
        reached = sorted(float(side[0] @ across) for side in sides)
        np.testing.assert_allclose(reached, [far.min(), far.max()], atol=1e-3)
        for side in sides:
            np.testing.assert_allclose(np.ptp(side @ across), 0, atol=1e-12)


def test_lines_go_from_origins_to_what_stands_there(equations):
    parts = parts_of(equations)
    places, names = parts.known.places[0], parts.known.names
    base, arm = frames(0.5, -0.7)
    elbow = np.array([0, 0, 0.2]) + arm.apply([0.4, 0, 0])
    expected = [
        ([0, 0, 0], [0, 0, 0.2]),
        ([0, 0, 0], base.apply([0, 0.3, 0])),
        ([0, 0, 0.2], elbow),
        (elbow, elbow + arm.apply([0.2, 0, 0])),
        (elbow, elbow + arm.apply([0.2, 0, 0.1])),
        (base.apply([0, 0.3, 0]), base.apply([0.1, 0.3, 0])),
    ]
    drawn = [(places[a], places[b]) for a, b in (link.ends for link in parts.known.links)]
    assert len(drawn) == len(expected)
    for line in expected:
        assert any(np.abs(np.array(line) - other).max() < 1e-9 for other in drawn), line
    assert "tip" in names


def test_only_the_lowest_joint_stands_on_the_ground(equations):
    ground = [s for s in sketch_of(equations).strokes if s.kind == "ground"]
    assert {s.name for s in ground} == {""}
    assert len({s.points for s in ground}) <= 7
    middle = np.array([np.mean(s.points, axis=0) for s in ground])
    assert np.ptp(middle, axis=0).max() < 0.8


def test_shapes_move_along_a_motion(equations):
    """The film of a motion draws each configuration as a sketch of that one."""
    sketch = RestingSketch(equations, np.array([0.5, -0.7]))
    moved = sketch.followed(np.array([[0.5, -0.7], [1.0, 0.2]]), np.array([0.0, 1.0])).moved
    kinds = [kind for kind, _ in moved[0].strokes]
    assert kinds.count("body") == 12 + 5 + 2 + 2
    first, second = (
        np.array([line for kind, line in m.strokes if kind == "body" and len(line) == 2])
        for m in moved
    )
    assert np.abs(first - second).max() > 0.5


def test_a_page_has_the_sources_of_outlines(equations):
    """Numbers behind the names of the scene: origins, then spans, as the sketch has them."""
    drawn = drawn_equations(equations)
    stage = stage_of(drawn)
    names = [c.name for c in drawn.system.cartesian_names]
    assert names[: len(equations.system.cartesian_names)] == [
        c.name for c in equations.system.cartesian_names
    ]
    outlines = {stage["bodies"][o["body"]]["name"]: o for o in stage["outlines"]}
    assert set(outlines) == {"base", "arm", "ball", "wheel", "pin"}
    values = {c.q: x for c, x in zip(drawn.system.coordinates, (0.5, -0.7), strict=True)}
    values |= {p.symbol: {"m": 1, "l": 0.4}[p.name] for p in drawn.system.parameters}
    _, arm = frames(0.5, -0.7)
    for span, half in zip(outlines["arm"]["spans"], np.diag([0.2, 0.03, 0.04]), strict=True):
        parts = [float(drawn.system.cartesian_names[k].position.subs(values)) for _, k in span]
        np.testing.assert_allclose(parts, arm.apply(half), atol=1e-12)


def test_bodies_of_a_plane_are_flat():
    plane = """
parameters: {m: 1, l: 1, R: 0.2}
plane: xz
bodies:
  rod: {turn: theta, centre: [0, 0, -l/2], mass: m, inertia: {rod: l}}
  disk: {on: rod, at: [0, 0, -l], mass: m, inertia: {disk: R}}
coordinates: [theta]
potentials: {weight: {gravity: 9.81}}
initial: {theta: 0.4}
"""
    equations = loads(plane).derive().equations
    drawn = lines(equations, (0.4,), np.eye(3)[[0, 2]])
    down = np.array([np.sin(0.4), 0, -np.cos(0.4)])
    np.testing.assert_allclose(sorted(drawn["rod"][0][:, 2]), sorted([0, down[2]]), atol=1e-12)
    rim = drawn["disk"][0] - down
    np.testing.assert_allclose(np.linalg.norm(rim, axis=1), 0.2, atol=1e-12)
    np.testing.assert_allclose(rim[:, 1], 0, atol=1e-12)
    arcs = [s for s in sketch_of(equations).strokes if s.kind == "angle"]
    assert [arc.name for arc in arcs] == ["theta"]


def test_what_rolls_is_drawn_by_the_radius_that_touches():
    rolling = """
parameters: {m: 1, R: 0.3}
bodies:
  wheel: {at: [x, y, z], turn: [z: a, x: b, y: c], mass: m, inertia: [0.1, 0.2, 0.1]}
  ball: {at: [u, v, w], turn: {y: d}, mass: m, inertia: [0.1, 0.1, 0.2]}
constraints:
  road: {roll: wheel, radius: R, axis: y, on: {normal: z}}
  floor: {touch: ball, radius: 2*R, on: {normal: z}}
coordinates: [x, y, a, b, c, u, v, d]
potentials: {weight: {gravity: 9.81}}
initial: {x: 0, y: 0, a: 0, b: 0.2, c: 0, u: 2, v: 0, d: 0}
"""
    equations = loads(rolling).derive().equations
    drawn = lines(equations, (0.5, 0.1, 0.4, 0.2, 1.0, 2.0, 0.0, 0.3))
    turned = Rotation.from_euler("ZXY", [0.4, 0.2, 1.0])
    rim = turned.inv().apply(drawn["wheel"][0] - [0.5, 0.1, 0.3 * np.cos(0.2)])
    np.testing.assert_allclose(np.hypot(rim[:, 0], rim[:, 2]), 0.3, atol=1e-12)
    np.testing.assert_allclose(rim[:, 1], 0, atol=1e-12)
    for line in drawn["ball"]:
        np.testing.assert_allclose(np.linalg.norm(line - [2, 0, 0.6], axis=1)[:-1], 0.6, atol=1e-12)
