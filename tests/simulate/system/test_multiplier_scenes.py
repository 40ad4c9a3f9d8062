"""Scenes whose constraints are kept beside the coordinates, from text to trajectory."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipj

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.report.values.simulation import TRAJECTORY
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.integrators.right_hand_side import structured
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.compiling import compiled_or_skip

PENDULUM = """
name: pendulum_xz
parameters: {m: 1.3, l: 2, g: 9.81}
particles: {bob: {mass: m, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: m*g*z}
initial: {x: 0, z: -l, dot(x): 9.5}
simulate: {until: 10, samples: 101}
"""

DOUBLE = """
name: double_xz
parameters: {m1: 1, m2: 1, l1: 1, l2: 1, g: 9.81}
particles:
  a: {mass: m1, position: [x1, 0, z1]}
  b: {mass: m2, position: [x2, 0, z2]}
constraints:
  upper: x1^2 + z1^2 = l1^2
  lower: (x2 - x1)^2 + (z2 - z1)^2 = l2^2
potentials: {weight: m1*g*z1 + m2*g*z2}
initial: {x1: sin(1.5), z1: -cos(1.5), x2: sin(1.5) + sin(2), z2: -cos(1.5) - cos(2)}
simulate: {until: 5, samples: 101}
"""

DOUBLE_BY_ANGLES = """
name: double
parameters: {m1: 1, m2: 1, l1: 1, l2: 1, g: 9.81}
particles:
  a: {mass: m1, position: [x1, 0, z1]}
  b: {mass: m2, position: [x2, 0, z2]}
coordinates: [theta1, theta2]
definitions:
  x1: l1*sin(theta1)
  z1: -l1*cos(theta1)
  x2: x1 + l2*sin(theta2)
  z2: z1 - l2*cos(theta2)
potentials: {weight: m1*g*z1 + m2*g*z2}
initial: {theta1: 1.5, theta2: 2}
simulate: {until: 5, samples: 101}
"""

OVAL = """
name: oval
parameters: {m: 2, a: 1.5, b: 0.8, g: 9.81}
particles: {bead: {mass: m, position: [x, 0, z]}}
constraints: {wire: x^4/a^4 + z^4/b^4 = 1}
potentials: {weight: m*g*z}
initial: {x: 0, z: -b, dot(x): 8}
simulate: {until: 3, samples: 101}
"""

SLIDER_CRANK = """
name: slider_crank
parameters: {m: 1, M: 2, r: 0.5, l: 1.3, g: 9.81}
particles:
  crank: {mass: m, position: [r*cos(theta), 0, r*sin(theta)]}
  slider: {mass: M, position: [s, 0, 0]}
CONSTRAINED
potentials: {weight: m*g*r*sin(theta)}
initial: {theta: 0.5, dot(theta): 12START}
simulate: {until: 3, samples: 101}
"""

MOVING = """
name: moving
parameters: {m: 0.7, g: 9.81, l: 1.2, w: 2.5, h: 0.3}
particles: {bead: {mass: m, position: [x, 0, z]}}
constraints: {circle: x^2 + (z - h*sin(w*t))^2 = l^2}
potentials: {weight: m*g*z}
initial: {x: 0, z: -l, dot(x): 6}
simulate: {until: 3, samples: 61}
"""

MOVING_BY_ANGLE = """
name: moving
parameters: {m: 0.7, g: 9.81, l: 1.2, w: 2.5, h: 0.3}
particles: {bead: {mass: m, position: [x, 0, z]}}
coordinates: [theta]
definitions: {x: l*sin(theta), z: h*sin(w*t) - l*cos(theta)}
potentials: {weight: m*g*z}
initial: {theta: 0, dot(theta): 5}
simulate: {until: 3, samples: 61}
"""

BY_CLOSURE = """constraints: {rod: (s - r*cos(theta))^2 + (r*sin(theta))^2 = l^2}
coordinates: [theta, s]"""
BY_DEFINITION = """coordinates: [theta]
definitions: {s: r*cos(theta) + sqrt(l^2 - r^2*sin(theta)^2)}"""


def model(text):
    return model_of(loads(text).derive().equations)


def pendulum_at(t, rate=9.5, length=2.0, g=9.81):
    """A pendulum that turns over, from its lowest point: Jacobi's functions in closed form."""
    w = rate / length
    sn, cn, dn, _ = ellipj(w / 2 * t, 4 * g / (length * w**2))
    sin, cos, speed = 2 * sn * cn, 1 - 2 * sn**2, rate * dn
    return {"x": length * sin, "z": -length * cos, "dot(x)": cos * speed, "dot(z)": sin * speed}


def difference(run, exact):
    """The largest difference of the named columns, over their scales."""
    kept = {name: values[: len(run.t)] for name, values in exact.items()}
    return max(
        float(np.abs(run.columns[name] - values).max()) / run.scales[name]
        for name, values in kept.items()
    )


@pytest.fixture(scope="module")
def pendulum():
    return model(PENDULUM)


@pytest.fixture(scope="module")
def double():
    return model(DOUBLE)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-9, 1e-12])
