"""The shipped scenes, each derived and simulated once for all tests."""

from __future__ import annotations

from collections.abc import Container, Iterable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lagrange_cli.cache import open_cache
from lagrange_cli.files import read_bytes
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.step_values import Way
from lagrange_cli.mechanics.stored_derivation import stored_derivation
from lagrange_cli.scene.conditions import Formulation
from lagrange_cli.scene.reader import SceneText
from lagrange_cli.simulate import Trajectory, simulate

Array = NDArray[np.float64]

SYSTEMS = Path(__file__).parents[2] / "systems"

#: Scenes of bodies that close loops, touch and roll; a file of tests of their own compares them
#: with closed forms and published numbers.
JOINTS = {
    name: SYSTEMS / "bodies" / f"{name}.yaml"
    for name in (
        "ball_in_hole",
        "benchmark_bicycle",
        "bricards_linkage",
        "crank_and_slider",
        "eulers_disk",
        "flyball_governor",
        "leaning_disk",
        "marble_in_bowl",
        "marble_on_turntable",
        "n_four_bars",
        "rattleback",
        "rod_on_two_wires",
        "roller_in_cylinder",
        "segway",
        "sliding_ladder",
        "squeezer_of_bodies",
        "stewart_platform",
        "yo_yo",
    )
}

#: Scenes for which SymPy's own route takes minutes, or that it cannot take, as it has no states of
#: first order, whose forces switch, or that read tables; there are files of tests for them.
APART = {
    **JOINTS,
    "dzhanibekov": SYSTEMS / "bodies" / "dzhanibekov.yaml",
    "bicycle": SYSTEMS / "rolling" / "bicycle.yaml",
    "quadrotor": SYSTEMS / "bodies" / "quadrotor.yaml",
    "kuka_iiwa": SYSTEMS / "robots" / "kuka_iiwa.yaml",
    "scara": SYSTEMS / "robots" / "scara.yaml",
    "ur5": SYSTEMS / "robots" / "ur5.yaml",
    **{p.stem: p for p in sorted((SYSTEMS / "actuators").glob("*.yaml"))},
    **{p.stem: p for p in sorted((SYSTEMS / "switching").glob("*.yaml"))},
    **{p.stem: p for p in sorted((SYSTEMS / "data").glob("*.yaml"))},
}

SCENES = {
    p.stem: p
    for p in sorted(SYSTEMS.rglob("*.yaml"))
    if p.parent.name != "refused" and p.stem not in APART
}
REFUSED = sorted((SYSTEMS / "refused").glob("*.yaml"))

#: Scenes of rigid bodies, on which constraint forces are sums over their joints.
BODIES = frozenset(p.stem for p in (SYSTEMS / "bodies").glob("*.yaml"))

#: Scenes whose equations hold tables, or cases of `piecewise`: SymPy writes no code for them.
IN_PIECES = frozenset({"engine_on_a_brake", "engine_with_a_throttle", "play_between_springs"})

CONTACTS = [name for name, p in SCENES.items() if p.parent.name == "contact"]

#: Scenes of which each differs from the others in structure: that each key and each formulation,
#: fact and count of constraints is among them is tested.
SLICE = (
    "bead_on_rotating_hoop",
    "kepler",
    "schwarzschild_orbit",
    "two_bodies",
    "chain_of_rods",
    "net_of_springs",
    "oscillator_ring",
    "four_bar_linkage",
    "spherical_pendulum_from_the_pole",
    "bouncing_ball",
    "dropped_rod",
    "particle_leaving_sphere",
    "charged_particle",
    "relativistic_particle",
    "balance",
    "lever",
    "pendulum_driven_support",
    "driven_spring",
    "seismometer",
    "damped_driven_pendulum",
    "double_pendulum",
    "swinging_spring",
    "tautochrone",
    "double_atwood",
    "heavy_top",
    "rolling_cylinder",
    "chaplygin_sleigh",
    "rolling_disk",
    "wheel_down_incline",
    "cart_pole",
    "planar_quadrotor",
    "ballbot",
)

#: Scenes of the slice that differ in the functions that are emitted: free and with closures of
#: positions and of velocities, by loops, with contacts, inputs, a recording, friction and time.
NARROW = (
    "kepler",
    "net_of_springs",
    "chain_of_rods",
    "four_bar_linkage",
    "dropped_rod",
    "relativistic_particle",
    "driven_spring",
    "seismometer",
    "damped_driven_pendulum",
    "heavy_top",
    "chaplygin_sleigh",
    "rolling_disk",
)

every_scene = pytest.mark.parametrize("name", list(SCENES))


def sliced(
    scenes: Iterable[str | Path], chosen: Container[str] = SLICE, argument: str = "name"
) -> pytest.MarkDecorator:
    """Parametrize by scenes, given by names or paths; the names not chosen are campaigns."""
    stems = [(scene, Path(scene).stem) for scene in scenes]
    cases = [
        pytest.param(scene, id=stem, marks=() if stem in chosen else pytest.mark.campaign)
        for scene, stem in stems
    ]
    return pytest.mark.parametrize(argument, cases)


@cache
def derived(
    name: str,
    *,
    formulation: Formulation = "auto",
    steps: Way | None = None,
    forces: bool = False,
) -> Equations:
    """The equations of a scene, which all processes of a run derive once."""
    path = str(SCENES.get(name) or APART[name])
    text = SceneText(path, read_bytes(path))
    options = {"forces": forces, "formulation": formulation, "steps": steps}
    return stored_derivation(text.read(), text, open_cache(), **options)


@cache
def simulated(name: str) -> Trajectory:
    return simulate(derived(name))


def parameter_values(e: Equations) -> list[float]:
    values = [p.value for p in e.system.parameters]
    assert all(value is not None for value in values)
    return [value for value in values if value is not None]


def start(e: Equations) -> Array:
    assert e.system.initial is not None
    return np.array([*e.system.initial.positions, *e.system.initial.velocities])
