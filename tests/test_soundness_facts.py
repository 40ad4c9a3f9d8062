"""No fact is stated that is false, and no false expectation passes: a slice of the campaign."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def test_a_slice_of_the_campaign(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes 0 to 79 of seed 7; the campaign has 20,000."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    campaign = importlib.import_module("soundness_facts").campaign
    counts, lines = campaign(80, 7)
    assert counts["scenes"] > 70
    assert counts["facts stated"] > 80
    assert counts["false expectations"] > 400
    assert counts["facts stated and false"] == counts["false expectations passed"] == 0, lines
    assert counts["facts true and not stated"] + counts["true expectations failed"] <= 3, lines


def test_the_judge_sees_what_is_false(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers alone convict a fact that is put in the program's mouth."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    module = importlib.import_module("soundness_facts")
    assert module.convicts_planted_facts()
