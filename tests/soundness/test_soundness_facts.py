"""No fact is stated that is false, and no false expectation passes: a slice of the campaign."""

from __future__ import annotations

import importlib
import math
import random
from dataclasses import replace
from pathlib import Path

import pytest

from lagrange_cli.api import loads
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.findings import Conserved
from lagrange_cli.scene import read_text
from tests.parts import changed

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_a_slice_of_the_campaign(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes 0 to 23 of seed 7; the campaign has 20,000."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    campaign = importlib.import_module("soundness_facts").campaign
    counts, lines = campaign(24, 7)
    assert counts["scenes"] > 20
    assert counts["facts stated"] > 24
    assert counts["false expectations"] > 120
    assert counts["facts stated and false"] == counts["false expectations passed"] == 0, lines
    assert counts["facts true and not stated"] + counts["true expectations failed"] <= 1, lines


def test_numbers_convict_facts_that_are_planted(monkeypatch: pytest.MonkeyPatch) -> None:
    """At states beyond the surface, and along a motion that crosses it."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    module, shapes = map(importlib.import_module, ("soundness_facts", "soundness_shapes"))
    stop = next(shape for shape in shapes.SHAPES if shape.name == "stop")
    term = module.Term("potential", stop, "1", {"x": 1}, "3", "0.1")
    case = module.Case("line", [term])
    equations = derive(read_text(case.scene()))
    assert [c.name for c in equations.derivation.conserved] == ["energy"]
    energy = replace(equations.derivation.conserved[0], expression=equations.system.kinetic)
    momentum = Conserved("p_x", "momentum", equations.system.coordinates[0].v, "x is cyclic", "x")
    planted = changed(equations, cyclic=("x",), conserved=(momentum, energy))
    source = random.Random(3)
    assert not set(module.false_facts(case, equations, source))
    assert set(module.false_facts(case, planted, source)) == {"cyclic x", "p_x"}
    assert not set(module.drifting(case, equations))
    assert set(module.drifting(case, planted)) == {"p_x", "energy"}


def test_an_energy_that_is_not_conserved_convicts_no_run() -> None:
    """A push that begins at x = 5.9: the kinetic energy rests before, and grows after."""
    scene = (
        "name: push\nparticles: {b: {mass: 1, position: [x, y, 0]}}\ncoordinates: [x, y]\n"
        "forces: {f: {on: x, force: 'max(0, x - 5.9)'}}\n"
        "initial: {x: 0, y: 0, dot(x): 1, dot(y): 0}\n"
    )
    found = loads(scene).derive().simulate(until=10, accuracy=1e-6)
    assert found.status == "ok"
    assert found.energy_drift is None
    assert abs(found.state["x"] - 5.9 - math.sinh(4.1)) < 1e-4
