"""Samples that pass through files: the same results as in memory."""

from __future__ import annotations

import dataclasses
import io
import math
import os
import re
import shutil
from bisect import bisect_left
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.report.values.simulation import TRAJECTORY
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import samples, simulate
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.results.streaming import Stream
from lagrange_cli.simulate.samples import Grid, RowRanges
from lagrange_cli.simulate.simulation import RunContext

PENDULUM = """
parameters: {m: 1, l: 1.5}
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: 9.81}}
outputs: {height: z_bob + l}
initial: {theta: 2.5}
simulate: {until: 10}
"""

BALL = """
particles: {ball: {mass: 1, position: [x, 0, z]}}
coordinates: [x, z]
potentials: {weight: {gravity: 9.81}}
constraints: {floor: {unilateral: z >= 0, restitution: 0.5}}
initial: {x: 0, z: 2, dot(x): 1}
simulate: {until: 4}
"""

ROD = """
plane: xz
particles: {bob: {mass: 1, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = 4}
potentials: {weight: {gravity: 9.81}}
initial: {x: 2, z: 0}
simulate: {until: 5, formulation: multiplier}
"""

#: A scene and how to run it, with columns to write.
RUNS = {
    "gauss": (PENDULUM, {"method": "Gauss6", "step": 0.01}, ("energy",)),
    "adaptive": (PENDULUM, {"method": "DOP853", "rtol": 1e-9, "samples": 777}, ()),
    "python": (PENDULUM, {"method": "Radau", "rtol": 1e-6, "samples": 301}, ()),
    "contacts": (BALL, {"method": "DOP853", "rtol": 1e-9, "samples": 401}, ("energy",)),
    "promise": (PENDULUM, {"accuracy": 1e-9, "samples": 777}, ("energy",)),
    "bounces": (BALL, {"accuracy": 1e-6, "samples": 401}, ("energy",)),
    "held": (ROD, {"accuracy": 1e-6, "samples": 401}, ("forces",)),
    "rod": (ROD, {"method": "DOP853", "rtol": 1e-9, "samples": 401}, ("forces",)),
}


@pytest.fixture
def small(monkeypatch):
    """Windows of a few samples."""
    monkeypatch.setattr(samples, "WINDOW", 100)


def model(text: str):
    return model_of(derive(read_text(text), forces=True))


def compared(trajectory):
    """What two runs must have in common, as values that can be compared."""
    return TRAJECTORY.write(trajectory)


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["csv", "npz"])
@pytest.mark.parametrize("name", RUNS)
def test_streamed_is_what_memory_holds(small, tmp_path, name, ending):
    text, how, extra = RUNS[name]
    of = model(text)
    whole = simulate(of, **how)
    path = tmp_path / f"t.{ending}"
    part = simulate(of, **how, stream=Stream(str(path), extra, in_memory=0))
    assert part.written == str(path)
    whole.write(tmp_path / f"whole.{ending}", extra)
    assert path.read_bytes() == (tmp_path / f"whole.{ending}").read_bytes()
    assert compared(part) == compared(whole)
    assert sorted(os.listdir(tmp_path)) == sorted([path.name, f"whole.{ending}"])


@pytest.mark.slow
def test_what_is_kept_of_a_stream_are_samples(small):
    of = model(PENDULUM)
    how = {"method": "RK4", "step": 0.001}
    whole, part = simulate(of, **how), simulate(of, **how, stream=Stream(in_memory=0))
    assert part.written is None
    assert len(part.t) == 1001
    kept = np.searchsorted(whole.t, part.t)
    for name, values in whole.columns.items():
        assert np.array_equal(values[kept], part.columns[name])


