"""The campaign of fits from afar: its judge sees values that are off, a slice is right or told."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("fits")


def test_values_that_are_off_are_seen(fits, monkeypatch) -> None:
    fitted = fits.fit_of(fits.drawn_record(1, 7))
    off = tuple(replace(value, value=value.value + 6 * value.error) for value in fitted.values)
    monkeypatch.setattr(fits, "fit_of", lambda record: replace(fitted, values=off))
    assert fits.outcome_of(1, 7).outcome == "false"


def test_time_ends(fits, monkeypatch) -> None:
    monkeypatch.setattr(fits, "LIMIT", 1e-6)
    assert fits.outcome_of(7, 7).outcome == "out of time"


def test_first_values_of_a_restitution_are_below_one(fits) -> None:
    records = [fits.drawn_record(10 + 11 * k, 7) for k in range(8)]
    first = [record.first["e"] for record in records if "e" in record.first]
    assert max(first) == 0.99


@pytest.mark.parametrize("number", [0, 1, 3, 4, 5, 6, 8, 9])
def test_a_slice_is_right(fits, number: int) -> None:
    outcome = fits.outcome_of(number, 7)
    assert outcome.outcome == "right", str(outcome)
