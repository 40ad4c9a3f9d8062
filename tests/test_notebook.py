"""What notebooks show of every value: its report, in HTML and in LaTeX."""

from __future__ import annotations

import importlib
import inspect
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from lagrange_cli import InputError, load, loads
from lagrange_cli.analysis.values import FrequencyResponse
from lagrange_cli.api import Derivation, Report, Section, Trajectory
from lagrange_cli.api.analyzed import Analyzed
from lagrange_cli.api.derivation import Shown
from lagrange_cli.drawn import Reported
from lagrange_cli.report.formats import ReportForm
from lagrange_cli.report.writers.latex.document import equations_latex
from lagrange_cli.simulate.ensemble.store.result import Ensemble
from lagrange_cli.studies.fit.result import Fit, FitFinding
from lagrange_cli.studies.linear_motion import LinearMotion
from lagrange_cli.studies.lyapunov import Lyapunov
from lagrange_cli.studies.path.result import Paths
from lagrange_cli.studies.stress.measure import Stress
from lagrange_cli.studies.tradeoff.result import Trade
from tests.emit.emit_scenes import chain_pendulum
from tests.systems.shipped import derived

ROOT = Path(__file__).resolve().parents[1]
HOSTILE = "<script>alert(\"$x$\")</script> & <b onclick='y'> $\\frac{1}$ </td></table>"


#: What the interface returns that is no text, mapping or part of a run.
VALUES = {
    *(Analyzed, Derivation, Ensemble, Fit, FrequencyResponse, LinearMotion, Lyapunov, Paths),
    *(Report, Section, Shown, Stress, Trade, Trajectory),
}

#: Returned, and shown by no report: films play.
PARTS = {"Film | None", "Model", "Package", "PathModels"}


class Page:
    """What a notebook has of a value: its text, headings, and rows of cells."""

    def __init__(self, value: Any) -> None:
        self.html = value._repr_html_()
        self.tree = ElementTree.fromstring(f"<div>{self.html}</div>")
        self.text = "".join(self.tree.itertext())
        self.headings = ["".join(e.itertext()) for n in ("h1", "h2") for e in self.tree.iter(n)]
        self.rows = [["".join(cell.itertext()) for cell in row] for row in self.tree.iter("tr")]

    def cells(self, name: str) -> list[str]:
        """The cells of the row that begins with a name."""
        (row,) = [row[1:] for row in self.rows if row[0] == name]
        return row

    def said(self, label: str) -> list[str]:
        """What stands beside a label in a list of terms."""
        terms = list(self.tree.iter("dt"))
        answers = list(self.tree.iter("dd"))
        pairs = zip(terms, answers, strict=True)
        return ["".join(a.itertext()) for t, a in pairs if "".join(t.itertext()) == label]


@pytest.fixture(scope="module")
def derivation():
    return load(ROOT / "systems" / "pendulums" / "double_pendulum.yaml").derive()


