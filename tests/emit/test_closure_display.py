"""Equations with closures as text, LaTeX and JSON."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace

import pytest
import sympy as sp

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.errors import Mark
from lagrange_cli.mechanics import derive, interpret
from lagrange_cli.notation.symbols import latex_name, multiplier_name, text_name
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.report.writers.latex.document import equations_latex
from lagrange_cli.scene import parse_expression, read_text
from tests.emit import emit_closures as closures
from tests.parts import changed


def parsed(text, equations):
    """An expression of the scene language, with multipliers, as SymPy's."""
    names = {"dot": {}, "ddot": {}}
    for c in equations.system.coordinates:
        names["dot"][c.name], names["ddot"][c.name] = c.v, c.a
    symbols = {}

    def symbol(found):
        key = f"s{len(symbols)}"
        symbols[key] = names[found[1]][found[2]]
        return key

    text = re.sub(r"\b(ddot|dot)\((\w+)\)", symbol, text)
    own = {x.name: x for c in equations.system.coordinates for x in [c.q]}
    own |= {p.name: p.symbol for p in equations.system.parameters} | {"t": equations.system.t}
    own |= {f"lambda_{c.name}": c.multiplier for c in equations.system.closures}
    return sp.sympify(text.replace("^", "**"), locals={**own, **symbols})


MAKE = {
    "pendulum": closures.pendulum,
    "chain": lambda: closures.chain(2),
    "sleigh": closures.sleigh,
    "moving_circle": closures.moving_circle,
}


@pytest.mark.slow
@pytest.mark.parametrize("form", ["lagrange", "explicit"])
@pytest.mark.parametrize("name", list(MAKE))
def test_json_holds_the_whole_system(name, form):
    equations = MAKE[name]()
    report = json.loads(json.dumps(derivation_report(equations, form)))
    kinds = [k.kind for k in equations.system.closures]
    assert report["formulation"] == "multiplier"
    assert report["dof"] == len(equations.system.coordinates) - kinds.count("position")
    assert report["nonholonomic"] == kinds.count("velocity")
    assert report["multipliers"] == [f"lambda_{k.name}" for k in equations.system.closures]
    for entry, k in zip(report["closure"], equations.system.closures, strict=True):
        assert (entry["name"], entry["kind"]) == (k.name, k.kind)
        assert sp.expand(parsed(entry["expression"], equations) - k.expression) == 0
    # The residuals are M a − f − Σ λ·gradient up to the factor shown; beside those of multipliers
    # they determine all unknowns as the system of M and gradients does.
    residuals = [parsed(row["residual"], equations) for row in report["equations"]]
    accelerations = sp.Matrix([c.a for c in equations.system.coordinates])
    multipliers = sp.Matrix([k.multiplier for k in equations.system.closures])
    gradient = sp.Matrix([list(k.gradient) for k in equations.system.closures])
    expected = sp.Matrix(equations.system.mass_matrix) * accelerations - gradient.T * multipliers
    system = [*(expected - sp.Matrix(equations.system.forcing))]
    unknowns = [*accelerations]
    if form == "explicit":
        rows = report["multiplier_equations"]
        assert [row["multiplier"] for row in rows] == report["multipliers"]
        residuals += [parsed(row["residual"], equations) for row in rows]
        system += [
            *(gradient * accelerations + sp.Matrix([k.bias for k in equations.system.closures]))
        ]
        unknowns += [*multipliers]
    found = sp.solve(residuals, unknowns, dict=True)[0]
    for unknown, value in sp.solve(system, unknowns, dict=True)[0].items():
        assert sp.simplify(found[unknown] - value) == 0


def test_minimal_reports_have_no_multipliers():
    equations = closures.closed(closures.pendulum(), [], "free")
    report = derivation_report(equations)
    assert report["formulation"] == "minimal"
    assert report["multipliers"] == []
    assert report["closure"] == []
    assert "Closure" not in derivation_text(equations)
    assert "λ" not in derivation_text(equations)


