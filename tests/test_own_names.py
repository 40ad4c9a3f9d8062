"""Test files have names of their own, since pytest imports them by name alone."""

from __future__ import annotations

from collections import Counter
from pathlib import Path


def test_no_two_test_files_have_the_same_name() -> None:
    counts = Counter(path.name for path in Path(__file__).parent.rglob("*.py"))
    assert [name for name, count in counts.items() if count > 1] == []
