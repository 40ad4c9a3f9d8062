"""The shipped scenes, each derived and simulated once for all tests."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lagrange_cli.cache import open_cache
from lagrange_cli.files import read_bytes
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.stored_derivation import stored_derivation
from lagrange_cli.scene.reader import SceneText
from lagrange_cli.simulate import Trajectory, simulate

Array = NDArray[np.float64]

SYSTEMS = Path(__file__).parents[2] / "systems"

#: Scenes for which SymPy's own route takes minutes; each has a file of tests.
APART = {"bicycle": SYSTEMS / "rolling" / "bicycle.yaml"}

SCENES = {
    p.stem: p
    for p in sorted(SYSTEMS.rglob("*.yaml"))
    if p.parent.name != "refused" and p.stem not in APART
}
REFUSED = sorted((SYSTEMS / "refused").glob("*.yaml"))

CONTACTS = [name for name, p in SCENES.items() if p.parent.name == "contact"]

every_scene = pytest.mark.parametrize("name", list(SCENES))

#: Scenes without contacts: one right-hand side for all of a motion.
every_smooth_scene = pytest.mark.parametrize("name", [n for n in SCENES if n not in CONTACTS])


@cache
def derived(name: str) -> Equations:
    """The equations of a scene, which all processes of a run derive once."""
    path = str(SCENES[name])
    text = SceneText(path, read_bytes(path))
    return stored_derivation(text.read(), text, open_cache())


@cache
def simulated(name: str) -> Trajectory:
    return simulate(derived(name))


def parameter_values(e: Equations) -> list[float]:
    values = [p.value for p in e.parameters]
    assert all(value is not None for value in values)
    return [value for value in values if value is not None]


def start(e: Equations) -> Array:
    assert e.initial is not None
    return np.array([*e.initial.positions, *e.initial.velocities])
