"""Slices of the campaigns of expressions and of scenes in the making, and what they would find."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import pytest

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def expressions(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("soundness_expressions")


@pytest.fixture
def editing(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("soundness_editing")


def test_expressions_are_understood_or_refused_at_a_place(expressions: ModuleType) -> None:
    (tally,) = expressions.tallies(1500, 0, 2, 0)
    assert tally.wrong == []
    kinds = {kind for kind, outcome in tally.counts if outcome == "understood"}
    assert {"arithmetic", "changed", "tokens"} <= kinds
    assert "| all | 1,500 |" in expressions.table(tally)


def test_other_values_places_and_errors_are_found(
    expressions: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert expressions.judged("arithmetic", "2 - 3 - 4", 2) == ("understood", "")
    right = expressions.parse_expression
    monkeypatch.setattr(
        expressions, "parse_expression", lambda text, mark: right(text.replace("-", "+"), mark)
    )
    assert expressions.judged("arithmetic", "2 - 3 - 4", 2)[1] == "another value than in Python"
    monkeypatch.setattr(
        expressions,
        "parse_expression",
        lambda text, mark: right(text, expressions.Mark("f", 1, 99, text)),
    )
    assert expressions.judged("changed", "2 +", 2)[1].startswith("a place that is none")
    monkeypatch.setattr(expressions, "parse_expression", lambda text, mark: {}[text])
    assert expressions.judged("changed", "2", 2)[1].startswith("raised KeyError")


def test_a_text_that_takes_too_long_is_ended(
    expressions: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    def endless(text: str, mark: object) -> None:
        while True:
            pass

    monkeypatch.setattr(expressions, "PATIENCE", 0.1)
    monkeypatch.setattr(expressions, "parse_expression", endless)
    assert expressions.judged("changed", "2", 2)[0] == "ended"


def test_scenes_in_the_making_have_answers(editing: ModuleType) -> None:
    (tally,) = editing.tallies(60, 0, 2, 0)
    assert tally.wrong == []
    assert tally.counts["renamed", ""] == 60


def test_a_name_that_is_not_changed_everywhere_is_found(
    editing: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "particles: {b: {mass: m, position: [x, 0, 0]}}\nparameters: {m: 1}\n"
    offset = text.index("m,")
    assert editing.answer("renamed", text, offset) == ""
    right = editing.answered

    def first_alone(request: dict[str, object]) -> object:
        answer = right(request)
        return {"edits": answer["edits"][:1]}

    monkeypatch.setattr(editing, "answered", first_alone)
    assert editing.answer("renamed", text, offset) == "refused with another name"
