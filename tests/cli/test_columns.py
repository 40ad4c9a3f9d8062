"""``simulate --with``: which columns there are, and what is refused before the work."""

from __future__ import annotations

import json
import re

import pytest

from tests.cli.terminal import lagrange, succeed

HOLE = "systems/lecture/masses_through_hole.yaml"


def header(tmp_path, *words):
    path = tmp_path / "t.csv"
    succeed("simulate", HOLE, "--until", "1", "--samples", "3", "-o", str(path), *words)
    return path.read_text().splitlines()[0].split(",")


@pytest.mark.slow
def test_energy_is_one_more_column(tmp_path):
    plain = header(tmp_path)
    assert "energy" not in plain
    assert header(tmp_path, "--with", "energy") == [*plain, "energy"]
    assert header(tmp_path, "--with", " energy ,positions,energy") == [*plain, "energy"]
    assert header(tmp_path, "--with", "positions") == plain


@pytest.mark.parametrize("names", ["enery", "energy,,", "", "energy forces"])
def test_unknown_columns(tmp_path, names):
    done = lagrange("simulate", HOLE, "--with", names, "-o", str(tmp_path / "t.csv"))
    assert done.returncode == 2
    assert "is not one of energy, positions, forces" in done.stderr
    assert not (tmp_path / "t.csv").exists()


FREE = """
name: free
parameters: {k: 1}
coordinates: [u]
kinetic: {T: dot(u)^2/2}
potentials: {V: k*u^2/2}
initial: {u: 1}
simulate: {until: 1}
"""


def test_forces_where_nothing_is_constrained(tmp_path):
    (tmp_path / "s.yaml").write_text(FREE)
    done = lagrange("simulate", "s.yaml", "--with", "forces", "-o", "t.csv", cwd=tmp_path)
    assert done.returncode == 2
    assert "there are no constraint forces of 'free'" in done.stderr
    assert not (tmp_path / "t.csv").exists()


@pytest.mark.slow
def test_forces_where_no_constraint_is_kept(tmp_path):
    names = header(tmp_path, "--with", "forces")
    forces = [f"force_{x}({body})" for body in ("puck", "weight") for x in "xyz"]
    multipliers = [f"lambda_{c}" for c in ("table", "plumb_1", "plumb_2", "rope")]
    assert names == [*header(tmp_path), *forces, *multipliers]
    succeed(
        *("simulate", HOLE, "--until", "1", "--samples", "3"),
        *("-o", str(tmp_path / "t.csv"), "--with", "forces"),
    )
    rows = (tmp_path / "t.csv").read_text().splitlines()
    for line in rows[1:]:
        row = dict(zip(names, map(float, line.split(",")), strict=True))
        tension = 2 * 1 / (2 + 1) * (9.81 + row["r"] * row["dot(theta)"] ** 2)
        assert row["force_z(weight)"] == pytest.approx(tension, rel=1e-13)
        assert row["lambda_rope"] == pytest.approx(-tension, rel=1e-13)
        pull = -row["force_x(puck)"] * row["x1"] - row["force_y(puck)"] * row["y1"]
        assert pull == pytest.approx(tension * row["r"], rel=1e-13)


@pytest.mark.slow
def test_last_values_are_shown_and_told(tmp_path):
    how = ["simulate", HOLE, "--until", "1", "--samples", "3", "--with", "forces,energy"]
    succeed(*how, "-o", str(tmp_path / "t.csv"))
    header, *_, last = (tmp_path / "t.csv").read_text().splitlines()
    row = dict(zip(header.split(","), map(float, last.split(",")), strict=True))
    told = json.loads(succeed(*how, "--json"))["with"]
    assert set(told) == {n for n in row if n == "energy" or n.startswith(("force_", "lambda_"))}
    assert told == {name: row[name] for name in told}
    shown = succeed(*how)
    assert re.search(rf"^  lambda_rope +{row['lambda_rope']:.9g}$", shown, re.MULTILINE)
    assert "lambda" not in succeed(*how[:-2])
    assert "with" not in json.loads(succeed(*how[:-2], "--json"))


KEPT = """
name: pendulum_xz
parameters: {m: 1.3, l: 2, g: 9.81}
particles: {bob: {mass: m, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: m*g*z}
initial: {x: 0, z: -l, dot(x): 9.5}
simulate: {until: 1, samples: 5}
"""


@pytest.mark.slow
def test_forces_where_a_constraint_is_kept(tmp_path):
    (tmp_path / "s.yaml").write_text(KEPT)
    text = succeed("simulate", "s.yaml", "--with", "forces", "-o", "t.csv", cwd=tmp_path)
    head, first, *_ = (tmp_path / "t.csv").read_text().splitlines()
    assert head.startswith("t,x,z,")
    assert head.endswith(",lambda_rod,force_x(bob),force_y(bob),force_z(bob)")
    # At the lowest point, along 2 (x, z): m (v²/l + g) = -2 l λ.
    tension = 1.3 * (9.5**2 / 2 + 9.81)
    *_, multiplier, x, y, z = map(float, first.split(","))
    assert multiplier == pytest.approx(-tension / 4, rel=1e-14)
    assert (x, y) == (0, 0)
    assert z == pytest.approx(tension, rel=1e-14)
    assert re.search(r"^Constraints  largest drift [0-9.]+e-1[67]$", text, re.MULTILINE)


@pytest.mark.slow
def test_drift_in_the_report(tmp_path):
    (tmp_path / "s.yaml").write_text(KEPT)
    kept = json.loads(succeed("simulate", "s.yaml", "--json", cwd=tmp_path))
    assert kept["formulation"] == "multiplier"
    assert 0 < kept["constraint_drift"] < 1e-15
    minimal = json.loads(succeed("simulate", HOLE, "--until", "1", "--json"))
    assert minimal["constraint_drift"] is None
    assert "Constraints" not in succeed("simulate", HOLE, "--until", "1")


def test_a_method_that_cannot_project(tmp_path):
    (tmp_path / "s.yaml").write_text(KEPT)
    done = lagrange("simulate", "s.yaml", "--method", "LSODA", "--rtol", "1e-6", cwd=tmp_path)
    assert done.returncode == 2
    assert "cannot move its past states onto the constraints" in done.stderr
