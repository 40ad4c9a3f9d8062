"""MJCF → scene: bodies stand and turn as the format says, and shapes have their inertia."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from lagrange_cli.mechanics import derive
from lagrange_cli.robots.importing import ImportedScene, import_robot
from lagrange_cli.scene.reader import read_text
from tests.robots.placed_bodies import PlacedBody, assert_same, placed_bodies


def imported(tmp_path, text: str, **options: bool) -> ImportedScene:
    path = tmp_path / "model.xml"
    path.write_text(text)
    return import_robot(str(path), **options)


def model(worldbody: str, more: str = "", compiler: str = "") -> str:
    return (
        f'<mujoco model="m"><compiler {compiler}/>{more}<worldbody>{worldbody}</worldbody></mujoco>'
    )


INERTIAL = '<inertial pos="0.1 0.02 -0.03" mass="1.5" diaginertia="0.02 0.03 0.025" {}/>'


def test_joints_beside_origins_follow_each_other(tmp_path):
    """As the format defines it: each joint turns the body about its place, in order."""
    text = model(
        f"""<body name="torso" pos="0 0 1" quat="0.7071 0 0 0.7071">
              <joint name="lift" type="slide" axis="0 3 4"/>
              <joint name="bend" axis="0 1 0" pos="0 0 0.2"/>
              <joint name="sway" axis="1 0 0" pos="0.1 0 0.3" ref="10"/>
              {INERTIAL.format('quat="0.9 0.1 -0.2 0.3"')}
              <body name="arm" pos="0.5 0 0" euler="20 30 40">
                <joint name="elbow" axis="1 2 2" pos="0.05 0 0"/>
                {INERTIAL.format("")}
              </body>
            </body>"""
    )
    angles = {"lift": 0.1, "bend": 0.4, "sway": -0.3, "elbow": 0.7}
    scene = read_text(imported(tmp_path, text).text, "model.yaml")
    placed = placed_bodies(scene, angles)

    at, turn = np.array([0, 0, 1.0]), Rotation.from_quat([0, 0, 1, 1])
    at = at + turn.apply([0, 0.6, 0.8]) * angles["lift"]
    for axis, place, angle in (
        ([0, 1, 0], [0, 0, 0.2], angles["bend"]),
        ([1, 0, 0], [0.1, 0, 0.3], angles["sway"] - np.deg2rad(10)),
    ):
        anchor = at + turn.apply(place)
        turn = turn * Rotation.from_rotvec(np.array(axis) * angle)
        at = anchor - turn.apply(place)
    own = turn * Rotation.from_quat([0.1, -0.2, 0.3, 0.9])
    assert_same(placed["torso"], _body(at, turn, own))
    at = at + turn.apply([0.5, 0, 0])
    turn = turn * Rotation.from_euler("XYZ", [20, 30, 40], degrees=True)
    anchor = at + turn.apply([0.05, 0, 0])
    turn = turn * Rotation.from_rotvec(np.array([1, 2, 2]) / 3 * angles["elbow"])
    assert_same(placed["arm"], _body(anchor - turn.apply([0.05, 0, 0]), turn, turn))


def _body(at: np.ndarray, turn: Rotation, own: Rotation) -> PlacedBody:
    axes = own.as_matrix()
    tensor = axes @ np.diag([0.02, 0.03, 0.025]) @ axes.T
    return PlacedBody(1.5, at + turn.apply([0.1, 0.02, -0.03]), tensor)


@pytest.mark.parametrize(
    ("orientation", "expected"),
    [
        ('euler="10 20 30"', Rotation.from_euler("XYZ", [10, 20, 30], degrees=True)),
        (
            'axisangle="1 -1 2 50"',
            Rotation.from_rotvec(np.deg2rad(50) * np.array([1, -1, 2]) / 6**0.5),
        ),
        ('quat="1 2 -3 4"', Rotation.from_quat([2, -3, 4, 1])),
        ('quat="0.5 0.5 0.5 0.5"', Rotation.from_quat([1, 1, 1, 1])),
        ('xyaxes="1 1 0 -1 1 0.5"', None),
        ('xyaxes="-1 0.1 0 0.2 -1 0"', None),
        ('zaxis="0 0 -1"', Rotation.from_rotvec([np.pi, 0, 0])),
        ('zaxis="1 2 2"', Rotation.align_vectors([[1, 2, 2]], [[0, 0, 3]])[0]),
    ],
)
def test_orientations(tmp_path, orientation, expected):
    text = model(
        f'<body name="a" {orientation}><joint name="q" type="slide"/>{INERTIAL.format("")}</body>'
    )
    placed = placed_bodies(read_text(imported(tmp_path, text).text, "m.yaml"), {"q": 0.0})
    if expected is None:
        x, y = np.array([float(w) for w in orientation.split('"')[1].split()]).reshape(2, 3)
        x = x / np.linalg.norm(x)
        y = y - (x @ y) * x
        y = y / np.linalg.norm(y)
        expected = Rotation.from_matrix(np.array([x, y, np.cross(x, y)]).T)
    assert_same(placed["a"], _body(np.zeros(3), expected, expected))


def test_sequences_in_capitals_are_about_axes_that_stay(tmp_path):
    inside = f'<joint name="q" type="slide"/>{INERTIAL.format("")}'
    body = f'<body name="a" euler="0.1 0.2 0.3">{inside}</body>'
    text = model(body, compiler='angle="radian" eulerseq="ZyX"')
    placed = placed_bodies(read_text(imported(tmp_path, text).text, "m.yaml"), {"q": 0.0})
    turns = [Rotation.from_euler(a, v) for a, v in (("z", 0.1), ("y", 0.2), ("x", 0.3))]
    expected = turns[2] * turns[0] * turns[1]
    assert_same(placed["a"], _body(np.zeros(3), expected, expected))


def capsule(radius: float, half: float, density: float) -> tuple[float, float, float]:
    """Mass and moments of a capsule along z by integrals over its disks."""

    def squared_radius(z: float) -> float:
        beyond = max(abs(z) - half, 0)
        return max(radius**2 - beyond**2, 0)

    ends = [-half - radius, -half, half, half + radius]

    def total(weight) -> float:
        parts = pairwise(ends)
        return sum(
            quad(lambda z: np.pi * density * squared_radius(z) * weight(z), a, b)[0]
            for a, b in parts
        )

    mass = total(lambda z: 1)
    across = total(lambda z: squared_radius(z) / 4 + z**2)
    return mass, across, total(lambda z: squared_radius(z) / 2)


def test_shapes_have_their_inertia(tmp_path):
    text = model(
        """<body name="a"><joint name="q" axis="1 0 0"/>
             <geom type="capsule" fromto="0 0 0 0.3 0 0.4" size="0.05" density="700"/>
             <geom type="ellipsoid" size="0.1 0.2 0.3" pos="0 0.1 0" mass="2"/>
             <geom type="plane" size="1 1 1"/><geom type="sphere" size="0.1" mass="0"/></body>"""
    )
    placed = placed_bodies(read_text(imported(tmp_path, text).text, "m.yaml"), {"q": 0.0})
    mass, across, along = capsule(0.05, 0.25, 700)
    axis = np.array([0.6, 0, 0.8])
    parts = [
        (
            mass,
            np.array([0.15, 0, 0.2]),
            across * np.eye(3) + (along - across) * np.outer(axis, axis),
        ),
        (
            2,
            np.array([0, 0.1, 0]),
            2 / 5 * np.diag([0.2**2 + 0.3**2, 0.1**2 + 0.3**2, 0.1**2 + 0.2**2]),
        ),
    ]
    total = sum(m for m, _, _ in parts)
    centre = sum(m * c for m, c, _ in parts) / total
    tensor = np.zeros((3, 3))
    for m, c, own in parts:
        d = c - centre
        tensor += own + m * (d @ d * np.eye(3) - np.outer(d, d))
    assert_same(placed["a"], PlacedBody(total, centre, tensor), within=1e-9)


@pytest.mark.parametrize(
    ("geom", "shape"),
    [
        ('type="sphere" size="0.1"', "{sphere: 0.1}"),
        ('type="box" size="0.1 0.2 0.3"', "{box: [0.2, 0.4, 0.6]}"),
        ('type="box" size="0.1 0.2 0.3" euler="90 0 0"', "{box: [0.2, 0.6, 0.4]}"),
        ('type="cylinder" size="0.1 0.2"', "{cylinder: [0.1, 0.4]}"),
        ('type="cylinder" size="0.1" fromto="0 0 0 0 0.5 0"', "{cylinder: [0.1, 0.5], axis: y}"),
    ],
)
def test_a_shape_of_the_language_stays_one(tmp_path, geom, shape):
    text = model(f'<body name="a"><joint name="q" axis="1 0 0"/><geom {geom} mass="1"/></body>')
    assert f"inertia: {shape}" in imported(tmp_path, text).text


def test_defaults_springs_motors_and_limits(tmp_path):
    text = model(
        """<body name="cart" childclass="rail">
             <joint name="x" type="slide" axis="1 0 0" range="-1 1"/>
             <geom type="box" size="0.2 0.1 0.1" mass="1"/>
             <body name="pole">
               <joint name="hinge" class="pole" axis="0 1 0" stiffness="3" springref="30"/>
               <geom type="sphere" size="0.1" pos="0 0 1" mass="0.1"/>
               <site name="tip" pos="0 0 1"/>
             </body>
           </body>""",
        more="""<option gravity="0 0 -1.62"/><default><joint armature="0.01"/><motor gear="10"/>
             <default class="rail"><joint damping="0.5"/><default class="pole">
             <joint damping="0.2" frictionloss="0.1"/></default></default></default>
             <actuator><motor name="push" joint="x"/>
             <position name="x" joint="hinge" kp="5" kv="0.5"/>
             <muscle joint="x"/></actuator>""",
    )
    scene = imported(tmp_path, text, limits=True)
    for line in (
        "  g: {value: 1.62, unit: m/s^2, description: gravitational acceleration}",
        "  damping: d_hinge/2*dot(hinge)^2 + d_x/2*dot(x)^2",
        "  armature: a_hinge/2*dot(hinge)^2 + a_x/2*dot(x)^2",
        "  spring_hinge: k_hinge/2*(hinge - pi/6)^2",
        "  drive_x: {on: x, force: 10*push}",
        "  drive_hinge: {on: hinge, force: 5*(u_hinge - hinge) - 0.5*dot(hinge)}",
        "  friction_hinge: {on: hinge, force: -f_hinge*sign(dot(hinge))}",
        "  tip: {on: pole, at: [0, 0, 1]}",
        "  lower_x: x >= -1",
    ):
        assert line in scene.text.splitlines(), line
    assert "not in the scene: actuators of type muscle" in [w.message for w in scene.warnings]
    read_text(scene.text, "m.yaml")


def test_a_free_body_begins_where_it_stands(tmp_path):
    text = model(
        """<body name="b" pos="1 2 3" quat="0 1 0 0"><freejoint/><geom size="0.1"/>
             <body name="leg" pos="0 0 -0.5">
               <joint name="hip" axis="0 1 0" range="20 60"/><geom size="0.05"/></body>
           </body>"""
    )
    scene = imported(tmp_path, text)
    assert "at: [x, y, z]" in scene.text
    assert "turn: [quaternion: [e0, e1, e2, e3], x: pi]" in scene.text
    start = "initial: {x: 1, y: 2, z: 3, e0: 1, e1: 0, e2: 0, e3: 0, hip: pi/9}"
    assert start in scene.text
    assert derive(read_text(scene.text), points=2).derivation.account.dof == 7


def test_settotalmass_scales_what_has_mass(tmp_path):
    body = '<body name="{}"><joint axis="1 0 0"/><geom size="0.1" mass="{}"/></body>'
    text = model(body.format("a", 1) + body.format("b", 3), compiler='settotalmass="2"')
    masses = re.findall(r"value: ([0-9.]+), unit: kg", imported(tmp_path, text).text)
    assert masses == ["0.5", "1.5"]
