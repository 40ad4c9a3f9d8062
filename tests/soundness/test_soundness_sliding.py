"""The campaign of kinks that meet: exact motions are those of small steps, a slice is right."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def sliding(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("soundness_sliding")


def test_exact_motions_are_those_of_closed_forms(sliding) -> None:
    """x = 1 on a spring with friction 0.3: arcs about ±0.3, at rest at −0.2 since 2 π."""
    family = sliding.FAMILIES["dry friction on a spring, steps"]
    numbers = {"k": 1.0, "c": 0.0, "r": 0.0, "m": 0.3}
    with sliding.mp.workdps(sliding.DIGITS):
        of = sliding.Mechanism(family.forces, numbers)
        states, counts, _ = sliding.exact_motion(of, [1.0, 0.0, 0.0, 0.0], [0.0, 2.0, 5.0, 9.0])
    x = [float(z[0]) for z in states]
    assert x[1:] == pytest.approx(
        [0.3 + 0.7 * np.cos(2.0), -0.3 + 0.1 * np.cos(5.0), -0.2], abs=1e-12
    )
    assert counts["slides"] >= 1


def test_modes_at_an_intersection_are_one_or_none(sliding) -> None:
    """Two relays that drive each other: rest where the matrix is a P-matrix, else undetermined."""
    family = sliding.FAMILIES["two coupled relays"]
    with sliding.mp.workdps(sliding.DIGITS):
        rest = sliding.mp.matrix([0, 0, 0, 0, 0, 1])
        calm = sliding.Mechanism(family.forces, {"m": 2.0, "n": 2.0, "a": -1.0, "b": 1.0})
        assert sliding.next_mode(calm, rest).slides == 2
        wild = sliding.Mechanism(family.forces, {"m": -1.0, "n": -1.0, "a": -2.0, "b": 2.0})
        with pytest.raises(sliding.UndeterminedError):
            sliding.next_mode(wild, rest)


def test_a_wrong_run_is_seen(sliding, monkeypatch) -> None:
    (start,) = sliding.starts(1, np.random.default_rng(1))
    moved = sliding.moved(start)
    off = {name: column + 1e-2 for name, column in moved.columns.items()}
    monkeypatch.setattr(sliding, "moved", lambda start: replace(moved, columns=off))
    assert sliding.judged(start).wrong


def test_a_slice_is_right(sliding) -> None:
    results = [sliding.judged(start) for start in sliding.starts(4, np.random.default_rng(3))]
    assert not [result for result in results if result.wrong]
