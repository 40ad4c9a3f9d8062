"""A slice of the campaign that kills commands: nothing is lost or half-written."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import pytest

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def kills(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("soundness_kills")


def test_commands_that_are_ended_leave_what_was_or_what_is(kills: ModuleType) -> None:
    verdicts = list(kills.campaign(3, 3, ("fmt",)))
    assert [verdict.wrong for verdict in verdicts] == [[]] * 3
    assert any(verdict.code != 0 for verdict in verdicts)


def test_what_is_wrong_is_found(kills: ModuleType, tmp_path: Path) -> None:
    """The judge itself: files that are gone, cut short, or of two runs."""
    place = kills.Place(tmp_path, 0)
    scenario = kills.SCENARIOS["emit c"]
    names = scenario.outputs
    whole = kills.Reference(
        dict.fromkeys(names, b"new"), dict.fromkeys(names, b"old"), 1.0, frozenset()
    )
    (place.folder / "out").mkdir()
    cases = {
        (b"new", b"new"): [],
        (b"old", b"old"): [],
        (b"new", b"old"): ["half-written"],
        (b"ne", b"new"): ["half-written"],
        (b"", b"old"): ["lost"],
    }
    for contents, expected in cases.items():
        for name, data in zip(names, contents, strict=True):
            (place.folder / name).write_bytes(data)
        verdict = kills.Verdict("SIGTERM", "emit c", 143)
        kills.judge_outputs(verdict, place, scenario, whole)
        assert [kind for kind, _ in verdict.wrong] == expected


def test_parts_of_a_motion_are_told_from_half_a_file(kills: ModuleType) -> None:
    assert kills.is_part("a.csv", b"t,x\n0,1\n1,2\n")
    assert not kills.is_part("a.csv", b"t,x\n0,1\n1,")
    assert not kills.is_part("a.csv", b"t,x\n0,1\n1\n")
    assert not kills.holds(kills.is_part, "a.npz", b"PK\x03\x04")
    assert not kills.is_part("a.txt", b"anything")
