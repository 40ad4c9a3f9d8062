"""Scalings of scenes: dimensions of parameters follow from where they stand."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from lagrange_cli.scene import read_file, read_text
from lagrange_cli.scene.dimensions import dimensions

SYSTEMS = Path(__file__).parents[2] / "systems"

PENDULUM = """\
parameters: {m: 1, l: 1, g: 9.81, k: 2, c: 0.1, w: 3, F: 1, J: 1}
particles:
  bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}
coordinates: [theta]
kinetic: {wheel: J/2*dot(theta)^2}
potentials:
  weight: m*g*z_bob
  spring: k/2*(x_bob^2 + z_bob^2)
dissipation: {drag: "c/2*norm(dot(x_bob), dot(z_bob))^2"}
forces: {push: {on: bob, force: [F*sin(w*t), 0, 0]}}
"""


def exponents(text, name):
    return tuple(map(float, dimensions(read_text(text)).exponents_of(name)))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        *(("m", (1, 0, 0)), ("l", (0, 1, 0)), ("g", (0, 1, -2)), ("k", (1, 0, -2))),
        *(("c", (1, 0, -1)), ("w", (0, 0, -1)), ("F", (1, 1, -2)), ("J", (1, 2, 0))),
        *(("theta", (0, 0, 0)), ("x_bob", (0, 1, 0))),
    ],
)
def test_dimensions_follow_from_the_equations(name, expected):
    assert exponents(PENDULUM, name) == expected


def test_roots_and_powers():
    text = """\
parameters: {m: 1, a: 1, b: 2, M: 1}
particles: {p: {mass: m, position: [x, 0, 0]}}
potentials: {v: M*sqrt(a*x) + b/x^1.5}
"""
    # M is left open, as energies have no other term; a and b follow.
    assert exponents(text, "b") == (1, 3.5, -2)
    assert dimensions(read_text(text)).complete


def test_a_number_keeps_lengths_from_being_scaled():
    text = """\
parameters: {m: 1, k: 1}
particles: {p: {mass: m, position: [x, 0, 0]}}
potentials: {v: k*(x - 1)^2}
"""
    found = dimensions(read_text(text))
    assert set(found.exponents) == {"mass", "time"}
    assert not found.complete
    assert found.exponents_of("k") == (1, 0, -2)


def test_units_say_what_equations_leave_open():
    text = """\
parameters:
  M: {value: 1, unit: kg}
  g: {value: 9.81, unit: m/s^2}
  l: 1
  I: {value: 1, unit: kg m^2}
coordinates: [theta]
kinetic: {turning: I/2*dot(theta)^2}
potentials: {weight: M*g*l*cos(theta)}
"""
    assert exponents(text, "l") == (0, 1, 0)
    # A unit that cannot be is left aside.
    wrong = text.replace("kg m^2", "kg m")
    assert exponents(wrong, "I") == (1, 2, 0)


def test_factors_of_names_and_their_rates():
    found = dimensions(read_text(PENDULUM))
    units = {"mass": 4.0, "length": 2.0, "time": 0.5}
    assert found.factor("m", units) == 4
    assert found.factor("g", units) == 8
    assert found.factor("k", units) == 16
    assert found.factor("dot(x_bob)", units) == 4
    assert found.factor("dot(theta)", units) == 2


def test_exponents_are_exact():
    text = """\
parameters: {m: 1, a: 1}
particles: {p: {mass: m, position: [x, 0, 0]}}
potentials: {v: a*abs(x)^(1/3)}
"""
    assert dimensions(read_text(text)).exponents_of("a") == (1, Fraction(5, 3), -2)


@pytest.mark.parametrize(
    ("scene", "name", "expected"),
    [
        ("celestial/kepler", "G", (-1, 3, -2)),
        ("celestial/lagrange_triangle", "w", (0, 0, -1)),
        ("rigid/heavy_top", "I3", (1, 2, 0)),
        ("contact/bouncing_ball", "u", (0, 1, -1)),
        ("oscillators/calogero_moser", "c", (1, 2, -1)),
    ],
)
def test_shipped_scenes(scene, name, expected):
    assert dimensions(read_file(str(SYSTEMS / f"{scene}.yaml"))).exponents_of(name) == expected


@pytest.mark.slow
@pytest.mark.parametrize("scene", sorted(SYSTEMS.glob("*/*.yaml")), ids=lambda p: p.stem)
def test_units_in_scenes_are_those_that_follow(scene):
    """What a scene says of a parameter's unit in mechanics agrees with its equations."""
    if scene.parent.name == "refused":
        return
    found = dimensions(read_file(str(scene)))
    known = {"kg": (1, 0, 0), "m": (0, 1, 0), "N/m": (1, 0, -2), "m/s^2": (0, 1, -2)}
    for parameter in read_file(str(scene)).parameters:
        if parameter.unit in known and found.complete and scene.stem != "relativistic_oscillator":
            assert found.exponents_of(parameter.name) == known[parameter.unit], parameter.name