def test_pendulum_through_full_rotations(pendulum, accuracy):
    run = simulate(pendulum, accuracy=accuracy, functions=compiled_or_skip(pendulum))
    assert (run.status, run.formulation) == ("ok", "multiplier")
    exact = pendulum_at(run.t)
    assert (exact["z"] > 1.99).any()
    assert difference(run, exact) <= run.estimated + 1e-13 < accuracy
    assert run.constraint_drift < 1e-15
    assert run.energy_drift < 1e-12 + accuracy


def test_tension(pendulum):
    """λ·∇φ is the force of the rod: inward m v²/l − m g z/l."""
    run = simulate(pendulum, accuracy=1e-11)
    state = run.columns
    speed = state["dot(x)"] ** 2 + state["dot(z)"] ** 2
    tension = 1.3 * (speed / 2 - 9.81 * state["z"] / 2)
    force = run.multipliers["rod"] * 2 * np.hypot(state["x"], state["z"])
    assert np.abs(force + tension).max() < 1e-13 * tension.max()


@pytest.mark.slow
def test_double_pendulum_against_angles(double):
    ours = simulate(double, accuracy=1e-9)
    angles = simulate(model(DOUBLE_BY_ANGLES), accuracy=1e-11)
    exact = {name: angles.columns[name] for name in ours.scales}
    assert ours.status == angles.status == "ok"
    assert difference(ours, exact) <= ours.estimated + 1e-11 < 1e-9
    assert ours.constraint_drift < 1e-15
    assert abs(ours.energy_drift) < 1e-9


@pytest.mark.slow
def test_normal_force_on_a_curve():
    """m·(curvature·v² + g along the normal), from the implicit function's derivatives."""
    run = simulate(model(OVAL), accuracy=1e-10)
    assert run.status == "ok"
    x, z = run.columns["x"], run.columns["z"]
    v = np.stack([run.columns["dot(x)"], run.columns["dot(z)"]])
    gradient = np.stack([4 * x**3 / 1.5**4, 4 * z**3 / 0.8**4])
    size = np.linalg.norm(gradient, axis=0)
    bend = 12 * x**2 / 1.5**4 * v[0] ** 2 + 12 * z**2 / 0.8**4 * v[1] ** 2
    outward = 2 * (9.81 * gradient[1] - bend) / size
    force = run.multipliers["wire"] * size
    assert np.abs(force - outward).max() < 1e-12 * np.abs(outward).max()
    assert run.energy_drift < 1e-10
    assert run.constraint_drift < 1e-15


@pytest.mark.slow
def test_slider_crank_against_its_closed_form():
    start = ", s: r*cos(0.5) + sqrt(l^2 - r^2*sin(0.5)^2)"
    closed = SLIDER_CRANK.replace("CONSTRAINED", BY_CLOSURE).replace("START", start)
    ours = simulate(model(closed), accuracy=1e-9)
    explicit = SLIDER_CRANK.replace("CONSTRAINED", BY_DEFINITION).replace("START", "")
    other = simulate(model(explicit), accuracy=1e-11)
    assert (ours.formulation, other.formulation) == ("multiplier", "minimal")
    exact = {name: other.columns[name] for name in ours.scales}
    assert difference(ours, exact) <= ours.estimated + 1e-11 < 1e-9
    assert ours.constraint_drift < 1e-13


@pytest.mark.slow
def test_moving_constraint_against_its_angle():
    ours = simulate(model(MOVING), accuracy=1e-9)
    other = simulate(model(MOVING_BY_ANGLE), accuracy=1e-11)
    exact = {name: other.columns[name] for name in ours.scales}
    assert difference(ours, exact) <= ours.estimated + 1e-11 < 1e-9
    assert ours.energy_drift is None
    assert ours.constraint_drift < 1e-15


