"""Bodies of scenes at values of their coordinates, by the definitions of the scene alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from lagrange_cli.scene.bodies import bodies_of
from lagrange_cli.scene.model import Scene
from tests.scene.scene_evaluation import value


class PlacedBody(NamedTuple):
    """A body in space: its mass, its centre, its tensor about that in the axes of space."""

    mass: float
    centre: np.ndarray
    tensor: np.ndarray


class _Names(dict[str, float]):
    """Values of names, evaluated when they are asked for."""

    def __init__(self, scene: Scene, values: Mapping[str, float]) -> None:
        super().__init__(values)
        self._expressions = {d.name: d.expression.node for d in scene.definitions}
        self._expressions |= {p.name: p.value.node for p in scene.parameters if p.value}

    def __missing__(self, name: str) -> float:
        self[name] = result = value(self._expressions[name], self)
        return result


def placed_bodies(scene: Scene, values: Mapping[str, float]) -> dict[str, PlacedBody]:
    names = _Names(scene, values)
    results = {}
    for body in bodies_of(scene):
        centre = np.array([value(e.node, names) for e in body.position])
        rotation = np.array([value(e.node, names) for e in body.rotation]).reshape(3, 3)
        own = np.array([[value(e.node, names) for e in row] for row in body.inertia])
        mass = value(body.mass.node, names)
        results[body.name] = PlacedBody(mass, centre, rotation @ own @ rotation.T)
    return results


def assert_same(actual: PlacedBody, expected: PlacedBody, within: float = 1e-12) -> None:
    assert math.isclose(actual.mass, expected.mass, rel_tol=within)
    np.testing.assert_allclose(actual.centre, expected.centre, atol=within)
    size = np.abs(expected.tensor).max()
    np.testing.assert_allclose(actual.tensor, expected.tensor, atol=within * max(size, 1e-12))
