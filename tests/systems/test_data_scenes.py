"""Scenes that read files beside them, against splines and motions of SciPy."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PchipInterpolator

from tests.systems.shipped import SYSTEMS, derived, simulated

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
Rates = Callable[[float, Array], list[float]]

FOLDER = SYSTEMS / "data"


def columns_of(name: str) -> Array:
    return np.loadtxt(FOLDER / f"{name}.csv", delimiter=",", skiprows=1).T


def values_of(name: str) -> dict[str, float]:
    return {p.name: p.value for p in derived(name).system.parameters if p.value is not None}


def moved(rates: Rates, start: list[float], times: Array) -> Array:
    """States at the times by DOP853, which begins anew at each of them."""
    states = [np.array(start)]
    for begin, end in pairwise(times):
        run = solve_ivp(rates, (begin, end), states[-1], "DOP853", rtol=1e-13, atol=1e-15)
        states.append(run.y[:, -1])
    return np.array(states)


def test_a_wheel_follows_the_spline_through_a_recorded_road() -> None:
    p, run = values_of("quarter_car"), simulated("quarter_car")
    assert run.status == "ok"
    road = CubicSpline(*columns_of("quarter_car"))
    slope = road.derivative()

    def rates(t: float, s: Array) -> list[float]:
        z, y, vz, vy = s
        between = p["k"] * (z - y) + p["c"] * (vz - vy)
        below = p["kt"] * (y - road(t)) + p["ct"] * (vy - slope(t))
        return [vz, vy, -between / p["M"], (between - below) / p["m"]]

    # Samples are the rows of the file, at which the spline is joined.
    expected = moved(rates, [0, 0, 0, 0], run.t)
    for name, column in zip(("z", "y", "dot(z)", "dot(y)"), expected.T, strict=True):
        assert run.columns[name] == pytest.approx(column, abs=1e-9 * np.abs(column).max())
    assert run.columns["road"] == pytest.approx(road(run.t), abs=1e-15)


def test_an_engine_has_the_torque_of_its_table_and_settles_where_the_brake_takes_it() -> None:
    p, run = values_of("engine_on_a_brake"), simulated("engine_on_a_brake")
    assert run.status == "ok"
    torque = PchipInterpolator(*columns_of("engine_on_a_brake"))

    def rates(t: float, s: Array) -> list[float]:
        return [s[1], (float(torque(s[1])) - p["b"] * s[1] ** 2) / p["J"]]

    expected = moved(rates, [0, 80], run.t)
    assert run.columns["phi"] == pytest.approx(expected[:, 0], abs=1e-7)
    assert run.columns["dot(phi)"] == pytest.approx(expected[:, 1], abs=1e-7)
    speed = run.columns["dot(phi)"]
    assert run.columns["power"] == pytest.approx(torque(speed) * speed, rel=1e-12)
    assert speed[-1] == pytest.approx(400, abs=0.1)


def test_an_engine_has_the_torque_of_its_table_over_speed_and_throttle() -> None:
    p, run = values_of("engine_with_a_throttle"), simulated("engine_with_a_throttle")
    assert run.status == "ok"
    speed, opening, torque = columns_of("engine_with_a_throttle")
    speeds, openings = np.unique(speed), np.unique(opening)
    grid = torque.reshape(len(speeds), len(openings))
    along = PchipInterpolator(speeds, grid)
    slopes = PchipInterpolator(openings, grid, axis=1).derivative()(openings)
    across = CubicHermiteSpline(speeds, slopes, np.zeros_like(slopes))

    def rates(t: float, s: Array) -> list[float]:
        at = 1 - 0.75 * np.exp(-t)
        drive = CubicHermiteSpline(openings, along(s[1]), across(s[1]))(at)
        return [s[1], (float(drive) - p["b"] * s[1] ** 2) / p["J"]]

    expected = moved(rates, [0, 80], run.t[::20])
    assert run.columns["phi"][::20] == pytest.approx(expected[:, 0], abs=1e-7)
    assert run.columns["dot(phi)"][::20] == pytest.approx(expected[:, 1], abs=1e-7)
