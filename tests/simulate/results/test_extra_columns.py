"""Columns beyond the state, from Python and from the command line."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.cli.commands.simulate import FILE_COLUMNS as OFFERED
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.results.trajectory import EXTRA_COLUMNS
from lagrange_cli.simulate.system.functions import interpreted

ATWOOD = """
name: atwood
parameters: {m1: 2.0, m2: 1.0, l: 3.0, g: 9.81}
particles:
  left: {mass: m1, position: [x, 0, z_left]}
  right: {mass: m2, position: [5, 0, z_right]}
constraints: {rope: z_left + z_right = -l, wall: x = 1}
coordinates: [s]
definitions: {z_left: -s}
potentials: {weight: m1*g*z_left + m2*g*z_right}
initial: {s: 1.0, dot(s): 0.0}
simulate: {until: 1, samples: 11}
"""


@pytest.fixture(scope="module")
def atwood():
    return model_of(loads(ATWOOD).derive().equations)


@pytest.fixture(scope="module")
def run(atwood):
    return simulate(atwood)


def test_the_command_offers_what_there_is():
    """Momenta are outputs of the model by then, not columns that a trajectory adds."""
    assert {*EXTRA_COLUMNS, "momenta"} == set(OFFERED)


def test_every_component_of_every_particle_is_there(run):
    table, s = run.table(["positions"]), run.columns["s"]
    assert list(table) == list(run.table())
    expected = {"x": 1.0, "y_left": 0.0, "z_left": -s, "x_right": 5.0, "z_right": s - 3.0}
    for name, values in expected.items():
        assert table[name] == pytest.approx(np.broadcast_to(values, s.shape), abs=1e-14)


def test_interpreted_gives_the_same(atwood, run):
    other = simulate(atwood, functions=interpreted(atwood, "a test"))
    mine, theirs = run.table(EXTRA_COLUMNS[:2]), other.table(EXTRA_COLUMNS[:2])
    assert list(mine) == list(theirs)
    assert max(np.abs(mine[name] - theirs[name]).max() for name in mine) < 1e-6


def test_columns_together(run):
    rows = list(csv.reader(io.StringIO(run.csv(["positions", "energy"]))))
    assert rows[0][0] == "t"
    assert "energy" in rows[0]
    assert len(set(rows[0])) == len(rows[0])
    assert len(rows) == 12


def test_forces_that_were_not_derived(run):
    assert run.constraint_drift is None
    assert run.multipliers == {}
    with pytest.raises(InputError, match="there are no constraint forces of 'atwood'"):
        run.table(["forces"])
