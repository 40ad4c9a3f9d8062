"""``lagrange fit`` as a user runs it."""

from __future__ import annotations

import json
import math

import pytest

from tests.cli.terminal import lagrange, succeed

SCENE = """\
name: spring
parameters: {m: 2, k: 3.5}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
initial: {x: 1, dot(x): 0}
simulate: {until: 5}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "spring.yaml").write_text(SCENE)
    rows = [f"{0.2 * k},{math.cos(math.sqrt(1.5) * 0.2 * k) + 1e-3 * (-1) ** k}" for k in range(20)]
    (tmp_path / "data.csv").write_text("t,x\n" + "\n".join(rows) + "\n")
    return tmp_path


@pytest.mark.slow
def test_text_json_and_picture(folder):
    words = ("fit", "spring.yaml", "data.csv", "--free", "k,x")
    text = succeed(*words, cwd=folder)
    assert "variational equations" in text
    found = json.loads(succeed(*words, "--json", "-o", "out.json", "--plot", "fit.svg", cwd=folder))
    assert found["status"] == "ok"
    assert [v["name"] for v in found["values"]] == ["k", "x"]
    assert found["values"][0]["value"] == pytest.approx(3, abs=4 * found["values"][0]["error"])
    assert found["chi_squared"] is None
    assert json.loads((folder / "out.json").read_text()) == found
    assert (folder / "fit.svg").read_text().lstrip().startswith("<?xml")


@pytest.mark.slow
def test_what_is_not_determined_is_exit_code_1(folder):
    done = lagrange("fit", "spring.yaml", "data.csv", "--free", "k,m", cwd=folder)
    assert done.returncode == 1
    assert "leave all measured values as they are" in done.stdout
    done = lagrange("fit", "spring.yaml", "data.csv", "--free", "k,m", "--json", cwd=folder)
    assert json.loads(done.stdout)["correlation"] == [[None, None], [None, None]]


def test_refusals_have_their_place(folder):
    (folder / "data.csv").write_text("t,x\n0,1\n1,one\n")
    done = lagrange("fit", "spring.yaml", "data.csv", "--free", "k", cwd=folder)
    assert done.returncode == 2
    assert "data.csv:3:3: expected a finite number" in done.stderr
    done = lagrange("fit", "spring.yaml", "none.csv", "--free", "k", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    done = lagrange("fit", "spring.yaml", "data.csv", cwd=folder)
    assert done.returncode == 2


def test_measurements_are_not_replaced(folder):
    (folder / "out.json").symlink_to(folder / "data.csv")
    before = (folder / "data.csv").read_text()
    done = lagrange("fit", "spring.yaml", "data.csv", "--free", "k", "-o", "out.json", cwd=folder)
    assert done.returncode == 2
    assert (folder / "data.csv").read_text() == before
