"""Linear systems of sampled loops, against SciPy's and python-control's zero-order hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import cont2discrete

from lagrange_cli import load, loads
from tests.simulate.test_sampled_control import CASCADE, PID

SCENE = Path(__file__).parents[2] / "systems/actuators/sampled_cart_pole.yaml"

#: What the tutorial prints, in the order of the scene: gains; A and B from sample to sample.
GAINS = np.array([[-61.9933, 95.0597, -33.5040, 18.8300]])
PRINTED_A = [
    [1, 0.0001, 0.01, 0],
    [0, 1.0016, 0, 0.01],
    [0, 0.0267, 0.9982, 0.0001],
    [0, 0.3119, -0.0045, 1.0016],
]
PRINTED_B = [[0.0001], [0.0002], [0.0182], [0.0454]]


@pytest.fixture(scope="module")
def regulator():
    analysis = load(str(SCENE)).derive().analyze("equilibria", "linearization")
    return analysis.report()


def poles_of(report) -> np.ndarray:
    return np.sort_complex(np.array([complex(*pole) for pole in report["sampled"]["poles"]]))


def test_the_cart_pole_is_that_of_the_tutorial(regulator):
    loop = regulator["sampled"]
    assert loop["states"] == ["x", "phi", "dot(x)", "dot(phi)"]
    assert np.abs(np.array(loop["A"]) - PRINTED_A).max() <= 6e-5
    assert np.abs(np.array(loop["B"]) - PRINTED_B).max() <= 6e-5


def test_the_loop_is_that_of_scipy(regulator):
    space, loop = regulator["linearization"]["state_space"], regulator["sampled"]
    assert space["inputs"] == ["F"]
    matrices = [np.array(space[name]) for name in "ABCD"]
    a, b, *_ = cont2discrete(matrices, 0.01, "zoh")
    assert np.abs(np.array(loop["A"]) - a).max() < 1e-14
    assert np.abs(np.array(loop["B"]) - b).max() < 1e-14
    poles = np.sort_complex(np.linalg.eigvals(a - b @ GAINS))
    assert np.abs(poles_of(regulator) - poles).max() < 1e-10
    assert (np.abs(poles) < 1).all()
    upright = regulator["equilibria"][0]
    assert upright["stability"] == "asymptotically stable"


def test_the_loop_is_that_of_python_control(regulator):
    control = pytest.importorskip("control")
    space, loop = regulator["linearization"]["state_space"], regulator["sampled"]
    system = control.c2d(control.ss(*(np.array(space[name]) for name in "ABCD")), 0.01, "zoh")
    assert np.abs(np.array(loop["A"]) - system.A).max() < 1e-13
    gains, _, _ = control.dlqr(system.A, system.B, np.diag([5000, 100, 0, 0]), np.eye(1))
    assert np.abs(gains - GAINS).max() < 1e-4


def test_memory_is_part_of_the_loop():
    report = loads(PID).derive().analyze("equilibria", "linearization").report()
    rest = report["equilibria"][0]["at"]
    assert rest["theta"] == pytest.approx(0.5)
    assert rest["tau"] == pytest.approx(9.81 * 0.5 * np.sin(0.5))
    h, stiffness = 0.05, 9.81 / 0.5 * np.cos(0.5)
    flow = expm(np.array([[0, 1, 0], [-stiffness, 0, 4], [0, 0, 0]]) * h)
    a, b = flow[:2, :2], flow[:2, 2:]
    # x = (θ, θ̇, e, before): the force over it, then the memory behind a sample.
    force = np.array([[-30 - 5 / h, 0, 40, 5 / h]])
    memory = np.array([[-h, 0, 1, 0], [1, 0, 0, 0]])
    whole = np.vstack([np.hstack([a, np.zeros((2, 2))]) + b @ force, memory])
    poles = np.sort_complex(np.linalg.eigvals(whole))
    assert np.abs(poles_of(report) - poles).max() < 1e-9


def test_rates_of_several_controllers_meet():
    report = loads(CASCADE).derive().analyze("linearization", at={"target": 0.5}).report()
    loop = report["sampled"]
    assert loop["period"] == 3 / 200
    assert "A" not in loop
    # Behind the outer sample x and v go on with the force held, which inner samples change.
    flow = expm(np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0], [0, 0, 0, 0]]) / 200)
    inner = np.diag([1.0, 1, 0, 1])
    inner[2] = [-40, -8, 0, 40]
    both = inner.copy()
    both[3] = [-1, 0, 0, 0]
    exact = np.linalg.eigvals(both @ flow @ inner @ flow @ inner @ flow)
    found, exact = poles_of(report), np.sort_complex(exact[np.abs(exact) > 1e-9])
    assert np.abs(found - exact).max() < 1e-10


def test_gains_beyond_the_circle_are_unstable():
    text = PID.replace("P: 30", "P: 300").replace("max(-8, min(8, ", "").replace("/h))", "/h")
    report = loads(text).derive().analyze("equilibria").report()
    assert {point["stability"] for point in report["equilibria"]} == {"unstable"}


def test_motions_that_grow_beyond_doubles_between_samples_are_refused():
    text = PID.replace("h: 0.05, w: 0.5", "h: 1e4, w: 2.8")
    analysis = loads(text).derive().analyze("equilibria")
    reasons = [point.stability.reason for point in analysis.equilibria.points]
    assert "numbers of the sampled loop are beyond double precision" in map(str, reasons)
