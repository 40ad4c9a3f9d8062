"""No expected equation with a flipped sign passes a check; the campaign would see one that does."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


@pytest.fixture
def sign_flips(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("sign_flips")


def test_every_sign_is_flipped_once(sign_flips) -> None:
    text = "expect:\n  equations:\n    - >-\n      1.5e-3*x - y\n      + z = 0\n    - -x = 0\n"
    flipped = list(sign_flips.flipped(text))
    assert [change.replace("\n      ", " ") for change in flipped] == [
        "expect:\n  equations:\n    - >- 1.5e-3*x + y + z = 0\n    - -x = 0\n",
        "expect:\n  equations:\n    - >- 1.5e-3*x - y - z = 0\n    - -x = 0\n",
        "expect:\n  equations:\n    - >- 1.5e-3*x - y + z = 0\n    - +x = 0\n",
    ]


def test_flips_of_a_scene_are_refused(sign_flips, monkeypatch) -> None:
    path, counts = ROOT / "systems" / "pendulums" / "pendulum.yaml", sign_flips.Counts()
    sign_flips.count(path, counts)
    assert (counts.equations, counts.refused, counts.same, counts.passed) == (1, 1, 0, 0)
    monkeypatch.setitem(sign_flips.CHECKS, "equations", lambda expect, equations: [])
    sign_flips.count(path, counts)
    assert counts.passed == 1
