"""The JSON report: its keys, sparse matrices, independence of the hash seed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import sympy

from lagrange_cli.errors import Mark, Problem
from lagrange_cli.report.values import expressions
from lagrange_cli.report.values.derivation import derivation_report
from tests.emit.emit_scenes import HALF, build, coordinates, masses_through_hole, parameters
from tests.parts import changed

KEYS = [
    "name", "cartesian", "extra", "constraints", "dof", "nonholonomic", "unilateral",
    "coordinates", "formulation", "predicted", "singular", "positive", "kinetic", "potential",
    "lagrangian", "equations",
    "mass_matrix", "forcing", "cyclic", "conserved", "undecided", "energy_balance",
    "multipliers", "closure", "contacts", "inputs", "outputs", "facts", "certificate", "warnings",
]  # fmt: skip


@pytest.mark.parametrize("form", ["lagrange", "explicit"])
def test_keys(form):
    report = derivation_report(masses_through_hole(), form)
    known = [key for key in report if key != "multiplier_equations" or form == "lagrange"]
    assert known == KEYS
    assert report.get("multiplier_equations", []) == []
    assert json.loads(json.dumps(report)) == report


#: Keys with expressions, and the symbols.
LATEX_KEYS = {
    "symbols", "singular", "kinetic", "potential", "lagrangian", "equations", "mass_matrix",
    "forcing", "conserved", "energy_balance", "closure", "contacts", "inputs", "outputs",
}  # fmt: skip


def test_latex_beside_the_scene_language():
    plain, report = (derivation_report(masses_through_hole(), latex=it) for it in (False, True))
    typeset = report.pop("latex")
    assert report == plain
    assert set(typeset) == LATEX_KEYS
    assert typeset["symbols"]["dot(theta)"] == r"\dot{\theta}"
    assert typeset["kinetic"].startswith(r"\frac{1}{2} M (\dot{r}^{2} + r^{2}")
    assert typeset["equations"][1] == {
        "coordinate": "theta",
        "residual": r"M r^{2} \ddot{\theta} + 2 M r \dot{r} \dot{\theta}",
    }
    assert typeset["mass_matrix"] == [["M + m", "0"], ["0", "M r^{2}"]]
    assert typeset["conserved"][0] == {
        "name": "p_theta",
        "expression": r"M r^{2} \dot{\theta}",
    }


def test_latex_of_the_explicit_form():
    typeset = derivation_report(masses_through_hole(), "explicit", latex=True)["latex"]
    assert set(typeset) == LATEX_KEYS | {"multiplier_equations"}
    assert typeset["equations"][1]["residual"] == (
        r"\ddot{\theta} + \frac{2 \dot{r} \dot{\theta}}{r}"
    )


def test_masses_through_hole():
    report = derivation_report(masses_through_hole())
    assert (report["cartesian"], report["constraints"], report["dof"]) == (6, 4, 2)
    assert report["cyclic"] == ["theta"]
    assert report["conserved"][0] == {"name": "p_theta", "expression": "M*r^2*dot(theta)"}
    assert report["conserved"][1]["name"] == "energy"
    assert report["equations"] == [
        {"coordinate": "r", "residual": "(M + m)*ddot(r) - M*r*dot(theta)^2 + m*g"},
        {
            "coordinate": "theta",
            "residual": "M*r^2*ddot(theta) + 2*M*r*dot(r)*dot(theta)",
        },
    ]
    assert report["mass_matrix"] == [["M + m", "0"], ["0", "M*r^2"]]
    assert report["certificate"] == {"points": 8, "digits": 30, "mismatch": 3e-31}
    assert report["facts"]["positive_definite_mass_matrix"] is True


def test_explicit_form_solves_for_accelerations():
    report = derivation_report(masses_through_hole(), "explicit")
    assert [e["residual"] for e in report["equations"]] == [
        "ddot(r) - (M*r*dot(theta)^2 - m*g)/(M + m)",
        "ddot(theta) + 2*dot(r)*dot(theta)/r",
    ]


def test_large_matrices_are_sparse(monkeypatch):
    n = 9
    monkeypatch.setattr(expressions, "LARGEST_DENSE", n - 1)
    given = parameters(m=1.0)
    chosen = coordinates(*(f"x{i}" for i in range(n)))
    kinetic = sympy.Add(*(HALF * given[0].symbol * c.v**2 for c in chosen))
    report = derivation_report(build("many", given, chosen, kinetic, sympy.Integer(0)))
    assert report["mass_matrix"]["shape"] == [n, n]
    assert report["mass_matrix"]["entries"] == [[i, i, "m"] for i in range(n)]
    assert report["forcing"] == ["0"] * n


def test_warnings_carry_their_place():
    placed = Problem("unused", Mark("a.yaml", 3, 7, "text"), rule="unused", severity="warning")
    report = derivation_report(
        changed(masses_through_hole(), warnings=(placed, Problem("bare", rule="bare")))
    )
    assert report["warnings"] == [
        {"line": 3, "column": 7, "rule": "unused", "message": "unused"},
        {"line": None, "column": None, "rule": "bare", "message": "bare"},
    ]


@pytest.mark.campaign
@pytest.mark.slow
def test_output_does_not_depend_on_the_hash_seed():
    code = (
        "import json; from tests.emit import emit_scenes as s\n"
        "from lagrange_cli.report.values.derivation import derivation_report\n"
        "from lagrange_cli.report.contents.derivation.contents import derivation_text\n"
        "from lagrange_cli.api.emitters import EMITTERS\n"
        "for e in (s.masses_through_hole(), s.chain_pendulum(3), s.damped_driven()):\n"
        "    for form in ('lagrange', 'explicit'):\n"
        "        print(json.dumps(derivation_report(e, form)))\n"
        "        print(derivation_text(e, form=form))\n"
        "        print(EMITTERS['latex'].emit(e, {'form': form}))\n"
    )
    outputs = set()
    for seed in ("1", "2"):
        env = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONIOENCODING": "utf-8"}
        run = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            check=True,
            timeout=300,
            cwd=Path(__file__).parents[2],
            env=env,
        )
        outputs.add(run.stdout)
    assert len(outputs) == 1
    assert len(outputs.pop()) > 10_000
