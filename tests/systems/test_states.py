"""The scenes with states of first order, against rates typed by hand and SciPy's DOP853."""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from lagrange_cli import load
from lagrange_cli.analysis.analyze import analyze
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.simulate import simulate
from tests.systems.shipped import APART, SYSTEMS, derived, simulated
from tests.systems.textbook_states import RATES

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]

each_scene = pytest.mark.parametrize("name", RATES)


def parameters(e: Equations) -> SimpleNamespace:
    return SimpleNamespace(**{p.name: p.value for p in e.system.parameters})


def start(e: Equations) -> Array:
    assert e.system.initial is not None
    return np.array(e.system.initial.numbers)


def module_of(name: str) -> ModuleType:
    derivation = load(str(APART[name])).derive()
    (text,) = derivation.emit("python", jacobian=True, linearization=True).values()
    module = ModuleType(f"emitted_{name}")
    sys.modules[module.__name__] = module
    exec(compile(text, module.__name__, "exec"), vars(module))
    return module


def test_each_scene_has_rates_that_were_typed() -> None:
    scenes = (SYSTEMS / "actuators").glob("*.yaml")
    assert {p.stem for p in scenes if "\nstates:" in p.read_text()} == set(RATES)


@each_scene
def test_emitted_code_has_the_typed_rates(name: str) -> None:
    e, module = derived(name), module_of(name)
    p, random = parameters(e), np.random.default_rng(sum(name.encode()))
    for _ in range(5):
        y = start(e) + random.uniform(0, 0.3, e.system.layout.size)
        expected = np.array(RATES[name](p, 0.0, y))
        found = np.asarray(module.rhs(0.0, y))
        assert np.abs(found - expected).max() <= 1e-13 * max(1.0, np.abs(expected).max())


@each_scene
def test_the_linear_system_is_that_of_differences(name: str) -> None:
    e, module = derived(name), module_of(name)
    p, y, h = parameters(e), start(e) + 0.1, 1e-5
    linear = module.linearization(0.0, y)

    def rates(state: Array) -> Array:
        return np.array(RATES[name](p, 0.0, state))

    steps = h * np.eye(len(y))
    slopes = [
        (8 * (rates(y + s) - rates(y - s)) - rates(y + 2 * s) + rates(y - 2 * s)) / (12 * h)
        for s in steps
    ]
    assert np.abs(linear.A.T - slopes).max() <= 1e-9 * max(1.0, np.abs(linear.A).max())
    assert np.array_equal(linear.A, module.jacobian(0.0, y))


@each_scene
def test_simulation_keeps_its_promise(name: str) -> None:
    """Every coordinate, velocity and state within accuracy times scale of SciPy's motion."""
    e, trajectory = derived(name), simulated(name)
    assert trajectory.status == "ok", trajectory.reason
    p = parameters(e)
    solution = solve_ivp(
        lambda t, y: RATES[name](p, t, y),
        (trajectory.t[0], trajectory.t[-1]),
        start(e),
        method="DOP853",
        t_eval=trajectory.t,
        rtol=1e-13,
        atol=1e-15,
    )
    for column, exact in zip(e.system.state_names, solution.y, strict=True):
        found, scale = trajectory.columns[column], np.abs(exact).max()
        assert np.abs(found - exact).max() <= trajectory.requested * scale


def test_poles_of_a_motor_are_those_of_the_textbook() -> None:
    """(J s² + b s + m g l cos φ) (L s + R) + K² s has the roots that the analysis finds."""
    e = derived("dc_motor_pendulum")
    linear = analyze(e, ["linearization"]).linearization
    assert linear is not None
    assert linear.at.position is not None
    p, phi = parameters(e), float(linear.at.position[0])
    inertia, stiffness = p.m * p.l**2 + p.I, p.m * p.g * p.l * np.cos(phi)
    expected = np.roots(
        [
            inertia * p.L,
            inertia * p.R + p.b * p.L,
            stiffness * p.L + p.b * p.R + p.K**2,
            stiffness * p.R,
        ]
    )
    found = np.linalg.eigvals(np.array(linear.state_space.a, dtype=float))
    for pole in expected:
        assert np.abs(found - pole).min() <= 1e-11 * abs(pole)


TOLERANCES = {"rtol": 1e-10, "atol": 1e-12}
FIXED = {"Gauss6": {"step": 2.5e-3}}


@pytest.mark.parametrize("method", ["taylor", "Gauss6", "Radau", "Gauss16"])
def test_other_methods_take_states(method: str) -> None:
    e = derived("dc_motor_pendulum")
    found = simulate(e, method=method, until=1.0, **FIXED.get(method, TOLERANCES))
    exact = simulate(e, accuracy=1e-11, until=1.0)
    assert abs(found.columns["i"][-1] - exact.columns["i"][-1]) <= 1e-8
