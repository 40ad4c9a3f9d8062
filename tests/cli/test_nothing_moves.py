"""A scene without degrees of freedom: derived and written as any other, not simulated."""

from __future__ import annotations

import json

import numpy as np
import pytest

from lagrange_cli import load
from lagrange_cli.program.program import build_program
from tests.cli.terminal import lagrange, succeed
from tests.program.interpreted import interpreted

SCENE = """\
name: pinned
parameters: {m: 2, g: 10}
particles:
  p: {mass: m, position: [x, y, z]}
constraints: {a: x = 1, b: y = 2*t, c: z = 3}
coordinates: []
potentials: {weight: {gravity: g}}
simulate: {until: 1}
expect: {dof: 0}
"""


@pytest.fixture
def scene(tmp_path) -> str:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return str(path)


def test_it_is_derived_and_checked(scene):
    assert json.loads(succeed("derive", "--json", scene))["dof"] == 0
    succeed("check", scene)


def test_its_module_in_python(scene):
    module = {"__name__": "emitted"}
    exec(compile(succeed("emit", "--to", "python", scene), "<emitted>", "exec"), module)
    none = np.zeros(0)
    assert module["rhs"](0.0, none).shape == (0,)
    assert module["mass_matrix"](0.0, none).shape == (0, 0)
    assert module["forcing"](0.0, none).shape == (0,)
    assert module["positions"](0.5, none).tolist() == [1.0, 1.0, 3.0]
    assert module["velocities"](0.5, none).tolist() == [0.0, 2.0, 0.0]
    # T2 - T0 + V of a given motion: m g z - m dot(y)^2/2.
    assert module["energy"](0.5, none) == 2 * 10 * 3 - 2 * 2**2 / 2


def test_its_evaluators_for_simulation(scene):
    program = build_program(load(scene).derive().equations, ["acceleration"])
    rhs = interpreted({"rhs": program})["rhs"]
    assert rhs(0.0, np.empty(0), (2.0, 10.0)).shape == (0,)


@pytest.mark.parametrize("words", [(), ("--method", "RK4", "--step", "0.1"), ("--json",)])
def test_it_is_not_simulated(scene, words):
    for _ in range(2):
        done = lagrange("simulate", scene, *words)
        assert (done.returncode, done.stdout) == (2, "")
        assert "nothing can move: 'pinned' has no degrees of freedom" in done.stderr
        assert "internal error" not in done.stderr
