"""Constraint forces at the samples, in each formulation and with each way to evaluate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.mechanics import derive
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.scene import read_file, read_text
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.results.columns import constraint_force_columns
from lagrange_cli.simulate.system.functions import interpreted, right_hand_side

SYSTEMS = Path(__file__).parents[3] / "systems"

PENDULUM = """
name: pendulum
parameters: {m: 1.4, l: {value: 0.8, positive: true}, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: g}}
simulate: {until: 2, samples: 9, accuracy: 1e-10}
"""
ANGLE = """
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta)}
initial: {theta: 0.3, dot(theta): 9}
"""
CARTESIAN = "initial: {x: l*sin(0.3), z: -l*cos(0.3), dot(x): 9*l*cos(0.3), dot(z): 9*l*sin(0.3)}\n"

PUSHED = """
name: pushed
parameters: {m: 2, g: 9.81, A: 3}
inputs: {F: A*sin(t)}
particles: {block: {mass: m, position: [x, y, z]}}
constraints: {floor: z = 0, rail: y = 0}
coordinates: [x]
potentials: {weight: m*g*z}
forces: {push: {on: block, force: [F, F, 0]}}
initial: {x: 0, dot(x): 0}
simulate: {until: 1, samples: 5}
"""


def moved(text):
    return simulate(derive(read_text(text), forces=True))


@pytest.mark.slow
def test_angle_and_cartesian_coordinates_give_the_same_columns():
    angle, cartesian = moved(PENDULUM + ANGLE), moved(PENDULUM + CARTESIAN)
    assert (angle.formulation, cartesian.formulation) == ("minimal", "multiplier")
    minimal, kept = angle.table(["forces"]), cartesian.table(["forces"])
    names = [f"force_{axis}(bob)" for axis in "xyz"] + ["lambda_rod", "lambda_plane"]
    for name in names:
        size = np.abs(minimal["lambda_rod"]).max()
        assert np.abs(minimal[name] - kept[name]).max() < 1e-7 * size
    tension = 1.4 * (9.81 * -minimal["z"] / 0.8 + 0.8 * minimal["dot(theta)"] ** 2)
    assert np.abs(minimal["lambda_rod"] + tension / 1.6).max() < 1e-11 * tension.max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "heavy"),
    [
        ("chains/pendulum_chain", ["p[1]", "p[2]", "p[3]", "p[4]"]),
        ("lecture/masses_through_hole", ["weight"]),
        ("pendulums/double_pendulum", ["upper", "lower"]),
    ],
)
def test_newtons_law_at_the_samples(path, heavy):
    """m z̈ + m g = f, with z̈ from differences of the velocities at close samples."""
    equations = derive(read_file(str(SYSTEMS / f"{path}.yaml")), forces=True)
    run = simulate(equations, until=0.02, samples=41, method="DOP853", rtol=1e-13)
    table = run.table(["forces"])
    values = {p.symbol: p.value for p in equations.system.parameters}
    step = table["t"][1] - table["t"][0]
    for body in (p for p in equations.system.particles if p.name in heavy):
        mass = float(body.mass.subs(values))
        rates = table[f"dot({body.components[2]})"]
        # Central differences of fourth order.
        found = (8 * (rates[3:-1] - rates[1:-3]) - (rates[4:] - rates[:-4])) / (12 * step)
        force = table[f"force_z({body.name})"][2:-2]
        assert np.abs(mass * (found + 9.81) - force).max() < 1e-7 * np.abs(force).max()


@pytest.mark.slow
def test_interpreted_gives_the_same():
    model = model_of(derive(read_text(PENDULUM + ANGLE), forces=True))
    compiled = simulate(model).table(["forces"])
    other = simulate(model, functions=interpreted(model, "a test")).table(["forces"])
    for name in model.forces:
        assert np.abs(compiled[name] - other[name]).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("path", ["chains/chain_of_rods", "constraints/slider_crank"])
def test_machine_code_gives_what_python_gives_at_each_state(path):
    model = model_of(derive(read_file(str(SYSTEMS / f"{path}.yaml")), forces=True))
    functions = right_hand_side(model)
    assert functions.native
    assert functions.forces is not None
    generator = np.random.default_rng(3)
    states = np.array(model.initial) + 0.1 * generator.uniform(-1, 1, (5, len(model.initial)))
    found = constraint_force_columns(model, functions, np.arange(5.0), states)
    python = replace(functions, forces=None)
    expected = constraint_force_columns(model, python, np.arange(5.0), states)
    assert len(found) == len(model.forces)
    assert any(np.abs(column).max() > 0 for column in found.values())
    for name, column in expected.items():
        np.testing.assert_allclose(found[name], column, rtol=1e-12, atol=1e-12)


def test_forces_of_inputs():
    table = moved(PUSHED).table(["forces"])
    assert table["force_y(block)"] == pytest.approx(-3 * np.sin(table["t"]), abs=1e-14)
    assert table["lambda_rail"] == pytest.approx(-3 * np.sin(table["t"]), abs=1e-14)
    assert table["force_z(block)"] == pytest.approx(2 * 9.81, rel=1e-14)
    assert np.abs(table["force_x(block)"]).max() < 1e-14


@pytest.mark.slow
def test_models_with_forces_are_kept_as_json():
    model = model_of(derive(read_text(PENDULUM + ANGLE), forces=True))
    assert Model.from_json(model.to_json()) == model
    plain = model_of(derive(read_text(PENDULUM + ANGLE)))
    assert plain.forces == ()
    assert "forces" not in plain.code.functions


@pytest.mark.slow
@pytest.mark.parametrize("clash", ["outputs: {lambda_rod: x}", "definitions: {lambda_rod: 2*x}"])
def test_multipliers_have_the_name_that_equations_give_them(clash):
    scene = f"""
plane: xz
points: {{pivot: [0, 0, 0]}}
particles: {{bob: {{mass: 2, position: [x, y, z]}}}}
constraints: {{rod: {{distance: [pivot, bob], equals: 1}}}}
coordinates: [x, z]
potentials: {{weight: {{gravity: 9.81}}}}
{clash}
initial: {{x: 0.6, z: -0.8}}
simulate: {{until: 0.5, samples: 3, accuracy: 1e-8}}
"""
    equations = derive(read_text(scene), forces=True)
    (closure,) = equations.system.closures
    assert closure.multiplier.name == "lambda_rod_"
    report = derivation_report(equations)
    named = [entry["name"] for entry in report["constraint_multipliers"]]
    assert "lambda_rod_" in named
    assert any("lambda_rod_" in entry["residual"] for entry in report["equations"])
    table = simulate(equations).table(["forces"])
    # λ times the gradient of x² + z² − 1, which is 2 long, is the pull of a rod at rest.
    assert 2 * table["lambda_rod_"][0] == pytest.approx(-2 * 9.81 * 0.8, rel=1e-9)
