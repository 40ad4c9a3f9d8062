"""Equilibria at singular coordinates: those of the system stay, those of the chart alone go."""

from __future__ import annotations

import math

import pytest

from lagrange_cli import loads
from tests.systems.shipped import SYSTEMS

#: A ball on a plane whose normal leans by arctan s, turned by Euler angles: gimbal lock at b = π/2.
BALL = """
name: ball
parameters: {m: 1, g: 9.81, r: 0.02, s: 0.75}
bodies:
  ball: {at: [x, y, z], turn: [x: a, y: b, z: c], mass: m, inertia: {sphere: r}}
constraints: {plane: {roll: ball, radius: r, on: {normal: [s, 0, 1]}}}
coordinates: [x, y, a, b, c]
potentials: {weight: {gravity: g}}
"""


def found(text):
    return loads(text).derive().analyze("equilibria").equilibria.points


def test_a_ball_rests_on_a_level_plane_alone():
    assert found(BALL) == ()
    assert len(found(BALL.replace("s: 0.75", "s: 0"))) == 1


@pytest.mark.slow
def test_a_marble_rests_at_the_bottom_of_its_bowl():
    (point,) = found((SYSTEMS / "bodies" / "marble_in_bowl.yaml").read_text(encoding="utf-8"))
    assert [abs(float(x)) < 1e-20 for x in point.position[:2]] == [True, True]


def test_a_pendulum_rests_at_its_poles_unless_wind_blows():
    """At a pole, wind across the meridian has no part along θ, and none along φ anywhere there.

    That these are no equilibria is measured: they are counted, and the list is not called proven.
    """
    pendulum = (SYSTEMS / "pendulums" / "spherical_pendulum.yaml").read_text(encoding="utf-8")
    still = pendulum.partition("expect:")[0]
    assert {round(float(p.position[0]), 9) for p in found(still)} == {0, round(math.pi, 9)}
    windy = loads(still.replace("potentials:", "potentials:\n  wind: -3*x")).derive()
    analysis, tilt = windy.analyze("equilibria"), math.atan(3 / 9.81)
    sines = {round(abs(math.sin(p.position[0])), 9) for p in analysis.equilibria.points}
    assert sines == {round(math.sin(tilt), 9)}
    assert analysis.equilibria.released == 4
    left_out = "These are all; 4 more at singular coordinates are left out, since motions from rest"
    assert left_out in " ".join(analysis.text().split())
    assert analysis.report()["complete"] is False


#: A top by a quaternion, whose mass matrix over four numbers never has the rank four.
TOP = """
parameters: {m: 0.2, h: 0.05, A: 8e-4, C: 2e-4, g: 9.81}
bodies:
  top: {turn: {quaternion: [q0, q1, q2, q3]}, mass: m, centre: [0, 0, h],
    inertia: {about: origin, moments: [A, A, C]}}
coordinates: [q0, q1, q2, q3]
potentials: {weight: {gravity: g}}
initial: {q0: 1, q1: 0, q2: 0, q3: 0}
"""


def test_a_mass_matrix_that_is_singular_everywhere_excludes_nothing():
    heights = {round(float(p.position[0] ** 2 + p.position[3] ** 2), 9) for p in found(TOP)}
    assert heights == {0, 1}


@pytest.mark.parametrize("potential", ["abs(r)", "abs(r*cos(phi)) + r^2"])
def test_forces_with_kinks_exclude_nothing(potential):
    """The apex of a cone is a minimum, though its slope is the same at every distance."""
    (apex,) = found(
        "coordinates: [r, phi]\nkinetic: {bead: (dot(r)^2 + r^2*dot(phi)^2)/2}\n"
        f"potentials: {{cone: {potential}}}\n"
    )
    assert apex.position[0] == 0
