"""IDA: constraints as equations of its steps, by closed forms and by other methods."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ellipj

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.base import UNMET
from lagrange_cli.simulate.integrators.right_hand_side import FunctionRhs
from lagrange_cli.simulate.model.build import model_of
from tests.simulate.available import or_skip
from tests.simulate.compiling import compiled_or_skip
from tests.simulate.constrained_systems import constrained

PENDULUM = """
name: pendulum_xz
parameters: {m: 1.3, l: 2, g: 9.81}
particles: {bob: {mass: m, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: m*g*z}
initial: {x: 0, z: -l, dot(x): 9.5}
simulate: {until: 5, samples: 51}
"""

#: Sinking in oil, with an angular velocity that dies away within microseconds.
OIL = """
name: oil
parameters: {m: 1.3, l: 2, g: 9.81, c: 6e5}
particles: {bob: {mass: m, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: m*g*z}
dissipation: {oil: c/2*(dot(x)^2 + dot(z)^2)}
initial: {x: l*sin(2), z: -l*cos(2), dot(x): cos(2), dot(z): sin(2)}
simulate: {until: 1e5, samples: 101}
"""

#: A skate, whose velocity has no part across the blade, on a slope: it goes round and drifts.
SKATE = """
name: skate
parameters: {m: 1.5, I: 0.4, g: 9.81, alpha: 0.3, w: 2}
particles: {foot: {mass: m, position: [x, y, 0]}}
coordinates: [x, y, theta]
constraints: {blade: dot(x)*sin(theta) - dot(y)*cos(theta) = 0}
kinetic: {turning: I/2*dot(theta)^2}
potentials: {weight: -m*g*sin(alpha)*x}
initial: {x: 0, y: 0, theta: 0, dot(x): 0, dot(y): 0, dot(theta): w}
simulate: {until: 5, samples: 51}
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

#: A parallelogram of bars, which folds where it is stretched out.
FOLDS = """
name: parallelogram
parameters: {m: 1, a: 1, b: 2, g: 9.81}
particles:
  p: {mass: m, position: [x, 0, z]}
  q: {mass: m, position: [u, 0, w]}
coordinates: [x, z, u, w]
constraints:
  one: x^2 + z^2 = a^2
  two: (u - b)^2 + w^2 = a^2
  coupler: (u - x)^2 + (w - z)^2 = b^2
potentials: {weight: m*g*(z + w)}
initial: {x: 0, z: -a, u: b, w: -a, dot(x): 8, dot(z): 0, dot(u): 8, dot(w): 0}
simulate: {until: 2, samples: 21}
"""

L, G, RATE = 1.5, 9.81, 7.0


@pytest.fixture(scope="module")
def method():
    return or_skip("IDA")


def model(text):
    return model_of(loads(text).derive().equations)


def run_of(text, rtol=1e-9, name="IDA", **options):
    """A run, with the functions of the model compiled."""
    found = model(text)
    return simulate(found, method=name, rtol=rtol, functions=compiled_or_skip(found), **options)


def distance(run, other):
    """The largest difference of any column, over its scale."""
    return max(
        np.abs(run.columns[name] - other.columns[name]).max() / scale
        for name, scale in other.scales.items()
    )


def control(n, tolerance):
    return Control(np.full(n, tolerance), np.full(n, tolerance), 1e-3, 1e9)


def turning(times, length=L, speed=RATE):
    """A pendulum that turns over, from its lowest point: Jacobi's functions in closed form."""
    sn, cn, dn, _ = ellipj(speed / 2 * times, 4 * G / (length * speed**2))
    sin, cos, rate = 2 * sn * cn, 1 - 2 * sn**2, speed * dn
    parts = [length * sin, -length * cos, length * cos * rate, length * sin * rate]
    return np.column_stack(parts)


def walked(method, rhs, y0, until, tolerance):
    run = start_integrator(method, rhs, 0.0, y0, until, control(len(y0), tolerance))
    done = run.advance(
        np.array([until]), np.empty((1, len(y0))), most_steps=10**6, most_evaluations=math.inf
    )
    assert done.failure is None
    return run


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-5, 1e-7, 1e-9, 1e-11])
def test_a_pendulum_that_turns_over(method, tolerance):
    run = walked(method, constrained("pendulum", L, G), turning(np.zeros(1))[0], 2.0, tolerance)
    assert np.abs(run.y - turning(np.array([2.0]))).max() < 1e4 * tolerance


@pytest.mark.slow
def test_steps_are_those_of_a_high_order_and_take_one_slope_each(method):
    """Equations without rates do not keep orders low, nor iterations long."""
    for tolerance, most in ((1e-7, 900), (1e-10, 2500)):
        run = walked(method, constrained("pendulum", L, G), turning(np.zeros(1))[0], 4.0, tolerance)
        assert run.steps < most
        assert run.evaluations < 1.5 * run.steps


@pytest.mark.slow
def test_what_it_goes_on_from_stays_near_the_constraints(method):
    """States that are handed out are projected; the solver's own do not drift either."""
    tolerance = 1e-7
    run = walked(method, constrained("pendulum", L, G), turning(np.zeros(1))[0], 60.0, tolerance)
    assert run.steps > 5000
    own = run.interpolate(np.array([run.t]))[0]
    assert np.hypot(*run.y[:2]) == pytest.approx(L, rel=1e-15)
    off = abs(np.hypot(*own[:2]) - L), abs(own[:2] @ own[2:]) / L
    assert 0 < max(off) < 20 * tolerance


