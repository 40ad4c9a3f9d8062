"""The outputs of a scene in reports, documents and emitted code."""

from __future__ import annotations

import math
import types

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.report.writers.latex.document import latex_document
from tests.emit.emitted_c import Compiled

PENDULUM = """
name: pendulum
parameters: {m: 1.5, l: 2.0, g: 9.81, k: 3.5}
plane: xz
particles:
  bob: {mass: m, position: [x, y, z]}
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta), E: m*l^2*dot(theta)^2/2}
potentials: {weight: m*g*z}
outputs:
  T: 2*E
  height[i=1..2]: i*(z + l)
  driven: k*t + max(dot(x), 0)
"""

#: The same through another formulation: the rod stays beside x and z.
CARTESIAN = """
name: kept
parameters: {l: 2.0}
plane: xz
particles:
  bob: {mass: 1, position: [x, y, z]}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: 9.81}}
outputs: {turn: "atan2(x, -z)", moment: x*dot(z) - z*dot(x)}
initial: {x: 2, z: 0}
"""


@pytest.fixture(scope="module")
def pendulum():
    return loads(PENDULUM).derive().equations


def expected(t, theta, v):
    """T, heights and the driven one, by hand."""
    height = 2 * (1 - math.cos(theta))
    speed = 2 * math.cos(theta) * v
    return [1.5 * 4 * v * v, height, 2 * height, 3.5 * t + max(speed, 0)]


STATES = [(0.0, 0.3, 0.0), (1.5, -0.7, 2.0), (2.0, 2.5, -0.4), (3.0, 1.0, -1.0)]


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("real", ["float", "double", "long-double"])
def test_c(pendulum, tmp_path, real):
    compiled = Compiled(pendulum, tmp_path, real)
    assert compiled.macro("OUTPUTS") == 4
    tolerance = 1e-5 if real == "float" else 1e-14
    for t, *y in STATES:
        status, out = compiled("outputs", t, y, compiled.defaults, 4)
        assert status == 0
        assert out.astype(float) == pytest.approx(expected(t, *y), rel=tolerance, abs=tolerance)


def python_module(equations):
    (source,) = EMITTERS["python"].emit(equations, {}).values()
    module = types.ModuleType("emitted")
    exec(compile(source, "emitted", "exec"), module.__dict__)
    return module


def test_python(pendulum):
    module = python_module(pendulum)
    assert module.OUTPUTS == ("T", "height[1]", "height[2]", "driven")
    for t, *y in STATES:
        assert module.outputs(t, np.array(y)) == pytest.approx(
            expected(t, *y), rel=1e-14, abs=1e-14
        )


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_does_not_exist_is_nan_or_refused(tmp_path):
    text = PENDULUM.split("outputs:")[0] + "outputs: {fine: theta, root: sqrt(theta)}\n"
    equations = loads(text).derive().equations
    assert np.isnan(python_module(equations).outputs(0.0, np.array([-1.0, 0.0]))).any()
    compiled = Compiled(equations, tmp_path)
    assert compiled("outputs", 0.0, [-1.0, 0.0], compiled.defaults, 2)[0] == 2
    assert compiled("outputs", 0.0, [4.0, 0.0], compiled.defaults, 2)[0] == 0


@pytest.mark.slow
@pytest.mark.compiler
def test_with_closures(tmp_path):
    equations = loads(CARTESIAN).derive().equations
    assert equations.system.formulation == "multiplier"
    theta, v = 0.8, -1.25
    x, z = 2 * math.sin(theta), -2 * math.cos(theta)
    state = [x, z, -z * v, x * v]
    status, out = Compiled(equations, tmp_path)("outputs", 0.0, state, [2.0], 2)
    assert status == 0
    assert out == pytest.approx([theta, 4 * v], rel=1e-14)
    assert python_module(equations).outputs(0.0, np.array(state)) == pytest.approx(out, rel=1e-14)


def test_without_outputs_nothing_is_said_of_them(tmp_path):
    equations = loads(PENDULUM.split("outputs:")[0]).derive().equations
    code = EMITTERS["c"].emit(equations, {"real": "double", "main": False})
    texts = [*code.values(), *EMITTERS["python"].emit(equations, {}).values()]
    texts += [derivation_text(equations), latex_document(equations)]
    assert not any("outputs" in text.lower() for text in texts)
    assert derivation_report(equations)["outputs"] == []


def test_reports(pendulum):
    assert derivation_report(pendulum)["outputs"] == [
        {"name": "T", "expression": "m*l^2*dot(theta)^2"},
        {"name": "height[1]", "expression": "l - l*cos(theta)"},
        {"name": "height[2]", "expression": "2*l - 2*l*cos(theta)"},
        {"name": "driven", "expression": "max(0, l*dot(theta)*cos(theta)) + k*t"},
    ]
    text = derivation_text(pendulum, ascii=True)
    assert "Outputs\n  T = m*l^2*dot(theta)^2\n" in text
    assert "T_kin = " in text  # the kinetic energy leaves the name to the scene
    assert r"\section*{Outputs}" in latex_document(pendulum)


@pytest.mark.slow
@pytest.mark.compiler
def test_names_of_outputs_are_only_comments(tmp_path):
    text = PENDULUM.split("outputs:")[0] + "outputs: {int: theta, rhs: 2*theta}\n"
    equations = loads(text).derive().equations
    compiled = Compiled(equations, tmp_path)
    assert compiled("outputs", 0.0, [0.5, 0.0], compiled.defaults, 2)[1].tolist() == [0.5, 1.0]
