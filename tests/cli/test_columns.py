"""``simulate --with``: which columns there are, and what is refused before the work."""

from __future__ import annotations

import json
import re

import pytest
from terminal import lagrange, succeed

HOLE = "systems/lecture/masses_through_hole.yaml"


def header(tmp_path, *words):
    path = tmp_path / "t.csv"
    succeed("simulate", HOLE, "--until", "1", "--samples", "3", "-o", str(path), *words)
    return path.read_text().splitlines()[0].split(",")


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


def test_forces_where_no_constraint_is_kept(tmp_path):
    done = lagrange("simulate", HOLE, "--with", "forces", "-o", str(tmp_path / "t.csv"))
    assert done.returncode == 2
    assert "no multipliers are computed for 'masses_through_hole'" in done.stderr
    assert not (tmp_path / "t.csv").exists()


KEPT = """
name: pendulum_xz
parameters: {m: 1.3, l: 2, g: 9.81}
particles: {bob: {mass: m, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: m*g*z}
initial: {x: 0, z: -l, dot(x): 9.5}
simulate: {until: 1, samples: 5}
"""


def test_forces_where_a_constraint_is_kept(tmp_path):
    (tmp_path / "s.yaml").write_text(KEPT)
    text = succeed("simulate", "s.yaml", "--with", "forces", "-o", "t.csv", cwd=tmp_path)
    head, first, *_ = (tmp_path / "t.csv").read_text().splitlines()
    assert head.startswith("t,x,z,")
    assert head.endswith(",lambda(rod)")
    # At the lowest point, along 2 (x, z): m (v²/l + g) = -2 l λ.
    assert float(first.split(",")[-1]) == pytest.approx(-1.3 * (9.5**2 / 2 + 9.81) / 4, rel=1e-14)
    assert re.search(r"^Constraints  largest drift [0-9.]+e-1[67]$", text, re.MULTILINE)


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
