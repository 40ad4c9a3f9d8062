"""What benchmarks share: the scenes that they go through, and how they end."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

#: Results that differ by more than this are not those of the same system.
LARGEST_MISMATCH = 1e-10


def scene_files(paths: Sequence[str]) -> Iterator[Path]:
    """Yield scene files, those of folders in order."""
    for path in map(Path, paths):
        yield from sorted(path.rglob("*.yaml")) if path.is_dir() else [path]


def verdict(
    rows: Sequence[Mapping[str, Any]], about: Mapping[str, Any], reference: str, path: str | None
) -> int:
    """Print the largest mismatch with the reference, write JSON if asked to; 0 if all agree."""
    worst = max(row["mismatch"] for row in rows)
    print(f"\nlargest mismatch with {reference}: {worst:.1e}")
    if path:
        with open(path, "w", encoding="utf-8") as file:
            json.dump({"about": about, "rows": rows}, file, indent=1)
    return 0 if worst < LARGEST_MISMATCH else 1
