"""Outputs of a scene as the commands show them."""

from __future__ import annotations

import json

import pytest

from tests.cli.terminal import lagrange, succeed

THROWN = """
parameters: {g: 10.0, v0: 5.0}
particles:
  ball: {mass: 2, position: [x, y, z]}
constraints: {line: [x = 0, y = 0]}
potentials: {weight: {gravity: g}}
outputs: {turn: 3*t, power: dot(z)^2}
initial: {z: 0, dot(z): v0}
simulate: {until: 1, samples: 3}
"""


def test_derive():
    assert "Outputs\n  turn = 3*t\n  power = dot(z)^2\n" in succeed(
        "derive", "-", "--ascii", input=THROWN
    )
    report = json.loads(succeed("derive", "-", "--format", "json", input=THROWN))
    assert [output["name"] for output in report["outputs"]] == ["turn", "power"]


def test_state_of_simulate():
    state = json.loads(succeed("simulate", "-", "--json", input=THROWN))["state"]
    assert list(state)[-2:] == ["turn", "power"]
    assert state["power"] == pytest.approx(25, rel=1e-12)
    rows = [line.split() for line in succeed("simulate", "-", input=THROWN).splitlines()]
    assert ["turn", "3"] in rows
    assert ["power", "25"] in rows


def test_columns_of_files(tmp_path):
    succeed("simulate", "-", "-o", "run.csv", input=THROWN, cwd=tmp_path)
    header, first, *_ = (tmp_path / "run.csv").read_text().splitlines()
    assert header.endswith(",turn,power")
    assert first.endswith(",0,25")


def test_a_problem_is_shown_where_it_is():
    done = lagrange("derive", "-", input=THROWN.replace("3*t", "3*tt"))
    assert done.returncode == 2
    assert done.stderr.startswith("<stdin>:7:19: unknown name 'tt' in output 'turn'")
