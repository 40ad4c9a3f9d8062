"""The command that runs all campaigns gives each the options that it has."""

from __future__ import annotations

import importlib
import subprocess
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.slow
def test_every_campaign_takes_its_options(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    soundness = importlib.import_module("soundness")
    for part in soundness.PARTS:
        command = [*soundness.command(part, seed=3, jobs=1), "--help"]
        run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        assert run.returncode == 0, (part.name, run.stderr)
        options = [word for word in command[2:] if word.startswith("-")]
        assert all(option in run.stdout for option in options), part.name
