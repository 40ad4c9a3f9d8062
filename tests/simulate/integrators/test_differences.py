"""Difference quotients on the scale of the motion, beside exact derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.integrators.differences import distances, quotients
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.system.functions import interpreted, right_hand_side
from tests.simulate.compiling import compiled_or_skip

#: Beads on stiff springs between two walls, in a thick oil.
CHAIN = """
name: chain
sizes: {n: 5}
parameters: {m: 1e-3, k: 1e4, l: 0.8, c: 10}
particles: {"p[i=1..n]": {mass: m, position: ["x[i]", 0, "z[i]"]}}
points: {"p[0]": [0, 0, 0], "p[n+1]": [n + 1, 0, 0]}
coordinates: ["x[i=1..n]", "z[i=1..n]"]
potentials:
  spring[i=0..n]: {spring: ["p[i]", "p[i+1]"], stiffness: k, length: l}
dissipation:
  oil[i=1..n]: c*(dot(x[i])^2 + dot(z[i])^2)/2
initial:
  x[i=1..n]: i
  z[i=1..n]: sin(pi*i/(n + 1))
  dot(x[i=1..n]): 0
  dot(z[i=1..n]): 0
simulate: {until: 1, samples: 11}
"""


@pytest.fixture(scope="module")
def derivation():
    return loads(CHAIN).derive()


@pytest.fixture(scope="module")
def exact(derivation):
    """Emitted derivatives of the slopes by the state."""
    (text,) = derivation.emit("python", jacobian=True).values()
    module = {"__name__": "chain"}
    exec(compile(text, "chain", "exec"), module)

    def jacobian(t, y):
        return module["jacobian"](t, y, module["DEFAULTS"])

    return jacobian


@pytest.mark.parametrize("motion", [1e-8, 1e-3, 1.0])
def test_quotients_are_the_exact_derivatives(derivation, exact, motion):
    rhs = interpreted(model_of(derivation.equations), "").rhs
    n = len(derivation.equations.system.coordinates)
    y = np.random.default_rng(3).normal(1, 0.3, 2 * n)
    right = exact(0.3, y)
    found = quotients(lambda y: rhs(0.3, y), y, distances(y, np.full(2 * n, motion)))
    assert np.abs(found - right).max() < 1e-3 * np.abs(right).max()
    assert (found == 0)[right == 0].all()


def test_numbers_are_moved_to_where_there_is_a_value():
    found = quotients(np.sqrt, np.array([4.0, 1.0]), np.array([1e-7, 1e-7]))
    assert found == pytest.approx(np.diag([0.25, 0.5]), rel=1e-6)
    with np.errstate(invalid="ignore"):
        ends = quotients(lambda y: np.sqrt(1 - y), np.array([1 - 2.0**-30]), np.array([2.0**-28]))
        nowhere = quotients(np.sqrt, np.array([-1.0]), np.array([1e-7]))
    assert ends < 0
    assert np.isnan(nowhere).all()


@pytest.mark.parametrize("method", ["Radau", "BDF"])
def test_jacobians_of_solvers_are_those_of_the_equations(derivation, exact, method):
    rhs = interpreted(model_of(derivation.equations), "").rhs
    initial = derivation.equations.system.initial
    y0 = np.array([*initial.positions, *initial.velocities])
    control = Control(np.full(20, 1e-6), np.full(20, 1e-8), 1e-6, 0.1)
    run = INTEGRATORS[method](rhs, 0.0, y0, 1.0, control)
    right = exact(0.0, y0)
    kept = run.state()["solver"]["J"]
    assert np.abs(kept - right).max() < 1e-3 * np.abs(right).max()


@pytest.mark.slow
def test_a_stiff_chain_takes_few_right_hand_sides(derivation):
    """With SciPy's own differences there were 3619 steps of 49,918 right-hand sides."""
    model = model_of(derivation.equations)
    compiled_or_skip(model)
    fine = simulate(model, method="Radau", rtol=1e-9)
    for functions in (right_hand_side(model), interpreted(model, "")):
        run = simulate(model, method="BDF", rtol=1e-6, functions=functions)
        assert run.status == fine.status == "ok"
        assert (run.steps < 900, run.rhs_evaluations < 6000) == (True, True)
        for name, scale in fine.scales.items():
            assert np.abs(run.columns[name] - fine.columns[name]).max() < 1e-3 * scale
