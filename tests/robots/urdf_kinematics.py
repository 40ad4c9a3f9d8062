"""Links of a URDF file in space, as the format is defined: matrices, from the root on.

Written against the definition of the format with SciPy's rotations and ElementTree; it shares
nothing with what imports.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from tests.robots.placed_bodies import PlacedBody


def _numbers(element: ElementTree.Element | None, key: str, default: str) -> np.ndarray:
    text = default if element is None else element.get(key, default)
    return np.array([float(word) for word in text.split()])


def _frame(origin: ElementTree.Element | None) -> np.ndarray:
    frame = np.eye(4)
    frame[:3, :3] = Rotation.from_euler("xyz", _numbers(origin, "rpy", "0 0 0")).as_matrix()
    frame[:3, 3] = _numbers(origin, "xyz", "0 0 0")
    return frame


def _moved(joint: ElementTree.Element, at: np.ndarray) -> np.ndarray:
    axis = _numbers(joint.find("axis"), "xyz", "1 0 0")
    axis = axis / np.linalg.norm(axis)
    frame = np.eye(4)
    kind = joint.get("type")
    if kind in ("revolute", "continuous"):
        frame[:3, :3] = Rotation.from_rotvec(axis * at[0]).as_matrix()
    elif kind == "prismatic":
        frame[:3, 3] = axis * at[0]
    elif kind == "planar":
        first = int(np.abs(axis).argmax())
        frame[:3, :3] = Rotation.from_rotvec(axis * at[2]).as_matrix()
        frame[(first + 1) % 3, 3], frame[(first + 2) % 3, 3] = at[:2]
    return frame


def links_of_urdf(text: str, values: Mapping[str, list[float]]) -> dict[str, PlacedBody]:
    """Links with mass, at values of the joints; ``mimic`` is followed."""
    root = ElementTree.fromstring(text)
    joints = {joint.find("child").get("link"): joint for joint in root.iter("joint")}  # type: ignore[union-attr]
    frames: dict[str, np.ndarray] = {}

    def place(joint: ElementTree.Element) -> list[float]:
        mimic = joint.find("mimic")
        if mimic is None:
            return values.get(str(joint.get("name")), [0.0])
        (other,) = values[str(mimic.get("joint"))]
        return [float(mimic.get("multiplier", 1)) * other + float(mimic.get("offset", 0))]

    def frame(link: str) -> np.ndarray:
        if link not in frames:
            joint = joints.get(link)
            if joint is None:
                return np.eye(4)
            parent = joint.find("parent").get("link")  # type: ignore[union-attr]
            moved = _moved(joint, np.array(place(joint)))
            frames[link] = frame(str(parent)) @ _frame(joint.find("origin")) @ moved
        return frames[link]

    results = {}
    for link in root.iter("link"):
        inertial = link.find("inertial")
        mass = (
            float(_numbers(inertial.find("mass"), "value", "0")[0]) if inertial is not None else 0
        )
        if inertial is None or mass == 0:
            continue
        turned = frame(str(link.get("name"))) @ _frame(inertial.find("origin"))
        inertia = inertial.find("inertia")
        xx, yy, zz, xy, xz, yz = (
            _numbers(inertia, key, "0")[0] for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        )
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        rotation = turned[:3, :3]
        results[str(link.get("name"))] = PlacedBody(
            mass, turned[:3, 3], rotation @ own @ rotation.T
        )
    return results
