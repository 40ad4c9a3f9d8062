"""Points that stress a scene, and what is made of runs that are wrong."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.files import read_bytes
from lagrange_cli.scene import SceneText
from lagrange_cli.simulate.ensemble.plan.recipe import Recipe
from lagrange_cli.studies.stress import runs as stress_runs
from lagrange_cli.studies.stress.measure import stress
from lagrange_cli.studies.stress.points import STRESS_AXES

SYSTEMS = Path(__file__).parents[2] / "systems"


def recipe(scene, times=None, **more):
    path = str(SYSTEMS / f"{scene}.yaml")
    return Recipe(SceneText(path, read_bytes(path), times=times or {}), **more)


def found(scene, *axes, times=None, budget=300.0, **more):
    """The stress of a scene; no run of it is ended by the load of the machine."""
    return stress(recipe(scene, times=times or {}), axes=axes, budget=budget, **more)


def test_every_axis_says_what_it_sets():
    for axis in STRESS_AXES.values():
        first, second = axis.__doc__.splitlines()
        assert first.endswith(".")
        assert second.strip()


@pytest.mark.slow
def test_angles_on_which_nothing_depends_have_no_separatrix():
    """The azimuth of a spherical pendulum is cyclic, its polar angle is not."""
    runs = found(
        "pendulums/spherical_pendulum", "separatrix", times={"until": "0.1"}, budget=1.0
    ).runs
    assert {name for run in runs for name in run.point.initial} == {"theta", "dot(phi)"}
    assert [run.point.value for run in runs] == [1e-3, 1e-6, 1e-9, 1e-12]
    assert float(runs[-1].point.initial["theta"]) == math.pi - 1e-12


@pytest.mark.slow
def test_singular_places_of_a_chart_are_found():
    runs = found("pendulums/spherical_pendulum", "chart", times={"until": "0.2"}, budget=1.0).runs
    places = {round(float(run.point.initial["theta"]), 3) for run in runs}
    assert places == {0.0, 3.142}
    assert all(run.outcome != "wrong" and run.checked for run in runs)


@pytest.mark.slow
def test_other_units_are_compared_with_the_scene_itself():
    runs = found("pendulums/elastic_pendulum", "units", times={"until": "1"}).runs
    assert len(runs) == 5
    for run in runs:
        assert run.outcome == "holds"
        assert run.reference.endswith("the scene's units")
        assert "not bit by bit" not in run.reason
        assert run.error < 1e-9


@pytest.mark.slow
def test_a_scene_without_springs_has_no_stiffness():
    assert found("pulleys/atwood", "stiffness", "accuracy").left_out == ("stiffness",)


@pytest.mark.slow
def test_random_points_are_the_same_every_time():
    one, two = (found("pulleys/atwood", "random") for _ in range(2))
    assert one == two
    assert one.counts["holds"] == 6


def spoiled(simulate, column, error):
    """A simulation whose result is off, and says otherwise."""

    def run(*words, **how):
        right = simulate(*words, **how)
        columns = {**right.columns, column: right.columns[column] * (1 + error)}
        return replace(right, columns=columns, estimated=1e-12)

    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    ("error", "outcome", "underestimated"),
    [(0.0, "holds", False), (1e-10, "holds", True), (1e-6, "wrong", False)],
)
def test_a_wrong_result_is_called_wrong(monkeypatch, error, outcome, underestimated):
    simulate = spoiled(stress_runs.simulate_past_singularities, "x", error)
    monkeypatch.setattr(stress_runs, "simulate_past_singularities", simulate)
    result = found("pulleys/atwood", "degenerate")
    (run,) = [run for run in result.runs if run.point.parameters == {"g": "0"}]
    assert run.outcome == outcome
    assert run.underestimated is (underestimated or outcome == "wrong")
    assert result.counts["wrong"] == (outcome == "wrong")


@pytest.mark.slow
def test_where_there_is_no_reference_another_formulation_is_compared_with(monkeypatch):
    def none(*words):
        raise stress_runs.StoppedError

    monkeypatch.setattr(stress_runs, "reference", none)
    result = found("lecture/bead_on_parabola", "degenerate", times={"until": "1"})
    (run,) = [run for run in result.runs if run.point.parameters == {"g": "0"}]
    assert run.reference == "multiplier form"
    assert run.outcome == "holds"
    assert run.checked
    assert np.isfinite(run.error)


@pytest.mark.slow
def test_a_speed_of_light_in_other_units():
    """States that certify a derivation are drawn where expressions are real."""
    runs = found("oscillators/relativistic_oscillator", "units", budget=20.0).runs
    assert [run.outcome for run in runs] == ["holds"] * 5
