"""Units that follow from a scene, beside those that it declares."""

from __future__ import annotations

from pathlib import Path

import pytest

from lagrange_cli import load, loads

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"

PENDULUM = """
parameters: {m: MASS, l: LENGTH, g: {value: 9.81, unit: m/s^2}}
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: m*g*z_bob}
outputs: {height: z_bob + l, moment: m*l^2*dot(theta), swing: "atan2(x_bob, l)"}
initial: {theta: 1}
"""


def units(mass="{value: 1, unit: kg}", length="{value: 1, unit: m}"):
    scene = PENDULUM.replace("MASS", mass).replace("LENGTH", length)
    return loads(scene).derive().equations.presentation.units


def test_units_of_a_pendulum_in_the_si():
    found = units().units
    assert {name: found.get(name) for name in ("t", "energy", "theta", "dot(theta)")} == {
        "t": "s",
        "energy": "J",
        "theta": "rad",
        "dot(theta)": "rad/s",
    }
    assert found["x_bob"] == "m"
    assert found["dot(x_bob)"] == "m/s"
    assert found["height"] == "m"
    assert found["moment"] == "kg m^2/s"
    assert not found["swing"]


@pytest.mark.parametrize("length", ["{value: 1, unit: cm}", "{value: 1, unit: m + s}"])
def test_units_that_may_not_fit_together_are_not_made_up(length):
    found = units(length=length)
    assert found.units == {"theta": "rad"}
    assert found.dimensions["x_bob"] == "m"


def test_a_scene_without_units_has_none_but_radians():
    scene = PENDULUM.replace("{value: 9.81, unit: m/s^2}", "9.81")
    found = (
        loads(scene.replace("MASS", "1").replace("LENGTH", "1"))
        .derive()
        .equations.presentation.units
    )
    assert found.units == {"theta": "rad"}


def test_numbers_in_a_scene_leave_its_positions_lengths():
    found = loads(
        "particles: {p: {mass: {value: 1}, position: [x, y, z]}}\n".replace("{value: 1}", "1")
        + "constraints: {a: y = 0, b: z = x^2}\ncoordinates: {x: {unit: m}}\n"
        + "potentials: {v: 9.81*z}\ninitial: {x: 1}\n"
    )
    found = found.derive().equations.presentation.units
    assert {name: found.dimensions[name] for name in ("x", "y", "z", "dot(x)")} == {
        "x": "m",
        "y": "m",
        "z": "m",
        "dot(x)": "m/s",
    }
    assert found.units["x"] == "m"


@pytest.mark.parametrize(
    "path", ["pendulums/furuta_pendulum", "pulleys/swinging_atwood", "celestial/kepler"]
)
def test_derived_dimensions_are_those_that_scenes_declare(path):
    """The unit of a coordinate, taken out of its scene, follows from the rest of it."""
    loaded = load(SYSTEMS / f"{path}.yaml")
    declared = {c.name: c.unit for c in loaded.scene.coordinates}
    text = (SYSTEMS / f"{path}.yaml").read_text()
    bare = text.replace("{unit: m, desc", "{desc").replace("{unit: rad, desc", "{desc")
    assert bare != text
    found = loads(bare).derive().equations.presentation.units
    assert {name: found.units[name] for name in declared} == declared
