"""What notebooks show: tables in HTML, pages in Markdown, formulas that MathJax and KaTeX take."""

from __future__ import annotations

import importlib
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import InputError, load, loads
from lagrange_cli.notation.html import html_formula, html_table, html_text
from lagrange_cli.report.writers.latex.document import equations_latex
from lagrange_cli.studies.lyapunov import Lyapunov
from tests.emit.emit_scenes import chain_pendulum
from tests.systems.shipped import derived

ROOT = Path(__file__).resolve().parents[1]
HOSTILE = "<script>alert(\"$x$\")</script> & <b onclick='y'> $\\frac{1}$ </td></table>"


class Tables(HTMLParser):
    """Captions and rows of cells, as a reader sees them; every tag is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.captions: list[str] = []
        self.rows: list[list[str]] = []
        self.seen: set[str] = set()
        self.feed(text)
        assert self.tags == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.seen.add(tag)
        assert [name for name, _ in attrs] in ([], ["colspan"])
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        elif tag == "caption":
            self.captions.append("")

    def handle_endtag(self, tag):
        assert self.tags.pop() == tag

    def handle_data(self, data):
        if "caption" in self.tags:
            self.captions[-1] += data
        elif {"td", "th"} & set(self.tags):
            self.rows[-1][-1] += data
        else:
            assert not data.strip()

    def cell(self, name):
        """The cells of the row that begins with a name."""
        (row,) = [row[1:] for row in self.rows if row and row[0] == name]
        return row


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


def test_text_is_neither_markup_nor_mathematics():
    table = Tables(html_table(html_text(HOSTILE), (HOSTILE, "b"), [[html_text(HOSTILE), ""]], 1))
    assert table.captions == [HOSTILE]
    assert table.rows == [[HOSTILE, "b"], [HOSTILE, ""]]
    assert table.seen == {"table", "caption", "thead", "tbody", "tr", "th", "td", "span"}
    assert "$x" not in html_text(HOSTILE)
    assert html_formula("a < b") == "$a &lt; b$"


def test_long_tables_say_what_they_leave_out():
    table = Tables(html_table("", ("n",), ([str(n)] for n in range(30)), 30))
    assert [row[0] for row in table.rows] == ["n", *map(str, range(24)), "and 6 more"]


def test_a_trajectory_shows_its_accuracy_and_its_end(derivation, katex):
    trajectory = derivation.simulate(until=1.0, accuracy=1e-9)
    shown = Tables(trajectory._repr_html_())
    assert shown.captions[0] == "Double pendulum: t = 0 to 1, 501 samples, ok"
    (accuracy,) = shown.cell("accuracy")
    assert accuracy.startswith("1e-09 requested, ")
    value, rate, unit = shown.cell(r"$\theta_{1}$")
    assert float(value) == pytest.approx(trajectory.state["theta1"], rel=1e-8)
    assert float(rate) == pytest.approx(trajectory.state["dot(theta1)"], rel=1e-8)
    assert unit == "rad"
    formulas = [row[0][1:-1] for row in shown.rows if row[0].startswith("$")]
    assert len(formulas) == 8
    assert katex(formulas) == []


def test_a_motion_that_ends_says_why():
    ball = load(ROOT / "systems" / "contact" / "bouncing_ball.yaml").derive()
    shown = Tables(ball.simulate(until=2.0)._repr_html_())
    (events,) = shown.cell("events")
    assert "first contact:floor at t = 0.45" in events
    chosen = Tables(ball.simulate(until=0.2, method="RK45", rtol=1e-6)._repr_html_())
    assert chosen.cell("accuracy") == ["nothing is promised or estimated: a method was chosen"]


def test_texts_of_a_trajectory_are_escaped(derivation):
    trajectory = derivation.simulate(until=0.1)
    labels = replace(trajectory.labels, title=HOSTILE, units={"theta1": HOSTILE})
    hostile = replace(trajectory, labels=labels, reason=HOSTILE, remarks=(HOSTILE,))
    shown = Tables(hostile._repr_html_())
    assert shown.captions[0].startswith(HOSTILE)
    assert shown.cell("reason") == shown.cell("remark") == [HOSTILE]
    assert shown.cell(r"$\theta_{1}$")[2] == HOSTILE


def test_an_ensemble_shows_its_members(derivation):
    ensemble = derivation.ensemble({"theta1": [0.1, 0.2], "m1": [1, -1]}, until=0.5)
    shown = Tables(ensemble._repr_html_())
    assert shown.captions == ["double_pendulum: 4 members, 501 samples; 2 ok, 2 refused"]
    assert shown.rows[0] == ["theta1", "m1", "status", "estimated", "method", "reason"]
    assert [row[:3] for row in shown.rows[1:]] == [
        *(["0.1", "1", "ok"], ["0.1", "-1", "refused"]),
        *(["0.2", "1", "ok"], ["0.2", "-1", "refused"]),
    ]
    assert shown.rows[2][3] == ""
    reasons = np.array([HOSTILE] * 4)
    hostile = replace(ensemble, arrays={**ensemble.arrays, "member/reason": reasons})
    assert Tables(hostile._repr_html_()).rows[1][-1] == HOSTILE


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_garbage")
def test_a_trade_shows_its_front(derivation, katex):
    trade = derivation.tradeoff(methods=["DOP853"], repeat=1, until=0.5)
    assert repr(trade).startswith("<Trade of double_pendulum: ")
    page = trade._repr_markdown_()
    assert page.startswith("# double\\_pendulum until t = $0.5$: ")
    assert "| method | setting | error | seconds |" in page
    assert f"--method {trade.recommended[0].point.setting.method} --rtol" in page
    assert katex(re.findall(r"\$([^$]+)\$", page)) == []


def test_a_derivation_shows_a_page_and_formulas(derivation, katex):
    page = derivation._repr_markdown_()
    assert page == derivation.emit("markdown")["double_pendulum.md"]
    assert "## Equations of motion" in page
    formula = derivation._repr_latex_()
    assert formula.startswith("$$\n")
    assert formula.endswith("\n$$")
    assert katex([formula[3:-3]]) == []
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
    page = loads(scene, file="it.yaml").derive()._repr_markdown_()
    assert page.startswith(r"# \<b\> $x$ \# \*bold\* \| \[a\](b)")
    (row,) = [line for line in page.splitlines() if line.startswith("| $")]
    assert row == r"| ${x\vert{}y\vert{}}$ | a \| b \<i\> $z$ | $1$ |"


@pytest.mark.slow
def test_equations_that_nobody_would_read_are_left_out(derivation):
    bicycle = replace(derivation, equations=derived("bicycle"))
    assert "`--written-out` prints them." in bicycle._repr_markdown_()
    assert len(bicycle._repr_latex_()) < 20_000
    assert repr(bicycle) == "<Derivation of bicycle>"


def test_parts_of_a_derivation_are_shown_alone(derivation):
    shown = derivation.show("account", "certificate")
    headings = [line for line in shown._repr_markdown_().splitlines() if line.startswith("## ")]
    assert headings == ["## Degrees of freedom", "## Certificate"]
    assert repr(shown) == shown.markdown
    assert "## Freiheitsgrade" in derivation.show(language="de").markdown
    with pytest.raises(InputError, match="'sections' of format 'markdown' cannot be 'acount'"):
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
    page = analysis._repr_markdown_()
    assert page == analysis.emit("markdown")["double_pendulum.md"]
    assert "## Modes" in page
    assert repr(analysis) == analysis.text()
    documents = importlib.import_module("documents")
    assert documents.refused_by_katex(documents.formulas(page)) == []


def test_paths_show_actions_and_starts():
    ball = load(ROOT / "systems" / "lecture" / "thrown_ball.yaml").derive()
    paths = ball.path({"x": 0, "z": 0, "t": 0}, {"x": 4, "z": 0, "t": 1}, starts=2)
    (table,) = [line for line in paths._repr_markdown_().splitlines() if "minimum" in line]
    action, *rates = (float(x) for x in re.findall(r"\$([-\d.]+)\$", table)[-3:])
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
    (row,) = [line for line in fit._repr_markdown_().splitlines() if line.startswith("| l |")]
    plain = re.sub(r" \\times 10\^\{(-?\d+)\}", r"e\1", row)
    value, error, start = (float(x.strip(" $")) for x in plain.split("|")[2:5])
    assert value == pytest.approx(fit.values[0].value, rel=1e-6)
    assert (error, start) == (pytest.approx(fit.values[0].error, rel=0.1), 1.0)
    marred = replace(fit, name=HOSTILE, status="undetermined", reason=HOSTILE)
    hostile = marred._repr_markdown_()
    assert "<script>" not in hostile
    assert "\\<script\\>" in hostile


def test_exponents_are_a_table():
    exponents = Lyapunov("it", (0.5, -0.5), (0.1, 0.2), 1.0, 10.0, np.ones(1), np.ones(1))
    shown = Tables(exponents._repr_html_())
    assert shown.captions == ["it: averaged from t = 1 to 10"]
    assert shown.rows == [["exponent", "spread"], ["0.5", "0.1"], ["-0.5", "0.2"]]
