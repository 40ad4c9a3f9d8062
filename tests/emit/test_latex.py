"""LaTeX: exact forms, documents that compile without overfull lines, hostile scenes."""

import os
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache

import pytest
import sympy

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.mechanics.findings import ConstraintLine
from lagrange_cli.notation.symbols import latex_text
from lagrange_cli.report.writers.latex import letters
from lagrange_cli.report.writers.latex.document import equation_latex, equations_latex
from tests.emit.emit_scenes import (
    bead_on_parabola,
    build,
    chain_pendulum,
    coordinates,
    damped_driven,
    masses_through_hole,
    parameters,
)
from tests.parts import changed

HOSTILE = [
    r"\input{/etc/passwd}",
    r"\write18{touch owned}\immediate\openout5=owned",
    "100% of $x$ & #1 ~ ^^5c \\end{document} {",
    "two\nlines\n\n\\par three",
    "`` '' -- <<>> \"quoted\" ?` ^^M",
    "Ωmega äöü ß 中文 \u202e 🚀 ½ µm",
    "\x00\x07\x1b[31m",
]


def emit(equations, **options):
    (text,) = EMITTERS["latex"].emit(equations, options).values()
    return text


def compiled(tmp_path, text):
    """Run pdfLaTeX without shell; return its log."""
    if shutil.which("pdflatex") is None:
        assert os.environ.get("CI") != "true", "CI needs pdflatex (texlive-latex-extra)"
        pytest.skip("pdflatex is not installed")
    (tmp_path / "a.tex").write_text(text, encoding="utf-8")
    run = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape", "a.tex"],
        cwd=tmp_path,
        capture_output=True,
        timeout=120,
    )
    log = (tmp_path / "a.log").read_text(encoding="utf-8", errors="replace")
    assert run.returncode == 0, log[-3000:]
    assert (tmp_path / "a.pdf").stat().st_size > 1000
    return log


def one_document(documents):
    """One document of several, which the log tells apart by their names.

    Packages are loaded once; other commands of a preamble hold for its document alone.
    """
    packages, bodies = [], []
    for name, text in documents.items():
        preamble, body = text.split("\\begin{document}\n")
        lines = preamble.splitlines()
        loading = [
            x for x in lines if x.startswith(("\\documentclass", "\\usepackage", "\\IfFile"))
        ]
        own = [x for x in lines if x not in loading and not x.startswith("%")]
        packages += [line for line in loading if line not in packages]
        body = body.rpartition("\\end{document}")[0]
        begin = rf"\clearpage\typeout{{{BEGIN}{name}}}\begingroup"
        bodies.append("\n".join([begin, *own, body, r"\endgroup"]))
    parts = [*packages, r"\begin{document}", *bodies, r"\end{document}"]
    return "\n".join(parts) + "\n"


#: What begins a line of a preamble that loads a class or a package.
LOADING = ("\\documentclass", "\\usepackage", "\\IfFileExists")

#: What the log says before a document.
BEGIN = "== document "


def logs_by_document(log):
    """The parts of the log of :func:`one_document`, by the names of its documents."""
    _, *parts = re.split(rf"^{BEGIN}", log, flags=re.M)
    return dict(part.split("\n", 1) for part in parts)


def overfull(log):
    """Points by which lines stick out of the page."""
    return [float(p) for p in re.findall(r"Overfull \\hbox \(([\d.]+)pt too wide\)", log)]


@pytest.mark.parametrize(
    ("equations", "index", "text"),
    [
        (
            bead_on_parabola(),
            0,
            r"(1 + 4 a^{2} x^{2}) \ddot{x} + 4 a^{2} x \dot{x}^{2} + 2 a g x = 0",
        ),
        (masses_through_hole(), 0, r"(M + m) \ddot{r} - M r \dot{\theta}^{2} + m g = 0"),
        (
            chain_pendulum(2),
            1,
            r"m_{2} l_{1} \ddot{\theta}_{1} \cos(\theta_{1} - \theta_{2}) "
            r"+ m_{2} l_{2} \ddot{\theta}_{2} "
            r"- m_{2} l_{1} \dot{\theta}_{1}^{2} \sin(\theta_{1} - \theta_{2}) "
            r"+ m_{2} g \sin \theta_{2} = 0",
        ),
    ],
)
def test_equations(equations, index, text):
    assert equation_latex(equations, index) == text


def test_all_equations_for_a_notebook():
    assert equations_latex(masses_through_hole()) == (
        "\\begin{aligned}\n"
        "& (M + m) \\ddot{r} - M r \\dot{\\theta}^{2} + m g = 0 \\\\\n"
        "& M r^{2} \\ddot{\\theta} + 2 M r \\dot{r} \\dot{\\theta} = 0\n"
        "\\end{aligned}"
    )


