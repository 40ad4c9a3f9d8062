"""Widths of lines: a length, or the words ``page`` and ``column``."""

from __future__ import annotations

import re

#: Points of a unit of length, as LaTeX has them.
_POINTS = {"pt": 1.0, "mm": 72.27 / 25.4, "cm": 72.27 / 2.54, "in": 72.27}

#: The shortest and the longest line that formulas are broken for, in points.
_LEAST, _MOST = 100.0, 4000.0

_LENGTH = re.compile(r"(\d+(?:\.\d*)?|\.\d+) ?(pt|mm|cm|in)", re.ASCII)


def is_width(text: str) -> bool:
    """Say whether a text is ``page``, ``column`` or a length that a line may have."""
    if text in ("page", "column"):
        return True
    points = length(text)
    return points is not None and _LEAST <= points <= _MOST


def length(text: str) -> float | None:
    """The points of a length such as ``8.6cm``; None for other texts."""
    match = _LENGTH.fullmatch(text)
    return float(match[1]) * _POINTS[match[2]] if match else None