@pytest.fixture
def katex(monkeypatch):
    """What KaTeX refuses of formulas."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    documents = importlib.import_module("documents")
    if not documents.has_katex():
        pytest.skip("node does not find katex (npm install --no-save katex)")
    return lambda formulas: documents.refused_by_katex([(f, False) for f in formulas])


@pytest.mark.parametrize("kind", sorted(VALUES, key=lambda kind: kind.__name__))
def test_every_value_shows_itself_by_its_report(kind):
    assert kind._repr_html_ is Reported._repr_html_
    assert kind._repr_latex_ is Reported._repr_latex_


def test_every_value_that_a_derivation_returns_is_one_of_them():
    methods = [f for n, f in inspect.getmembers(Derivation, callable) if not n.startswith("_")]
    returned = {f.__annotations__.get("return", "Self") for f in methods}
    names = {name for name in returned if name[0].isupper() and name not in ("None", "Self")}
    assert names <= {kind.__name__ for kind in VALUES} | PARTS


def test_a_trajectory_shows_its_accuracy_and_its_end(derivation):
    trajectory = derivation.simulate(until=1.0, accuracy=1e-9)
    shown = Page(trajectory)
    assert shown.headings == ["double_pendulum at t = 1"]
    (accuracy,) = shown.said("Accuracy")
    assert accuracy.startswith("10−9 requested, ")
    value, rate, unit = shown.cells("θ1")
    assert float(value.replace("−", "-")) == pytest.approx(trajectory.state["theta1"], rel=1e-8)
    rates = float(rate.replace("−", "-"))
    assert rates == pytest.approx(trajectory.state["dot(theta1)"], rel=1e-8)
    assert unit == "rad"
    assert r"$\theta_{1}$" in trajectory._repr_latex_()


def test_a_motion_that_ends_says_why():
    ball = load(ROOT / "systems" / "contact" / "bouncing_ball.yaml").derive()
    (first,) = Page(ball.simulate(until=0.5)).rows[-1:]
    assert first[:2] == ["0.451523641", "contact:floor"]
    chosen = Page(ball.simulate(until=0.2, method="RK45", rtol=1e-6))
    promise = "nothing is promised or estimated: a method was chosen"
    assert chosen.said("Accuracy") == [promise]


def test_texts_of_a_trajectory_are_escaped(derivation):
    trajectory = derivation.simulate(until=0.1)
    labels = replace(trajectory.labels, units={"theta1": "<b>"})
    hostile = replace(
        trajectory, name=HOSTILE, labels=labels, reason=HOSTILE, remarks=(HOSTILE, "it")
    )
    shown = Page(hostile)
    assert shown.headings[0].startswith(HOSTILE)
    assert shown.said("Reason") == [HOSTILE]
    assert shown.said("Remark") == [HOSTILE, "it"]
    assert not list(shown.tree.iter("b"))


def test_an_ensemble_shows_its_members(derivation):
    ensemble = derivation.ensemble(
        {"theta1": [0.1, 0.2], "m1": [1, -1]}, until=0.5, reduce=["max(theta1)"]
    )
    shown = Page(ensemble)
    assert shown.headings == ["double_pendulum: 4 of 4 members", "Reduced", "Failed"]
    assert shown.said("Status") == ["2 ok, 2 refused"]
    (reduced,) = shown.said("max(theta1)")
    assert reduced.endswith(", of 2 members")
    (refused,) = shown.said("3")
    assert refused.startswith("θ1 = 0.2, m1 = -1: refused, ")
    reasons = np.array([HOSTILE] * 4)
    hostile = Page(replace(ensemble, arrays={**ensemble.arrays, "member/reason": reasons}))
    assert hostile.said("1") == [f"θ1 = 0.1, m1 = -1: refused, {HOSTILE}"]


def test_sections_responses_and_linear_systems_are_shown(derivation):
    crossings = derivation.section("theta1=0, dot(theta1)>0", until=2.0)
    assert Page(crossings).headings == [
        f"double_pendulum where theta1=0, dot(theta1)>0: {len(crossings)} points"
    ]
    beside = load(ROOT / "systems" / "pendulums" / "pendulum.yaml").derive().linearize(until=1.0)
    assert Page(beside).headings == ["pendulum", "Along the motion"]
    spring = load(ROOT / "systems" / "oscillators" / "driven_spring.yaml").derive()
    response = Page(spring.frequency_response(0.1, 100))
    assert response.headings == ["Frequency response"]
    assert "6.32455532" in response.text


@pytest.mark.slow
@pytest.mark.latex
def test_what_notebooks_hold_compiles_within_their_document(derivation, tmp_path):
    """Of the packages that are not LaTeX's own nbconvert loads these two."""
    if shutil.which("pdflatex") is None:
        pytest.skip("pdflatex is not installed")
    values = derivation, derivation.simulate(until=1.0), derivation.analyze()
    body = "\n\n".join(value._repr_latex_() for value in values)
    preamble = r"\documentclass{article}\usepackage[T1]{fontenc}\usepackage{amsmath,booktabs}"
    text = preamble + "\n\\begin{document}\n" + body + "\n\\end{document}\n"
    (tmp_path / "it.tex").write_text(text, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "it.tex"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
    assert run.returncode == 0, run.stdout.decode(errors="replace")[-2000:]


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_garbage")
def test_a_trade_shows_its_front(derivation, katex):
    trade = derivation.tradeoff(methods=["DOP853"], repeat=1, until=0.5)
    assert repr(trade).startswith("<Trade of double_pendulum: ")
    page = ReportForm("markdown").written(trade)
    assert page.startswith("# double\\_pendulum until t = $0.5$: ")
    assert "| method | setting | error | seconds |" in page
    assert f"--method {trade.recommended[0].point.setting.method} --rtol" in page
    assert katex(re.findall(r"\$([^$]+)\$", page)) == []


def test_a_derivation_shows_a_page_and_formulas(derivation, katex):
    page = Page(derivation)
    assert page.html in derivation.emit("html")["double_pendulum.html"]
    assert "Equations of motion" in page.headings
    assert r"\paragraph{Equations of motion}" in derivation._repr_latex_()
    assert katex([equations_latex(derivation.equations)]) == []
    assert repr(derivation.equations) == (
        "<Equations of double_pendulum in theta1, theta2: minimal form>"
    )


def test_a_page_holds_no_text_of_the_scene_as_markup():
    parameter = "{value: 1, latex: 'x|y|', description: 'a | b <i> $z$'}"
    scene = f"""
        title: "<b> $x$ # *bold* | [a](b)"
        parameters: {{m: {parameter}}}
        particles: {{p: {{mass: m, position: [x, 0, 0]}}}}
        coordinates: [x]
    """
    page = loads(scene, file="it.yaml").derive().emit("markdown")["it.md"]
    assert page.startswith(r"# \<b\> $x$ \# \*bold\* \| \[a\](b)")
    (row,) = [line for line in page.splitlines() if line.startswith("| $")]
    assert row == r"| ${x\vert{}y\vert{}}$ | a \| b \<i\> $z$ | $1$ |"


@pytest.mark.slow
def test_equations_that_nobody_would_read_are_left_out(derivation):
    bicycle = replace(derivation, equations=derived("bicycle"))
    assert "<code>--written-out</code> prints them." in bicycle._repr_html_()
    assert len(bicycle._repr_latex_()) < 40_000
    assert repr(bicycle) == "<Derivation of bicycle>"


def test_parts_of_a_derivation_are_shown_alone(derivation):
    shown = derivation.show("account", "certificate")
    assert Page(shown).headings == ["Double pendulum", "Degrees of freedom", "Certificate"]
    assert "\n## Degrees of freedom\n" in repr(shown)
    german = derivation.show(language="de")
    assert "Freiheitsgrade" in Page(german).headings
    assert r"\paragraph{Freiheitsgrade}" in german._repr_latex_()
    assert "<svg" in derivation.show("sketch")._repr_html_()
    with pytest.raises(InputError, match="'sections' of format 'html' cannot be 'acount'"):
        derivation.show("acount")


@pytest.mark.slow
def test_long_equations_are_broken(katex):
    formula = equations_latex(chain_pendulum(8))
    lines = formula.splitlines()[1:-1]
    assert len(lines) > 2 * 8
    assert all(line.startswith("&") for line in lines)
    assert max(map(len, lines)) < 300
    assert katex([formula]) == []


@pytest.mark.slow
def test_an_analysis_shows_its_page(derivation, katex):
    analysis = derivation.analyze()
    assert Page(analysis).html in analysis.emit("html")["double_pendulum.html"]
    page = analysis.emit("markdown")["double_pendulum.md"]
    assert "## Modes" in page
    assert repr(analysis) == analysis.text()
    documents = importlib.import_module("documents")
    assert documents.refused_by_katex(documents.formulas(page)) == []


def test_paths_show_actions_and_starts():
    ball = load(ROOT / "systems" / "lecture" / "thrown_ball.yaml").derive()
    paths = ball.path({"x": 0, "z": 0, "t": 0}, {"x": 4, "z": 0, "t": 1}, starts=2)
    (table,) = [
        line for line in ReportForm("markdown").written(paths).splitlines() if "minimum" in line
    ]
    action, *rates = (float(x) for x in re.findall(r"([-\d.]+)\$", table)[-3:])
    assert action == pytest.approx(paths.solutions[0].action, rel=1e-6)
    assert rates == pytest.approx([4, 4.905])


def test_fits_show_values_with_their_errors(tmp_path):
    pendulum = load(ROOT / "systems" / "pendulums" / "pendulum.yaml").derive()
    times = np.linspace(0, 2, 21)
    motion = pendulum.simulate(until=2.0, samples=21)
    path = tmp_path / "measured.csv"
    lines = [
        f"{float(t)!r},{float(x)!r}" for t, x in zip(times, motion.columns["theta"], strict=True)
    ]
    path.write_text("t,theta\n" + "\n".join(lines) + "\n")
    fit = pendulum.fit(path, ["l"])
    (row,) = [
        line
        for line in ReportForm("markdown").written(fit).splitlines()
        if line.startswith("| l |")
    ]
    plain = re.sub(r" \\times 10\^\{(-?\d+)\}", r"e\1", row)
    value, error, start = (float(x.strip(" $")) for x in plain.split("|")[2:5])
    assert value == pytest.approx(fit.values[0].value, rel=1e-6)
    assert (error, start) == (pytest.approx(fit.values[0].error, rel=0.1), 1.0)
    marred = replace(fit, name=HOSTILE, findings=(FitFinding("undetermined", HOSTILE),))
    assert HOSTILE in Page(marred).text


def test_exponents_are_a_table():
    exponents = Lyapunov("it", (0.5, -0.5), (0.1, 0.2), 1.0, 10.0, np.ones(1), np.ones(1))
    shown = Page(exponents)
    assert shown.headings == ["it", "Lyapunov exponents"]
    assert shown.rows == [["exponent", "spread"], ["0.5", "0.1"], ["−0.5", "0.2"]]
