"""Hostile and wrong descriptions of robots are refused at their place, and nothing else happens."""

from __future__ import annotations

from contextlib import suppress

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.robots.importing import import_robot
from tests.cli.terminal import lagrange
from tests.robots.test_urdf import axis, joint, link, origin, robot

WORLD = '<link name="w"/>'
HINGE = joint("q", "revolute", "w > a", "", axis("0 0 1"))

BOMB = """<?xml version="1.0"?>
<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>
<robot name="&b;"/>
"""
OUTSIDE = """<?xml version="1.0"?>
<!DOCTYPE robot SYSTEM "file:///etc/passwd">
<robot/>
"""


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (BOMB, 2, "a document type is refused"),
        (OUTSIDE, 2, "a document type is refused"),
        ("", 1, "this is not XML: no element found"),
        ("<robot>\n<link></robot>", 2, "this is not XML: mismatched tag"),
        ("<robot>&lt;&x;</robot>", 1, "this is not XML: undefined entity"),
        ("\0\0", 1, "this is not XML"),
        ("<robot>" + "<a>" * 300 + "</a>" * 300 + "</robot>", 1, "more than 200 elements within"),
        (f'<robot name="{"a" * 30_000}"/>', 1, "more than 20000 characters in an attribute"),
        ("<html/>", 1, "<html> is no description of a robot"),
        ("<robot/>", 1, "this robot has no links"),
        (robot(WORLD), 3, "nothing of this robot moves"),
        (robot(link("a"), link("a")), 4, "two links are called 'a'"),
        (robot(WORLD, link("a"), HINGE, HINGE), 6, "two joints are called 'q'"),
        (robot(WORLD, HINGE), 4, "names the link 'a', which there is not"),
        (robot(WORLD, link("a"), HINGE.replace("revolute", "screw")), 5, "unknown type 'screw'"),
        (robot(WORLD, link("a"), HINGE.replace("0 0 1", "0 0 0")), 5, "has no length"),
        (robot(WORLD, link("a"), HINGE.replace("0 0 1", "0 0")), 5, "'xyz' is 3 numbers, found 2"),
        (robot(WORLD, link("a"), HINGE.replace("0 0 1", "0 0 1e999")), 5, "is too large"),
        (robot(WORLD, link("a"), HINGE.replace("0 0 1", "0 0 nan")), 5, "'nan' is not a number"),
        (robot(WORLD, link("a"), HINGE.replace("0 0 1", "0 0 ${x}")), 5, "'${x}' is not a number"),
        (robot(WORLD, link("a", -1), HINGE), 4, "the mass of link 'a' is negative"),
        (
            robot(WORLD, link("a").replace('izz="0.025"', 'izz="0.5"'), HINGE),
            4,
            "no body has the inertia",
        ),
        (robot(WORLD, link("a").replace("<mass", "<moss"), HINGE), 4, "has no <mass>"),
        (
            robot(
                link("a"), link("b"), joint("p", "revolute", "a > b"), joint("q", "fixed", "b > a")
            ),
            5,
            "no link is the root",
        ),
        (
            robot(WORLD, link("a"), HINGE, joint("p", "fixed", "w > a")),
            6,
            "is the child of two joints",
        ),
        (
            robot(WORLD, link("a"), HINGE.replace("<axis", '<mimic joint="q"/><axis')),
            5,
            "joint 'q' follows itself",
        ),
        (
            robot(WORLD, link("a"), HINGE.replace("<axis", '<mimic joint="z"/><axis')),
            5,
            "follows 'z', which does not move",
        ),
        (
            robot(WORLD, link("a"), joint("p", "planar", "w > a", origin(), axis("1 1 0"))),
            5,
            "moves in a plane across a slanted axis",
        ),
        (
            '<mujoco><worldbody><body name="a"><joint/><geom type="mesh" mesh="m"/></body>'
            "</worldbody></mujoco>",
            1,
            "the mass of a shape of type 'mesh' is not known",
        ),
        ("<mujoco/>", 1, "this model has no bodies"),
        (
            '<mujoco>\n<worldbody><body><joint class="x"/></body></worldbody></mujoco>',
            2,
            "there is no default class 'x'",
        ),
        (
            '<mujoco><worldbody>\n<body quat="0 0 0 0"><joint/><geom size="1"/></body>'
            "</worldbody></mujoco>",
            2,
            "'quat' has no direction",
        ),
        (
            '<mujoco><worldbody><body><joint type="screw"/></body></worldbody></mujoco>',
            1,
            "unknown type 'screw'",
        ),
    ],
)
def test_refused_at_its_line(tmp_path, text, line, message):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        import_robot(str(path))
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.mark is not None
    assert problem.mark.line == line


def test_a_folder_is_no_description(tmp_path):
    with pytest.raises(InputError, match="this is a folder, not a description of a robot"):
        import_robot(str(tmp_path))


def test_nothing_but_refusals_comes_of_mutilated_files(tmp_path):
    """Files that end too early, or lack a character, import or are refused."""
    text = robot(
        WORLD, link("a"), HINGE, link("b"), joint("r", "prismatic", "a > b", "", axis("1 0 0"))
    )
    path = tmp_path / "robot.urdf"
    for at in range(0, len(text), 7):
        for shorter in (text[:at], text[:at] + text[at + 1 :], text[:at] + "<" + text[at:]):
            path.write_text(shorter)
            with suppress(InputError):
                import_robot(str(path))


@pytest.mark.slow
def test_the_command_writes_a_scene_that_is_derived(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(robot(WORLD, link("a"), HINGE.replace("0 0 1", "0 1 0")))
    done = lagrange("import", str(path), "-o", str(tmp_path / "arm.yaml"))
    assert done.returncode == 0
    assert "1 pass" in lagrange("check", "--strict", str(tmp_path / "arm.yaml")).stdout
    assert lagrange("import", str(path), "-o", "arm.txt").returncode == 2
    path.write_text(BOMB)
    refused = lagrange("import", str(path))
    assert refused.returncode == 2
    assert "arm.urdf:2:" in refused.stderr
    assert refused.stdout == ""
