"""``lagrange simulate --section`` as a user runs it."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from tests.cli.terminal import lagrange

SCENE = """
title: Two frequencies
parameters: {a: 0.3}
coordinates: [x, y]
kinetic: {T: (dot(x)^2 + dot(y)^2)/2}
potentials: {V: x^2/2 + y^2}
initial: {x: 0, dot(x): 1, y: a, dot(y): 0}
simulate: {until: 40, accuracy: 1e-9}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


def simulate(folder, *words):
    return lagrange("simulate", "scene.yaml", *words, cwd=folder)


@pytest.mark.slow
def test_points_as_a_table_as_json_and_in_python(folder):
    from lagrange_cli import load

    words = ("--section", "x = 0, dot(x) > 0", "--with", "energy", "-o", "points.csv")
    done = simulate(folder, *words)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("scene where x = 0, dot(x) > 0: 7 points\n")
    header, *rows = (folder / "points.csv").read_text().splitlines()
    assert header == "t,x,y,dot(x),dot(y),energy,error"
    numbers = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    np.testing.assert_allclose(numbers[:, 0], 2 * np.pi * np.arange(7), atol=4e-8)
    (member,) = json.loads(simulate(folder, *words, "--json").stdout)["members"]
    assert member["t"] == numbers[:, 0].tolist()
    assert member["state"]["y"] == numbers[:, 2].tolist()
    assert member["error"] == numbers[:, 6].tolist()
    assert (member["status"], member["uncertain"], member["open"]) == ("ok", 0, [])
    section = load(folder / "scene.yaml").derive().section("x = 0, dot(x) > 0")
    assert section.t.tolist() == numbers[:, 0].tolist()


@pytest.mark.slow
def test_members_in_one_table(folder):
    words = ("--section", "x = 0", "--vary", "a=[0.1,0.2]", "--until", "20", "-j", "1")
    assert simulate(folder, *words, "-o", "points.npz").returncode == 0
    with np.load(folder / "points.npz") as table:
        assert table["member"].tolist() == [0] * 7 + [1] * 7
        assert table["y"][[0, 7]].tolist() == [0.1, 0.2]
    (folder / "members.csv").write_text("y,dot(y)\n0.3,0\n0,a\n")
    words = ("--section", "x = 0", "--ensemble", "members.csv", "--until", "20")
    report = json.loads(simulate(folder, *words, "--json").stdout)
    assert report["members"][1]["given"] == {"y": "0", "dot(y)": "a"}
    assert report["members"][1]["state"]["dot(y)"][0] == 0.3
    assert report["points"] == 14


def test_a_picture_of_dots(folder):
    words = ("--section", "x = 0, dot(x) > 0", "--vary", "a=[0.1,0.2]", "--plot", "section.tex")
    assert simulate(folder, *words).returncode == 0
    text = (folder / "section.tex").read_text()
    # x is fixed, so that the phase portrait is that of y.
    assert re.findall(r"[xy]label=\{(.*?)\}(?=,\n)", text) == [r"$\dot{y}$", "$y$"]
    assert r"\mbox{$x = 0$, $\dot{x} > 0$}" in text
    assert text.count("only marks") == 2
    assert re.findall(r"addlegendentry\{(.*)\}", text) == ["$a = 0.1$", "$a = 0.2$"]
    assert len(re.findall(r"^\(", text, re.MULTILINE)) == 14
    assert simulate(folder, *words, "--plot-of", "y:t, x:dot(x)").returncode == 0
    assert (folder / "section.tex").read_text().count(r"\begin{axis}") == 2


def test_what_is_open_is_said_and_exits_with_1(folder):
    done = simulate(folder, "--section", "dot(x) = 1", "--until", "10")
    assert done.returncode == 1
    assert "the number of points at t = 6.283" in done.stdout
    report = json.loads(
        simulate(folder, "--section", "dot(x) = 1", "--until", "10", "--json").stdout
    )
    np.testing.assert_allclose(report["members"][0]["open"], [2 * np.pi], atol=1e-4)


def test_with_a_method_nothing_is_promised(folder):
    words = ("--section", "x = 0", "--method", "DOP853", "--rtol", "1e-9", "--until", "20")
    done = simulate(folder, *words)
    assert done.returncode == 0
    assert "nothing is promised" in done.stdout
    assert json.loads(simulate(folder, *words, "--json").stdout)["members"][0].get("error") is None


@pytest.mark.slow
def test_a_spent_budget_keeps_what_is_done(folder):
    done = simulate(folder, "--section", "x = 0", "--until", "1e5", "--budget", "0.5", "--json")
    assert done.returncode == 1
    (member,) = json.loads(done.stdout)["members"]
    assert member["status"] == "stopped"
    assert member["reason"].startswith("stopped; what is kept ends at")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--section", "y = 0, dot(z) > 0"], "--section:1:12: unknown name 'z'"),
        (["--section", "y"], "--section:1:1: an equation or inequality has one of"),
        (["--section", "y = 0", "--samples", "3"], "--samples does not go with --section"),
        (["--section", "y = 0", "--sensitivity", "x"], "--sensitivity does not go with"),
        (["--section", "y = 0", "--with", "forces"], "--with forces does not go with"),
        (["--section", "y = 0", "--checkpoint", "c"], "--checkpoint does not go with"),
        (["--section", "y = 0", "--vary", "y=[1,2]", "--resume"], "--resume does not go with"),
        (["--section", "y = 0", "--vary", "y=[1,2]", "--reduce", "max(x)"], "--reduce does not go"),
        (
            [
                "--section",
                "y = 0",
                "--vary",
                "y=0:1:2",
                "--vary",
                "x=0:1:2",
                "--map",
                "y,x",
                "--plot",
                "a.svg",
            ],
            "--map does not go",
        ),
        (["--section", "y = 0", "--plot", "a.tex", "--plot-of", "z"], "nothing named 'z'"),
        (["--section", "y = 0", "--vary", "b=[1,2]"], "--vary"),
        (["--section", "y = 0", "--method", "RK4", "--rtol", "1e-9"], "RK4 end at samples"),
        (["--section", "x = 0", "--until", "4e5"], "than memory holds"),
    ],
)
def test_what_cannot_be_is_refused(folder, words, said):
    before = sorted(path.name for path in folder.iterdir())
    done = simulate(folder, *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert sorted(path.name for path in folder.iterdir()) == before
