"""A seeded slice of the campaign of mutated scenes (benchmarks/soundness_mutants.py)."""

from __future__ import annotations

import importlib
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest
import yaml

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def campaign(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    monkeypatch.setenv("LAGRANGE_CACHE", "off")
    return importlib.import_module("soundness_mutants")


def test_mutants_end_in_an_answer_or_a_located_refusal(
    campaign: ModuleType, tmp_path: Path
) -> None:
    """Of small scenes, by all commands but those that integrate for long."""
    mutants = importlib.import_module("mutants")
    slow = ("path", "fit", "--lyapunov", "--along", "--branches")
    quick = [entry for entry in mutants.COMMANDS if not {*slow} & {*entry[0]}]
    trees = [yaml.safe_load(text) for text in mutants.SEEDS]
    outcomes = [
        campaign.run_mutant(campaign.mutant(number, 3, trees, quick), tmp_path)
        for number in range(30)
    ]
    assert [outcome for outcome in outcomes if outcome.problem] == []
    codes = Counter(outcome.code for outcome in outcomes)
    # Most are refused, and enough are derived.
    assert codes[0] >= 5
    assert codes[2] >= 10


def test_structured_scenes_end_in_an_answer_or_a_located_refusal(
    campaign: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    outcomes = [
        campaign.run_mutant(campaign.structured(number, 3), tmp_path) for number in range(40)
    ]
    assert [outcome for outcome in outcomes if outcome.problem] == []
    # Most are valid.
    assert Counter(outcome.code for outcome in outcomes)[0] >= 20


def test_files_that_no_option_named_are_found(
    campaign: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def writing(arguments: list[str]) -> int:
        Path(arguments[1]).with_name("other").touch()
        return 0

    monkeypatch.setattr("lagrange_cli.cli.main.run", writing)
    outcome = campaign.run_mutant(campaign.Mutant(0, ("derive",), "name: x"), tmp_path)
    assert outcome.problem == "foreign: ['other']"


def test_a_mutant_is_the_same_in_every_run(campaign: ModuleType) -> None:
    trees = campaign.sources()
    assert campaign.mutant(17, 1, trees) == campaign.mutant(17, 1, campaign.sources())
    assert campaign.mutant(17, 1, trees) != campaign.mutant(18, 1, trees)


@pytest.mark.parametrize(
    ("code", "errors", "kind"),
    [
        (0, "", ""),
        (2, "scene.yaml:3:4: this is wrong\n", ""),
        (2, "this is wrong\n", "no place"),
        (3, "internal error: TypeError: x\n", "internal"),
        (1, "internal error: TypeError: x\n", "internal"),
        (139, "", "exit 139"),
    ],
)
def test_what_is_wrong_is_counted(campaign: ModuleType, code: int, errors: str, kind: str) -> None:
    problem = campaign.judged(code, "", errors)
    assert problem.startswith(kind)
    assert bool(problem) == bool(kind)


def test_what_says_nothing_is_ended(
    campaign: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def silent(arguments: list[str]) -> int:
        while True:
            pass

    monkeypatch.setattr(campaign, "PATIENCE", 0.2)
    monkeypatch.setattr("lagrange_cli.cli.main.run", silent)
    one = campaign.Mutant(0, ("derive",), "name: x")
    assert campaign.run_mutant(one, tmp_path).problem.startswith("late")


def test_what_goes_on_and_says_so_is_ended_late(
    campaign: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from lagrange_cli.stages import announce

    def telling(arguments: list[str]) -> int:
        while True:
            announce("still at it")

    monkeypatch.setattr(campaign, "LONGEST", 0.3)
    monkeypatch.setattr("lagrange_cli.cli.main.run", telling)
    outcome = campaign.run_mutant(campaign.Mutant(0, ("derive",), "name: x"), tmp_path)
    assert (outcome.code, outcome.problem) == (campaign.ENDED, "")