@pytest.mark.slow
def test_drift_does_not_grow_with_the_steps(double):
    """Thirty thousand steps of a chaotic motion; rods measured from the columns themselves."""
    run = simulate(double, method="RK4", step=1e-3, until=30.0, samples=31)
    assert run.steps >= 30_000
    c = run.columns
    upper = np.hypot(c["x1"], c["z1"]) - 1
    lower = np.hypot(c["x2"] - c["x1"], c["z2"] - c["z1"]) - 1
    assert max(np.abs(upper).max(), np.abs(lower).max()) < 1e-15
    assert run.constraint_drift < 1e-15


@pytest.mark.slow
@pytest.mark.parametrize("text", [PENDULUM, DOUBLE, MOVING], ids=["pendulum", "double", "moving"])
def test_interpreted_gives_the_same(text):
    found = model(text)
    how = {"accuracy": 1e-9, "until": 0.5, "samples": 11}
    ours = simulate(found, functions=compiled_or_skip(found), **how)
    other = simulate(found, functions=interpreted(found, "a test"), **how)
    assert ours.status == other.status == "ok"
    assert difference(ours, {name: other.columns[name] for name in ours.scales}) < 1e-12
    for name, values in ours.multipliers.items():
        assert other.multipliers[name] == pytest.approx(values, rel=1e-10, abs=1e-10)
    assert other.constraint_drift < 1e-15


@pytest.mark.parametrize("method", ["Gauss16", "RK45", "Radau", "BDF"])
def test_every_method_projects(pendulum, method):
    run = simulate(pendulum, method=method, rtol=1e-7, until=1.5, samples=16)
    assert run.status == "ok"
    assert difference(run, pendulum_at(run.t)) < 1e-4
    assert run.constraint_drift < 1e-15


def test_a_method_that_cannot_is_refused(pendulum):
    with pytest.raises(InputError, match=r"LSODA cannot move its past states.*'rod'"):
        simulate(pendulum, method="LSODA", rtol=1e-7)


def test_a_model_is_kept_as_json(double):
    again = Model.from_json(json.loads(json.dumps(double.to_json())))
    assert again == double
    assert (again.multipliers, again.residuals) == (("upper", "lower"), 4)


@pytest.mark.parametrize("power", [-40, 50])
def test_units_that_are_powers_of_two_change_no_bit(pendulum, power):
    unit = 2.0**power
    text = PENDULUM.replace("l: 2, g: 9.81", f"l: {2 * unit!r}, g: {9.81 * unit!r}")
    text = text.replace("dot(x): 9.5", f"dot(x): {9.5 * unit!r}")
    ours, scaled = (simulate(m, accuracy=1e-9) for m in (pendulum, model(text)))
    for name in ours.scales:
        assert (ours.columns[name] * unit == scaled.columns[name]).all()
    assert ours.constraint_drift == scaled.constraint_drift


@pytest.mark.slow
def test_a_stiff_system():
    """A stiff damper along the circle: an implicit method takes over, and projects."""
    text = PENDULUM.replace("initial:", "dissipation: {oil: 3e5*dot(x)^2}\ninitial:")
    run = simulate(model(text.replace("dot(x): 9.5", "dot(x): 1")), accuracy=1e-5, until=5.0)
    assert run.status == "ok"
    assert run.method == "Radau"
    assert run.constraint_drift < 1e-14


@pytest.mark.slow
def test_wider_arithmetic(double):
    functions = compiled_or_skip(double)
    wider = functions.wider()
    if wider is None:
        pytest.skip("this machine has no arithmetic wider than double")
    y = np.array(double.initial)
    for side in (wider.rhs, *wider.perturbed):
        assert np.abs(structured(side).project(0.0, y) - y).max() < 1e-15
    assert wider.rhs(0.0, y) == pytest.approx(functions.rhs(0.0, y), rel=1e-12)


def test_disturbed_sides_are_projected_by_their_own_parameters(pendulum):
    functions = compiled_or_skip(pendulum)
    y = np.array(pendulum.initial)
    lengths = [
        math.hypot(*structured(side).project(0.0, y * (1 + 1e-9))[:2]) / 2.0 - 1
        for side in (functions.rhs, *functions.perturbed)
    ]
    assert max(map(abs, lengths)) < 4e-16
    assert len(set(lengths)) > 1


