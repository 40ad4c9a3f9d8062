"""URDF → scene: bodies stand and turn as the format says, in names and numbers of a person."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.robots.importing import ImportedScene, import_robot
from lagrange_cli.scene.reader import read_text
from tests.robots.placed_bodies import assert_same, placed_bodies
from tests.robots.urdf_kinematics import links_of_urdf

LINK = '<link name="{}"><inertial><origin xyz="{}" rpy="{}"/><mass value="{}"/>{}</inertial></link>'
INERTIA = '<inertia ixx="0.02" ixy="0.001" ixz="-0.002" iyy="0.03" iyz="0.0005" izz="0.025"/>'


def link(name: str, mass: float = 1.5, xyz: str = "0.1 -0.02 0.03", rpy: str = "0 0 0") -> str:
    return LINK.format(name, xyz, rpy, mass, INERTIA)


def joint(name: str, kind: str, ends: str, origin: str = "", more: str = "") -> str:
    parent, child = ends.split(" > ")
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{origin}{more}</joint>'


def origin(xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def axis(xyz: str) -> str:
    return f'<axis xyz="{xyz}"/>'


def robot(*parts: str) -> str:
    return f'<?xml version="1.0"?>\n<robot name="robot">\n{chr(10).join(parts)}\n</robot>\n'


def imported(tmp_path, text: str, **options: bool) -> ImportedScene:
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    return import_robot(str(path), **options)


#: Joints of each kind after turns by right angles and by others, on links with mass and without.
TREE = robot(
    '<link name="world"/>',
    link("base"),
    joint("stand", "fixed", "world > base", origin("0 0 0.5", "0 0 1.5707963267948966")),
    link("column", rpy="0.3 -0.4 1.1"),
    joint(
        "lift",
        "prismatic",
        "base > column",
        origin("0.1 0 0.2", "0 3.141592653589793 0"),
        axis("0 0 -1"),
    ),
    link("arm", 0.7),
    joint(
        "swing",
        "revolute",
        "column > arm",
        origin("0 0.3 0", "1.5707963267948966 0 0.2"),
        axis("0 -2 0"),
    ),
    '<link name="flange"/>',
    joint("flange_joint", "fixed", "arm > flange", origin("0.2 0 0.1", "0 -1.5707963267948966 0")),
    link("tool", 0.2, rpy="1.5707963267948966 0 0"),
    joint(
        "tool_turn",
        "continuous",
        "flange > tool",
        origin("0 0 0.05", "0.1 0.2 0.3"),
        axis("1 2 -2"),
    ),
    link("slider", 0.4),
    joint("slide", "prismatic", "tool > slider", origin("0 0.01 0", "0.7 0 0"), axis("0 3 4")),
    '<link name="skew"/>',
    joint("skew_joint", "fixed", "arm > skew", origin("0 0 0.1", "0.5 0.6 0.7")),
    link("finger", 0.1),
    joint(
        "finger_joint", "revolute", "skew > finger", origin("0.02 0 0", "0 0 0.1"), axis("0 0 1")
    ),
    link("thumb", 0.1),
    joint(
        "thumb_joint",
        "revolute",
        "skew > thumb",
        origin("-0.02 0 0"),
        axis("0 0 -1") + '<mimic joint="finger_joint" multiplier="-1.5" offset="0.2"/>',
    ),
    '<link name="tip"/>',
    joint("tip_joint", "fixed", "thumb > tip", origin("0.05 0 0")),
    link("puck"),
    joint(
        "puck_joint",
        "planar",
        "base > puck",
        origin("0 0 1", "1.5707963267948966 0 0"),
        axis("0 0 1"),
    ),
)
SINGLE = {"lift": 0.3, "swing": -0.8, "tool_turn": 0.5, "slide": 0.02, "finger_joint": 0.4}


def test_bodies_stand_where_the_format_says(tmp_path):
    """Also links on joints that follow others, and on links without mass."""
    scene = read_text(imported(tmp_path, TREE).text, "robot.yaml")
    short = {
        "lift": "lift",
        "swing": "swing",
        "tool_turn": "tool_turn",
        "slide": "slide",
        "finger_joint": "finger",
    }
    values = {short[name]: at for name, at in SINGLE.items()} | {
        "x": 0.11,
        "y": -0.07,
        "theta": 0.9,
    }
    joints = {name: [at] for name, at in SINGLE.items()} | {"puck_joint": [0.11, -0.07, 0.9]}
    expected = links_of_urdf(TREE, joints)
    placed = placed_bodies(scene, values)
    names = {name: f"{name}_body" for name in ("finger",)} | {"column": "column"}
    assert len(placed) == len(expected) - 1  # the base does not move
    for name, body in expected.items():
        if name != "base":
            assert_same(placed[names.get(name, name)], body)


def test_names_and_numbers_are_a_person_s(tmp_path):
    text = robot(
        *(link(f"lbr_iiwa_link_{k}", xyz="0 0 0.1250") for k in range(3)),
        joint(
            "lbr_iiwa_joint_1",
            "revolute",
            "lbr_iiwa_link_0 > lbr_iiwa_link_1",
            origin("0 0 0.15750"),
            axis("0 0 1")
            + '<limit lower="-2.96705972839" upper="2.9671" effort="300" velocity="1"/>'
            '<dynamics damping="0.50"/>',
        ),
        joint(
            "lbr_iiwa_joint_2",
            "revolute",
            "lbr_iiwa_link_1 > lbr_iiwa_link_2",
            origin("0 0 0.2025", "1.5708 0 3.14159265359"),
            axis("0 0 1") + '<dynamics damping="0.5" friction="0.1"/>',
        ),
        '<link name="tool-0"/>',
        joint("tool_joint", "fixed", "lbr_iiwa_link_2 > tool-0", origin("0 0 1.0e-05")),
    )
    scene = imported(tmp_path, text, limits=True)
    for line in (
        "  m1: {value: 1.5, unit: kg, description: mass of lbr_iiwa_link_1}",
        "  d: {value: 0.5, unit: N*m*s, description: damping of each of 2 joints}",
        "  tau1: 0",
        "    at: [0, 0, 0.1575]",
        "    turn: [z: pi, x: pi/2, z: q2]",
        "    centre: [0, 0, 0.125]",
        "  tool_0: {on: link2, at: [0, 0, 0.00001]}",
        "  q1: {unit: rad, description: angle of lbr_iiwa_joint_1}",
        "  damping: d/2*(dot(q1)^2 + dot(q2)^2)",
        "  drive1: {on: q1, force: tau1}",
        "  friction2: {on: q2, force: -f2*sign(dot(q2))}",
        "  lower1: q1 >= -17*pi/18",
        "  upper1: q1 <= 2.9671",
        "expect: {dof: 2}",
    ):
        assert line in scene.text.splitlines(), line
    assert "lbr_iiwa_joint_1 is q1" in scene.remarks[0]
    assert [w.message for w in scene.warnings] == [
        "not in the scene: largest effort of joints",
        "not in the scene: largest velocity of joints",
        "not in the scene: masses of links that are fixed in space",
    ]


def test_wrists_without_mass_between_their_joints_are_turns_in_order(tmp_path):
    text = robot(
        '<link name="base"/><link name="a"/>',
        joint("pan", "revolute", "base > a", origin("0 0 1"), axis("0 0 1")),
        link("camera"),
        joint("tilt", "revolute", "a > camera", "", axis("0 1 0")),
    )
    assert "turn: [z: pan, y: tilt]" in imported(tmp_path, text).text


def test_a_floating_root_has_three_places_and_a_quaternion(tmp_path):
    text = robot(link("hull"))
    scene = imported(tmp_path, text, floating=True)
    assert "at: [x, y, z]" in scene.text
    assert "turn: {quaternion: [e0, e1, e2, e3]}" in scene.text
    assert "expect: {dof: 6}" in scene.text
    assert scene.remarks[0] == (
        "'hull' moves by x, y, z and the quaternion e0, e1, e2, e3, which reaches every orientation"
    )
    with pytest.raises(InputError, match="nothing of this robot moves"):
        imported(tmp_path, text)


def test_names_that_the_language_has_or_that_are_alike_get_others(tmp_path):
    text = robot(
        '<link name="w"/>',
        *(link(name) for name in ("sin", "a-b", "a_b", "3d", "pi")),
        *(
            joint(name, "revolute", f"w > {child}", "", axis("0 0 1"))
            for name, child in (
                ("t", "sin"),
                ("pi", "a-b"),
                ("dot", "a_b"),
                ("A_b", "3d"),
                ("é", "pi"),
            )
        ),
    )
    scene = read_text(imported(tmp_path, text).text, "robot.yaml")
    assert len({p.name for p in scene.particles}) == 5
    assert len(scene.coordinates or ()) == 5


def test_numbers_keep_their_digits(tmp_path):
    rng = np.random.default_rng(36)
    written = [f"{x:.16g}" for x in rng.uniform(-1, 1, 3)]
    text = robot(
        '<link name="w"/>',
        link("a", xyz=" ".join(written)),
        joint("q", "revolute", "w > a", "", axis("0 0 1")),
    )
    assert f"centre: [{', '.join(written)}]" in imported(tmp_path, text).text


def test_a_lower_limit_above_the_upper_one_is_none_and_listed(tmp_path):
    text = robot(
        link("base"),
        link("wheel"),
        joint("spin", "revolute", "base > wheel", '<limit lower="1" upper="0" velocity="0"/>'),
    )
    written = imported(tmp_path, text, limits=True)
    assert "lower" not in written.text
    assert [p.message for p in written.warnings if "limit" in p.message] == [
        "not in the scene: limits of joints whose lower one is above the upper one"
    ]
