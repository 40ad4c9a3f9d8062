"""``simulate --with``: which columns there are, and what is refused before the work."""

from __future__ import annotations

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
