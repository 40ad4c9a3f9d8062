"""The campaign of printed steps: its judge sees a line that is off, a slice of scenes has none."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import pytest

from lagrange_cli import load

ROOT = Path(__file__).parents[2]
HOLE = str(ROOT / "systems" / "lecture" / "masses_through_hole.yaml")


@pytest.fixture
def campaign(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("soundness_steps")


@pytest.mark.slow
def test_each_line_that_is_off_is_seen(campaign: ModuleType) -> None:
    """Formulas, one at a time, have one more term than follows from the lines above them."""
    text = load(HOLE).derive(steps="lagrange").text(ascii=True, width=campaign.WIDTH)
    whole = campaign.Judge(["r", "theta"], {}).read(text)
    assert whole.wrong + whole.unread == []
    assert whole.checked > 25
    lines = text.splitlines()
    formulas = [
        number
        for number, line in enumerate(lines)
        if number > lines.index("Velocities")
        and line.startswith("    ")
        and " = " in line
        and not any(general in line.split(" = ")[0] for general in ("_i", "q_j"))
    ]
    for number in formulas[::3]:
        line = lines[number]
        off = line.replace(" = 0", " + 1/7 = 0") if line.endswith(" = 0") else f"{line} + 1/7"
        changed = [*lines[:number], off, *lines[number + 1 :]]
        judge = campaign.Judge(["r", "theta"], {}).read("\n".join(changed))
        assert judge.wrong or judge.unread, off


def test_a_lagrangian_without_its_constant_is_seen(campaign: ModuleType) -> None:
    derivation = load(HOLE).derive(steps="lagrange")
    text = derivation.text(ascii=True, width=campaign.WIDTH)
    assert "- m*g*(r - l)\n" in text
    judge = campaign.Judge(["r", "theta"], {})
    judge.read(text.replace("- m*g*(r - l)\n", "- m*g*r\n"))
    assert len(judge.wrong) == 2  # L itself, and E


@pytest.mark.slow
def test_a_slice_of_scenes(campaign: ModuleType) -> None:
    judged = [campaign.shipped(str(ROOT / "systems" / "lecture" / "lever.yaml"), "dalembert")]
    judged += [campaign.made(seed, campaign.WAYS[seed % 2]) for seed in range(3)]
    assert {j.outcome for j in judged} == {"read"}
    assert [line for j in judged for line in (*j.wrong, *j.unread)] == []
    assert min(j.checked for j in judged) >= 12
    assert campaign.table(judged).count("\n") == 4


def test_generated_scenes_are_of_all_kinds(campaign: ModuleType) -> None:
    texts = [campaign.generated(seed) for seed in range(60)]
    for part in ("kinetic:", "forces:", "dissipation:", "constraints:", "c*t*b", "cos(w*t)"):
        assert any(part in text for text in texts), part
