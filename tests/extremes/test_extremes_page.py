"""The page of extremes: counts add up, and reasons are counted by kind."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

from tests.extremes.extreme_cases import CASES, found

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def extremes(monkeypatch):
    """The module of the benchmark of that name."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("extremes")


@pytest.mark.slow
def test_page_has_a_summary_and_every_case_and_scene(extremes):
    names = ("degenerate-m_=_0", "degenerate-k2_=_0:_two_springs_apart")
    results = [found(case) for case in CASES if case.name in names]
    stressed = extremes.stressed("pulleys/atwood", ["accuracy", "degenerate"], 20.0, 1)
    page = extremes.page(results, [stressed], 2.0, 40)
    assert "- 11 runs: 6 right, 0 degraded with a right estimate, 5 refused, 0 silently wr" in page
    assert "| degenerate | m = 0 | 1e-09 | refused |" in page
    assert "| atwood | 9 | 5 | 0 | 4 | 0 | 0 |" in page
    assert "| accuracy | 5 | 4 | 0 | 1 | 0 |" in page
    assert "| a mass or a positive parameter vanishes | 3 | atwood, degenerate: m1 = 0 |" in page


def test_scenes_of_the_page_are_shipped(extremes):
    for scene in extremes.SCENES:
        assert (ROOT / "systems" / f"{scene}.yaml").exists()
