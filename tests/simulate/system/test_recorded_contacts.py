"""Recorded inputs beside contacts and kept constraints: events at rows, forces, checks."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli.check import check_paths
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_file
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.compiling import compiled_or_skip

#: A ball on a floor, accelerated by what is recorded.
BALL = """
name: ball
inputs: {a: {file: a.csv, column: a, interpolation: KIND}}
particles: {ball: {mass: 2, position: [0, 0, z]}}
constraints: {floor: {unilateral: z >= 0, restitution: 0.5}}
coordinates: [z]
forces: {push: {on: z, force: 2*a}}
initial: {z: HEIGHT, dot(z): 0}
simulate: {until: 3, accuracy: 1e-9, samples: 31}
"""


def written(folder, scene, table):
    (folder / "scene.yaml").write_text(scene, encoding="ascii")
    (folder / "a.csv").write_text(table, encoding="ascii")
    return str(folder / "scene.yaml")


def model(folder, kind, height, table):
    scene = BALL.replace("KIND", kind).replace("HEIGHT", str(height))
    return model_of(derive(read_file(written(folder, scene, table))))


def both_ways(of):
    yield simulate(of, functions=compiled_or_skip(of))
    yield simulate(of, functions=interpreted(of, "asked for"))


@pytest.mark.slow
def test_a_force_that_jumps_at_a_row_opens_a_contact_there(tmp_path):
    for found in both_ways(model(tmp_path, "previous", 0, "t,a\n0,-5\n1,5\n2,-7\n")):
        assert found.status == "ok"
        (event,) = found.events
        assert event.name == "release:floor"
        assert event.t == pytest.approx(1, abs=1e-14)
        t = found.t
        rising = 2.5 * np.clip(t - 1, 0, 1) ** 2
        after = np.maximum(t - 2, 0)
        assert found.columns["z"] == pytest.approx(rising + 5 * after - 3.5 * after**2, abs=1e-12)


@pytest.mark.slow
def test_a_force_that_crosses_zero_between_rows_opens_a_contact_there(tmp_path):
    for found in both_ways(model(tmp_path, "linear", 0, "t,a\n0,-6\n2,12\n3,12\n")):
        assert found.status == "ok"
        (event,) = found.events
        assert event.t == pytest.approx(2 / 3, abs=3e-9)
        # z'' = 9 (t − 2/3) until t = 2.
        inside = found.t <= 2
        free = 1.5 * np.clip(found.t - 2 / 3, 0, None) ** 3
        assert found.columns["z"][inside] == pytest.approx(free[inside], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("row", [1.0, 1.0 + 2**-52, 1.0 - 2**-53, 1.0 + 1e-9, 1.1])
def test_an_impact_and_a_row_may_fall_together(tmp_path, row):
    """From 1 with acceleration −8: impacts at 0.5 with 4 and, after 2, at 1."""
    table = f"t,a\n0,-8\n{row!r},4\n"
    for found in both_ways(model(tmp_path, "previous", 1, table)):
        assert found.status == "ok"
        assert [e.name for e in found.events] == ["contact:floor", "contact:floor"]
        assert [e.t for e in found.events] == pytest.approx([0.5, 1.0], abs=3e-9)
        # Up from there with 1, against −8 until the row.
        h = max(row - 1, 0)
        t = found.t[found.t > 1.2] - 1 - h
        z = h - 4 * h**2 + (1 - 8 * h) * t + 2 * t**2
        assert found.columns["z"][found.t > 1.2] == pytest.approx(z, abs=1e-8)


PENDULUM = """
inputs: {a: {file: a.csv, column: a, interpolation: previous}}
plane: xz
points: {pivot: [0, 0, 0]}
particles: {bob: {mass: 2, position: [x, y, z]}}
constraints: {rod: {distance: [pivot, bob], equals: 1}}
potentials: {weight: {gravity: 10}}
forces: {wind: {on: bob, force: [2*a, 0, 0]}}
coordinates: [x, z]
initial: {x: 0, z: -1}
simulate: {until: 1, accuracy: 1e-9, samples: 11}
"""


@pytest.mark.slow
def test_constraint_forces_jump_with_the_recording(tmp_path):
    table = "t,a\n0,0\n0.5,30\n0.7,0\n"
    path = written(tmp_path, PENDULUM, table)
    of = model_of(derive(read_file(path), forces=True))
    for found in both_ways(of):
        columns = found.table(["forces"])
        t, x, z = found.t, columns["x"], columns["z"]
        speed = columns["dot(x)"] ** 2 + columns["dot(z)"] ** 2
        wind = np.where((t >= 0.5) & (t < 0.7), 30.0, 0.0)
        # Along the rod, which has length 1: m v² − m g·r̂.
        pull = 2 * (speed - 10 * z + wind * x)
        assert columns["force_x(bob)"] == pytest.approx(-pull * x, abs=1e-6)
        assert columns["force_z(bob)"] == pytest.approx(-pull * z, abs=1e-6)
        assert 2 * columns["lambda_rod"] == pytest.approx(-pull, abs=1e-6)
        assert np.abs(x).max() > 0.5


@pytest.mark.slow
def test_wider_numbers_have_the_same_rows(tmp_path):
    scene = PENDULUM.replace("previous", "cubic")
    path = written(tmp_path, scene, "t,a\n0,1\n0.3,4\n0.5,30\n0.7,-2\n1,0\n")
    functions = compiled_or_skip(model_of(derive(read_file(path))))
    wider = functions.wider()
    if wider is None:
        pytest.skip("doubles are the widest numbers here")
    y = np.array([0.6, -0.8, 0.4, 0.3])
    for t in (0.0, 0.1, 0.3, np.nextafter(0.5, 0), 0.5, 0.6, 0.7, 1.0):
        assert wider.rhs(t, y) == pytest.approx(functions.rhs(t, y), rel=1e-14)
        for off in (*functions.perturbed, *wider.perturbed):
            assert off(t, y) == pytest.approx(functions.rhs(t, y), rel=1e-13)


@pytest.mark.parametrize(
    ("table", "place", "message"),
    [
        (None, ("scene.yaml", 2), "no such file"),
        ("t,b\n0,1\n", ("scene.yaml", 2), "has no column 'a'"),
        ("t,a\n0,1\n0,2\n", ("a.csv", 3), "time 0 is not after the one before"),
    ],
)
def test_check_finds_what_is_wrong_with_the_file(tmp_path, table, place, message):
    path = written(tmp_path, PENDULUM.lstrip("\n").replace("plane", "# \nplane"), table or "")
    if table is None:
        (tmp_path / "a.csv").unlink()
    (scene,) = check_paths([path]).scenes
    assert scene.outcome == "invalid"
    (problem,) = scene.problems
    assert message in problem.message
    assert problem.mark is not None
    assert problem.mark.file == str(tmp_path / place[0])
    assert problem.mark.line == place[1] - (place[0] == "scene.yaml")
