"""``simulate --vary --plot``: the motions of all members as curves."""

from __future__ import annotations

import re

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.pictures import picture_of
from lagrange_cli.pictures.curves import read_panels
from lagrange_cli.pictures.drawn.families import Family
from lagrange_cli.simulate.model.labels import labels_of
from tests.cli.terminal import lagrange
from tests.simulate.ensemble.test_ensemble import PENDULUM

SCENE = PENDULUM.replace("positive: true}", "positive: true, unit: m}")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


def simulate(folder, *words):
    return lagrange("simulate", "scene.yaml", "--until", "1", *words, cwd=folder)


def family_of(members, text, starts=()):
    derivation = loads(SCENE).derive()
    ensemble = derivation.ensemble(members, until=1.0)
    panels = read_panels(text, ("t", *ensemble.columns), "of")
    labels = labels_of(derivation.equations)
    return ensemble, picture_of(Family(ensemble, panels, labels, frozenset(starts)))


def test_a_curve_for_each_member():
    ensemble, picture = family_of({"l": [0.5, 1, 2]}, "theta, dot(theta):theta")
    first, second = picture.panels
    assert [line.label.plain for line in first.lines] == ["l = 0.5 m", "l = 1 m", "l = 2 m"]
    for line, values in zip(first.lines, ensemble.columns["theta"], strict=True):
        assert np.array_equal(line.y, values)
    assert [line.has_ends for line in (*first.lines, *second.lines)] == [False] * 3 + [True] * 3
    assert (first.has_legend, second.has_legend, picture.bar) == (True, False, None)


def test_many_members_have_a_bar_of_colours():
    starts = np.linspace(0.1, 3, 9).tolist()
    _, picture = family_of({"theta": starts}, "theta", ["theta"])
    assert (picture.bar.low, picture.bar.high) == (0.1, 3)
    assert picture.bar.axis.label.plain == "θ(0) in rad"
    levels = [line.level for line in picture.panels[0].lines]
    assert np.allclose(levels, np.linspace(0, 1, 9))


def test_curves_of_one_panel_have_their_names():
    _, picture = family_of({"l": [1, 2]}, "theta + dot(theta)")
    names = [line.label.plain for line in picture.panels[0].lines]
    assert names == ["θ, l = 1 m", "θ, l = 2 m", "θ̇, l = 1 m", "θ̇, l = 2 m"]


def test_members_that_cannot_be_begun_have_no_curve():
    _, picture = family_of({"l": ["1/2", -1, "pi"]}, "theta")
    names = [line.label.plain for line in picture.panels[0].lines]
    assert names == ["l = 0.5 m", "l = 3.14159 m"]


def test_the_command_draws_them(folder):
    done = simulate(folder, "--vary", "l=[1,2]", "--plot", "a.tex")
    assert done.returncode == 0
    text = (folder / "a.tex").read_text()
    assert text.count(r"\begin{axis}") == 2
    assert re.findall(r"addlegendentry\{(.*)\}", text) == [
        rf"$l = {k}\,\mathrm{{m}}$" for k in (1, 2)
    ]
    words = ("--vary", "l=[1,2]", "--plot-of", "energy", "--plot", "b.tex")
    assert simulate(folder, *words).returncode == 0
    assert "ylabel={$E$" in (folder / "b.tex").read_text()


def test_the_command_draws_what_a_file_keeps(folder):
    words = ("--vary", "l=[1,2]", "-o", "a.npz", "--plot", "a.tex")
    assert simulate(folder, *words, "--columns", "theta").returncode == 0
    assert (folder / "a.tex").read_text().count(r"\addplot") == 2
    refused = simulate(folder, *words, "--columns", "theta", "--plot-of", "dot(theta)")
    assert refused.returncode == 2
    assert "--plot-of:1:1" in refused.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--vary", "l=linspace(1,2,101)", "--plot", "a.tex"], "too many curves"),
        (["--vary", "l=[1,2]", "--plot", "a.tex", "--plot-of", "thta"], "'theta'"),
        (["--vary", "l=[1,2]", "--vary", "m=[1,2]", "--map", "l,m"], "the file of --plot"),
        (["--vary", "l=[1,2]", "-o", "a.npz", "--final", "--plot", "a.tex"], "theta"),
    ],
)
def test_what_is_no_family_is_refused_before_the_run(folder, words, said):
    done = simulate(folder, *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert sorted(path.name for path in folder.iterdir()) == ["scene.yaml"]
