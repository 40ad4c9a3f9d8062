"""Shipped scenes keep their accuracy, judged by references of more than twice the digits."""

from __future__ import annotations

import importlib
import json
import os
import random
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import mpmath
import numpy as np
import pytest
import yaml

from lagrange_cli import loads
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.toolchain.compiler import CompileError

ROOT = Path(__file__).parents[3]
SYSTEMS, REFERENCES = ROOT / "systems", ROOT / "tests" / "references"
STORED = sorted(REFERENCES.rglob("*.json"))
ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12)

#: Those that are tested here; benchmarks/calibration.py takes all.
SLICE = random.Random(1788).sample([(path, eps) for path in STORED for eps in ACCURACIES], 8)

BALL = """
name: ball
parameters: {m: 1, g: 8, e: 0.5}
particles: {ball: {mass: m, position: [0, 0, z]}}
coordinates: [z]
constraints: {floor: {unilateral: z >= 0, restitution: e}}
potentials: {weight: {gravity: g}}
initial: {z: 3, dot(z): 0}
simulate: {until: 1.5, samples: 7}
"""

PENDULUM = """
name: pendulum
parameters: {m: 1, g: 9.75, l: 2}
plane: xz
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: g}}
initial: {theta: 2, dot(theta): 0}
simulate: {until: 10, samples: 21}
"""


@pytest.fixture(scope="module")
def calibration() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "benchmarks")
        yield importlib.import_module("calibration")


def scene_of(path: Path) -> tuple[Path, str]:
    """The scene and the formulation that a reference is of."""
    name, formulation, _ = path.name.split(".")
    return SYSTEMS / path.relative_to(REFERENCES).parent / f"{name}.yaml", formulation


def words(case: object) -> str:
    path, accuracy = case
    return f"{path.relative_to(REFERENCES).with_suffix('')}-{accuracy:.0e}"


@pytest.mark.slow
@pytest.mark.parametrize("case", SLICE, ids=words)
def test_seeded_slice(case, calibration):
    path, accuracy = case
    system = calibration.system(*scene_of(path))
    row = calibration.measured(system, accuracy, calibration.read(path))
    assert row.error is not None or row.reason
    assert not calibration.report.wrong(row)
    assert not calibration.report.below(row)


def test_references_are_fresh(calibration):
    """Else: python benchmarks/calibration.py --references"""
    stale = [
        path
        for path in STORED
        if calibration.stored_content(path) != calibration.content(scene_of(path)[0])
    ]
    assert stale == []


@pytest.mark.slow
def test_every_scene_that_moves_has_a_reference(calibration):
    there = {scene_of(path)[0] for path in STORED}
    for scene in calibration.scenes([]):
        sections = yaml.load(scene.read_text(encoding="utf-8"), yaml.CBaseLoader)
        moves = "initial" in sections and "until" in sections.get("simulate", {})
        # The rule of the references takes smooth equations of coordinates; states, tables, samples
        # and kinks are judged by closed forms in tests/systems.
        is_smooth = not sections.keys() & {"states", "functions", "controllers"}
        is_smooth = is_smooth and scene.parent.name != "switching"
        assert (scene in there) == (moves and is_smooth), scene


def test_references_say_how_they_were_made():
    for path in STORED:
        found = json.loads(path.read_text(encoding="utf-8"))
        assert found["made"]["error"] <= 1e-16
        assert found["made"]["ends"] == ""
        assert len(found["samples"]) >= 5


def made(calibration, text):
    """The reference of a scene, or a skip where there is no quadruple precision."""
    equations = loads(text).derive().equations
    try:
        return calibration.reference_of(
            calibration.System(SYSTEMS / "none.yaml", "minimal", equations, model_of(equations))
        )
    except CompileError as error:
        if os.environ.get("CI") == "true":
            raise
        pytest.skip(error.reason)


@pytest.mark.slow
def test_a_reference_is_the_closed_form_to_25_digits(calibration):
    """A pendulum from rest: sin(theta/2) = k sn(K - w t), k the sine of half the amplitude."""
    found = made(calibration, PENDULUM)
    with mpmath.workdps(40):
        k, w = mpmath.sin(1), mpmath.sqrt(mpmath.mpf("9.75") / 2)
        quarter = mpmath.ellipk(k**2)
        for time, high, low in zip(found.times, found.high, found.low, strict=True):
            sn = mpmath.ellipfun("sn", quarter - w * mpmath.mpf(float(time)), m=k**2)
            exact = 2 * mpmath.asin(k * sn)
            assert abs(mpmath.mpf(high[0]) + mpmath.mpf(low[0]) - exact) < 1e-25


@pytest.mark.slow
def test_events_of_a_reference(calibration):
    """Falling from 3 with g = 8 the ball meets the floor at √3/2, with half its speed after it."""
    found = made(calibration, BALL)
    with mpmath.workdps(40):
        fall = mpmath.sqrt(3) / 2
        (hit,) = found.happened
        assert hit.name == "contact:floor"
        assert abs(mpmath.mpf(hit.high) + mpmath.mpf(hit.low) - fall) < 1e-28
        late = mpmath.mpf(1.5) - fall
        exact = 4 * fall * late - 4 * late**2
        assert abs(mpmath.mpf(found.high[-1, 0]) + mpmath.mpf(found.low[-1, 0]) - exact) < 1e-28


def test_what_is_wrong_is_called_wrong(calibration):
    """A sample of a result moved by 1.1 times the accuracy, and by more than the estimate."""
    path = REFERENCES / "pendulums" / "pendulum.minimal.json"
    reference, system = calibration.read(path), calibration.system(*scene_of(path))
    found = simulate(system.model, accuracy=1e-6)
    error = calibration.judged(found, reference)
    assert error <= found.estimated < 1e-6
    moved = {name: column.copy() for name, column in found.columns.items()}
    (coordinate,) = found.coordinates
    moved[coordinate][reference.numbers[3]] += 1.1e-6
    assert 1e-6 < calibration.judged(replace(found, columns=moved), reference) < 1.2e-6


@pytest.mark.slow
def test_a_variant_obeys_the_constraints(calibration):
    """Other numbers, other states, the same twice."""
    path = REFERENCES / "constraints" / "four_bar_linkage.multiplier.json"
    model = calibration.system(*scene_of(path)).model
    one, again, other = (calibration.variant(model, seed) for seed in (1, 1, 2))
    assert one == again
    assert one.initial != other.initial != model.initial
    found = simulate(one, accuracy=1e-6, until=0.1)
    assert found.status == "ok"
    assert found.constraint_drift < 1e-13


def test_the_page_counts_what_it_shows(calibration):
    row = calibration.report.Row(
        "a/b", "minimal", 1e-6, "ok", 1.0, 1.0, 1e-8, 1e-7, "DOP853", 100, 350, ""
    )
    bad = replace(row, accuracy=1e-9)
    refused = replace(row, accuracy=1e-12, status="refused", error=None, estimate=None)
    first, second, third = calibration.report.summary([row, bad, refused])
    assert first == (
        "3 runs, 1 right to the end, 0 right as far as they are kept, 1 refused, 1 silently wrong"
    )
    assert "100.00 % of 2 runs" in second
    assert "cost 2.5 times the run" in third
    text = calibration.report.page([row, bad, refused], 1e-16, 41)
    assert "| a/b | minimal | 1.0e-08 / 1.0e-07 | **1.0e-08** / 1.0e-07 | refused |" in text
    assert np.isclose(row.overhead, 2.5)
