"""What ``auto`` chooses, why, and what it costs beside the cheapest run that is as good."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import load
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.integrators.external.heyoka_method import Taylor
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted, right_hand_side
from lagrange_cli.studies.tradeoff.measure import trade

SYSTEMS = Path(__file__).parents[3] / "systems"


def model(name):
    return model_of(load(SYSTEMS / f"{name}.yaml").derive().equations)


@pytest.fixture(scope="module")
def pendulum():
    return model("pendulums/double_pendulum")


def run(of, accuracy, functions=None, **how):
    functions = functions or right_hand_side(of)
    if not functions.native:
        pytest.skip("no C compiler")
    return simulate(of, accuracy=accuracy, functions=functions, **how)


@pytest.mark.slow
@pytest.mark.parametrize(("accuracy", "method"), [(1e-3, "DOP853"), (1e-7, "Gauss16")])
def test_fine_tolerances_are_run_by_collocation(pendulum, accuracy, method):
    found = run(pendulum, accuracy, until=10.0)
    assert (found.status, found.method) == ("ok", method)
    assert ("side by side" in found.choice) == (method == "Gauss16")


def test_both_methods_give_the_same(pendulum):
    coarse, fine = (run(pendulum, eps, until=10.0) for eps in (1.99e-7 * 1.01, 1.9e-7))
    assert (coarse.method, fine.method) == ("DOP853", "Gauss16")
    for name in pendulum.coordinates:
        assert np.abs(coarse.columns[name] - fine.columns[name]).max() < 2 * 2e-7


def test_interpreted_code_has_no_stages_side_by_side(pendulum, monkeypatch):
    monkeypatch.setattr(Taylor, "suits", classmethod(lambda cls, rhs, size: False))
    found = simulate(pendulum, accuracy=1e-6, until=0.5, functions=interpreted(pendulum, ""))
    assert (found.status, found.method) == ("ok", "DOP853")


@pytest.mark.slow
def test_contacts_and_rows_of_inputs_are_run_by_steps_of_order_8():
    for name in ("contact/particle_leaving_sphere", "oscillators/seismometer"):
        assert run(model(name), 1e-8).method == "DOP853"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "until"),
    [
        ("pendulums/double_pendulum", 2.0),
        ("celestial/figure_eight", None),
        ("rigid/heavy_top", 2.0),
    ],
)
def test_cost_is_within_twice_the_front(name, until):
    of = model(name)
    if not right_hand_side(of).native:
        pytest.skip("no C compiler")
    found = trade(of, methods=["auto", "DOP853", "Gauss16", "LSODA"], repeat=1, until=until)
    costs = [
        behind.evaluations
        for behind in found.automatic
        if behind.point.setting.accuracy in (1e-3, 1e-6, 1e-9)
    ]
    assert len(costs) == 3
    assert all(cost is not None and cost <= 2 for cost in costs), costs
