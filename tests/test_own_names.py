"""Test files have names of their own, since pytest imports them by name alone."""

from __future__ import annotations

from collections import Counter
from pathlib import Path


def test_no_two_test_files_have_the_same_name() -> None:
    paths = Path(__file__).parent.rglob("*.py")
    # Emitted modules are compared and not imported.
    counts = Counter(path.name for path in paths if "outputs" not in path.parts)
    assert [name for name, count in counts.items() if count > 1] == []