@pytest.mark.slow
def test_a_picture_has_every_extreme_of_a_curve(small):
    of = model(PENDULUM)
    how = {"method": "RK4", "step": 1e-4}
    whole = simulate(of, **how)
    part = simulate(of, **how, stream=Stream(drawn=("theta", "dot(theta)"), in_memory=0))
    shown = part.decimated.curves
    assert len(shown.t) == 4000
    for name in ("theta", "dot(theta)"):
        assert shown.columns[name].max() == whole.columns[name].max()
        assert shown.columns[name].min() == whole.columns[name].min()
        # Every part of the time has what is least and largest in it.
        parts = np.array_split(whole.columns[name][:-1], 2000)
        lowest = [part.min() for part in parts]
        assert np.abs(shown.columns[name][:-2:2] - lowest[:-1]).max() < 1e-3
    assert shown.energy.max() == whole.energy.max()
    # A path has samples as they are, at equal distances.
    path = part.decimated.path
    assert np.array_equal(path.t, whole.t[:: len(whole.t) // 50_000 + 1])
    assert np.array_equal(path.columns["theta"], np.interp(path.t, whole.t, whole.columns["theta"]))


def test_a_stream_that_is_stopped_writes_what_is_done(small, tmp_path):
    calls = iter(range(1000))
    path = tmp_path / "t.npz"
    part = simulate(
        model(PENDULUM),
        method="RK4",
        step=1e-5,
        stream=Stream(str(path), in_memory=0),
        stop=lambda: next(calls) >= 3,
    )
    assert part.status == "stopped"
    assert f"{part.t[-1]:.9g}" in part.reason
    with np.load(path, allow_pickle=False) as found:
        assert found["t"][-1] == part.t[-1]
        assert len(found["t"]) == len(found["theta"]) < 1_000_001


def test_a_motion_that_ends_keeps_what_was_before(small, tmp_path):
    text = """
particles: {p: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {v: -x^4/4}
initial: {x: 1, dot(x): 1}
simulate: {until: 10}
"""
    how = {"method": "DOP853", "rtol": 1e-9, "samples": 1001}
    path = tmp_path / "t.csv"
    whole = simulate(model(text), **how)
    part = simulate(model(text), **how, stream=Stream(str(path), in_memory=0))
    assert part.status == whole.status == "blow_up"
    assert path.read_text() == whole.csv()


SPHERICAL = """
particles: {{bob: {{mass: 1, position: [x, y, z]}}}}
coordinates: [theta, phi]
definitions: {{x: sin(theta)*cos(phi), y: sin(theta)*sin(phi), z: -cos(theta)}}
potentials: {{weight: {{gravity: 9.81}}}}
initial: {{theta: 1, phi: 0, dot(theta): 0, dot(phi): {rate}}}
simulate: {{until: 3}}
"""

STEPS = {"method": "RK4", "step": 0.01}


@pytest.mark.slow
def test_a_stream_of_a_motion_past_a_singular_place_is_refused_unwritten(small, tmp_path):
    stream = Stream(str(tmp_path / "t.csv"), in_memory=0)
    of = model(SPHERICAL.format(rate=1e-6))
    with pytest.raises(InputError, match="the coordinates are singular where"):
        simulate_past_singularities(
            of, SimulationOptions(**STEPS), context=RunContext(stream=stream)
        )
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
def test_a_stream_that_keeps_away_from_singular_places_is_written(small, tmp_path):
    of = model(SPHERICAL.format(rate=2))
    stream = Stream(str(tmp_path / "t.csv"), in_memory=0)
    simulate_past_singularities(of, SimulationOptions(**STEPS), context=RunContext(stream=stream))
    assert (tmp_path / "t.csv").read_text() == simulate(of, **STEPS).csv()


def test_columns_that_are_not_there_leave_no_file(small, tmp_path):
    of = dataclasses.replace(model(PENDULUM), forces=())
    stream = Stream(str(tmp_path / "t.csv"), ("forces",), in_memory=0)
    with pytest.raises(InputError, match="no constraint forces"):
        simulate(of, method="RK4", step=0.01, stream=stream)
    assert os.listdir(tmp_path) == []


def test_a_disk_without_room_is_refused_before_the_work(monkeypatch, tmp_path):
    usage = shutil.disk_usage(tmp_path)._replace(free=1_000_000)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage)
    with pytest.raises(InputError, match=r"200,001 samples take .* GB") as refused:
        simulate(
            model(PENDULUM),
            method="RK4",
            step=5e-5,
            stream=Stream(str(tmp_path / "t.npz"), in_memory=0),
        )
    fits = re.search(r"--samples (\d+)", str(refused.value))
    assert fits
    assert 1000 < int(fits[1]) < 200_001


def test_without_a_stream_many_samples_are_refused():
    with pytest.raises(InputError, match="samples must be from 2 to 1,000,000"):
        simulate(model(PENDULUM), method="DOP853", rtol=1e-6, samples=10**8)


@pytest.mark.parametrize("count", [2, 3, 501, 99_999])
def test_times_by_windows_are_those_of_linspace(count):
    start, until = -0.3, 7.1
    grid = Grid(start, until, (until - start) / (count - 1), count)
    expected = np.linspace(start, until, count)
    assert np.array_equal(grid[:], expected)
    found = [grid[k : k + 1000] for k in range(0, count, 1000)]
    assert np.array_equal(np.concatenate(found), expected)
    assert (grid[0], grid[-1], grid[count - 1]) == (start, until, until)
    assert np.array_equal(grid[0 : count - 1 : 7], expected[0:-1:7])


@pytest.mark.parametrize("t", [-1.0, 0.0, 0.31, 0.5, 1.0, 1.1, math.inf])
def test_the_first_time_from_one_on_is_found(t):
    grid = Grid(0.0, 1.0, 0.01, 101)
    assert bisect_left(grid, t) == np.searchsorted(grid[:], t)


def test_ranges_are_read_like_one_array():
    of = np.arange(40.0).reshape(20, 2)
    found = RowRanges(of, [(1, 4), (7, 8), (8, 8), (15, 20)])
    expected = np.concatenate([of[1:4], of[7:8], of[15:20]])
    assert len(found) == len(expected)
    for first in range(10):
        for last in range(first, 10):
            assert np.array_equal(found[first:last], expected[first:last])
            assert np.array_equal(found[first:last:3], expected[first:last:3])
    assert [found[k].tolist() for k in range(9)] == expected.tolist()


def test_a_spool_gives_back_what_it_took():
    width, rng = 3, np.random.default_rng(1)
    values = rng.normal(size=(50, width))
    of = samples.FileBuffer(io.BytesIO(), width, size=8)
    filled = 0
    while filled < 50:
        room = of.unfilled(filled, min(filled + int(rng.integers(1, 20)), 50))
        room[:] = values[filled : filled + len(room)]
        filled += len(room)
        found = of.rows(filled)
        assert np.array_equal(found[:], values[:filled])
        assert np.array_equal(found[::4], values[:filled:4])
        assert np.array_equal(found[filled // 3 : filled - 1], values[filled // 3 : filled - 1])
        assert np.array_equal(found[filled - 1], values[filled - 1])


def test_large_archives_are_read_back(monkeypatch, tmp_path):
    monkeypatch.setattr("lagrange_cli.simulate.results.formats.LARGE", 64)
    monkeypatch.setattr("lagrange_cli.simulate.results.formats.BYTES_IN_MEMORY", 64)
    found = simulate(model(PENDULUM), method="RK4", step=0.1)
    path = Path(tmp_path / "t.npz")
    found.write(path)
    with np.load(path, allow_pickle=False) as arrays:
        assert np.array_equal(arrays["theta"], found.columns["theta"])
