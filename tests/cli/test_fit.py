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
    # Noise that alternated would be none: neighbours would be correlated.
    noise = [float(side + "1e-3") for side in "+-++-+--+---+-+-++--"]
    rows = [f"{0.2 * k},{math.cos(math.sqrt(1.5) * 0.2 * k) + x}" for k, x in enumerate(noise)]
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


@pytest.mark.slow
def test_noise_that_is_none_is_exit_code_1(folder):
    """The scene has no damping, and the measurements are of a damped motion."""
    rows = [f"{t},{math.exp(-0.05 * t) * math.cos(1.2 * t)}" for t in (0.1 * k for k in range(60))]
    (folder / "data.csv").write_text("t,x\n" + "\n".join(rows) + "\n")
    done = lagrange("fit", "spring.yaml", "data.csv", "--free", "k,x", "--json", cwd=folder)
    assert done.returncode == 1
    assert json.loads(done.stdout)["status"] == "contradicted"


def test_bounds_and_starts(folder):
    words = ("fit", "spring.yaml", "data.csv", "--free", "k,x")
    found = json.loads(succeed(*words, "--bounds", "k=1,10", "--starts", "4", "--json", cwd=folder))
    assert (found["status"], found["starts"], found["minima"][0]["starts"]) == ("ok", 4, 4)
    found = json.loads(lagrange(*words, "--bounds", "k=3.2,10", "--json", cwd=folder).stdout)
    assert "at_bound" in [f["kind"] for f in found["findings"]]
    assert found["values"][0]["error"] is None
    for wrong, said in (
        ("k=1", "two numbers"),
        ("k=2,1", "do not ascend"),
        ("k=4,5", "not within its"),
        ("m=1,3", "is not free"),
    ):
        done = lagrange(*words, "--bounds", wrong, cwd=folder)
        assert (done.returncode, done.stdout) == (2, "")
        assert said in done.stderr
