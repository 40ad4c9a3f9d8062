"""Documents that people shape: parts, styles, widths, numbers."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from lagrange_cli import InputError, load, loads
from lagrange_cli.cli.main import run
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.document_options import DEFAULT_SECTIONS, SECTIONS, is_width, length
from lagrange_cli.report.writers.latex.letters import Macros

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"

#: Part of a document → what only it says.
TELLING = {
    "system": "Particle: bob of mass",
    "account": "Generalized coordinate: ",
    "constraints": "built into the positions",
    "energies": "The kinetic energy",
    "equations": "Equations of motion",
    "result": "Result",
    "forces": "Constraint forces",
    "conserved": "Conserved quantities",
    "initial": "Initial values",
    "certificate": "8 random states",
}


@cache
def derived(scene: str, steps=None, *, forces=True):
    return load(SYSTEMS / f"{scene}.yaml").derive(forces=forces, steps=steps)


def emitted(scene: str, to="latex", steps=None, **options) -> str:
    (text,) = derived(scene, steps).emit(to, **options).values()
    return text


@pytest.mark.parametrize("to", ["latex", "markdown", "typst", "html"])
@pytest.mark.parametrize("part", TELLING)
def test_each_part_stands_alone(to, part):
    text = emitted("pendulums/pendulum", to, sections=part)
    assert [name for name, told in TELLING.items() if told in text] == [part]


def test_parts_stand_in_one_order_whatever_is_asked_for():
    forth = emitted("pendulums/pendulum", sections="energies,conserved,account")
    assert forth == emitted("pendulums/pendulum", sections="conserved, account,energies")
    assert set(TELLING) | {"sketch"} == set(SECTIONS)


@pytest.mark.slow
def test_the_sketch_is_the_one_of_tikz():
    text = emitted("pendulums/pendulum", sections="sketch")
    (picture,) = derived("pendulums/pendulum").emit("tikz").values()
    assert picture.rstrip() in text
    assert r"\usepackage{tikz}" in text
    narrow = emitted("pendulums/double_pendulum", sections="sketch", width="4cm")
    assert r"\resizebox{\linewidth}{!}{%" in narrow


def test_steps_have_parts_too():
    text = emitted("pendulums/pendulum", steps="lagrange", sections="equations")
    assert "Lagrange's equations" in text
    assert "Kinetic energy" not in text
    assert "Degrees of freedom" not in text
    assert "Kinetic energy" in emitted("pendulums/pendulum", steps="lagrange")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["derive", "--sections", "energy"], "cannot be 'energy'; it takes system, account"),
        (["derive", "--sections", "sketch"], "text holds no pictures"),
        (["derive", "--format", "markdown", "--sections", "sketch"], "Markdown holds no pictures"),
        (["derive", "--format", "json", "--sections", "account"], "no option 'sections'"),
        (["derive", "--style", "beamer"], "format 'text' has no option 'style'"),
        (["emit", "--to", "latex", "--sections", ""], "cannot be ''"),
        (["emit", "--to", "latex", "--width", "3"], "it takes page|column|LENGTH"),
        (["emit", "--to", "markdown", "--width", "page"], "no option 'width'"),
    ],
)
def test_what_a_format_has_not_is_refused(words, told, capsys):
    command, *options = words
    assert run([command, str(SYSTEMS / "pendulums/pendulum.yaml"), *options]) == 2
    assert told in capsys.readouterr().err


def test_derive_and_emit_write_the_same(capsys):
    scene = str(SYSTEMS / "pendulums/pendulum.yaml")
    options = ["--sections", "energies,forces", "--width", "8.6cm", "--numbers", "off", "-q"]
    assert run(["derive", scene, "--format", "latex", *options]) == 0
    by_derive = capsys.readouterr().out
    assert run(["emit", scene, "--to", "latex", *options]) == 0
    assert capsys.readouterr().out == by_derive
    assert "Constraint forces" in by_derive


def test_forces_that_were_not_derived_are_asked_for():
    derivation = derived("pendulums/pendulum", forces=False)
    with pytest.raises(InputError, match="constraint forces were not derived"):
        derivation.emit("latex", sections="forces")
    assert derivation.emit("latex") == derivation.emit("latex", sections=DEFAULT_SECTIONS)


@pytest.mark.parametrize(
    ("text", "points"), [("8.6cm", 244.69), ("246pt", 246), ("86mm", 244.69), (".5in", 36.135)]
)
def test_lengths(text, points):
    assert length(text) == pytest.approx(points, abs=0.01)


def test_widths_that_no_line_has():
    assert [t for t in ("page", "column", "1cm", "9 cm", "9", "9em", "1e3pt") if is_width(t)] == [
        "page",
        "column",
        "9 cm",
    ]


def longest_line(text: str) -> int:
    formulas = re.findall(r"\\begin\{align\*?\}.*?\\end\{align\*?\}", text, re.S)
    return max(len(line) for formula in formulas for line in formula.split("\\\\\n"))


@pytest.mark.slow
def test_narrow_displays_have_more_and_shorter_lines():
    wide, narrow = (
        emitted("pendulums/triple_pendulum", style="snippet", width=w) for w in ("page", "column")
    )
    assert longest_line(narrow) < 0.7 * longest_line(wide)
    assert narrow.count("\\\\\n") > wide.count("\\\\\n")


@pytest.mark.parametrize("style", ["document", "beamer", "snippet"])
@pytest.mark.parametrize("steps", [None, "lagrange"])
def test_displays_have_labels_of_their_own_or_no_numbers(style, steps):
    text = emitted("rolling/wheel_down_incline", steps=steps, style=style)
    labels = re.findall(r"\\label\{([^}]*)\}", text)
    assert labels
    assert len(set(labels)) == len(labels)
    assert all(re.fullmatch(r"eq:wheel_down_incline:[a-z]+:\d+", label) for label in labels)
    plain = emitted("rolling/wheel_down_incline", steps=steps, style=style, numbers="off")
    assert r"\label" not in plain
    assert not re.search(r"\\begin\{(equation|align|gather)\}", plain)


@pytest.mark.slow
def test_a_formula_alone_is_an_equation_and_a_long_one_is_split():
    text = emitted("pendulums/triple_pendulum", sections="conserved", width="column")
    assert "\\begin{equation}\\label{eq:triple_pendulum:conserved:1}\n\\begin{split}" in text
    text = emitted("pendulums/pendulum", sections="equations")
    assert "\\begin{equation}\\label{eq:pendulum:equations:1}\n  \\theta\\colon" in text


@pytest.mark.slow
def test_frames_are_filled_with_whole_ideas():
    text = emitted("pendulums/double_pendulum", steps="lagrange", style="beamer")
    frames = re.findall(r"\\begin\{frame\}(.*?)\\end\{frame\}", text, re.S)
    assert len(frames) == text.count(r"\end{frame}") <= 13
    equations = [f for f in frames if "0.95]{Lagrange's equations}" in f]
    subtitles = [rf"\framesubtitle{{For $\theta_{{{k}}}$}}" for k in (1, 2)]
    assert all(title in f for title, f in zip(subtitles, equations, strict=True))
    bead = derived("lecture/bead_on_parabola", "lagrange", forces=False)
    (text,) = bead.emit("latex", style="beamer").values()
    assert text.count(r"\begin{frame}") == 5
    assert r"\structure{\large Certificate}" in frames[-1]
    assert not re.search(r"\\(section|paragraph)", text)


@pytest.mark.parametrize("style", ["document", "beamer", "snippet"])
@pytest.mark.parametrize("steps", [None, "dalembert"])
def test_macros_stand_for_the_letters(style, steps):
    """With what they stand for in their places the document is the one without them."""
    scene = "rolling/wheel_down_incline"
    text = emitted(scene, steps=steps, style=style, macros=True)
    defined = dict(re.findall(r"\\providecommand\{(\\\w+)\}\[1\]\[\]\{(.*)\}\n", text))
    assert defined[r"\symalpha"] == r"#1{\alpha}"
    text = re.sub(r"% Letters of.*\n|\\InputIf.*\n|\\providecommand.*\n", "", text)

    def letters(use: re.Match[str]) -> str:
        meaning = defined.get(use[1])
        if meaning is None:
            return use[0]
        if use[2]:
            return meaning.replace("#1", use[2])
        return re.sub(r"#1\{((?:[^{}]|\{[^{}]*\})*)\}", r"\1", meaning)

    text = re.sub(r"(\\(?:sym|word)[A-Za-z]+)(?:\[(\\d?dot)\])?", letters, text)
    assert text == emitted(scene, steps=steps, style=style)


def test_macros_have_names_of_their_own():
    macros = Macros({"beta": r"\beta_0"})
    names = [macros.name(n) for n in ("x_1", "x1", "x[1]", "angle", "θ", "lambda(rod)", "beta")]
    assert names[:3] == [r"\symxOne"] * 3
    assert names[3:] == [
        r"\wordangle",
        r"\symUNineFiveTwo",
        r"\symlambdarod",
        r"\symbeta",
    ]
    assert macros.name("xOne") == r"\wordxOne"
    assert macros.name("x_one") != macros.name("x_1") != macros.name("xone")
    assert macros.name("beta", 2) == r"\symbeta[\ddot]"
    assert macros.definitions("s", [r"\symbeta \symbetax"])[2:] == [
        r"\providecommand{\symbeta}[1][]{#1{\beta}_0}"
    ]


def log_of(folder: Path, text: str) -> str:
    """Compile a document; return what pdfLaTeX says."""
    if shutil.which("pdflatex") is None:
        assert os.environ.get("CI") != "true", "CI needs pdflatex"
        pytest.skip("pdflatex is not installed")
    (folder / "page.tex").write_text(text, encoding="utf-8")
    words = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape"]
    done = subprocess.run([*words, "page.tex"], cwd=folder, capture_output=True, timeout=120)
    log = (folder / "page.log").read_text(encoding="utf-8", errors="replace")
    assert done.returncode == 0, log[-2000:]
    return log


def sticking_out(log: str) -> list[float]:
    """By how many points lines and pages stick out."""
    return [float(p) for p in re.findall(r"Overfull \\[hv]box \(([\d.]+)pt", log)]


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.parametrize(
    ("scene", "steps", "options"),
    [
        ("pendulums/double_pendulum", "lagrange", {"style": "beamer", "language": "de"}),
        ("beads/bead_on_rotating_hoop", None, {"width": "column", "sections": ",".join(SECTIONS)}),
        ("contact/ladder_leaving_wall", None, {"width": "8.6cm", "language": "fr"}),
    ],
)
def test_documents_compile_and_nothing_sticks_out(scene, steps, options, tmp_path):
    log = log_of(tmp_path, emitted(scene, steps=steps, **options))
    assert max(sticking_out(log), default=0) < 5


@pytest.mark.slow
@pytest.mark.latex
def test_no_page_ends_between_a_law_and_the_rest_of_its_sentence(tmp_path):
    """Below rules of many heights the law and the word after it are on the same page."""
    text = emitted("pendulums/pendulum", sections="equations")
    law = re.search(r"\\\[ \\postdisplaypenalty=10000 .*? \\\]\nread", text, re.S)
    assert law is not None
    preamble = text.split(r"\begin{document}")[0]
    for sentence in (law[0], law[0].replace(r"\postdisplaypenalty=10000", "")):
        pages = [
            rf"\newpage\rule{{1pt}}{{{height}pt}}\par Equations, "
            + sentence.replace(r"\[", rf"\[ \write16{{law {height}: \thepage}}")
            + rf"\write16{{read {height}: \thepage}}"
            for height in range(590, 690, 4)
        ]
        log = log_of(
            tmp_path, preamble + r"\begin{document}" + "\n\n".join(pages) + r"\end{document}"
        )
        law_on, read_on = (
            re.findall(rf"^{word} (\d+): (\d+)", log, re.M) for word in ("law", "read")
        )
        assert len(law_on) == len(pages)
        # Without the penalty there is a height at which they come apart.
        assert (law_on == read_on) == ("penalty" in sentence)


BARE = """
parameters: {m: {}, k: {}}
particles: {bob: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
"""


@pytest.mark.parametrize(
    ("to", "told"),
    [
        ("latex", "Parameters: $m$, $k$."),
        ("markdown", "Parameters: $m$, $k$."),
        ("typst", "Parameters: $m$, $k$."),
    ],
)
def test_parameters_of_which_nothing_is_known_are_a_sentence(to, told):
    (text,) = loads(BARE, file="it.yaml").derive().emit(to, sections="system").values()
    assert told in text
    known = BARE.replace("m: {}", "m: {unit: kg}")
    (text,) = loads(known, file="it.yaml").derive().emit(to, sections="system").values()
    assert told not in text


def test_parameters_of_which_nothing_is_known_are_one_line_of_text():
    derivation = loads(BARE, file="it.yaml").derive()
    assert "\n  Parameters: m, k.\n" in derivation_text(derivation.equations, sections="system")
