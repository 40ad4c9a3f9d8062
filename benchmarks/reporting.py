"""How a benchmark ends: its largest mismatch, its rows as JSON, and whether all results agree."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["verdict"]

#: Results that differ by more than this are not those of the same system.
LARGEST_MISMATCH = 1e-10


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