@pytest.mark.parametrize("paths", ["compiled", "interpreted"])
def test_a_start_off_the_constraints_is_refused(pendulum, paths):
    off = replace(pendulum, initial=(0.0, -2.1, 9.5, 0.0))
    functions = compiled_or_skip(off) if paths == "compiled" else interpreted(off, "a test")
    with pytest.raises(InputError, match="the start is not on the constraints"):
        simulate(off, functions=functions)
    falling = replace(pendulum, initial=(0.0, -2.0, 9.5, 0.1))
    with pytest.raises(InputError, match="the start is not on the constraints"):
        simulate(falling, functions=functions)


@pytest.mark.parametrize("paths", ["compiled", "interpreted"])
def test_a_singular_start_is_refused(pendulum, paths):
    """At the centre of the circle the constraint says nothing."""
    off = replace(pendulum, initial=(0.0, 0.0, 0.0, 0.0))
    functions = compiled_or_skip(off) if paths == "compiled" else interpreted(off, "a test")
    with pytest.raises(InputError, match="constraints or mass matrix are singular there"):
        simulate(off, functions=functions)


def test_forces_are_columns(pendulum):
    run = simulate(pendulum, accuracy=1e-6, until=1.0, samples=5)
    table = run.table(["forces", "energy"])
    assert list(table)[-2:] == ["energy", "lambda_rod"]
    assert (table["lambda_rod"] == run.multipliers["rod"]).all()
    assert run.csv(["forces"]).splitlines()[0].endswith(",lambda_rod")
    assert TRAJECTORY.write(run)["constraint_drift"] == run.constraint_drift


PARALLELOGRAM = """
name: parallelogram
parameters: {m: 1, l: 2}
particles:
  a: {mass: m, position: [xa, 0, za]}
  b: {mass: m, position: [xb, 0, zb]}
constraints:
  left: xa^2 + za^2 = 1
  right: (xb - l)^2 + zb^2 = 1
  bar: (xb - xa)^2 + (zb - za)^2 = l^2
initial:
  {xa: cos(A), za: sin(A), xb: l + cos(A), zb: sin(A), dot(xa): -5*sin(A), dot(xb): -5*sin(A)}
simulate: {until: 2, samples: 201}
"""


@pytest.mark.slow
@pytest.mark.parametrize("angle", ["0.5", "0.9", "0.2"])
def test_through_a_folded_linkage_or_not_at_all(angle):
    """In line, the cranks may turn either way: what is kept is the motion that goes on."""
    run = simulate(model(PARALLELOGRAM.replace("A", angle)), accuracy=1e-7)
    turned = float(angle) + 5 * run.t
    exact = {"xa": np.cos(turned), "za": np.sin(turned), "xb": 2 + np.cos(turned)}
    assert difference(run, exact) < 1e-7
    if run.status == "blow_up":
        assert "a position where the constraints are singular" in run.reason
        # It is where the linkage is in line.
        assert abs(math.sin(float(angle) + 5 * run.t[-1])) < 0.1
    else:
        assert run.status in ("ok", "accuracy_not_reached")


@pytest.mark.slow
def test_a_crossing_of_the_wire():
    """A lemniscate, against the form in which its crossing is a point like any other."""
    text = OVAL.replace("x^4/a^4 + z^4/b^4 = 1", "(x^2 + z^2)^2 = a^2*(x^2 - z^2)")
    text = text.replace("x: 0, z: -b, dot(x): 8", "x: a, z: 0, dot(z): 8")
    run = simulate(model(text), accuracy=1e-6)
    regular = text.replace(
        "constraints: {wire: (x^2 + z^2)^2 = a^2*(x^2 - z^2)}",
        "coordinates: [s]\ndefinitions:\n  x: a*cos(s)/(1 + sin(s)^2)\n"
        "  z: a*sin(s)*cos(s)/(1 + sin(s)^2)",
    ).replace("x: a, z: 0, dot(z): 8", "s: 0, dot(s): 8/a")
    other = simulate(model(regular), accuracy=1e-9)
    assert len(run.t) > 30
    exact = {name: other.columns[name] for name in ("x", "z")}
    assert difference(run, exact) < 1e-6
