"""Contradictions of all kinds: what is named may be left out, what is suggested works."""

from __future__ import annotations

import re

import pytest
import yaml

from tests.cli.explaining import P, hints, pasted, rods, run, without
from tests.systems.shipped import sliced

pytestmark = pytest.mark.slow

WHEEL = (
    "parameters: {R: 0.3, w: 2}\n" + P + "coordinates: [x, phi, y, z]\n"
    "kinetic: {spin: dot(phi)^2/2}\n"
)
BEADS = """
sizes: {n: 6}
particles:
  p[i=1..n]: {mass: 1, position: ["x[i]", 0, "z[i]"]}
constraints:
  apart[i=2..n]: "x[i] - x[i-1] >= 1"
  left: "x[1] >= 0"
  right: "x[6] <= 4"
"""
SLED = """
sizes: {n: 3}
particles:
  p[i=1..n]: {mass: 1, position: ["x[i]", "y[i]", 0]}
constraints:
  tie[i=2..n]: "dot(x[i]) = dot(x[i-1])"
  drive: "dot(x[1]) = 1"
  brake: "dot(x[3]) = 0"
"""
LADDER = """
parameters: {l: 1, g: 9.81}
plane: xz
particles: {top: {mass: 1}, foot: {mass: 1}}
constraints:
  ladder: {distance: [top, foot], equals: l}
  wall: x_top = 0
  floor: z_foot = 0
  gutter: z_top >= 1.5
potentials: {weight: {gravity: g}}
"""
ROPES = """
plane: xz
points: {o: [0, 0, 0], e: [5, 0, 0]}
particles: {a: {mass: 1}, b: {mass: 1}}
constraints:
  one: "norm(x_a, z_a) <= 1"
  two: "norm(x_b - x_a, z_b - z_a) <= 2"
  three: "norm(x_b - 5, z_b) <= 1"
"""


def point(constraints: str) -> str:
    return P + f"constraints: {{{constraints}}}\n"


SCENES = {
    # Positions.
    "planes": point("floor: z = 0, wall: x = 1, shelf: z = 1"),
    "dependent planes": point("a: x + y = 1, b: y + z = 1, c: x - z = 1, d: x = 2"),
    "spheres": point("small: x^2+y^2+z^2 = 1, large: x^2+y^2+z^2 = 4"),
    "ring and wall": point("flat: y = 0, ring: x^2 + z^2 = 1, wall: x = 2"),
    "negative square": point("flat: y = 0, ring: x^2 + z^2 = -1"),
    "hyperbola and circle": point("h: x*z = 3, c: x^2 + z^2 = 1"),
    "times": point("a: x = t, b: x = 2*t"),
    "sine": point("s: sin(x) = 2"),
    "triangle": rods({"ab": 1, "bc": 1, "ca": 3}),
    "quadrangle": rods({"ab": 1, "bc": 1, "cd": 1, "da": 4}),
    # Velocities.
    "rate of a position": point("a: dot(x) = 1, c: x = 2*t"),
    "three": point("a: dot(x) = 0, b: x = 3, c: dot(x) = 1"),
    "two rates": point("a: dot(x) = 1, b: dot(x) = 2"),
    "rate of a ring": point("ring: x^2 + y^2 = 4, d: x*dot(x) + y*dot(y) = 1"),
    "cycle of rates": point("a: dot(x) = dot(y), b: dot(y) = dot(z), c: dot(x) = dot(z) + 1"),
    "nonholonomic": point("a: y*dot(x) - x*dot(y) = dot(z), b: y*dot(x) - x*dot(y) = dot(z) + 1"),
    "value put in": point("a: dot(x) = y, b: y = 3, c: dot(x) = 4"),
    "a further position": point("a: dot(x) = y, b: dot(x) = z"),
    "slipping belt": WHEEL
    + "constraints: {roll: dot(x) = R*dot(phi), motor: dot(phi) = w, belt: dot(x) = w}\n",
    "sled": SLED,
    # One-sided ones.
    "ball and shelf": point("ball: x^2+y^2+z^2 = 1, shelf: z >= 2"),
    "slab": point("a: x >= 2, b: x <= 1"),
    "corner": point("a: x + y >= 3, b: x <= 1, c: y <= 1, d: z >= 0"),
    "bouncing slab": point("a: {unilateral: x >= 2, restitution: 0.5}, b: x <= 1"),
    "ring in ring": point("in: x^2+y^2 <= 1, out: x^2+y^2 >= 4"),
    "wave": point("s: z = sin(x), t: z >= 2"),
    "bowls": point("a: z >= 1 + x^2, b: z <= -x^2"),
    "moving slab": point("a: x >= t + 2, b: x <= t + 1"),
    "held by an equation": point("flat: z = 0, shelf: z >= 1, wall: x >= 0"),
    "discs": point("a: (x-3)^2+y^2 <= 1, b: (x+3)^2+y^2 <= 1"),
    "rope and shelf": point("rope: 'norm(x, y, z) <= 1', shelf: z >= 3"),
    "ropes": ROPES,
    "ladder": LADDER,
    "beads": BEADS,
}


def named(scene: str, message: str) -> list[str]:
    """The constraints that a message names, as far as the scene has a line for each."""
    lines = yaml.safe_load(scene)["constraints"]
    return [n for n in dict.fromkeys(re.findall(r"'([^']+)'", message)) if n in lines]


#: Kinds of which ``test_explanations`` leaves out the first and the last constraint as well.
EXPLAINED = ("planes", "spheres", "ring and wall", "negative square", "two rates", "triangle")


@sliced(SCENES, set(SCENES) - set(EXPLAINED), "kind")
def test_what_is_suggested_works(kind: str) -> None:
    scene = SCENES[kind]
    done = run("derive", scene)
    assert done.returncode == 2, done.stdout
    first, *_ = done.stderr.splitlines()
    place, _, message = first.partition(": ")
    assert re.fullmatch(r"<stdin>:\d+:\d+", place)
    assert len(message) < 300
    suggested = hints(done)
    assert 1 <= len(suggested) <= 3
    written = {str(text) for text in yaml.safe_load(scene)["constraints"].values()}
    for line in suggested:
        assert not any(line.endswith(f": {text}") for text in written), line
        if re.match(r"\w+: ", line):
            again = run("derive", pasted(scene, line))
            assert again.returncode == 0, (line, again.stderr)
    parts = named(scene, suggested[0]) if suggested[0].startswith("leave out") else []
    for name in dict.fromkeys([*parts[:1], *parts[-1:]]):
        again = run("derive", without(scene, name))
        assert again.returncode == 0, (name, again.stderr)
