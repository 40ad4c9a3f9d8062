"""Inputs in positions and constraints: against definitions in t, SciPy's splines, closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from lagrange_cli import load, loads
from lagrange_cli.analysis.analyze import analyze
from lagrange_cli.errors import InputError
from lagrange_cli.report.values.derivation import derivation_report
from tests.mechanics.mechanics_support import derived

HOIST = """
parameters: {m: 2, g: 9.81, l0: {value: 2, positive: true}, s: 0.1}
plane: xz
particles: {load: {mass: m, position: [x, y, z]}}
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta)}
inputs: {l: LENGTH}
potentials: {weight: {gravity: g}}
initial: {x: 0.4, dot(x): 0.3}
near: {theta: 0.2}
simulate: {until: 6, accuracy: 1e-10}
"""
LENGTH = "l0 - s*t + 0.05*sin(3*t)"


def hoist(length: str = LENGTH) -> str:
    return "name: hoist\n" + HOIST.replace("LENGTH", length)


def by_definition() -> str:
    text = hoist().replace(f"inputs: {{l: {LENGTH}}}\n", "")
    return text.replace("definitions: {x", f"definitions: {{l: {LENGTH}, x")


def test_equations_hold_the_input_and_its_rates():
    report = derivation_report(loads(hoist()).derive().equations)
    residual = "l*ddot(theta) + 2*dot(l)*dot(theta) + g*sin(theta)"
    assert report["equations"][0]["residual"] == residual
    assert [u["name"] for u in report["inputs"]] == ["l", "dot(l)", "ddot(l)"]
    assert report["inputs"][1]["expression"] == "3/20*cos(3*t) - s"


def test_a_motion_is_that_of_the_same_definition_in_t():
    """The start, given in Cartesian names, is found with the values of the input."""
    runs = [loads(text).derive().simulate() for text in (hoist(), by_definition())]
    for name in ("theta", "dot(theta)", "x", "dot(x)", "z", "dot(z)"):
        one, other = (np.array(run.columns[name]) for run in runs)
        assert one == pytest.approx(other, abs=1e-9), name
    assert runs[0].columns["x"][0] == pytest.approx(0.4)
    assert runs[0].columns["dot(x)"][0] == pytest.approx(0.3)


CLOSED = """
name: closed
parameters: {m: 1, g: 9.81}
plane: xz
points: {pivot: [PLACE, 0, 0]}
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: {distance: [pivot, bob], equals: LENGTH}}
coordinates: [x, z]
potentials: {weight: {gravity: g}}
initial: {x: 0.6, z: -0.8, dot(x): 0}
near: {z: -1}
simulate: {until: 3, accuracy: 1e-9}
"""


def test_closures_move_with_inputs():
    place, length = "0.1*sin(3*t)", "1 + 0.2*sin(t)"
    plain = CLOSED.replace("PLACE", place).replace("LENGTH", length)
    driven = CLOSED.replace("PLACE", "a").replace("LENGTH", "b")
    driven += f"inputs: {{a: {place}, b: {length}}}\n"
    runs = [loads(text).derive().simulate() for text in (driven, plain)]
    for name in ("x", "z", "dot(x)", "dot(z)"):
        one, other = (np.array(run.columns[name]) for run in runs)
        assert one == pytest.approx(other, abs=1e-9), name


def test_a_driven_direction_in_closed_form():
    """A sledge whose runner turns at the rate w keeps its speed v: a circle of radius v/w."""
    text = """
