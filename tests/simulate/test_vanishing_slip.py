"""Dry friction against a slip of two directions: a motion ends where the slip vanishes, at once."""

from __future__ import annotations

import math

import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError

pytestmark = pytest.mark.slow

PUCK = """
name: puck
parameters: {m: 1, g: 9.81, mu: 0.2, k: 0}
particles:
  puck: {mass: m, position: [x, y, 0]}
coordinates: [x, y]
potentials: {springs: k*(x^2 + 2*y^2)/2}
forces:
  friction:
    on: puck
    force: ["-mu*m*g*dot(x)/norm(dot(x), dot(y))", "-mu*m*g*dot(y)/norm(dot(x), dot(y))", 0]
initial: {x: 0, y: 0, dot(x): 1, dot(y): 0.5}
simulate: {until: 2}
"""

#: A ball whose centre of mass lies below its middle, spinning on a table (R. J. Cohen, American
#: Journal of Physics 45, 12 (1977)), with the pressure m g.
TIPPE_TOP = """
name: tippe_top
parameters: {m: 0.02, R: 0.02, e: 0.002, A: 3.2e-6, C: 3.5e-6, g: 9.81, mu: 0.3, n: 150}
bodies:
  top:
    at: [x, y, R]
    turn: [z: phi, x: theta, z: psi]
    centre: [0, 0, -e]
    mass: m
    inertia: [A, A, C]
points:
  middle: {on: top, at: [0, 0, 0]}
coordinates: [x, y, phi, theta, psi]
definitions:
  s: dot(x) - R*omega_y(top)
  r: dot(y) + R*omega_x(top)
potentials: {weight: {gravity: g}}
forces:
  friction: {on: middle, force: ["-mu*m*g*s/norm(s, r)", "-mu*m*g*r/norm(s, r)", 0]}
  lever: {on: top, torque: ["-mu*m*g*R*r/norm(s, r)", "mu*m*g*R*s/norm(s, r)", 0]}
outputs:
  jellett: R*(A*omega_z(top) + (C - A)*omega_3(top)*cos(theta)) - e*C*omega_3(top)
  slip: norm(s, r)
initial:
  {x: 0, y: 0, phi: 0, theta: 0.1, psi: 0}
simulate: {until: 3, accuracy: 1e-8, samples: 3001}
""".replace("psi: 0}", "psi: 0, dot(psi): n}")

#: Evaluations of the right-hand side within which the reason is found.
FEW = 100_000


def ended(run):
    assert run.status == "blow_up"
    assert "vanishes in all directions" in run.reason
    assert run.all_evaluations < FEW
    return float(run.t[-1])


def test_a_puck_ends_where_it_stops():
    run = loads(PUCK).derive().simulate(accuracy=1e-9, samples=2001)
    stops = math.hypot(1, 0.5) / (0.2 * 9.81)
    assert 0 <= stops - ended(run) < 2e-3
    assert f"{stops:.6f}"[:7] in run.reason
    left = 1 - run.t / stops
    assert run.columns["x"] == pytest.approx(stops / 2 * (1 - left**2), abs=1e-9)


def test_a_puck_that_only_turns_goes_on():
    run = loads(PUCK).derive().simulate(parameters={"k": 10.0}, until=0.6)
    assert run.status == "ok"


def test_a_puck_that_rests_has_no_friction_to_begin_with():
    text = PUCK.replace("dot(x): 1, dot(y): 0.5", "dot(x): 0, dot(y): 0")
    with pytest.raises(InputError):
        loads(text).derive().simulate()


def test_a_tippe_top_ends_where_it_begins_to_roll():
    run = loads(TIPPE_TOP).derive().simulate()
    assert ended(run) < 0.1
    slip, jellett = run.columns["slip"], run.columns["jellett"]
    assert slip[-1] < 0.05 * slip[0]
    assert jellett == pytest.approx(jellett[0], rel=1e-9)
