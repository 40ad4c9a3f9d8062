"""Ensembles from Python: closed forms, the command's file, and single runs."""

from __future__ import annotations

import math
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from click.testing import CliRunner

from lagrange_cli import InputError, load, loads
from lagrange_cli.cli.main import lagrange
from lagrange_cli.cli.session import Session

PENDULUM = Path(__file__).parents[3] / "systems/pendulums/pendulum.yaml"

OSCILLATOR = """
name: oscillator
parameters: {m: 1, k: 4}
particles: {mass: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
initial: {x: 1, dot(x): 0}
simulate: {until: 5, samples: 26, accuracy: 1e-9}
"""


@pytest.fixture(scope="module")
def oscillator():
    return loads(OSCILLATOR).derive()


def test_a_grid_combines_all_values_and_the_last_name_varies_fastest(oscillator):
    ensemble = oscillator.ensemble({"k": [1, "2^2"], "x": np.array([0.5, 1.0, 2.0])})
    k, x = np.repeat([1.0, 4.0], 3), np.tile([0.5, 1.0, 2.0], 2)
    assert (ensemble.given["k"] == k).all()
    assert (ensemble.given["x"] == x).all()
    exact = x[:, None] * np.cos(np.sqrt(k)[:, None] * ensemble.t)
    assert np.abs(ensemble.columns["x"] - exact).max() <= 1e-9 * 2
    assert len(ensemble) == 6
    assert repr(ensemble) == "<Ensemble of oscillator: 6 members, 26 samples; 6 ok>"


def test_members_are_taken_one_by_one(oscillator):
    members = [{"x": 1, "dot(x)": 0}, {"dot(x)": 3.0, "x": "0"}]
    ensemble = oscillator.ensemble(members, accuracy=1e-10)
    exact = [np.cos(2 * ensemble.t), 1.5 * np.sin(2 * ensemble.t)]
    assert np.abs(ensemble.columns["x"] - exact).max() <= 1e-10 * 1.5
    assert (ensemble.figures["estimated"] <= 1e-10).all()


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_the_file_is_that_of_the_command(tmp_path, jobs):
    words = f"simulate {PENDULUM} --until 1 --with energy --vary theta=[0.1,0.2] --vary l=[1,2]"
    theirs, ours = tmp_path / "theirs.npz", tmp_path / "ours.npz"
    done = CliRunner().invoke(lagrange, [*words.split(), "-o", str(theirs)], obj=Session())
    assert done.exit_code == 0, done.output
    values = {"theta": [0.1, 0.2], "l": [1, 2]}
    ensemble = load(PENDULUM).derive().ensemble(values, until=1, extra=["energy"], jobs=jobs)
    ensemble.write(ours)
    with np.load(theirs) as expected, np.load(ours) as written:
        assert written.files == expected.files
        for name in expected.files:
            assert (written[name] == expected[name]).all() or np.isnan(expected[name]).all(), name


def test_members_that_change_the_equations_are_what_single_runs_are(oscillator):
    ensemble = oscillator.ensemble({"k": [4, 0]}, method="DOP853", rtol=1e-9)
    for number, k in enumerate((4, 0)):
        single = oscillator.simulate(parameters={"k": k}, method="DOP853", rtol=1e-9)
        assert (ensemble.columns["x"][number] == single.columns["x"]).all()


def test_members_that_cannot_be_begun_are_refused_alone(oscillator):
    ensemble = oscillator.ensemble({"m": [1, -1, 0]})
    assert ensemble.status[0] == "ok"
    assert "refused" in ensemble.status
    refused = ensemble.status.index("refused")
    assert np.isnan(ensemble.columns["x"][refused]).all()
    assert ensemble.figures["reason"][refused]


def test_a_second_ensemble_derives_nothing(oscillator, monkeypatch):
    oscillator.ensemble({"m": [1, 2]})
    monkeypatch.setattr("lagrange_cli.mechanics.derive", Mock(side_effect=AssertionError))
    ensemble = oscillator.ensemble({"m": [4, 9]})
    assert ensemble.columns["x"][0, -1] == pytest.approx(math.cos(5), abs=1e-9)


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({}, "there is no member"),
        ([], "there is no member"),
        ({"x": []}, "there is no member"),
        ([{"x": 1}, {"m": 1}], "this member has 'm', unlike the first one"),
        ([{"x": 1, "m": 1}, {"m": 1}], "this member has no 'x', unlike the first one"),
        ({"mm": [1]}, "members mm:1:1: unknown name 'mm'"),
        ({"x": ["1/"]}, "members x:1:3: "),
        ({"x": [1.0, math.inf]}, "members x:1:1: "),
        ({"x": [1.0] * 400, "m": [1.0] * 400}, "more than 100,000 members"),
    ],
)
def test_wrong_members_are_refused_at_their_places(oscillator, members, message):
    with pytest.raises(InputError) as refusal:
        oscillator.ensemble(members)
    assert message in str(refusal.value)


def test_an_interrupt_is_one(oscillator):
    with pytest.raises(KeyboardInterrupt):
        oscillator.ensemble({"x": [1, 2]}, progress=Mock(side_effect=KeyboardInterrupt))
