"""Arms whose numbers are published: what is imported, and the shipped scenes of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from lagrange_cli.robots.importing import import_robot
from lagrange_cli.scene.reader import read_text
from tests.robots.placed_bodies import assert_same, placed_bodies
from tests.robots.published import iiwa, ur5
from tests.robots.urdf_kinematics import links_of_urdf

ROBOTS = Path(__file__).parents[2] / "systems" / "robots"


def imported(tmp_path, text: str) -> str:
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    return import_robot(str(path)).text


@pytest.mark.parametrize(
    ("name", "published", "points"),
    [("kuka_iiwa", iiwa, {"hand": "iiwa_link_ee"}), ("ur5", ur5, {})],
    ids=("kuka_iiwa", "ur5"),
)
def test_the_shipped_arm_is_what_is_imported(tmp_path, name, published, points):
    """But for its title and description, the name of its hand, and where it starts."""
    written = yaml.safe_load(imported(tmp_path, published()))
    shipped = yaml.safe_load((ROBOTS / f"{name}.yaml").read_text())
    shipped["points"] = {points.get(k, k): point for k, point in shipped["points"].items()}
    apart = ("title", "description", "initial", "simulate", "expect")
    assert {k: v for k, v in shipped.items() if k not in apart} == {
        k: v for k, v in written.items() if k not in apart
    }


def test_links_of_the_ur5_stand_where_the_file_says(tmp_path):
    text = imported(tmp_path, ur5())
    rng = np.random.default_rng(5)
    joints = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    values = dict(zip(joints, rng.uniform(-2, 2, 6), strict=True))
    placed = placed_bodies(read_text(text, "ur5.yaml"), values)
    expected = links_of_urdf(ur5(), {f"{name}_joint": [at] for name, at in values.items()})
    names = {"shoulder": "shoulder_link", "upper_arm": "upper_arm_link", "forearm": "forearm_link"}
    assert len(placed) == 6
    for name, body in placed.items():
        assert_same(body, expected[names.get(name, name)])
    assert "    turn: {y: pi/2 + shoulder_lift}" in text.splitlines()
    assert "  tool0: {on: wrist_3_link, at: [0, 0.0823, 0]}" in text.splitlines()