def test_snippet_holds_the_equations_alone():
    snippet = emit(masses_through_hole(), style="snippet")
    assert snippet == (
        "% Mass on a table tied through a hole to a hanging mass: "
        "equations of motion (needs amsmath)\n"
        "\\begin{align}\n"
        "  r\\colon\\quad & (M + m) \\ddot{r} - M r \\dot{\\theta}^{2} + m g = 0"
        " \\label{eq:masses_through_hole:equations:1} \\\\\n"
        "  \\theta\\colon\\quad & M r^{2} \\ddot{\\theta} + 2 M r \\dot{r} \\dot{\\theta} = 0"
        " \\label{eq:masses_through_hole:equations:2}\n"
        "\\end{align}\n"
    )


def test_document_says_what_a_reader_asks():
    text = emit(bead_on_parabola())
    for part in (
        r"\begin{center}\LARGE Bead sliding on a parabola\end{center}",
        r"3N = 3,\quad K = 2,\quad \text{DOF} = 1",
        r"\item wire: $z = a x^{2}$",
        r"T & = \frac{1}{2} m (1 + 4 a^{2} x^{2}) \dot{x}^{2}",
        r"& = T - V = ",
        r"Common factor divided out: $m$ in the equation for $x$.",
        "$L$ does not depend on $t$, so $E$ is conserved",
        r"3 \times 10^{-31}",
    ):
        assert part in text


@cache
def strange():
    """Functions, fractions and roots beyond the lecture, with units and LaTeX names."""
    given = tuple(
        replace(p, unit=u, description=d, latex=x)
        for p, u, d, x in zip(
            parameters(m=1.0, k=1e-31, G=6.7e-11, a=2.0),
            ("kg", "N/m", "m^3/(kg*s**2)", "µm 100%"),
            ("mass", None, "a long description of a constant " * 6, "scale & more"),
            (None, r"\kappa", None, r"\hat{a}_{0}"),
            strict=True,
        )
    )
    m, k, big, a = (p.symbol for p in given)
    chosen = coordinates("x", "theta_1", "angle")
    x, th, an = (c.q for c in chosen)
    functions = [
        f(x / (3 * a))
        for f in (
            sympy.sin, sympy.cos, sympy.tan, sympy.asin, sympy.acos, sympy.atan, sympy.sinh,
            sympy.cosh, sympy.tanh, sympy.asinh, sympy.acosh, sympy.atanh, sympy.exp, sympy.log,
            sympy.Abs,
        )
    ]  # fmt: skip
    potential = sympy.Add(
        *functions,
        *(f**2 * th for f in functions[:14]),
        sympy.Min(x, th, an),
        sympy.Max(x, th),
        sympy.atan2(x, th),
        -big * m**2 / sympy.sqrt(x**2 + th**2),
        (sympy.Add(*(x**i * th for i in range(1, 14))) + an) ** sympy.Rational(1, 2),
        m / sympy.Add(*(an**i * th for i in range(1, 14))),
        sympy.exp(-sympy.Add(*(th**i for i in range(1, 14)))),
        sympy.Abs(sympy.Add(*(th**i * an for i in range(1, 16)))),
        k * x ** sympy.Rational(2, 3) * sympy.Add(*(th**i for i in range(1, 14))) / a,
    )
    kinetic = sympy.Add(*(m * c.v**2 / 2 for c in chosen))
    return build("strange", given, chosen, kinetic, potential)


@pytest.mark.slow
@pytest.mark.latex
def test_documents_compile_and_stay_on_the_page(tmp_path):
    systems = [
        bead_on_parabola(),
        masses_through_hole(),
        chain_pendulum(2),
        chain_pendulum(6),
        damped_driven(),
        strange(),
        build("fixed", (), (), sympy.Integer(0), sympy.Integer(0)),
    ]
    documents = {
        f"{number} {form}": emit(equations, form=form)
        for number, equations in enumerate(systems)
        for form in ("lagrange", "explicit")
    }
    logs = logs_by_document(compiled(tmp_path, one_document(documents)))
    wide = {name: [p for p in overfull(log) if p > 10] for name, log in logs.items()}
    assert wide == {name: [] for name in documents}


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.parametrize("count", [3, 80])
def test_parameters_stand_in_a_table(count, tmp_path):
    many = build(
        "many",
        parameters(**{f"c{i}": 1.5 for i in range(count)}),
        coordinates("x"),
        coordinates("x")[0].v ** 2,
        sympy.Integer(0),
    )
    text = emit(many)
    assert text.count("& $1.5$ \\\\") == count
    # A long table is several, between which pages may end.
    assert (text.count(r"\begin{tabular}") > 1) == (count > 24)
    log = compiled(tmp_path, text)
    assert overfull(log) == []
    assert "Overfull \\vbox" not in log


