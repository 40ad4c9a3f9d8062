"""A file that describes a robot → a scene, and what the scene does not say."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import localcontext

from lagrange_cli.errors import Problem
from lagrange_cli.files import read_bytes
from lagrange_cli.robots.mjcf import robot_of_mjcf
from lagrange_cli.robots.placing import PlacedRobot, placed_robot
from lagrange_cli.robots.quantities import ARITHMETIC
from lagrange_cli.robots.robot import Robot
from lagrange_cli.robots.scene_text import SceneOptions, scene_text
from lagrange_cli.robots.urdf import robot_of_urdf
from lagrange_cli.robots.xml_reader import read_xml
from lagrange_cli.scene.reader import read_text


@dataclass(frozen=True)
class ImportedScene:
    """A scene of a robot.

    Attributes
    ----------
    text
        Its YAML.
    warnings
        What else is in the file, each with the place where it stands first.
    remarks
        Names that are others in the scene.
    """

    text: str
    warnings: tuple[Problem, ...]
    remarks: tuple[str, ...]


def import_robot(path: str, *, limits: bool = False, floating: bool = False) -> ImportedScene:
    """Read the description of a robot, URDF or MJCF, as a scene.

    Parameters
    ----------
    path
        The file, ``-`` for standard input.
    limits
        True for limits of joints as one-sided constraints.
    floating
        True if the root of the robot, which otherwise is fixed in space, moves freely.

    Raises
    ------
    InputError
        Located: the file cannot be read, is no description of a robot, or says something that no
        scene can.
    """
    data = read_bytes(path, "a description of a robot")
    name = "<stdin>" if path == "-" else path
    with localcontext(ARITHMETIC):
        imported = _imported(data, name, limits=limits, floating=floating)
    read_text(imported.text, f"the scene of {os.path.basename(name)}")
    return imported


def _imported(data: bytes, name: str, *, limits: bool, floating: bool) -> ImportedScene:
    root = read_xml(data, name)
    if root.tag == "robot":
        robot = robot_of_urdf(root, floating=floating)
    elif root.tag == "mujoco":
        robot = robot_of_mjcf(root, floating=floating)
    else:
        hint = "it begins with <robot ...> as URDF or with <mujoco ...> as MJCF"
        root.refuse(f"<{root.tag}> is no description of a robot", hint=hint)
    placed = placed_robot(robot)
    file = os.path.basename(name)
    text = scene_text(robot, placed, SceneOptions(limits, file, os.path.splitext(file)[0]))
    return ImportedScene(text, tuple(_warnings(robot, placed)), tuple(_renamed(placed)))


def _warnings(robot: Robot, placed: PlacedRobot) -> list[Problem]:
    problems = []
    for entry in (*robot.left_out, *placed.left_out):
        often = f", {entry.count} times" if entry.count > 1 else ""
        message = f"not in the scene: {entry.what}{often}"
        problems.append(Problem(message, entry.mark, rule="import", severity="warning"))
    return problems


def _renamed(placed: PlacedRobot) -> list[str]:
    pairs = [(c.joint.name, c.name) for c in placed.coordinates if c.joint.name != c.name]
    links = [(f.link, f.name) for f in placed.frames if f.link != f.name]
    remarks = list(_freedoms(placed))
    for what, renamed in (("joints", pairs), ("links", links)):
        if renamed:
            names = ", ".join(f"{old} is {new}" for old, new in dict.fromkeys(renamed))
            remarks.append(f"names of {what}: {names}")
    return remarks


def _freedoms(placed: PlacedRobot) -> Iterator[str]:
    """Say of each link that moves freely, or on a ball, by which coordinates it does."""
    by_joint: dict[str, list[str]] = {}
    for c in placed.coordinates:
        if c.joint.kind in ("free", "ball"):
            by_joint.setdefault(c.joint.child, []).append(c.name)
    for link, names in by_joint.items():
        *places, scalar, first, second, third = names
        moved = f"{', '.join(places)} and " if places else ""
        quaternion = f"the quaternion {scalar}, {first}, {second}, {third}"
        yield f"'{link}' moves by {moved}{quaternion}, which reaches every orientation"
