"""Tables over a grid in emitted code and in motions, against products of SciPy's cubics."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator, RegularGridInterpolator

from lagrange_cli import load
from lagrange_cli.api import Derivation
from tests.emit.emitted_c import Compiled

Array = NDArray[np.float64]
Torque = Callable[[float, float], float]

SPEEDS = np.array([0.0, 100, 250, 300, 450, 600])
THROTTLES = np.array([0.0, 0.25, 0.5, 1])
TORQUES = np.array(
    [
        [-5.0, 40, 70, 90],
        [-12, 60, 110, 140],
        [-22, 55, 125, 180],
        [-25, 52, 128, 190],
        [-34, 30, 105, 165],
        [-45, -20, 10, 40],
    ]
)

SCENE = """
name: engine
parameters: {J: 2, c: 0.1}
functions:
  T: {of: [dot(phi), throttle], file: torque.csv, column: torque, interpolation: WAY}
inputs: {throttle: 1/2 + 2*sin(3*t/2)/5}
coordinates: [phi]
kinetic: {wheel: J*dot(phi)^2/2}
forces:
  engine: {on: phi, force: 'T(dot(phi), throttle)'}
  load: {on: phi, force: -c*dot(phi)}
initial: {phi: 0, dot(phi): 40}
"""


def engine(folder: Path, way: str) -> Derivation:
    rows = [
        f"{w},{u},{TORQUES[i, j]}\n" for i, w in enumerate(SPEEDS) for j, u in enumerate(THROTTLES)
    ]
    (folder / "torque.csv").write_text("speed,throttle,torque\n" + "".join(rows))
    (folder / "engine.yaml").write_text(SCENE.replace("WAY", way))
    return load(folder / "engine.yaml").derive()


def at_a_throttle(folder: Path, way: str) -> Derivation:
    """The engine with a throttle that is a parameter."""
    engine(folder, way)
    text = (folder / "engine.yaml").read_text().replace("c: 0.1", "c: 0.1, throttle: 1")
    kept = [line for line in text.splitlines() if not line.startswith("inputs")]
    (folder / "engine.yaml").write_text("\n".join(kept))
    return load(folder / "engine.yaml").derive()


ALONG_SPEED = PchipInterpolator(SPEEDS, TORQUES)
SLOPES = PchipInterpolator(THROTTLES, TORQUES, axis=1).derivative()(THROTTLES)
ACROSS = CubicHermiteSpline(SPEEDS, SLOPES, np.zeros_like(SLOPES))


def product_of_cubics(speed: float, throttle: float) -> float:
    """Hermite's cubics along both arguments, with the slopes of SciPy's along lines of the grid."""
    return float(CubicHermiteSpline(THROTTLES, ALONG_SPEED(speed), ACROSS(speed))(throttle))


def product_of_lines(speed: float, throttle: float) -> float:
    return float(RegularGridInterpolator((SPEEDS, THROTTLES), TORQUES)([[speed, throttle]])[0])


RULES: dict[str, Torque] = {"monotone": product_of_cubics, "linear": product_of_lines}
each_way = pytest.mark.parametrize("way", RULES)


def acceleration(torque: Torque, throttle: float, speed: float) -> float:
    return (torque(speed, throttle) - 0.1 * speed) / 2


def states() -> list[tuple[float, float]]:
    """Pairs of a throttle and a speed: within cells, on lines of the grid, at its corners."""
    random = np.random.default_rng(3)
    within = zip(random.uniform(0, 1, 40), random.uniform(0, 600, 40), strict=True)
    return [*within, (0.25, 170.0), (0.6, 300.0), (0.5, 250.0), (0.0, 0.0), (1.0, 600.0)]


@each_way
def test_emitted_python_has_the_grid(tmp_path: Path, way: str) -> None:
    (text,) = at_a_throttle(tmp_path, way).emit("python").values()
    module = ModuleType(f"engine_{way}")
    sys.modules[module.__name__] = module
    exec(compile(text, module.__name__, "exec"), vars(module))
    for throttle, speed in states():
        found = module.rhs(0.0, np.array([0.0, speed]), np.array([2, 0.1, throttle]))[1]
        assert found == pytest.approx(acceleration(RULES[way], throttle, speed), abs=1e-11)


@pytest.mark.compiler
@each_way
def test_emitted_c_has_the_grid(tmp_path: Path, way: str) -> None:
    compiled = Compiled(at_a_throttle(tmp_path, way).equations, tmp_path)
    for throttle, speed in states():
        status, found = compiled("rhs", 0.0, [0.0, speed], [2, 0.1, throttle], 2)
        assert status == 0
        assert found[1] == pytest.approx(acceleration(RULES[way], throttle, speed), abs=1e-11)


@each_way
def test_an_engine_follows_its_throttle_as_by_scipy(tmp_path: Path, way: str) -> None:
    times = np.linspace(0, 6, 13)
    run = engine(tmp_path, way).simulate(accuracy=1e-9, times=times)

    def rates(t: float, y: Array) -> list[float]:
        return [y[1], acceleration(RULES[way], 0.5 + 0.4 * np.sin(1.5 * t), y[1])]

    options = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-10, "max_step": 0.05}
    expected = solve_ivp(rates, (0, 6), [0, 40], t_eval=times, **options).y
    assert run.status == "ok"
    assert np.array(run.columns["phi"]) == pytest.approx(expected[0], rel=1e-8, abs=1e-6)
    assert np.array(run.columns["dot(phi)"]) == pytest.approx(expected[1], rel=1e-8)
