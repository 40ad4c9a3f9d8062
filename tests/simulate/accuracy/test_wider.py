"""Arithmetic wider than double: more digits where a machine has them, honesty where not."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq

from lagrange_cli import loads
from lagrange_cli.cache import open_cache
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, EXTENDED, QUADRUPLE
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.request import SimulationOptions, resolve
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Run
from lagrange_cli.simulate.simulation import problem_of, simulate
from lagrange_cli.simulate.system import functions as right_hand_side
from lagrange_cli.simulate.system.rounding import rounding_factors
from tests.simulate.compiling import compiled_or_skip

SHIPPED = Path(__file__).parents[3] / "systems/pendulums/double_pendulum.yaml"

#: Shipped double pendulum with other masses of the lower bob: time → theta1, theta2 and
#: their rates. Taylor series of its equations of motion, solved for the accelerations by
#: hand, in numbers of 113 binary digits with tolerance 2^-104 (heyoka 7).
REFERENCES = {
    "1e9": {
        1.0: (-0.21725803263861568, -0.64834796869387091, -1.8430372636197281, -4.7272496250253392),
        2.0: (-2.2222144529292321, -0.83772035817470821, 1.1579324851711733, 2.3768766617959206),
        5.0: (-2.1238760789500072, -0.57461323118239394, 3.4895623367971882, 0.80123517953260949),
        10.0: (-5.2400872565041158, -8.0772836105485814, -11.513473339378376, -11.619562437002844),
    },
    "1e-9": {
        1.0: (-1.3662900013376301, -2.6120678727293132, -1.6114093592009413, -8.5100344239600439),
        2.0: (0.97236588509723762, -10.482173175352796, 3.1088569859970647, -8.1880974409945450),
        5.0: (0.95028078465408427, -32.915965965856024, -3.1654820764642544, -4.8758664811913732),
        10.0: (-0.39280594745788197, -30.260397055252955, -4.0911917663442037, -0.0099881251234200),
    },
}

OSCILLATOR = """
name: oscillator
parameters: {m: 1, k: 4}
particles: {body: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
initial: {x: 1, dot(x): 0}
simulate: {until: 50, samples: 101}
"""


ORBIT = """
name: kepler
parameters: {m: 1, e: 0.9999}
particles: {body: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {gravity: -m/sqrt(x^2 + y^2)}
initial: {x: 1 - e, y: 0, dot(x): 0, dot(y): sqrt((1 + e)/(1 - e))}
simulate: {until: 2*pi, samples: 51}
"""


def double_pendulum(lower_mass):
    text = SHIPPED.read_text(encoding="utf-8")
    changed = re.sub(r"m2: \{value: 1,", f"m2: {{value: {lower_mass},", text)
    assert changed != text
    return model_of(loads(changed[: changed.index("expect:")]).derive().equations)


def errors(trajectory, reference):
    """The largest error over its scale among the times of a reference that are kept."""
    names = ["theta1", "theta2", "dot(theta1)", "dot(theta2)"]
    scales = [trajectory.scales[name] for name in names]
    found = [0.0]
    for time, exact in reference.items():
        for k in np.flatnonzero(np.isclose(trajectory.t, time, rtol=0, atol=1e-12)):
            state = [trajectory.columns[name][k] for name in names]
            found.append(float(np.max(np.abs(np.subtract(state, exact)) / scales)))
    return max(found)


def with_wider(model):
    """The compiled functions, on a machine whose long double is wider than double."""
    functions = compiled_or_skip(model)
    if EXTENDED.epsilon >= DOUBLE.epsilon:
        pytest.skip("this machine has no arithmetic wider than double")
    return functions


@pytest.mark.slow
@pytest.mark.parametrize("lower_mass", REFERENCES)
@pytest.mark.parametrize("accuracy", [1e-8, 1e-9])
def test_double_pendulum_of_extreme_masses(lower_mass, accuracy):
    model = double_pendulum(lower_mass)
    found = simulate(model, accuracy=accuracy, functions=with_wider(model))
    assert found.status == "ok"
    assert found.holds_until == 10.0
    assert errors(found, REFERENCES[lower_mass]) <= found.estimated < accuracy
    assert (found.implementation != "compiled C") == (lower_mass == "1e9")


@pytest.mark.slow
def test_without_wider_arithmetic_the_promise_ends_early(monkeypatch):
    monkeypatch.setattr(right_hand_side, "WIDER_TYPES", ())
    model = double_pendulum("1e9")
    found = simulate(model, accuracy=1e-8, functions=compiled_or_skip(model))
    assert found.status == "accuracy_not_reached"
    assert 1.0 <= found.holds_until < 10.0
    assert errors(found, REFERENCES["1e9"]) < 1e-8
    assert found.implementation == "compiled C"


@pytest.mark.slow
def test_a_start_that_is_not_known_to_the_last_digit_still_ends_a_promise():
    """Wider arithmetic does not know more of such numbers than doubles hold."""
    model = replace(double_pendulum("1.0"), initial_decimals=())
    found = simulate(model, accuracy=1e-9, until=35.0, functions=with_wider(model))
    assert found.status == "accuracy_not_reached"
    assert 10.0 < found.holds_until < 30.0


@pytest.mark.slow
def test_every_digit_of_doubles_is_kept():
    model = model_of(loads(OSCILLATOR).derive().equations)
    wider = with_wider(model).wider()
    times = np.linspace(0.0, 50.0, 101)
    problem = InitialValueProblem(wider.rhs, np.array([1.0, 0.0]), times, ("length",))
    control = Control(np.zeros(2), np.full(2, 1e-18), 1e-4, 50.0)
    run = Run(INTEGRATORS["DOP853"], problem, control)
    while run.go(len(times)):
        pass
    exact = np.column_stack([np.cos(2 * times), -2 * np.sin(2 * times)])
    assert np.abs(run.states - exact).max() < 4e-16


def test_disturbed_in_its_own_last_place():
    factors = rounding_factors(64, 1, EXTENDED)
    epsilon = np.finfo(np.longdouble).eps
    assert set(factors - 1) == {epsilon, -np.finfo(np.longdouble).epsneg}
    model = model_of(loads(OSCILLATOR).derive().equations)
    first, second = with_wider(model).wider().perturbed
    assert first.parameters[:2].tolist() != [1.0, 4.0]
    assert np.abs(np.asarray(first.parameters[2:]) - 1).max() <= epsilon
    assert (first.parameters != second.parameters).any()


@pytest.mark.slow
@pytest.mark.compiler
def test_a_compiler_whose_long_double_is_a_double(monkeypatch, unoptimizing_compiler):
    """Its objects would read NumPy's numbers wrongly: they are not used."""
    gcc = shutil.which("gcc")
    model = model_of(loads(OSCILLATOR).derive().equations)
    with_wider(model)
    if gcc is None or os.uname().machine != "x86_64":
        pytest.skip("gcc for x86-64 is not here: it has -mlong-double-64")
    monkeypatch.setenv("CC", f"{unoptimizing_compiler} -mlong-double-64")
    functions = right_hand_side.compiled(model, open_cache())
    wider = functions.wider()
    assert wider is None or wider.real is QUADRUPLE


@pytest.mark.slow
@pytest.mark.compiler
def test_wider_sources_are_strict_c99(tmp_path):
    gcc = shutil.which("gcc")
    if gcc is None:
        assert os.environ.get("CI") != "true"
        pytest.skip("gcc was not found")
    model = double_pendulum("2")
    system, integrators = kernels.wide_files(model.code.c, "")
    sources = {**integrators, **system}
    for name, text in sources.items():
        (tmp_path / name).write_text(text, encoding="ascii")
    strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-Wdouble-promotion"]
    names = [name for name in sources if name.endswith(".c")]
    options = kernels.options_of(EXTENDED)
    subprocess.run([gcc, *strict, *options, "-c", *names], cwd=tmp_path, check=True)
    assert "gauss.c" not in sources


def kepler(eccentricity, times):
    """Positions on the ellipse, by Kepler's equation in 50 digits."""
    with mpmath.workdps(50):
        e, places = mpmath.mpf(eccentricity), []
        for t in times:
            anomaly = mpmath.findroot(
                lambda x, t=t: x - e * mpmath.sin(x) - mpmath.mpf(float(t)),
                (0, 7),
                solver="anderson",
            )
            place = mpmath.cos(anomaly) - e, mpmath.sqrt(1 - e * e) * mpmath.sin(anomaly)
            places.append([float(x) for x in place])
        return np.array(places)


@pytest.mark.slow
def test_an_orbit_that_only_quadruple_holds():
    """The start as it is written decides where it ends: its doubles are another orbit."""
    model = model_of(loads(ORBIT).derive().equations)
    functions = with_wider(model)
    trajectory = simulate(model, accuracy=1e-9, functions=functions)
    if functions.wider().wider() is None:
        pytest.skip("this compiler has no _Float128")
    assert trajectory.implementation == "compiled C, quadruple"
    assert trajectory.status == "ok"
    exact = kepler("0.9999", trajectory.t)
    for name, column in zip("xy", exact.T, strict=True):
        off = np.abs(trajectory.columns[name] - column).max() / trajectory.scales[name]
        assert off <= trajectory.estimated < 1e-9
    rounded = replace(model, initial_decimals=())
    assert simulate(rounded, accuracy=1e-9, functions=functions).status == "accuracy_not_reached"


def test_numbers_are_what_the_scene_wrote():
    text = """
name: oscillator
parameters: {m: 1/3, k: 4*pi}
particles: {body: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
initial: {x: 0.1, dot(x): k/7}
"""
    model = model_of(
        loads(text, parameters={"m": "1/7"}, initial={"x": "sqrt(2)"}).derive().equations
    )
    model = Model.from_json(json.loads(json.dumps(model.to_json())))
    with mpmath.workdps(60):
        exact = {"m": mpmath.mpf(1) / 7, "k": 4 * mpmath.pi}
        start = mpmath.sqrt(2), exact["k"] / 7
        written = [*exact.values(), *start]
        numbers = [*model.exact_numbers, *model.exact_initial]
        for number, value in zip(numbers, written, strict=True):
            assert abs(mpmath.mpf(number.numerator) / number.denominator - value) < 1e-38 * value
    others = replace(model.parameters[0], value=0.25), model.parameters[1]
    assert replace(model, parameters=others).exact_numbers[0] is None


def test_a_run_from_another_state_knows_its_doubles_alone():
    model = model_of(loads(OSCILLATOR.replace("x: 1,", "x: 0.1,")).derive().equations)
    functions, request = with_wider(model), resolve(model, SimulationOptions())
    assert problem_of(model, request, functions).wider().exact == (Fraction(1, 10), 0)
    other = replace(request, initial=np.array([0.2, 0.0]))
    assert problem_of(model, other, functions).wider().exact == (None, 0)


def test_constants_of_equations_are_what_the_scene_wrote():
    text = OSCILLATOR.replace("k*x^2/2", "k*x^2/2 + cos(pi*x)/3")
    code = model_of(loads(text).derive().equations).code
    assert "R(1.04719755119659774615421446109316763)" in code.c


@pytest.mark.slow
def test_a_perihelion_too_brief_for_doubles() -> None:
    """Steps fall below the last place of t at the first return to it; no singularity is there."""
    orbit = loads(
        "coordinates: [x, y]\nparameters: {e: 0.999999}\n"
        "kinetic: {T: (dot(x)^2 + dot(y)^2)/2}\npotentials: {v: -1/sqrt(x^2 + y^2)}\n"
        "initial: {x: 1 - e, y: 0, dot(x): 0, dot(y): sqrt((1 + e)/(1 - e))}\n"
        "simulate: {until: 7, accuracy: 1e-6, samples: 3}\n"
    )
    found = orbit.derive().simulate()
    assert found.status == "ok"
    eccentricity, anomaly = 0.999999, 7.0
    place = brentq(lambda a: a - eccentricity * math.sin(a) - anomaly, 6, 10, xtol=1e-15)
    assert found.state["x"] == pytest.approx(math.cos(place) - eccentricity, abs=1e-5)
