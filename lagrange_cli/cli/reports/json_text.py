"""The JSON of all reports."""

from __future__ import annotations

import json
import math
from typing import Any


def json_text(value: Any, *, ascii: bool = False) -> str:
    """Write a report as JSON, indented, with a final newline.

    Parameters
    ----------
    value
        A JSON value; numbers that are not finite are written as null, since JSON has none.
    ascii
        Escape all other characters, as in paths, whose bytes may be no text.
    """
    return json.dumps(_finite(value), indent=2, ensure_ascii=ascii, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    """Replace numbers that are not finite by null."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
