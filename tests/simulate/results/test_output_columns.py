"""Outputs as columns of trajectories, compiled and interpreted."""

from __future__ import annotations

import csv
import io
import json
import math

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.compiling import compiled_or_skip

#: A body thrown upwards; its outputs in closed form below.
THROWN = """
name: thrown
parameters: {m: 2.0, g: 10.0, v0: 5.0, k: 3.0, unit: 4.0}
particles:
  ball: {mass: m, position: [x, y, z]}
constraints: {line: [x = 0, y = 0]}
potentials: {weight: m*g*z}
outputs:
  turn: k*t
  power: m*dot(z)^2/2
  above: max(z, 1) - 1
  fall: dot(z)/unit
initial: {z: 0, dot(z): v0}
simulate: {until: 1, samples: 21}
"""


@pytest.fixture(scope="module")
def thrown():
    return model_of(loads(THROWN).derive().equations)


def closed_forms(t):
    z, v = 5 * t - 5 * t**2, 5 - 10 * t
    return {"turn": 3 * t, "power": v**2, "above": np.maximum(z, 1) - 1, "fall": v / 4}


def assert_closed_forms(trajectory):
    for name, values in closed_forms(trajectory.t).items():
        assert trajectory.columns[name] == pytest.approx(values, abs=1e-12), name


def test_compiled(thrown):
    assert_closed_forms(simulate(thrown, functions=compiled_or_skip(thrown)))


def test_interpreted(thrown):
    assert_closed_forms(simulate(thrown, functions=interpreted(thrown, "a test")))


def test_a_model_of_before_has_them(thrown):
    again = Model.from_json(json.loads(json.dumps(thrown.to_json())))
    assert again == thrown
    assert_closed_forms(simulate(again))


def test_files(thrown):
    run = simulate(thrown)
    header, *rows = csv.reader(io.StringIO(run.csv(["energy"])))
    assert header[-5:] == ["turn", "power", "above", "fall", "energy"]
    assert float(rows[-1][-5]) == run.columns["turn"][-1]
    archive = np.load(io.BytesIO(run.npz()))
    assert archive["power"].tolist() == run.columns["power"].tolist()


def test_parameters_of_outputs_are_used_and_needed():
    equations = loads(THROWN.replace("unit: 4.0", "unit: {}")).derive().equations
    assert equations.derivation.facts.unused_parameters == ()
    with pytest.raises(InputError, match="no value for 'unit'"):
        simulate(equations)


def test_what_does_not_exist_is_nan():
    text = THROWN.replace("turn: k*t", "turn: log(t - 1/2)*k")
    run = simulate(loads(text).derive().equations)
    defined = run.t > 0.5 + 1e-12
    assert (np.isnan(run.columns["turn"]) == ~defined).all()
    assert run.columns["turn"][-1] == pytest.approx(3 * math.log(0.5))
    assert run.status == "ok"


def test_an_output_called_energy_keeps_its_name():
    run = simulate(loads(THROWN.replace("power:", "energy:")).derive().equations)
    assert run.columns["energy"][0] == pytest.approx(25)
    with pytest.raises(InputError, match="name 'energy' of its own"):
        run.table(["energy"])
