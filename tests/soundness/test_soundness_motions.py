"""A slice of the campaign that looks for right runs that are disproved and wrong ones that pass."""

from __future__ import annotations

import importlib
import os
import shutil
from pathlib import Path

import pytest

pytestmark = [pytest.mark.compiler, pytest.mark.slow]


def test_no_right_run_is_disproved_and_no_wrong_one_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("cc") is None:
        assert os.environ.get("CI") != "true"
        pytest.skip("no C compiler is installed")
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
    campaign = importlib.import_module("soundness_motions")
    found = [outcome.word for outcome in campaign.campaign(24, 11, 1, each=6)]
    assert len(found) == 24
    assert not set(found) & set(campaign.BAD)
    assert sum(word.startswith("ok") for word in found) > 16
