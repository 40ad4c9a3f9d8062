"""Equilibria and branches that are known by construction: nothing false is said of them."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_a_slice_of_the_campaign(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    campaign = importlib.import_module("soundness_equilibria")
    outcomes = campaign.results(8, seed=2)
    assert not [o for o in outcomes if o.false]
    assert sum(o.counts["verdicts"] for o in outcomes) >= 2
    assert sum(o.counts["parts of branches"] for o in outcomes) >= 2
