"""``simulate --plot`` and ``--plot-of``: files by their endings, curves by their names."""

from __future__ import annotations

import re
import sys

import numpy as np
import pytest

from tests.cli.terminal import lagrange

SCENE = """
title: Kepler's problem
parameters: {k: 1}
particles: {planet: {mass: 1, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {gravitation: -k/sqrt(x^2 + y^2)}
outputs: {area: x*dot(y) - y*dot(x)}
initial: {x: 1, y: 0, dot(y): 1.2}
simulate: {until: 6, samples: 101}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


def simulate(folder, *words):
    return lagrange("simulate", "scene.yaml", *words, cwd=folder)


def written(folder):
    return sorted(path.name for path in folder.iterdir())


def test_paths_for_pgfplots(folder):
    done = simulate(folder, "--plot", "orbit.tex", "--plot-of", "y:x, area, energy:t")
    assert done.returncode == 0
    text = (folder / "orbit.tex").read_text()
    assert re.findall(r"ylabel=\{(.*?)\}(?=,\n)", text) == [
        "$y$",
        r"$\mathrm{area}$",
        r"$(E - E_{0}) / T_{\mathrm{max}}$",
    ]
    assert text.count("axis equal") == 1


def test_the_same_picture_from_python(folder):
    from lagrange_cli import load

    assert simulate(folder, "--plot", "a.tex", "--plot-of", "y:x + area:t").returncode == 0
    load(folder / "scene.yaml").derive().simulate().plot(folder / "b.tex", "y:x + area:t")
    assert (folder / "a.tex").read_text() == (folder / "b.tex").read_text()


@pytest.mark.parametrize(
    ("curves", "place", "said"),
    [
        ("y:z9", "1:3", "nothing named 'z9'"),
        ("y:x, dot(arae)", "1:6", "nothing named 'dot(arae)'"),
        ("y:x,", "1:5", "a name is missing"),
        ("y:x:t", "1:1", "a curve is ORDINATE:ABSCISSA"),
        ("lambda_rod", "1:1", "nothing named 'lambda_rod'"),
    ],
)
def test_names_that_there_are_not_are_refused_before_the_run(folder, curves, place, said):
    done = simulate(folder, "--plot", "a.tex", "--plot-of", curves, "-o", "a.csv")
    assert done.returncode == 2
    assert done.stderr.startswith(f"--plot-of:{place}: ")
    assert said in done.stderr
    assert done.stdout == ""
    assert written(folder) == ["scene.yaml"]


def test_curves_need_a_file(folder):
    done = simulate(folder, "--plot-of", "y:x")
    assert done.returncode == 2
    assert "--plot-of needs --plot FILE" in done.stderr


def test_endings_that_there_are_not_are_refused_before_the_run(folder, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("lagrange_cli.simulate.charts.simulation.simulate_past_singularities", None)
    done = simulate(folder, "--plot", "a.exe")
    assert (done.returncode, written(folder)) == (2, ["scene.yaml"])
    assert "cannot be written as '.exe'" in done.stderr


def test_without_matplotlib_there_is_pgfplots(folder, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    refused = simulate(folder, "--plot", "a.svg")
    assert refused.returncode == 2
    assert "--plot FILE.tex" in refused.stderr
    assert simulate(folder, "--plot", "a.tex").returncode == 0


@pytest.mark.slow
def test_a_run_that_memory_does_not_hold_is_drawn_too(folder):
    """150,001 samples pass through a file."""
    curves = ("--plot-of", "y:x, area, energy")
    done = simulate(folder, "--method", "RK4", "--step", "4e-5", "--plot", "a.tex", *curves)
    assert done.returncode == 0
    orbit, _, _, area, _ = (folder / "a.tex").read_text().split(r"\addplot")[1:]
    points = np.array(re.findall(r"\((\S+),(\S+)\)\n", orbit), dtype=float)
    # The conic section r = p - e x, with p = L^2 = 1.44 and e = 0.44.
    off = np.hypot(*points.T) - (1.44 - 0.44 * points[:, 0])
    assert 30 < len(points) < 2000
    assert np.abs(off).max() < 1e-4
    # What is conserved has two points.
    assert len(re.findall(r"\(\S+,1.2\)\n", area)) == area.count(",1.2)") == 2