name: runner
parameters: {m: 1, v: 0.8}
inputs: {angle: 0.5*t}
particles: {p: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
constraints: {runner: dot(x)*sin(angle) = dot(y)*cos(angle)}
initial: {x: 0, y: 0, dot(x): v, dot(y): 0}
simulate: {until: 4, accuracy: 1e-10}
"""
    run = loads(text).derive().simulate()
    assert run.columns["x"][-1] == pytest.approx(1.6 * math.sin(2), abs=1e-9)
    assert run.columns["y"][-1] == pytest.approx(1.6 * (1 - math.cos(2)), abs=1e-9)


TIMES = np.arange(0, 6.01, 0.25)
ROAD = 0.05 * np.sin(2 * TIMES) + 0.02 * np.cos(5.3 * TIMES)
CAR = """
name: car
parameters: {m: 300, M: 40, k: 15000, c: 1000, g: 9.81}
inputs: {w: {file: road.csv, column: height, interpolation: cubic}}
particles:
  wheel: {mass: M, position: [0, 0, w]}
  body: {mass: m, position: [0, 0, z]}
coordinates: [z]
potentials: {weight: {gravity: g}, spring: k*(z - w - 0.5)^2/2}
dissipation: {damper: c*dot(z - w)^2/2}
initial: {z: 0.4, dot(z): 0}
simulate: {until: 6, accuracy: 1e-10}
"""


@pytest.fixture
def car(tmp_path):
    rows = "".join(f"{t},{w!r}\n" for t, w in zip(TIMES.tolist(), ROAD.tolist(), strict=True))
    (tmp_path / "road.csv").write_text("t,height\n" + rows)
    (tmp_path / "car.yaml").write_text(CAR)
    return load(tmp_path / "car.yaml").derive()


def on_road() -> np.ndarray:
    road = CubicSpline(TIMES, ROAD)

    def rates(t, y):
        stretch, rate = y[0] - road(t) - 0.5, y[1] - road(t, 1)
        return [y[1], -9.81 - (15000 * stretch + 1000 * rate) / 300]

    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 0.01}
    return solve_ivp(rates, (0, 6), [0.4, 0], **options).y[:, -1]


def test_a_recorded_road_is_a_spline_with_two_rates(car):
    run = car.simulate()
    road = CubicSpline(TIMES, ROAD)
    times = np.array(run.t)
    assert [run.columns[n][-1] for n in ("z", "dot(z)")] == pytest.approx(on_road(), abs=1e-8)
    assert np.array(run.columns["z_wheel"]) == pytest.approx(road(times), abs=1e-12)
    assert np.array(run.columns["dot(z_wheel)"]) == pytest.approx(road(times, 1), abs=1e-11)


def test_emitted_python_takes_the_rates_as_inputs(car):
    (text,) = car.emit("python").values()
    namespace: dict = {}
    exec(text, namespace)
    assert namespace["INPUTS"] == ("w", "dot(w)", "ddot(w)")
    road = CubicSpline(TIMES, ROAD)
    for t in (0.1, 2.3, 5.99):
        found = namespace["inputs"](t, namespace["INITIAL"])
        assert found == pytest.approx(np.array([road(t, k) for k in range(3)]), abs=1e-10)
    rates = namespace["rhs"](0.0, np.array([0.4, 0.0]), u=lambda t, y, p: np.array([0.1, 2.0, 7.0]))
    assert rates[1] == pytest.approx(-9.81 - (15000 * (0.4 - 0.6) + 1000 * (0 - 2.0)) / 300)


def test_functions_of_python_give_the_rates_beside_the_input():
    derivation = loads(hoist()).derive()
    with pytest.raises(InputError, match="stands where its rates are needed"):
        derivation.simulate(inputs={"l": lambda t: 2.0})
    functions = {
        "l": lambda t: 2 - 0.1 * t + 0.05 * math.sin(3 * t),
        "dot(l)": lambda t: -0.1 + 0.15 * math.cos(3 * t),
        "ddot(l)": lambda t: -0.45 * math.sin(3 * t),
    }
    given = derivation.simulate(inputs=functions, accuracy=1e-8, until=2)
    scene = derivation.simulate(accuracy=1e-8, until=2)
    assert given.columns["theta"][-1] == pytest.approx(scene.columns["theta"][-1], abs=1e-8)


def test_a_value_beside_the_scene_replaces_an_input():
    """``-p l=...`` and ``--input l=...`` set an input as they set a parameter."""
    text = hoist().replace("{x: 0.4, dot(x): 0.3}", "{theta: 0.2, dot(theta): 0}")
    run = loads(text, parameters={"l": "2 + 0*t"}).derive().simulate(until=1)
    assert np.array(run.columns["dot(z)"]) == pytest.approx(
        2 * np.sin(run.columns["theta"]) * run.columns["dot(theta)"], abs=1e-9
    )
    with pytest.raises(InputError, match="unknown name 'q' in input 'l'"):
        loads(hoist(), parameters={"l": "q"})


def test_linear_systems_hold_inputs_at_rest_and_have_columns_for_rates():
    result = analyze(derived(hoist("2").removeprefix("name: hoist\n")), at={"theta": "0"})
    space = result.linearization.state_space
    assert space.inputs == ("l", "dot(l)", "ddot(l)")
    assert np.array(space.a) == pytest.approx(np.array([[0, 1], [-9.81 / 2, 0]]))


@pytest.mark.parametrize("length", ["abs(t - 1)", "heaviside(t)", "piecewise([1, t < 1], 2)"])
def test_lengths_that_jump_are_refused(length):
    with pytest.raises(InputError, match="the input 'l' cannot stand in definition 'x'"):
        loads(hoist(f'"{length}"'))
