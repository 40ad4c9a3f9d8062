"""Singular places that a motion all but meets: right coordinates, or an end before the place."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.cache import open_cache
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import compiled, interpreted
from lagrange_cli.simulate.system.singular_guard import ALWAYS, WHILE_MOVING, guard_signs

NEEDLE = """
name: needle
parameters: {d: 1e-100}
particles: {b: {mass: 1, position: [r*cos(th), r*sin(th), 0]}}
coordinates: [r, th]
initial: {r: 1, th: 0, dot(r): -1, dot(th): d}
simulate: {until: 2, accuracy: 1e-6, samples: 102}
"""

#: A great circle of the unit sphere past the pole, of which there is a form with multipliers.
SPHERE = """
name: sphere
parameters: {m: 1, d: 1e-40}
particles: {b: {mass: m, position: [x, y, z]}}
coordinates: [th, ph]
definitions: {x: sin(th)*cos(ph), y: sin(th)*sin(ph), z: cos(th)}
initial: {th: 1, ph: 0.5, dot(th): -1, dot(ph): d}
simulate: {until: 2, accuracy: 1e-6, samples: 51}
"""


def ran(text, formulation="auto", **parameters):
    return loads(text, parameters=parameters).derive(formulation=formulation).simulate()


@pytest.mark.slow
@pytest.mark.parametrize("d", [1e-6, 1e-10, 1e-14, 1e-40, 1e-100, -1e-100, 5e-324])
def test_past_the_origin(d):
    """x = 1 − t at the height d: r is never negative, th turns by half a turn."""
    run = ran(NEEDLE, d=d)
    angle = np.arctan2(d * run.t, 1 - run.t)
    assert np.abs(run.columns["r"] - np.hypot(1 - run.t, d * run.t)).max() < 1e-6
    assert np.abs(run.columns["th"] - angle).max() < 1e-6
    if abs(d) < 1e-16:
        assert run.status != "ok"
        assert run.t[-1] < 1
        assert "singular where r = 0" in run.reason
    elif abs(d) > 1e-12:
        assert run.status == "ok"


@pytest.mark.slow
@pytest.mark.parametrize("d", [1e-6, 1e-100])
def test_past_the_origin_beside_a_kink(d):
    """Right-hand sides on one side of a switching surface end there, too."""
    run = ran(NEEDLE + 'forces: {f: {on: r, force: "-max(0, r - 5)"}}\n', d=d)
    assert np.abs(run.columns["r"] - np.hypot(1 - run.t, d * run.t)).max() < 1e-6
    assert (run.status == "ok") == (d > 1e-12)


def test_through_the_origin():
    run = ran(NEEDLE, d=0)
    assert run.status == "ok"
    assert np.abs(run.columns["x_b"] - (1 - run.t)).max() < 1e-12
    assert (run.columns["th"] == 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("form", ["auto", "multiplier"])
@pytest.mark.parametrize("d", [1e-40, -1e-40, 1e-300])
def test_past_the_pole_in_the_other_form(d, form):
    """The azimuth turns the way its momentum goes, too small as that is beside everything."""
    run = ran(SPHERE, form, d=d)
    assert (run.status, run.formulation) == ("ok", "multiplier")
    assert not any("one choice" in remark for remark in run.remarks)
    known = np.abs(run.t - 1) > 0.01
    assert np.abs(run.columns["th"] - np.abs(1 - run.t))[known].max() < 1e-5
    phi = np.where(run.t < 1, 0.5, 0.5 + np.sign(d) * np.pi)
    assert np.abs(run.columns["ph"] - phi)[known].max() < 1e-5


@pytest.mark.slow
def test_a_torque_that_nothing_proves_ends_the_run():
    """Where the azimuth's momentum is not conserved, nothing tells on which side it passes."""
    text = SPHERE + 'forces: {f: {on: ph, force: "1e-30*cos(ph)*sin(th)"}}\n'
    run = ran(text.replace("samples: 51", "samples: 6"), d=1e-40)
    assert run.status != "ok"
    assert 0.3 < run.t[-1] <= 1


def test_both_kinds_of_code_end_beyond_the_place():
    model = model_of(derive(read_text(NEEDLE)))
    y = np.array(model.initial)
    assert guard_signs(model, 0.0, y).tolist() == [ALWAYS]
    assert guard_signs(model, 0.0, np.array([-1.0, 0, 1, 0])).tolist() == [-WHILE_MOVING]
    for functions in (compiled(model, open_cache()), interpreted(model, "for a test")):
        always, moving = (functions.guarded(np.array([side])) for side in (2.0, 1.0))
        for rhs in (always.rhs, *always.perturbed):
            assert np.isfinite(rhs(0.0, y)).all()
            assert np.isnan(rhs(0.0, y * [-1, 1, 1, 1])).all()
            assert np.isnan(rhs(0.0, y * [-1, 1, 1, 0])).all()
        assert np.isnan(moving.rhs(0.0, y * [-1, 1, 1, 1])).all()
        assert np.isfinite(moving.rhs(0.0, y * [-1, 1, 1, 0])).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "runs"), [("polar", 6), ("sphere", 4), ("space", 4), ("top", 3), ("body", 6)]
)
def test_random_passages_are_right_or_end(kind, runs, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[3] / "benchmarks")
    passages = importlib.import_module("soundness_passages")
    found = list(passages.results(kind, runs, np.random.default_rng(7), (1e-3, 1e-6)))
    assert not [result for result in found if result.wrong]
    assert any(result.status == "ok" for result in found)
