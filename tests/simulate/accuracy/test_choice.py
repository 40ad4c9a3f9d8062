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
@pytest.mark.parametrize("accuracy", [1e-3, 1e-7])
def test_compiled_motions_are_run_by_collocation(pendulum, accuracy):
    found = run(pendulum, accuracy, until=10.0)
    assert (found.status, found.method) == ("ok", "Gauss16")
    assert "collocation" in found.choice


def test_another_method_gives_the_same(pendulum):
    ours = run(pendulum, 1e-7, until=10.0)
    theirs = simulate(pendulum, method="DOP853", rtol=1e-13, until=10.0)
    for name in pendulum.coordinates:
        assert np.abs(ours.columns[name] - theirs.columns[name]).max() < 1e-7


def test_interpreted_code_has_no_stages_side_by_side(pendulum, monkeypatch):
    monkeypatch.setattr(Taylor, "suits", classmethod(lambda cls, rhs, size: False))
    found = simulate(pendulum, accuracy=1e-6, until=0.5, functions=interpreted(pendulum, ""))
    assert (found.status, found.method) == ("ok", "DOP853")


@pytest.mark.slow
def test_contacts_and_rows_of_inputs_are_run_by_steps_of_order_8():
    for name in ("contact/particle_leaving_sphere", "oscillators/seismometer"):
        assert run(model(name), 1e-8).method == "DOP853"
