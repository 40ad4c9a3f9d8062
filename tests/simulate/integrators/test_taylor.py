"""Taylor's method: its declared properties, on scenes; and what it says where it cannot."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.api import load, loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.base import UnfitError
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.system.functions import interpreted, right_hand_side
from tests.simulate.available import INSTALLED, or_skip

SYSTEMS = Path(__file__).parents[3] / "systems"

OSCILLATOR = """
name: oscillator
parameters: {m: 2, k: 8}
coordinates: [x]
kinetic: {inertia: m*dot(x)^2/2}
potentials: {spring: k*x^2/2}
initial: {x: 1, dot(x): 0}
simulate: {until: 20, samples: 101}
"""

ROD = """
name: rod
parameters: {m: 1.3, l: 2, g: 9.81}
particles: {bob: {mass: m, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: m*g*z}
initial: {x: 0, z: -l, dot(x): 9.5}
simulate: {until: 5, samples: 101}
"""

#: A force without a derivative at rest.
DRY = OSCILLATOR.replace("initial", "forces: {friction: {on: x, force: -sign(dot(x))}}\ninitial")


@pytest.fixture(scope="module")
def taylor():
    return or_skip("taylor")


@cache
def model(text):
    return model_of(loads(text).derive().equations)


@cache
def shipped(name):
    return model_of(load(SYSTEMS / name).derive().equations)


def begun(of, rtol=1e-9, functions=None, **how):
    """A run with the tolerance of every number."""
    n = 2 * len(of.coordinates)
    rhs = (functions or right_hand_side(of)).rhs
    control = Control(
        np.full(n, rtol), np.full(n, rtol), **{"first_step": 1.0, "max_step": 9.0} | how
    )
    return start_integrator(INTEGRATORS["taylor"], rhs, 0.0, np.array(of.initial), 20.0, control)


@pytest.mark.parametrize("rtol", [1e-5, 1e-9, 1e-13])
def test_errors_follow_the_tolerance_also_between_steps(taylor, rtol):
    found = simulate(model(OSCILLATOR), method="taylor", rtol=rtol)
    exact = np.column_stack([np.cos(2 * found.t), -2 * np.sin(2 * found.t)])
    states = np.column_stack([found.columns["x"], found.columns["dot(x)"]])
    assert rtol * 1e-6 < np.abs(states - exact).max() < 30 * rtol + 1e-14


def test_the_order_grows_with_the_tolerance(taylor):
    """Steps hardly become shorter: an order of 8 would need eighteen times as many."""
    orders, steps = [], []
    for rtol in (1e-4, 1e-14):
        run = begun(model(OSCILLATOR), rtol)
        run.advance(np.array([20.0]), np.empty((1, 2)), most_steps=10**6, most_evaluations=math.inf)
        orders.append(run.evaluations / run.steps)
        steps.append(run.steps)
    assert orders[0] < 7
    assert orders[1] > 16
    assert steps[1] < 3 * steps[0]
    assert max(orders) <= taylor.order


def test_steps_stay_within_limits(taylor):
    run = begun(model(OSCILLATOR), first_step=0.01, max_step=0.05)
    run.step(20.0)
    assert run.t == 0.01
    run.step(20.0)
    assert run.t == pytest.approx(0.06, abs=1e-15)
    run.step(0.065)
    assert run.t == 0.065


def test_explicit_steps_are_short_where_it_is_stiff(taylor):
    text = OSCILLATOR.replace("initial", "dissipation: {oil: 1e5*dot(x)^2}\ninitial")
    run = begun(model(text))
    run.advance(np.array([20.0]), np.empty((1, 2)), most_steps=300, most_evaluations=math.inf)
    assert run.t < 1.0
    assert not taylor.implicit


def test_the_same_bits_however_it_is_called(taylor):
    times = np.linspace(0.0, 20.0, 333)
    whole, parts = begun(model(OSCILLATOR)), begun(model(OSCILLATOR))
    limits = {"most_steps": 10**6, "most_evaluations": math.inf}
    states, others = np.empty((2, len(times), 2))
    whole.advance(times, states, **limits)
    filled = 0
    while filled < len(times):
        filled += parts.advance(
            times[filled:], others[filled:], **limits | {"most_steps": 1}
        ).filled
    assert (states == others).all()


def test_it_goes_on_from_a_state_bit_by_bit(taylor):
    whole = begun(model(OSCILLATOR))
    for _ in range(4):
        whole.step(20.0)
    other = begun(model(OSCILLATOR))
    other.restore(whole.state())
    for run in (whole, other):
        run.step(20.0)
    assert (whole.t, *whole.y) == (other.t, *other.y)


def test_parameters_are_not_compiled_in(taylor):
    light = simulate(model(OSCILLATOR), method="taylor", rtol=1e-12)
    heavy = simulate(model(OSCILLATOR.replace("m: 2", "m: 32")), method="taylor", rtol=1e-12)
    assert light.columns["x"][-1] == pytest.approx(math.cos(40), abs=1e-10)
    assert heavy.columns["x"][-1] == pytest.approx(math.cos(10), abs=1e-10)


def test_a_singularity_ends_the_run(taylor):
    text = OSCILLATOR.replace("spring: k*x^2/2", "well: -k/x")
    found = simulate(model(text), method="taylor", rtol=1e-9)
    assert found.status == "blow_up"
    assert np.isfinite(found.columns["x"]).all()
    assert found.t[-1] < math.pi / 2**2.5 * math.sqrt(2) + 0.2


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "pendulums/double_pendulum.yaml",
        "celestial/kepler.yaml",
        "constraints/four_bar_linkage.yaml",  # a mass matrix that is singular by itself
        "oscillators/seismometer.yaml",  # inputs from a file
        "contact/slack_rope.yaml",
        "rolling/chaplygin_sleigh.yaml",
    ],
)
def test_scenes_against_dop853(taylor, name):
    of = shipped(name)
    ours, other = (simulate(of, method=m, rtol=1e-12) for m in ("taylor", "DOP853"))
    assert ours.status == "ok"
    for column, scale in ours.scales.items():
        assert np.abs(ours.columns[column] - other.columns[column]).max() < 1e-7 * scale
    assert [e.name for e in ours.events] == [e.name for e in other.events]
    assert [e.t for e in ours.events] == pytest.approx([e.t for e in other.events], abs=1e-9)


def test_constraints_hold_to_rounding(taylor):
    found = simulate(model(ROD), method="taylor", rtol=1e-9)
    assert found.constraint_drift < 1e-15
    assert found.energy_drift < 1e-8


@pytest.mark.slow
def test_it_serves_without_a_compiler(taylor):
    of = model(ROD)
    ways = right_hand_side(of), interpreted(of, "asked for")
    ours, other = (simulate(of, method="taylor", rtol=1e-12, functions=f) for f in ways)
    assert np.abs(ours.columns["x"] - other.columns["x"]).max() < 1e-9


def test_without_a_compiler_series_stand_in(taylor):
    found = simulate(
        model(OSCILLATOR), accuracy=1e-9, functions=interpreted(model(OSCILLATOR), "x")
    )
    assert (found.status, found.method) == ("ok", "taylor")
    assert found.implementation == "series compiled by heyoka, and interpreted Python: x"
    assert "without a compiler" in found.choice
    assert np.abs(found.columns["x"] - np.cos(2 * found.t)).max() < 1e-9


def test_without_a_compiler_what_has_no_series_is_stepped_by_numpy(taylor):
    found = simulate(model(DRY), until=0.5, accuracy=1e-6, functions=interpreted(model(DRY), "x"))
    assert found.method == "DOP853"


def refusal(of, rtol):
    with pytest.raises(InputError) as refused:
        simulate(of, method="taylor", rtol=rtol, until=0.1)
    return refused.value.problems[0].message


def test_what_has_no_series_is_refused(taylor):
    said = refusal(model(DRY), 1e-9)
    assert said == "taylor cannot integrate this system: a force in it is not smooth (sign)"


def test_what_would_compile_for_ages_is_refused(taylor, monkeypatch):
    monkeypatch.setattr(
        "lagrange_cli.simulate.integrators.external.heyoka_algebra.MOST_HEYOKA_OPERATIONS", 5
    )
    other = ROD.replace("m*g*z", "m*g*z + m*x^4")
    assert "more than 5 operations" in refusal(model(other), 1e-9)


@pytest.mark.parametrize("most", [2, 3, 4, 5])
def test_what_is_too_long_only_when_perturbed_is_stepped_by_numpy(taylor, monkeypatch, most):
    monkeypatch.setattr(
        "lagrange_cli.simulate.integrators.external.heyoka_algebra.MOST_HEYOKA_OPERATIONS", most
    )
    of = model(OSCILLATOR)
    found = simulate(of, until=0.5, accuracy=1e-6, functions=interpreted(of, "x"))
    assert found.method in ("DOP853", "taylor")
    assert np.abs(found.columns["x"] - np.cos(2 * found.t)).max() < 1e-6


def test_a_right_hand_side_without_a_text_is_not_for_it():
    control = Control(np.zeros(2), np.ones(2), 1.0, 1.0)
    with pytest.raises(UnfitError, match="expressions"):
        start_integrator(INTEGRATORS["taylor"], lambda t, y: y, 0.0, np.zeros(2), 1.0, control)


def test_without_the_package_the_command_to_install_it_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError) as refusal:
        simulate(model(OSCILLATOR), method="taylor", rtol=1e-9)
    problem = refusal.value.problems[0]
    assert "heyoka, which is not installed" in problem.message
    assert problem.hint == "pip install 'lagrange-cli[taylor]'"
    assert "taylor" in INTEGRATORS or INSTALLED
