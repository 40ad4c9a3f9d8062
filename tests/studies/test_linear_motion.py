"""Linear systems along motions: against 60 digits, sensitivities, more accurate motions."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from tests.analysis.test_linearization import CART
from tests.cli.terminal import lagrange, succeed
from tests.emit.derivative_reference import AccelerationReference, relative
from tests.systems.shipped import SYSTEMS


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    ["pendulums/double_pendulum", "constraints/four_bar_linkage", "oscillators/driven_spring"],
)
def test_matrices_are_derivatives_of_the_equations(scene):
    derivation = load(f"{SYSTEMS}/{scene}.yaml").derive()
    found = derivation.linearize(until=2.0, samples=5)
    n = len(derivation.equations.system.coordinates)
    assert found.status == "ok"
    for k in range(5):
        y = found.y[k]
        by_state, by_inputs, _ = AccelerationReference(derivation.equations, ()).derivatives(
            found.t[k], y, found.u[k], [p.value for p in derivation.equations.system.parameters]
        )
        a, b = found.matrices["A"][k], found.matrices["B"][k]
        assert_allclose(a[:n], np.eye(n, 2 * n, n), atol=0)
        assert relative(a[n:], by_state).max() < 1e-10
        assert relative(b[n:], by_inputs).max(initial=0.0) < 1e-10


@pytest.mark.slow
def test_changes_are_those_of_the_sensitivities():
    """δ' = A(t) δ, integrated by SciPy, beside the variational equations of simulate."""
    derivation = load(f"{SYSTEMS}/pendulums/double_pendulum.yaml").derive()
    found = derivation.linearize(until=2.0, samples=801, accuracy=1e-9)
    slopes = CubicSpline(found.t, found.matrices["A"])
    run = solve_ivp(
        lambda t, x: (slopes(t) @ x.reshape(4, 4)).ravel(),
        (0, 2),
        np.eye(4).ravel(),
        rtol=1e-10,
        atol=1e-12,
    )
    reached = run.y[:, -1].reshape(4, 4)
    motion = derivation.simulate(until=2.0, sensitivity=found.states, accuracy=1e-9)
    for j, by in enumerate(found.states):
        for i, name in enumerate(found.states):
            column = f"d({name})/d({by})"
            if name.startswith("dot("):
                column = f"dot(d({name[4:-1]})/d({by}))"
            assert reached[i, j] == pytest.approx(motion.columns[column][-1], abs=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "until"),
    [("pendulums/double_pendulum", 8.0), ("constraints/four_bar_linkage", 5.0)],
)
def test_the_promise_is_kept(scene, until):
    derivation = load(f"{SYSTEMS}/{scene}.yaml").derive()
    found = derivation.linearize(until=until, samples=101, accuracy=1e-5)
    exact = derivation.linearize(until=until, samples=101, accuracy=1e-11)
    scales = np.abs(exact.y).max(axis=0)
    for name in "AC":
        change = (found.matrices[name] - exact.matrices[name]) * scales
        size = exact.matrices[name] * scales
        if name == "A":
            change, size = change / scales[:, None], size / scales[:, None]
        assert np.abs(change).max() <= 1e-5 * np.abs(size).max()
    assert 0 < found.estimated <= 1e-5


@pytest.mark.slow
def test_a_second_run_follows_where_one_is_not_enough():
    """Matrices of a linkage change faster than its coordinates: a motion to 1e-6 would not do."""
    derivation = load(f"{SYSTEMS}/constraints/four_bar_linkage.yaml").derive()
    found = derivation.linearize(until=5.0, samples=101, accuracy=1e-6)
    assert found.estimated <= 1e-6


def test_inputs_outputs_and_recordings():
    derivation = loads(CART.replace("[F]", "{F: 2*sin(3*t)}")).derive()
    found = derivation.linearize(until=1.0, samples=11)
    assert (found.inputs, found.outputs) == (("F",), ("place", "tip", "push"))
    assert_allclose(found.u[:, 0], 2 * np.sin(3 * found.t), rtol=1e-12)
    assert_allclose(found.matrices["D"][:, :, 0], np.tile([0, 0, 2], (11, 1)))
    theta = found.y[:, 1]
    assert_allclose(found.matrices["C"][:, 1, 1], 0.7 * np.cos(theta), rtol=1e-12)
    recorded = load(f"{SYSTEMS}/oscillators/seismometer.yaml").derive()
    beside = recorded.linearize(until=2.0, samples=21)
    outputs = recorded.simulate(until=2.0, samples=21).columns["ground"]
    assert_allclose(beside.u[:, 0], outputs, atol=1e-12)


def test_without_derivatives_it_is_refused():
    with pytest.raises(InputError, match="the contact 'floor' opens"):
        load(f"{SYSTEMS}/contact/bouncing_ball.yaml").derive().linearize(until=1.0)
    rough = CART.replace("force: F", "force: F - sign(dot(p))").replace("[F]", "{F: 1}")
    with pytest.raises(InputError, match="where a force does"):
        loads(rough).derive().linearize(until=1.0)


@pytest.mark.slow
def test_command(tmp_path):
    scene, file = f"{SYSTEMS}/pendulums/pendulum.yaml", tmp_path / "beside.npz"
    shown = succeed("analyze", scene, "--along", "2", "--samples", "9", "-o", str(file))
    assert "Along the motion   9 times from t = 0 to 2" in shown
    assert "Equilibria" not in shown
    arrays = np.load(file)
    assert arrays["A"].shape == (9, 2, 2)
    assert arrays["B"].shape == (9, 2, 0)
    assert list(arrays["states"]) == ["theta", "dot(theta)"]
    words = ("--along", "2", "--samples", "9", "--modes", "--json")
    report = json.loads(succeed("analyze", scene, *words))
    assert_allclose(report["along"]["A"], arrays["A"], rtol=1e-15)
    assert report["modes"] is not None
    for wrong in (["--samples", "9"], ["--accuracy", "1e-3"], ["--along", "2", "--at", "theta=0"]):
        assert lagrange("analyze", scene, *wrong).returncode == 2
    assert lagrange("analyze", scene, "--along", "-1").returncode == 2
    chaotic = f"{SYSTEMS}/pendulums/double_pendulum.yaml"
    assert lagrange("analyze", chaotic, "--along", "12", "--accuracy", "4e-15").returncode == 1
