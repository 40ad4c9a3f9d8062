"""Equations with contacts as text, LaTeX and JSON."""

from __future__ import annotations

import json
import shutil
import subprocess
from functools import cache

import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.report.writers.latex.document import equations_latex
from lagrange_cli.scene import read_text

BEAD = """
name: bead
parameters: {m: 1, g: 9.81, R: 2, e: 0.5}
plane: xz
particles: {bead: {mass: m, position: [x, y, z]}}
constraints:
  sphere: {unilateral: x^2 + z^2 >= R^2, restitution: e/2}
  rope: (x - t)^2 + z^2 <= 9*R^2
coordinates: [x, z]
potentials: {weight: {gravity: g}}
"""

BESIDE = """
name: beside
parameters: {m: 1, R: 2}
particles: {bead: {mass: m, position: [x, y, z]}}
constraints:
  wire: x^2 + y^4 = R^2
  "wall": "x <= R/2"
near: {x: 0, y: 1}
"""


@cache
def equations(text: str = BEAD, forces: bool = False) -> Equations:
    return derive(read_text(text), forces=forces)


def test_account_and_contacts() -> None:
    lines = derivation_text(equations(), width=100).splitlines()
    assert "Degrees of freedom   3N = 3, K = 1, DOF = 2, 2 one-sided constraints" in lines
    assert "  sphere   x² + z² ≥ R²   (one-sided, scleronomic; restitution e/2)" in lines
    assert "  rope     (x - t)² + z² ≤ 9 R²   (one-sided, rheonomic)" in lines
    start = lines.index("Contacts")
    assert lines[start : start + 6] == [
        "Contacts",
        "  sphere   x² + z² - R² ≥ 0   restitution ½ e",
        "  rope     9 R² - z² - (x - t)² ≥ 0   restitution 0",
        "  Where a gap is 0 its multiplier is at least 0, and times the gradient of the gap it is"
        " the force",
        "  of the contact; where a gap is open its multiplier is 0",
        "  A gap that closes opens again with the speed of its closing times its restitution",
    ]


def test_plain_text() -> None:
    text = derivation_text(equations(), ascii=True, form="explicit")
    assert text.isascii()
    assert "  sphere   x^2 + z^2 - R^2 >= 0   restitution 1/2*e\n" in text
    assert "  ddot(z) = " in text
    assert "lambda_sphere" in text


def test_energy_between_impacts() -> None:
    text = derivation_text(equations(BEAD.replace("(x - t)^2", "x^2")))
    assert "E = T + V     L does not depend on t (between impacts)\n" in text
    assert (
        "Conserved   No cyclic momentum is conserved, and neither is the energy."
        in derivation_text(equations())
    )


def test_forces_of_contacts() -> None:
    text = derivation_text(equations(forces=True))
    assert "  bead     f_x = 2 " in text
    assert "force on bead = 2 λ_sphere √(x² + z²)" in text
    assert "λ_sphere = λ_sphere" not in text


def test_json() -> None:
    report = json.loads(json.dumps(derivation_report(equations())))
    assert (report["unilateral"], report["constraints"], report["dof"]) == (2, 1, 2)
    assert report["formulation"] == "multiplier"
    assert report["multipliers"] == ["lambda_sphere", "lambda_rope"]
    assert report["closure"] == []
    sphere, rope = report["contacts"]
    assert sphere == {
        "name": "sphere",
        "gap": "x^2 + z^2 - R^2",
        "gradient": [{"coordinate": "x", "entry": "2*x"}, {"coordinate": "z", "entry": "2*z"}],
        "multiplier": "lambda_sphere",
        "restitution": "1/2*e",
    }
    assert (rope["name"], rope["restitution"]) == ("rope", "0")
    assert [row["residual"] for row in report["equations"]] == [
        "m*ddot(x) - 2*lambda_sphere*x + 2*lambda_rope*(x - t)",
        "m*ddot(z) + m*g - 2*lambda_sphere*z + 2*lambda_rope*z",
    ]


def test_closures_and_contacts_are_told_apart() -> None:
    report = derivation_report(equations(BESIDE))
    assert report["multipliers"] == ["lambda_wire", "lambda_wall"]
    assert [c["name"] for c in report["closure"]] == ["wire"]
    assert [c["name"] for c in report["contacts"]] == ["wall"]
    text = derivation_text(equations(BESIDE))
    assert text.index("Closure equations") < text.index("Contacts")


def test_without_contacts_nothing_is_said() -> None:
    free = equations(BESIDE.replace('  "wall": "x <= R/2"\n', ""))
    assert derivation_report(free)["contacts"] == []
    assert derivation_report(free)["unilateral"] == 0
    text = derivation_text(free)
    assert not any(word in text for word in ("Contacts", "unilateral", "restitution", "impact"))


def latex(e: Equations, style: str) -> str:
    options = {option.name: option.default for option in EMITTERS["latex"].options}
    files = EMITTERS["latex"].emit(e, {**options, "style": style})
    return files[f"{e.presentation.name}.tex"]


def test_complementarity_in_latex() -> None:
    aligned = equations_latex(equations())
    assert r"& 0 \le \lambda_{\mathrm{sphere}} \perp x^{2} + z^{2} - R^{2} \ge 0" in aligned
    document = latex(equations(), "document")
    assert (
        r"\varphi_{k} \ge 0,\quad \lambda_{k} \ge 0,\quad \lambda_{k} \varphi_{k} = 0" in document
    )
    assert r"\text{2 one-sided constraints}" in document
    assert r"x^{2} + z^{2} \ge R^{2}" in document
    assert r"for sphere" in document
    assert r"\sum_{k} \lambda_{k} \frac{\partial \varphi_{k}}{\partial q_{j}}" in document
    assert r"\perp" in latex(equations(), "snippet")


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no pdflatex")
@pytest.mark.parametrize("text", [BEAD, BESIDE])
def test_the_document_compiles(text: str, tmp_path) -> None:
    (tmp_path / "it.tex").write_text(latex(equations(text, forces=True), "document"))
    run = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "it.tex"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert run.returncode == 0, run.stdout[-2000:]