@pytest.mark.slow
def test_stiff_motion_on_a_constraint(method):
    """It sinks as l·θ' = −(m·g/c)·sin θ says, in fewer slopes than any other method."""
    found = run_of(OIL, 1e-8)
    assert found.status == "ok"
    assert found.constraint_drift < 1e-14
    angle = 2 * np.arctan(math.tan(1.0) * np.exp(-1.3 * 9.81 / 6e5 / 2 * found.t))
    assert np.abs(found.columns["x"] - 2 * np.sin(angle))[1:].max() < 1e-5
    assert found.rhs_evaluations < 1200
    for name in ("BDF", "Radau"):
        assert run_of(OIL, 1e-8, name).rhs_evaluations > 3 * found.rhs_evaluations


@pytest.mark.slow
def test_a_first_step_that_is_too_long(method):
    """It begins anew with a shorter one where what dies away is much faster."""
    found = run_of(OIL, 1e-11, until=1e3)
    assert found.status == "ok"
    assert distance(found, run_of(OIL, 1e-8, "Radau", until=1e3)) < 1e-7


@pytest.mark.slow
def test_constraints_on_velocities(method):
    """Closed form: Bloch, *Nonholonomic Mechanics and Control*, section 1.6."""
    found = run_of(SKATE)
    force, w, t = 9.81 * math.sin(0.3), 2.0, found.t
    exact = {
        "x": force / (2 * w**2) * np.sin(w * t) ** 2,
        "y": force / (2 * w**2) * (w * t - np.sin(2 * w * t) / 2),
    }
    for name, values in exact.items():
        assert np.abs(found.columns[name] - values).max() < 1e-6
    assert found.constraint_drift < 1e-15


@pytest.mark.slow
def test_constraints_that_move(method):
    found = run_of(MOVING)
    assert distance(found, run_of(MOVING, 1e-12, "DOP853")) < 1e-5
    assert found.constraint_drift < 1e-15


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["constraints/four_bar_linkage", "constraints/slider_crank", "lecture/balance"]
)
def test_linkages(method, name):
    equations = load(f"systems/{name}.yaml").derive(formulation="multiplier").equations
    linkage = model_of(equations)
    how = {"until": 1.0, "samples": 21, "functions": compiled_or_skip(linkage)}
    found = simulate(linkage, method="IDA", rtol=1e-10, **how)
    assert found.status == "ok"
    assert found.constraint_drift < 1e-14
    assert distance(found, simulate(linkage, accuracy=1e-9, **how)) < 1e-5


@pytest.mark.slow
def test_a_squeezing_mechanism_from_rest(method):
    """The angles that the Test Set for IVP Solvers gives; one coordinate starts at exactly 0."""
    scene = load("systems/constraints/andrews_squeezer.yaml").derive()
    squeezer = model_of(scene.equations)
    functions = compiled_or_skip(squeezer)
    found = simulate(squeezer, method="IDA", rtol=1e-10, samples=2, functions=functions)
    assert found.state["beta"] == pytest.approx(15.81077119629904, abs=3e-6)
    assert found.state["epsilon"] == pytest.approx(1.048080741042263, abs=3e-7)


@pytest.mark.slow
@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
def test_through_a_folded_linkage_or_not_at_all(method, rtol):
    """In line, the cranks may turn either way: what is kept is the motion that goes on."""
    found = run_of(FOLDS, rtol)
    assert len(found.t) > 5
    exact = turning(found.t, 1.0, 8.0)
    for name, column in (("x", 0), ("z", 1), ("w", 1), ("dot(x)", 2), ("dot(w)", 3)):
        assert np.abs(found.columns[name] - exact[:, column]).max() < 1e4 * rtol
    assert found.status in ("ok", "blow_up")
    if found.status == "blow_up":
        assert "a position where the constraints are singular" in found.reason
        assert abs(found.columns["z"][-1]) < 0.7


def test_a_projection_that_is_none_ends_the_run(method):
    """Its derivative is no projector: no equations follow from it."""
    rhs = FunctionRhs(lambda t, y: np.array([y[1], 0.0]), lambda t, y: y / 2)
    run = start_integrator(method, rhs, 0.0, np.array([1.0, 1.0]), 1.0, control(2, 1e-6))
    done = run.advance(np.ones(1), np.empty((1, 2)), most_steps=99, most_evaluations=1e4)
    assert done.failure == UNMET
    assert run.t == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("power", [-40, 50])
def test_units_that_are_powers_of_two_change_no_bit(method, power):
    unit = 2.0**power
    text = PENDULUM.replace("l: 2, g: 9.81", f"l: {2 * unit!r}, g: {9.81 * unit!r}")
    text = text.replace("dot(x): 9.5", f"dot(x): {9.5 * unit!r}")
    ours, scaled = (run_of(t, 1e-8) for t in (PENDULUM, text))
    for name in ours.scales:
        assert (ours.columns[name] * unit == scaled.columns[name]).all()


def test_the_report_says_who_makes_the_steps(method):
    assert run_of(PENDULUM, 1e-6).implementation == "compiled C, stepped by SUNDIALS"


def test_without_the_package_the_command_to_install_it_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError) as refusal:
        simulate(model(PENDULUM), method="IDA", rtol=1e-9)
    problem = refusal.value.problems[0]
    assert "IDA needs the package sksundae, which is not installed" in problem.message
    assert problem.hint == "pip install 'lagrange-cli[sundials]'"


def test_a_method_that_cannot_keep_constraints_names_the_one_that_can():
    or_skip("CVODE")
    with pytest.raises(InputError, match="CVODE cannot move its past states") as refusal:
        simulate(model(PENDULUM), method="CVODE", rtol=1e-9)
    assert refusal.value.problems[0].hint.startswith("--method IDA")
    assert INTEGRATORS["IDA"].projects