def test_text_of_the_pendulum():
    lines = derivation_text(closures.pendulum(), width=100).splitlines()
    start = lines.index("Equations of motion")
    assert lines[start : start + 8] == [
        "Equations of motion",
        "  x   m ẍ - 2 λ_rod x = 0",
        "  z   m z̈ + m g - 2 λ_rod z = 0",
        "",
        "Closure equations",
        "  rod   x² + z² - l² = 0",
        "  The multiplier times the gradient of the left side is the force that the constraint"
        " exerts.",
        "",
    ]
    plain = derivation_text(closures.pendulum(), ascii=True, form="explicit")
    assert plain.isascii()
    assert "  ddot(x) = x*(g*z - dot(x)^2 - dot(z)^2)/(x^2 + z^2)\n" in plain
    assert "  rod   x^2 + z^2 - l^2 = 0\n" in plain


def test_text_of_velocity_constraints():
    text = derivation_text(closures.sleigh(), width=100)
    assert "3N = 3, K = 0, DOF = 3, 1 nonholonomic constraint\n" in text
    assert "  blade   ẏ cos θ - ẋ sin θ = 0\n" in text
    assert "gradient of the left side by the velocities is the force" in text
    explicit = derivation_text(closures.sleigh(), form="explicit")
    assert "= m a θ̇² cos θ - λ_blade sin θ\n" in explicit


def test_integrable_rates_are_not_nonholonomic():
    """A closure of velocities whose integral has no closed form here: y/x is constant."""
    scene = (
        "name: ray\nparticles: {p: {mass: 1, position: [x, y, 0]}}\ncoordinates: [x, y]\n"
        "constraints: {level: y*dot(x) - x*dot(y) = 0}\ninitial: {x: 1, y: 2, dot(x): 1}\n"
    )
    equations = derive(read_text(scene))
    assert [c.kind for c in equations.system.closures] == ["velocity"]
    report = derivation_report(equations)
    assert (report["dof"], report["nonholonomic"]) == (1, 0)
    assert "nonholonomic" not in derivation_text(equations)
    (latex,) = EMITTERS["latex"].emit(equations).values()
    assert "nonholonomic" not in latex


def both():
    """The sleigh with its heading also on a curve: closures of both kinds."""
    equations = closures.sleigh()
    x, _, theta = equations.system.coordinates
    curve = closures.closure("curve", theta.q - x.q**2, equations.system.coordinates)
    return closures.closed(equations, [curve, *equations.system.closures], "both")


def test_closures_of_both_kinds():
    text = derivation_text(both())
    assert "DOF = 2, 1 nonholonomic constraint" in text
    assert "(by the velocities where it holds them)" in " ".join(text.split())
    (latex,) = EMITTERS["latex"].emit(both()).values()
    assert r"\sum_{k} \lambda_{k} \frac{\partial \varphi_{k}}{\partial q_{j}} + \sum_{k}" in latex
    assert r"$\psi_{k}$ where they hold velocities" in latex


@pytest.mark.slow
@pytest.mark.parametrize("form", ["lagrange", "explicit"])
def test_a_coordinate_without_inertia_is_not_divided_by_it(form):
    equations = closures.moving_circle()
    row = (sp.Integer(0),) * 3
    mass = (equations.system.mass_matrix[0], equations.system.mass_matrix[1], row)
    of = equations.system.coordinates
    follow = closures.closure("follow", of[2].q - of[0].q, of)
    bare = changed(equations, mass_matrix=mass)
    bare = closures.closed(bare, [*equations.system.closures, follow], "massless")
    for text in (
        derivation_text(bare, form=form),
        *EMITTERS["latex"].emit(bare, {"form": form}).values(),
    ):
        assert "zoo" not in text
        assert "nan" not in text.split("System")[0]
        assert "follow" in text
    report = derivation_report(bare, form)
    assert "lambda_follow" in report["equations"][2]["residual"]
    assert "zoo" not in json.dumps(report)


def test_names_of_multipliers():
    assert multiplier_name("rod") == "lambda(rod)"
    for constraint, text, latex in (
        ("rod", "λ_rod", r"\lambda_{\mathrm{rod}}"),
        ("rod1", "λ_rod1", r"\lambda_{\mathrm{rod},1}"),
        ("rod[1,2]", "λ_rod[1,2]", r"\lambda_{\mathrm{rod},1,2}"),
        ("mu", "λ_μ", r"\lambda_{\mu}"),
        ("left_rope", "λ_left_rope", r"\lambda_{\mathrm{left},\mathrm{rope}}"),
        ("sun_and_planet", "λ_sun_and_planet", r"\lambda_{\text{sun and planet}}"),
        ("rod_left_2", "λ_rod_left_2", r"\lambda_{\mathrm{rod},\mathrm{left},2}"),
    ):
        assert text_name(multiplier_name(constraint)) == text
        assert latex_name(multiplier_name(constraint)) == latex


