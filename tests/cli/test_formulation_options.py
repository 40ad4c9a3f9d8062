"""Options that say in which form the equations are derived, emitted and simulated."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from typing import get_args

import pytest

from lagrange_cli.api import load
from lagrange_cli.cli.options import FORMULATIONS
from lagrange_cli.report.formats import ReportForm
from lagrange_cli.report.values.simulation import Simulated
from lagrange_cli.scene.conditions import Formulation
from tests.cli.terminal import lagrange, succeed

SPHERICAL = "systems/pendulums/spherical_pendulum.yaml"
LINKAGE = "systems/constraints/four_bar_linkage.yaml"
TODA = "systems/oscillators/toda_lattice.yaml"
TRAMMEL = "systems/sliding/trammel.yaml"
TOP = "systems/rigid/heavy_top.yaml"


def test_choices_are_those_of_scenes():
    assert get_args(Formulation) == FORMULATIONS


@pytest.mark.slow
def test_derive_with_multipliers():
    text = succeed("derive", SPHERICAL, "--form", "multiplier")
    assert "3N = 3, K = 1, DOF = 2" in text
    assert "Coordinates   x, y, z" in text
    assert "bob   x² + y² + z² - l² = 0" in text
    assert "operations predicted" in text
    assert "λ_bob" in succeed("derive", SPHERICAL, "--form", "multiplier", "--forces")
    assert r"\lambda" in succeed("derive", SPHERICAL, "--form", "multiplier", "--format", "latex")


@pytest.mark.slow
def test_json_has_both_predictions_and_singular_places():
    found = json.loads(succeed("derive", SPHERICAL, "--json"))
    assert found["formulation"] == "minimal"
    assert found["predicted"].keys() == {"minimal", "multiplier"}
    assert found["singular"] == [{"coordinate": "phi", "where": "sin(theta) = 0"}]
    found = json.loads(succeed("derive", SPHERICAL, "--json", "--form", "multiplier"))
    assert found["formulation"] == "multiplier"
    assert found["multipliers"] == ["lambda_bob"]
    assert found["singular"] == []
    assert json.loads(succeed("derive", LINKAGE, "--json"))["predicted"] is None


@pytest.mark.slow
def test_singular_places_in_words():
    assert "  The motion of φ is singular where sin θ = 0.\n" in succeed("derive", SPHERICAL)
    assert "  The motion of phi is singular where sin(theta) = 0.\n" in succeed(
        "derive", SPHERICAL, "--ascii"
    )
    assert r"singular where $\sin \theta = 0$" in succeed("derive", TOP, "--format", "latex")
    assert "singular" not in succeed("derive", "systems/pendulums/double_pendulum.yaml")


@pytest.mark.parametrize(
    ("command", "line"),
    [
        (("derive", TODA, "--form", "multiplier"), "toda_lattice.yaml:9:14: "),
        (("emit", TODA, "--to", "python", "--formulation", "multiplier"), "toda_lattice.yaml:9"),
        (("simulate", LINKAGE, "--formulation", "minimal"), "four_bar_linkage.yaml:26:7: "),
    ],
)
def test_a_form_that_there_is_not(command, line):
    done = lagrange(*command)
    assert done.returncode == 2
    assert line in done.stderr
    assert "there is no" in done.stderr


@pytest.mark.slow
@pytest.mark.compiler
def test_emit_with_multipliers(tmp_path):
    succeed("emit", SPHERICAL, "--to", "c", "--formulation", "multiplier", "-o", str(tmp_path))
    text = (tmp_path / "spherical_pendulum.h").read_text()
    assert "spherical_pendulum_project" in text
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-c"]
    source = tmp_path / "spherical_pendulum.c"
    subprocess.run([compiler, *flags, str(source), "-o", str(tmp_path / "o")], check=True)
    minimal = succeed("emit", SPHERICAL, "--to", "python")
    assert "project" not in minimal
    assert minimal == succeed("emit", SPHERICAL, "--to", "python", "--formulation", "minimal")


@pytest.mark.slow
def test_simulate_in_both_forms_gives_the_same_names_and_numbers():
    how = ("--until", "2", "--accuracy", "1e-9", "--json")
    runs = [
        json.loads(succeed("simulate", SPHERICAL, "--formulation", form, *how))
        for form in ("minimal", "multiplier")
    ]
    assert [run["formulation"] for run in runs] == ["minimal", "multiplier"]
    ours, theirs = (run["state"] for run in runs)
    assert ours.keys() == theirs.keys()
    assert theirs == pytest.approx(ours, abs=1e-8)


@pytest.mark.slow
def test_simulate_goes_on_past_an_elbow():
    done = lagrange("simulate", TRAMMEL, "--until", "20", "--json")
    found = json.loads(done.stdout)
    assert done.returncode == 0
    assert (found["status"], found["formulation"]) == ("ok", "multiplier")
    assert found["t"] == 20.0
    assert "in multiplier form: the coordinates are singular where" in done.stderr
    assert any("in multiplier form" in remark for remark in found["remarks"])
    kept = lagrange("simulate", TRAMMEL, "--until", "20", "--json", "--formulation", "minimal")
    assert kept.returncode == 1
    assert json.loads(kept.stdout)["t"] < 20.0
    assert "singular where" in kept.stderr


@pytest.mark.slow
def test_euler_angles_at_gimbal_lock_are_refused():
    done = lagrange("simulate", TOP, "-i", "theta=0")
    assert done.returncode == 2
    assert "the coordinates are singular where sin(theta) = 0" in done.stderr


@pytest.mark.slow
def test_what_is_not_known_is_not_a_number(tmp_path):
    """The azimuth of the pole, at the first sample; in JSON such a number is null."""
    scene = "systems/constraints/spherical_pendulum_from_the_pole.yaml"
    path = tmp_path / "motion.csv"
    succeed("simulate", scene, "--until", "1", "--samples", "11", "-o", str(path))
    header, first, second, *_ = path.read_text().splitlines()
    column = header.split(",").index("phi")
    assert first.split(",")[column] == "nan"
    assert float(second.split(",")[column]) == pytest.approx(0.6435011087932844)


def test_form_is_told_where_it_is_another_one():
    """The form stands in the report where the motion left the scene's, whatever else is said."""
    derivation = load(TRAMMEL).derive()
    model = derivation.model()
    run = derivation.simulate(until=0.1)
    told = replace(run, remarks=("something else",))
    assert "\nForm " not in ReportForm().written(Simulated(told, model)).text()
    gone_on = replace(told, formulation="multiplier")
    assert "\nForm      multiplier\n" in ReportForm().written(Simulated(gone_on, model)).text()
