"""Balls on spheres and cylinders, at rest and moving: rolling by its definition, in NumPy.

A ball is put on the surface with a random turning rate, and its centre moves so that the point of
contact has the velocity of the surface there, by matrices of SciPy and differences in time. All
equations of the joint hold then, and no longer if the centre moves otherwise along the surface.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from lagrange_cli.scene import read_text
from lagrange_cli.scene.language.expression import Node
from lagrange_cli.scene.model import Scene
from tests.scene import scene_evaluation

Array = NDArray[np.float64]

SCENE = """
parameters: {R: 2.5, r: 0.4}
frames: {table: {at: [t, t^2, 1 - t], turn: [z: 0.3 + t, x: 0.2 - 2*t]}}
bodies:
  ball: {%sat: [x, y, z], turn: [z: a, x: b, y: c], mass: 1, inertia: [1, 1, 1]}
constraints: {joint: {roll: ball, radius: r, on: {%s, inside: %s, point: [0.3, -0.2, 0.5]%s}}}
coordinates: [x, y, z, a, b, c]
"""
LARGE, SMALL, POINT, STEP = 2.5, 0.4, np.array([0.3, -0.2, 0.5]), 1e-5

#: Shapes with their axes; the body and the surface each on the table or not.
SHAPES = {
    "sphere: R": None,
    "cylinder: R, axis: [1, 2, 2]": np.array([1, 2, 2]) / 3,
    "cylinder: R, axis: y": np.array([0, 1, 0]),
}
PLACES = {
    "space": ("", ""),
    "moving": ("", ", on: table"),
    "together": ("on: table, ", ", on: table"),
}


def table_matrix(t: float) -> Array:
    return np.asarray(Rotation.from_euler("ZX", [0.3 + t, 0.2 - 2 * t]).as_matrix())


def on_table(place: Array, t: float) -> Array:
    return np.array([t, t * t, 1 - t]) + table_matrix(t) @ place


def rate(function: Callable[[float], Array]) -> Array:
    return (function(STEP) - function(-STEP)) / (2 * STEP)


def spin(matrix: Callable[[float], Array]) -> Array:
    skew = rate(matrix) @ matrix(0).T
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])


@dataclass(frozen=True)
class Motion:
    """Coordinates and their rates at t = 0."""

    q: Array
    v: Array

    def at(self, t: float) -> Array:
        return self.q + self.v * t

    def matrix(self, t: float) -> Array:
        return np.asarray(Rotation.from_euler("ZXY", self.at(t)[3:]).as_matrix())


class Values(Mapping[str, float]):
    """Names of a scene along a motion at a time: coordinates, and definitions over them."""

    def __init__(self, scene: Scene, motion: Motion, t: float = 0.0) -> None:
        self.scene, self.motion, self.t = scene, motion, t
        self.known = dict(zip("xyzabc", motion.at(t), strict=True))
        self.known |= {"t": t, "R": LARGE, "r": SMALL}
        self.definitions = {d.name: d.expression.node for d in scene.definitions}

    def __getitem__(self, name: str) -> float:
        if name not in self.known:
            self.known[name] = self.value(self.definitions[name])
        return self.known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.definitions)

    def __len__(self) -> int:
        return len(self.definitions)

    def value(self, node: Node) -> float:
        return float(scene_evaluation.value(node, self, rate=self._rate))

    def _rate(self, node: Node) -> float:
        ahead, behind = (
            Values(self.scene, self.motion, self.t + step).value(node) for step in (STEP, -STEP)
        )
        return (ahead - behind) / (2 * STEP)


def residuals(scene: Scene, motion: Motion) -> Array:
    values = Values(scene, motion)
    (constraint,) = scene.constraints
    return np.array(
        [values.value(e.left.node) - values.value(e.right.node) for e in constraint.equations]
    )


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("place", PLACES)
def test_a_ball_rolls_where_its_lowest_point_moves_with_the_surface(
    shape: str, inside: bool, place: str
) -> None:
    random = np.random.default_rng(len(shape) + 7 * inside + len(place))
    body, surface = PLACES[place]
    scene = read_text(SCENE % (body, shape, str(inside).lower(), surface))
    axis = SHAPES[shape]
    outwards = random.normal(size=3)
    if axis is not None:
        outwards -= axis * (axis @ outwards)
    outwards /= np.linalg.norm(outwards)
    normal = -outwards if inside else outwards
    centre = POINT + outwards * (LARGE - SMALL if inside else LARGE + SMALL)
    if axis is not None:
        centre = centre + 0.7 * axis
    angles, rates = random.uniform(-1, 1, 3), random.uniform(-2, 2, 3)
    moves = place == "moving"
    if moves:
        normal, centre = table_matrix(0) @ normal, on_table(centre, 0)
    motion = Motion(np.array([*centre, *angles]), np.array([0, 0, 0, *rates]))
    touching = centre - SMALL * normal
    carried = np.zeros(3)
    if moves:
        fixed = table_matrix(0).T @ (touching - on_table(np.zeros(3), 0))
        carried = rate(lambda t: on_table(fixed, t))
    velocity = carried + np.cross(spin(motion.matrix), SMALL * normal)
    rolling = replace(motion, v=np.array([*velocity, *rates]))
    assert np.abs(residuals(scene, rolling)).max() < 1e-8
    slipping = np.cross(normal, random.normal(size=3))
    moved = replace(motion, v=np.array([*(velocity + slipping), *rates]))
    assert np.abs(residuals(scene, moved)[1:]).max() > 0.05
