"""The command that runs all campaigns gives each the options that it has."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.slow
def test_every_campaign_takes_its_options(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    soundness = importlib.import_module("soundness")
    for part in soundness.PARTS:
        _, path, *words = soundness.command(part, seed=3, jobs=1)
        monkeypatch.setattr(sys, "argv", [path, *words, "--help"])
        with pytest.raises(SystemExit) as ended:
            importlib.import_module(Path(path).stem).main()
        assert ended.value.code == 0
        shown = capsys.readouterr().out
        assert all(word in shown for word in words if word.startswith("-")), part.name
