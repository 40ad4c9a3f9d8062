"""Inputs as Python functions: closed forms, and what the same input as an expression gives."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import InputError, loads
from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
from lagrange_cli.simulate.system.functions import interpreted

CART = """
name: cart
parameters: {m: 1, k: 4}
inputs: [F]
particles: {cart: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
forces: {push: {on: x, force: F}}
initial: {x: 1, dot(x): 0}
simulate: {until: 5, samples: 26, accuracy: 1e-9}
"""

BALL = """
parameters: {m: 1, g: 10}
inputs: [F]
particles: {b: {mass: m, position: [0, 0, z]}}
coordinates: [z]
constraints: {floor: {unilateral: z >= 0, restitution: 0.5}}
potentials: {weight: {gravity: g}}
forces: {push: {on: z, force: F}}
initial: {z: 1, dot(z): 0}
simulate: {until: 1, samples: 26, accuracy: 1e-9}
"""

ROD = """
parameters: {m: 1, g: 10, l: 1}
inputs: [F]
plane: xz
particles: {b: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: g}}
forces: {push: {on: b, force: [F, 0, 0]}}
initial: {x: 0.6, z: -0.8, dot(x): 0, dot(z): 0}
simulate: {until: 3, samples: 26, accuracy: 1e-9}
"""


@pytest.fixture(scope="module")
def cart():
    return loads(CART).derive()


def pushed(t):
    """The motion with F = sin(3 t)."""
    return np.cos(2 * t) + (1.5 * np.sin(2 * t) - np.sin(3 * t)) / 5


@pytest.mark.parametrize("accuracy", [1e-4, 1e-9, 1e-12])
def test_the_closed_form_is_kept(cart, accuracy):
    motion = cart.simulate(inputs={"F": lambda t: math.sin(3 * t)}, accuracy=accuracy)
    assert motion.status == "ok"
    assert np.abs(motion.columns["x"] - pushed(motion.t)).max() <= accuracy
    assert motion.implementation == "interpreted Python: an input is a Python function"
    assert "of F steps see the values" in motion.remarks[0]


@pytest.mark.parametrize("method", ["DOP853", "Gauss16", "RK45", "Radau", "BDF", "LSODA"])
def test_every_method_calls_it(cart, method):
    motion = cart.simulate(inputs={"F": lambda t: np.sin(3 * t)}, method=method, rtol=1e-8)
    assert np.abs(motion.columns["x"] - pushed(motion.t)).max() <= 1e-6


@pytest.mark.slow
def test_a_jump_is_kept_or_told(cart):
    for end in np.random.default_rng(0).uniform(0.1, 4.9, 6).tolist():
        motion = cart.simulate(inputs={"F": lambda t, end=end: 4.0 * (t > end)}, accuracy=1e-6)
        after = np.where(motion.t > end, 1 - np.cos(2 * (motion.t - end)), 0.0)
        error = np.abs(motion.columns["x"] - np.cos(2 * motion.t)[: len(after)] - after).max()
        assert error <= 3e-6 or motion.status != "ok"


@pytest.mark.slow
def test_values_of_a_simulation_go_with_it(cart):
    def sine(t):
        return math.sin(3 * t)

    for k, x in ((4, 1.0), (4, 2.0), (0, 1.0)):
        motion = cart.simulate(inputs={"F": sine}, parameters={"k": k}, initial={"x": x})
        t = motion.t
        exact = pushed(t) + (x - 1) * np.cos(2 * t) if k else x + t / 3 - np.sin(3 * t) / 9
        assert np.abs(motion.columns["x"] - exact).max() <= 2e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "formulation"),
    [
        (BALL, "minimal"),
        (ROD, "multiplier"),
        (ROD.replace("l^2}", "l^2}\ncoordinates: [x]\nnear: {z: -1}"), "auto"),
        (CART.replace("force: F", "force: F*abs(x) - sign(dot(x))"), "minimal"),
        (CART + "outputs: {power: F*dot(x)}", "minimal"),
    ],
)
def test_it_is_what_the_expression_is(scene, formulation):
    """With contacts, constraints, singular coordinates, kinks and outputs."""
    written = scene.replace("[F]", "{F: sin(t)}")
    driven, known = (
        loads(text).derive(formulation=formulation, forces=True) for text in (scene, written)
    )
    motion = driven.simulate(inputs={"F": math.sin}, until=1.0)
    expected = known.simulate(until=1.0)
    assert motion.status == expected.status == "ok"
    assert [e.name for e in motion.events] == [e.name for e in expected.events]
    both = [(motion.columns, expected.columns), (motion.forces, expected.forces)]
    for ours, theirs in both:
        assert ours.keys() == theirs.keys()
        for name, column in theirs.items():
            assert np.abs(ours[name] - column).max() <= 1e-7, name


def test_one_input_is_recorded_and_another_driven(tmp_path):
    (tmp_path / "slope.csv").write_text("t,u\n0,0\n5,5\n", encoding="utf-8")
    scene = CART.replace("[F]", "{G: {file: slope.csv, column: u}, F: 1}")
    scene = scene.replace("force: F", "force: F + G")
    path = tmp_path / "scene.yaml"
    path.write_text(scene, encoding="utf-8")
    motion = loads(scene, file=str(path)).derive().simulate(inputs={"F": lambda t: -t})
    assert np.abs(motion.columns["x"] - np.cos(2 * motion.t)).max() <= 1e-9


@pytest.mark.parametrize(
    "scene",
    [
        ROD.replace("l^2}", "l^2}\ncoordinates: [x]\nnear: {z: -1}"),
        CART.replace("force: F", "force: -F*sqrt(abs(x))"),
        CART.replace("force: F", "force: sqrt(abs(x - F))"),
    ],
)
def test_recorded_inputs_go_with_singular_coordinates_and_infinite_slopes(scene, tmp_path):
    (tmp_path / "line.csv").write_text("t,u\n0,0\n5,5\n", encoding="utf-8")
    recorded = scene.replace("[F]", "{F: {file: line.csv, column: u}}")
    motion = loads(recorded, file=str(tmp_path / "scene.yaml")).derive().simulate()
    expected = loads(scene.replace("[F]", "{F: t}")).derive().simulate()
    assert motion.status == expected.status == "ok"
    assert np.abs(motion.columns["x"] - expected.columns["x"]).max() <= 1e-7


def test_the_scenes_own_input_is_not_forgotten():
    driven = loads(CART.replace("[F]", "{F: sin(3*t)}")).derive()
    driven.simulate(inputs={"F": lambda t: 0.0})
    motion = driven.simulate()
    assert motion.implementation == "compiled C" or "compiler" in motion.implementation
    assert np.abs(motion.columns["x"] - pushed(motion.t)).max() <= 1e-9


def test_it_is_asked_within_the_run_alone(cart):
    asked = []
    cart.simulate(inputs={"F": lambda t: asked.append(t) or 0.0})
    assert 0.0 <= min(asked) < max(asked) <= 5.0
    assert {type(t) for t in asked} == {float}


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda t: math.nan if t > 1 else 0.0, ": nan"),
        (lambda t: math.inf, "t = 0.0: inf"),
        (lambda t: 1 / t, "t = 0.0: ZeroDivisionError: "),
        (lambda t: math.sqrt(-1 - t), "t = 0.0: ValueError: "),
    ],
)
def test_values_that_are_none_stop_the_run(cart, function, said):
    with pytest.raises(InputError, match="the input 'F' has no finite value at t = ") as refusal:
        cart.simulate(inputs={"F": function})
    assert said in str(refusal.value)


def test_errors_of_the_function_are_the_callers(cart):
    with pytest.raises(KeyError):
        cart.simulate(inputs={"F": lambda t: {}[t]})


@pytest.mark.parametrize("force", ["-sign(dot(x) - F)", "abs(x - F)", "sqrt(abs(x - F))"])
def test_where_its_rate_would_be_needed_it_is_refused(force):
    derivation = loads(CART.replace("force: F", f"force: {force}")).derive()
    with pytest.raises(InputError, match="whose rate a Python function does not tell"):
        derivation.simulate(inputs={"F": math.sin})


def test_what_cannot_be_is_refused(cart, tmp_path):
    with pytest.raises(InputError, match="the scene has no input 'G'"):
        cart.simulate(inputs={"G": math.sin})
    functions = interpreted(cart.model(), "a test")
    with pytest.raises(InputError, match="'functions' have their own inputs"):
        cart.simulate(inputs={"F": math.sin}, functions=functions)
    with pytest.raises(InputError, match="cannot go on from a file"):
        cart.simulate(inputs={"F": math.sin}, checkpoint=Checkpoint(str(Path(tmp_path) / "c")))
