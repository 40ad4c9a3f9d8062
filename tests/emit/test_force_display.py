"""Constraint forces as text, LaTeX and JSON."""

from __future__ import annotations

import json
import shutil
import subprocess
from functools import cache

import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.errors import Mark
from lagrange_cli.mechanics import derive, interpret
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.scene import parse_expression, read_text

PENDULUM = """
parameters: {m: 1.4, l: {value: 0.8, positive: true}, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: g}}
"""
ANGLE = PENDULUM + "coordinates: [theta]\ndefinitions: {x: l*sin(theta), z: -l*cos(theta)}\n"
CARTESIAN = PENDULUM + "initial: {x: 0, z: -0.8}\n"
TORSION = """
parameters: {m: 1, l: 2, k: 3}
plane: xz
particles: {bob: {mass: m, position: [l*sin(theta), y, -l*cos(theta)]}}

coordinates: [theta]
potentials: {spring: k*theta^2/2, bend: k*theta^4}
"""


#: Inertia that is written in a coordinate, and acts on no particle.
WHEEL = """
parameters: {m: 1, R: 2, k: 3, g: 9.81}
plane: xz
particles: {wheel: {mass: m, position: [R*phi, 0, R]}}
coordinates: [phi]
kinetic: {spin: m*R^2*dot(phi)^2/4}
potentials: {weight: {gravity: g}}
"""


@cache
def found(text, forces=True):
    return derive(read_text("name: tested\n" + text), forces=forces)


def section(text):
    return text.split("Constraint forces")[1].split("\n\n")[0]


def test_text_of_a_pendulum():
    shown = section(derivation_text(found(ANGLE), width=100))
    lines = [line.strip() for line in shown.splitlines()[1:]]
    assert lines == [
        "bob     f_x = -m (l θ̇² + g cos θ) sin θ",
        "f_z = m (l θ̇² + g cos θ) cos θ",
        "|f| = m |l θ̇² + g cos θ|",
        "plane   λ_plane = 0",
        "rod     λ_rod = -m (l θ̇² + g cos θ) / (2 l)",
        "force on bob = -m (l θ̇² + g cos θ)",
    ]


def test_text_with_a_multiplier_that_is_an_unknown():
    shown = section(derivation_text(found(CARTESIAN), width=100))
    assert "f_x = 2 λ_rod x" in shown
    assert "force on bob = 2 λ_rod √(x² + z²)" in shown
    assert "λ_rod =" not in shown
    assert "Multipliers and accelerations are those of the equations of motion" in shown


def test_ascii_is_in_the_scene_language():
    shown = section(derivation_text(found(ANGLE), ascii=True, width=100))
    assert shown.isascii()
    assert "lambda_rod = -m*(l*dot(theta)^2 + g*cos(theta))/(2*l)" in shown


def test_what_is_passed_on_is_said():
    shown = section(derivation_text(found(WHEEL), width=100))
    assert "These include the term spin, because it is written in coordinates" in shown
    sprung = WHEEL + "forces: {motor: {on: phi, force: k}}\n"
    shown = section(derivation_text(found(sprung), width=100))
    assert "The force on wheel is not unique: what spin, motor exerts is written in" in shown
    assert "f_" not in shown
    assert "none" not in shown


def test_no_constraint_force_is_said_to_be_none():
    free = TORSION.replace("l*sin(theta), y, -l*cos(theta)", "theta, y, 0")
    shown = section(derivation_text(found(free), width=100))
    assert shown == "   none"


@pytest.mark.parametrize("text", [ANGLE, CARTESIAN, TORSION], ids=["angle", "cartesian", "torsion"])
def test_nothing_of_it_is_shown_unless_it_is_asked_for(text):
    equations = found(text, forces=False)
    assert "Constraint forces" not in derivation_text(equations)
    assert not [key for key in derivation_report(equations) if "force" in key]
    (latex,) = EMITTERS["latex"].emit(equations, {}).values()
    assert "Constraint forces" not in latex


def test_json_reads_back():
    equations = found(ANGLE)
    report = json.loads(json.dumps(derivation_report(equations)))
    (bob,) = report["constraint_forces"]
    assert bob["particle"] == "bob"
    (body,) = equations.derivation.constraint_forces.bodies
    for text, component in zip(bob["components"], body.components, strict=True):
        read = interpret(equations, parse_expression(text, Mark("answer", 1, 1, text)))
        assert (read - component).expand() == 0
    plane, rod = report["constraint_multipliers"]
    assert (plane["name"], plane["multiplier"]) == ("lambda_plane", "0")
    assert (rod["name"], rod["constraint"]) == ("lambda_rod", "x^2 + z^2 = l^2")
    assert [f["particle"] for f in rod["forces"]] == ["bob"]
    assert report["forces_in_terms_of"] == "motion"
    assert report["forces_pass_on"] == report["undetermined_multipliers"] == []
    assert report["multipliers"] == []


def test_json_of_closures_holds_the_unknown():
    report = derivation_report(found(CARTESIAN))
    assert report["multipliers"] == ["lambda_rod"]
    assert report["constraint_forces"][0]["components"] == [
        "2*lambda_rod*x",
        "0",
        "2*lambda_rod*z",
    ]
    assert report["forces_in_terms_of"] == "multipliers"


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.parametrize("text", [ANGLE, CARTESIAN, TORSION], ids=["angle", "cartesian", "torsion"])
def test_latex_compiles(text, tmp_path):
    (latex,) = EMITTERS["latex"].emit(found(text), {}).values()
    assert r"\section*{Constraint forces}" in latex
    if shutil.which("pdflatex") is None:
        pytest.skip("no pdflatex")
    (tmp_path / "a.tex").write_text(latex, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "a.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
