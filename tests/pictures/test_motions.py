"""Pictures of trajectories: what they show, with which labels, in which bytes."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.pictures import picture_of
from lagrange_cli.pictures.by_pgfplots import simplified
from lagrange_cli.pictures.curves import Curve, read_panels
from lagrange_cli.simulate.model.labels import Labels
from tests.simulate.results.test_streams import BALL, PENDULUM

HOSTILE = r"Text \input{/etc/passwd} $x_1$ 50 % & #{ ~^ \end{tikzpicture} ẞ中"

ATWOOD = """
title: Swinging Atwood machine
parameters: {M: {value: 3, unit: kg}, m: 1, l: {value: 3, unit: m}, g: {value: 9.81, unit: m/s^2}}
plane: xz
particles:
  weight: {mass: M, position: [0, 0, r - l]}
  bob: {mass: m, position: [r*sin(theta), 0, -r*cos(theta)]}
coordinates: {r: {}, theta: {latex: '\\vartheta'}}
potentials: {weight: {gravity: g}}
initial: {r: 1, theta: 1}
simulate: {until: 3, samples: 201}
"""


@pytest.fixture(scope="module")
def atwood():
    return loads(ATWOOD).derive().simulate()


@pytest.fixture(scope="module")
def ball():
    return loads(BALL).derive().simulate()


def shown(trajectory, of=None):
    return picture_of(trajectory, of).panels


class TestCurves:
    def test_panels_and_curves(self):
        names = ("t", "z", "x", "dot(theta)", "theta", "x[1,2]", "energy", "d(x)/d(m)")
        text = "z:x + theta, dot( theta ):theta, x[1,2], energy,d(x)/d(m)"
        assert read_panels(text, names, "of") == (
            (Curve("z", "x"), Curve("theta", "t")),
            (Curve("dot(theta)", "theta"),),
            (Curve("x[1,2]"),),
            (Curve("energy"),),
            (Curve("d(x)/d(m)"),),
        )

    @pytest.mark.parametrize(
        ("text", "column", "length", "said"),
        [
            ("z:x, thta", 6, 4, "did you mean 'theta'"),
            ("xyzzy9:x", 1, 6, "it has t, x, z, theta"),
            ("z:", 3, 1, "a name is missing"),
            ("", 1, 1, "a name is missing"),
            ("z,,x", 3, 1, "a name is missing"),
            ("z:x:t", 1, 5, "ORDINATE:ABSCISSA"),
            ("x, __import__('os')", 4, 16, "it has t, x, z, theta"),
        ],
    )
    def test_what_is_not_a_curve_is_located(self, text, column, length, said):
        with pytest.raises(InputError, match=re.escape(said)) as refused:
            read_panels(text, ("t", "x", "z", "theta"), "--plot-of")
        mark = refused.value.problems[0].mark
        assert (mark.file, mark.line, mark.column, mark.length) == ("--plot-of", 1, column, length)

    def test_every_mistake_is_reported(self):
        with pytest.raises(InputError) as refused:
            read_panels("a:b, x", ("t", "x"), "of")
        assert [p.mark.column for p in refused.value.problems] == [1, 3]


class TestPanels:
    def test_a_panel_for_each_dimension(self, atwood):
        labels = [(p.x.label.latex, p.y.label.latex) for p in shown(atwood)]
        assert labels == [
            (r"$t$ in $\mathrm{s}$", r"$r$ in $\mathrm{m}$"),
            (r"$t$ in $\mathrm{s}$", r"${\vartheta}$ in $\mathrm{rad}$"),
            (r"$t$ in $\mathrm{s}$", r"$\dot{r}$ in $\mathrm{m}/\mathrm{s}$"),
            (r"$t$ in $\mathrm{s}$", r"$\dot{\vartheta}$ in $\mathrm{rad}/\mathrm{s}$"),
            (r"$t$ in $\mathrm{s}$", r"$(E - E_{0}) / T_{\mathrm{max}}$"),
        ]

    def test_the_title_is_the_scenes(self, atwood):
        assert picture_of(atwood).title == "Swinging Atwood machine"
        untitled = loads(PENDULUM).derive().simulate(until=1)
        assert picture_of(untitled).title == untitled.name

    def test_a_conserved_energy_shows_its_drift(self, atwood):
        (line,) = shown(atwood)[-1].lines
        assert np.abs(line.y).max() == pytest.approx(atwood.energy_drift, rel=1e-12)
        assert line.y[0] == 0

    def test_an_energy_that_is_not_conserved_is_shown_itself(self):
        damped = PENDULUM + "dissipation: {air: 0.1*dot(theta)^2}\n"
        run = loads(damped).derive().simulate(until=1)
        assert run.energy_drift is None
        (panel,) = shown(run, "energy")
        assert np.array_equal(panel.lines[0].y, run.energy)
        assert panel.y.label.plain == "E"

    def test_a_path_of_lengths_has_one_scale(self, atwood):
        path, portrait, mixed = shown(atwood, "z_bob:x_bob, dot(r):r, r:theta")
        assert (path.is_equal, portrait.is_equal, mixed.is_equal) == (True, False, False)
        assert np.array_equal(path.lines[0].x, atwood.columns["x_bob"])
        assert np.array_equal(path.lines[0].y, atwood.columns["z_bob"])
        assert path.lines[0].label.plain == "z_bob(x_bob)"

    def test_curves_of_other_dimensions_have_no_unit(self, atwood):
        (panel,) = shown(atwood, "r + theta")
        assert panel.y.label.latex == r"$r$, ${\vartheta}$"
        assert [line.label.plain for line in panel.lines] == ["r", "θ"]

    @pytest.mark.slow
    def test_impacts_are_as_steep_as_they_are(self, ball):
        (line,) = shown(ball, "dot(z)")[0].lines
        impact = ball.events[0]
        beside = line.y[line.x == impact.t]
        assert beside.tolist() == [impact.before["dot(z)"], impact.state["dot(z)"]]
        assert beside[0] == pytest.approx(-((2 * 9.81 * 2) ** 0.5), rel=1e-6)
        assert (np.diff(line.x) >= 0).all()

    def test_sensitivities_are_partial_derivatives(self):
        labels = Labels()
        assert labels.symbol("d(theta)/d(dot(x1))").latex == (
            r"\partial \theta / \partial \dot{x}_{1}"
        )
        assert labels.symbol("dot(d(theta)/d(m))").plain == "∂θ̇/∂m"


class TestPoints:
    def test_a_simplified_curve_stays_near(self):
        t = np.linspace(0, 20, 3001)
        x, y = np.exp(-t / 9) * np.cos(t), 1e-3 * np.exp(-t / 9) * np.sin(2 * t)
        kept = simplified(x, y, 1e-3)
        assert {0, len(t) - 1} <= set(kept.tolist())
        assert len(kept) < 400
        points = np.stack([x / np.ptp(x), y / np.ptp(y)], axis=1)
        corners = points[kept]
        # The distance of every point from every chord.
        chords = np.diff(corners, axis=0)
        to_corner = points[:, None] - corners[:-1]
        along = (to_corner * chords).sum(-1) / (chords * chords).sum(-1)
        off = to_corner - np.clip(along, 0, 1)[..., None] * chords
        assert np.hypot(off[..., 0], off[..., 1]).min(axis=1).max() <= 1e-3

    def test_curves_that_stand_still_or_return(self):
        assert simplified(np.zeros(5), np.zeros(5), 1e-3).tolist() == [0, 4]
        back = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
        assert simplified(back, np.zeros(5), 1e-3).tolist() == [0, 2, 4]
        assert simplified(np.ones(1), np.ones(1), 1e-3).tolist() == [0]


class TestFiles:
    @pytest.mark.slow
    @pytest.mark.parametrize("ending", ["png", "svg", "pdf", "tex"])
    def test_pictures_are_the_same_every_time(self, atwood, tmp_path, ending):
        if ending != "tex":
            pytest.importorskip("matplotlib")
        paths = [tmp_path / f"{k}.{ending}" for k in range(2)]
        for path in paths:
            atwood.plot(path, "z_bob:x_bob + r, energy")
        first, second = (path.read_bytes() for path in paths)
        assert first == second
        assert len(first) > 1000
        assert not re.search(rb"<dc:date>|/CreationDate|\b20\d\d-\d\d-\d\d", first)

    @pytest.mark.slow
    @pytest.mark.parametrize("ending", ["svg", "pdf"])
    def test_texts_of_scenes_are_no_mathematics(self, atwood, tmp_path, ending):
        pytest.importorskip("matplotlib")
        latex = {"r": r"\vardiamondsuitheartsuit", "theta": r"\underbrace{x}"}
        labels = replace(atwood.labels, title=HOSTILE, latex=latex, units={"r": "$", "theta": "{"})
        replace(atwood, labels=labels).plot(tmp_path / f"a.{ending}", "r, theta:r")
        assert (tmp_path / f"a.{ending}").stat().st_size > 1000

    def test_pgfplots_has_the_curve(self, atwood, tmp_path):
        atwood.plot(tmp_path / "a.tex", "r, theta:r")
        text = (tmp_path / "a.tex").read_text()
        over_time, path = re.findall(r"coordinates \{\n(.*?)\}", text, re.DOTALL)
        points = np.array(re.findall(r"\((\S+),(\S+)\)", over_time), dtype=float)
        assert 10 < len(points) < len(atwood.t)
        between = np.interp(atwood.t, *points.T)
        assert np.abs(between - atwood.columns["r"]).max() < 5e-3 * np.ptp(atwood.columns["r"])
        assert path.startswith("(1,1)\n")

    def test_pgfplots_needs_no_matplotlib(self, atwood, tmp_path, monkeypatch):
        import sys

        monkeypatch.setitem(sys.modules, "matplotlib", None)
        atwood.plot(tmp_path / "a.tex")
        assert (tmp_path / "a.tex").read_text().count(r"\begin{axis}") == 5

    @pytest.mark.slow
    @pytest.mark.latex
    @pytest.mark.parametrize("of", [None, "z_bob:x_bob + r:theta, dot(r):r, energy"])
    def test_pgfplots_compiles(self, atwood, tmp_path, of):
        require_tex_package("pgfplots.sty")
        labels = replace(atwood.labels, title=HOSTILE, units={**atwood.labels.units, "r": "%_}"})
        replace(atwood, labels=labels).plot(tmp_path / "a.tex", of)
        compile_picture(tmp_path, "pgfplots", "a.tex")

    @pytest.mark.slow
    @pytest.mark.latex
    def test_pgf_compiles(self, atwood, tmp_path):
        pytest.importorskip("matplotlib")
        require_tex_package("pgf.sty")
        labels = replace(atwood.labels, title=HOSTILE)
        replace(atwood, labels=labels).plot(tmp_path / "a.pgf")
        compile_picture(tmp_path, "pgf", "a.pgf")


def require_tex_package(file):
    if shutil.which("pdflatex") is None or shutil.which("kpsewhich") is None:
        pytest.skip("pdflatex is not installed")
    if not subprocess.run(["kpsewhich", file], capture_output=True, check=False).stdout:
        pytest.skip(f"{file} is not installed")


def compile_picture(folder, package, file):
    (folder / "it.tex").write_text(
        rf"\documentclass{{article}}\usepackage[T1]{{fontenc}}\usepackage{{amsmath,{package}}}"
        rf"\begin{{document}}\input{{{file}}}\end{{document}}"
    )
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "it.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    assert (folder / "it.pdf").exists()