NAMESAKE = """
name: namesake
parameters: {m: 1.4, lambda_rod: {value: 0.8, positive: true}, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = lambda_rod^2}
potentials: {weight: {gravity: g}}
"""


def test_a_parameter_of_the_name_lambda_stays_itself():
    """A scene's ``lambda_rod`` is not the multiplier of ``rod``."""
    equations = derive(read_text(NAMESAKE + "initial: {x: 0, z: -0.8}\n"), forces=True)
    report = derivation_report(equations)
    assert report["closure"][0]["expression"] == "x^2 + z^2 - lambda_rod^2"
    assert report["equations"][0]["residual"] == "m*ddot(x) - 2*lambda_rod_*x"
    assert report["multipliers"] == ["lambda_rod_"]
    text = derivation_text(equations)
    assert "x   m ẍ - 2 λ_rod_ x = 0" in text
    assert "x² + z² - λ_rod² = 0" in text
    assert "f_x = 2 λ_rod_ x" in text
    (latex,) = EMITTERS["latex"].emit(equations).values()
    assert r"- 2 \lambda_{\text{rod\_}} x" in latex
    assert r"- \lambda_{\mathrm{rod}}^{2} = 0" in latex


def test_so_it_does_where_the_multiplier_is_known():
    angle = "coordinates: [theta]\n"
    angle += "definitions: {x: lambda_rod*sin(theta), z: -lambda_rod*cos(theta)}\n"
    equations = derive(read_text(NAMESAKE + angle), forces=True)
    assert "λ_rod_ = -m (λ_rod θ̇² + g cos θ) / (2 λ_rod)" in derivation_text(equations)
    (latex,) = EMITTERS["latex"].emit(equations).values()
    assert r"\text{rod}\colon\quad \lambda_{\text{rod\_}}" in latex


def test_residuals_read_back():
    """What JSON prints is what ``expect`` reads, multipliers of families included."""
    family = (
        "name: fan\nsizes: {n: 2}\nparameters: {g: 9.81}\nplane: xz\n"
        'particles: {"b[i=1..n]": {mass: 1, position: ["x[i]", 0, "z[i]"]}}\n'
        'constraints: {"rod[i=1..n]": "x[i]^2 + z[i]^2 = 1"}\n'
        "potentials: {weight: {gravity: g}}\n"
    )
    for scene in (NAMESAKE + "initial: {x: 0, z: -0.8}\n", family):
        equations = derive(read_text(scene))
        assert equations.system.closures
        report = derivation_report(equations)
        for row, shown in zip(report["equations"], equations.derivation.shown, strict=True):
            read = interpret(equations, parse_expression(row["residual"], Mark("json", 1, 1, "")))
            assert sp.expand(read - shown.residual) == 0
        for name, closure in zip(report["multipliers"], equations.system.closures, strict=True):
            read = interpret(equations, parse_expression(name, Mark("json", 1, 1, "")))
            assert read == closure.multiplier


def test_snippet_and_aligned_hold_the_closures():
    (snippet,) = EMITTERS["latex"].emit(closures.pendulum(), {"style": "snippet"}).values()
    assert r"z\colon\quad & m \ddot{z} + m g - 2 \lambda_{\mathrm{rod}} z = 0 \label" in snippet
    assert r"\text{rod}\colon\quad & x^{2} + z^{2} - l^{2} = 0" in snippet
    aligned = equations_latex(closures.pendulum())
    assert aligned.count("= 0") == 3


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
@pytest.mark.parametrize("name", [*MAKE, "both"])
def test_documents_compile(name, tmp_path):
    equations = (MAKE | {"both": both})[name]()
    (rod, *others) = equations.system.closures
    hostile = replace(rod, name=r"a_b%$\&{", text=r"\input{x}")
    equations = changed(equations, closures=(hostile, *others))
    ((file, text),) = EMITTERS["latex"].emit(equations).items()
    (tmp_path / file).write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", file],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Overfull" not in done.stdout