@pytest.mark.slow
@pytest.mark.latex
def test_snippets_compile_in_a_document_with_amsmath(tmp_path):
    body = "".join(
        emit(e, style="snippet") for e in (masses_through_hole(), chain_pendulum(6), strange())
    )
    log = compiled(
        tmp_path,
        "\\documentclass[11pt,a4paper]{article}\\usepackage{amsmath}"
        "\\usepackage[margin=25mm]{geometry}\\allowdisplaybreaks\n"
        f"\\begin{{document}}\n{body}\\end{{document}}\n",
    )
    assert [points for points in overfull(log) if points > 10] == []


def hostile_scene(text):
    masses = masses_through_hole()
    first, *others = masses.system.parameters
    one, *more = masses.system.coordinates
    puck, *rest = masses.system.particles
    line = ConstraintLine(text, (text,), "redundant", (text,))
    return changed(
        masses,
        title=text,
        description=text,
        parameters=(replace(first, description=text, unit=text), *others),
        coordinates=(replace(one, description=text, unit=text), *more),
        particles=(replace(puck, name=text), *rest),
        account=replace(masses.derivation.account, lines=(line,)),
        conserved=tuple(replace(c, reason=text) for c in masses.derivation.conserved),
    )


@pytest.mark.slow
@pytest.mark.latex
def test_no_text_of_a_scene_acts_as_tex(tmp_path):
    documents = {str(k): emit(hostile_scene(text)) for k, text in enumerate(HOSTILE)}
    logs = logs_by_document(compiled(tmp_path, one_document(documents)))
    # A text that ended its document would end all that follow.
    assert [*logs] == [*documents]
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".aux", ".log", ".pdf", ".tex"]


@pytest.mark.parametrize("text", HOSTILE)
def test_escaped_text_holds_no_command_of_its_own(text):
    escaped = latex_text(text)
    known = re.sub(r"\\[A-Za-z]+(\{\})?|\\[{}$&#%_]|\{\}", " ", escaped)
    assert not set("\\$&#%_^~\n\0") & set(known)
    assert not re.search(r"\\(input|write|immediate|openout|end|par)\b", escaped)


@pytest.mark.slow
@pytest.mark.latex
def test_every_hostile_character_alone(tmp_path):
    blocks = (0, 0x250), (0x1E00, 0x1F00), (0x2000, 0x2300)
    every = "".join(chr(i) for first, end in blocks for i in range(first, end)) + "αβγΩπ"
    masses = changed(masses_through_hole(), description=" ".join(every))
    compiled(tmp_path, emit(masses))


@pytest.mark.parametrize(
    ("text", "latex"),
    [
        ("§ 35", r"\S{} 35"),
        ("m₂ v⁴ cm⁻", r"m\ensuremath{{}_{2}} v\ensuremath{{}^{4}} cm{[}U+207B{]}"),
        ("ẍ = ẋ′", r"\"{x} = \.{x}\ensuremath{{}'}"),
        ("«ℏ ≈ 1»", r"\guillemotleft{}\ensuremath{\hbar} \ensuremath{\approx} 1\guillemotright{}"),
        ("x\u0300y\u0302", r"x{[}U+0300{]}\^{y}"),
    ],
)
def test_signs_letters_and_scripts_print_as_themselves(text, latex):
    """Those of which LaTeX has one; others as their code point."""
    assert latex_text(text) == latex


@pytest.mark.parametrize(
    ("text", "latex"),
    [
        ("m/s^2", r"$\text{m}/\text{s}^{2}$"),
        ("kg*m**2", r"$\text{kg}\,\text{m}^{2}$"),
        ("rad", r"$\text{rad}$"),
        ("m^3/(kg*s^(-2))", r"$\text{m}^{3}/(\text{kg}\,\text{s}^{-2})$"),
        ("J/(kg*K**2)", r"$\text{J}/(\text{kg}\,\text{K}^{2})$"),
        ("1/m", r"$1/\text{m}$"),
        ("", ""),
        ("µm", r"$\text{\ensuremath{\mu}m}$"),
        (r"\par", r"\textbackslash{}par"),
    ],
)
def test_units_are_upright(text, latex):
    assert letters.unit_latex(text) == latex


def test_values():
    assert letters.LatexLetters().value(2.0) == "2"
    assert letters.LatexLetters().value(-1e-31) == "-10^{-31}"
    assert letters.LatexLetters().value(9.81, "9.810") == "9.810"
