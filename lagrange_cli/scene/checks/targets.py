"""Checks of what forces and torques act on, and of what quaternions are made of."""

from __future__ import annotations

from lagrange_cli.scene.bodies import bodies_of
from lagrange_cli.scene.checks.table import NameTable
from lagrange_cli.scene.language.expression import Name
from lagrange_cli.scene.language.problems import Problems, shown, suggestion
from lagrange_cli.scene.model import Force, Scene


def check_target(force: Force, scene: Scene, table: NameTable, problems: Problems) -> None:
    """Check that a force acts on a known name and has as many components as that needs."""
    coordinates = table.cartesian if scene.coordinates is None else table.coordinates
    what = f"force '{force.name}'"
    if force.is_torque:
        _check_turned(force, scene, what, problems)
        return
    is_body, is_coordinate = force.on in table.bodies, force.on in coordinates
    if is_body and is_coordinate:
        problems.add(
            f"'{force.on}' in {what} is both a body and a coordinate", force.on_mark, rule="clash"
        )
    elif not is_body and not is_coordinate:
        problems.add(
            f"unknown particle, point or coordinate {shown(force.on)} in {what}",
            force.on_mark,
            hint=suggestion(force.on, [*table.bodies, *coordinates]),
            rule="unknown-name",
        )
    elif len(force.components) != (3 if is_body else 1):
        wanted = "a list of three components" if is_body else "one expression"
        kind = "particle or point" if is_body else "coordinate"
        problems.add(
            f"expected {wanted} for {what} on a {kind}", force.components[0].mark(), rule="shape"
        )


def _check_turned(force: Force, scene: Scene, what: str, problems: Problems) -> None:
    """Check that a torque acts on a body."""
    bodies = [body.name for body in bodies_of(scene)]
    if force.on not in bodies:
        problems.add(
            f"the torque of {what} acts on {shown(force.on)}, which is no body",
            force.on_mark,
            hint=suggestion(
                force.on,
                bodies,
                "a torque in a joint acts on its angle: {on: ANGLE, force: TORQUE}",
            ),
            rule="unknown-name",
        )


def check_quaternions(scene: Scene, table: NameTable, problems: Problems) -> None:
    """Check that the parts of the quaternions by which frames turn are coordinates."""
    coordinates = table.cartesian if scene.coordinates is None else table.coordinates
    joints = (constraint.joint for constraint in scene.constraints)
    for joint in (joint for joint in joints if joint is not None):
        frame = joint.parts[0]
        for part in joint.quaternions:
            if isinstance(part.node, Name) and part.node.name not in coordinates:
                problems.add(
                    f"{shown(part.node.name)} in the quaternion of '{frame}' is no coordinate",
                    part.mark(),
                    hint=f"write coordinates: [{part.node.name}]"
                    if part.node.name not in table
                    else "",
                    rule="unknown-name",
                )
