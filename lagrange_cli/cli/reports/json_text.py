"""JSON as every report writes it."""

from __future__ import annotations

import json
import math
from typing import Any


def json_text(value: Any, *, ascii: bool = False) -> str:
    """Write a report as JSON, indented, with a final newline.

    Parameters
    ----------
    value
        What JSON holds; numbers that are not finite are written as null, for JSON has none.
    ascii
        Escape all other characters, as for paths, whose bytes may be no text.
    """
    return json.dumps(_finite(value), indent=2, ensure_ascii=ascii, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    """The same JSON value with null for what is not a finite number."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
