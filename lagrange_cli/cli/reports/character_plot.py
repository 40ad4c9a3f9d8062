"""A work–precision picture made of characters, for a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lagrange_cli.studies.tradeoff.runs import WorkPrecisionPoint

#: Characters of a row of the picture.
_WIDTH = 64

#: Rows of the picture.
_HEIGHT = 18

#: Largest error that is drawn, relative to scales.
_LARGEST_ERROR = 1.0

_LETTERS = "abcdefghijklmnopqrstuvwxyz"


def character_plot(
    points: Sequence[WorkPrecisionPoint], width: int = _WIDTH, height: int = _HEIGHT
) -> list[str]:
    """Draw the logarithm of the error over that of the seconds, a letter for each method.

    Capitals are on the front; they cover other letters at their place.
    """
    letters = _letters(points)
    drawn = [
        (math.log10(p.median), math.log10(p.distance), p)
        for p in points
        if p.seconds and 0 < p.distance <= _LARGEST_ERROR
    ]
    if not drawn:
        return ["no run to draw"]
    low, high = math.floor(min(y for _, y, _ in drawn)), math.ceil(max(y for _, y, _ in drawn))
    left, right = math.floor(min(x for x, _, _ in drawn)), math.ceil(max(x for x, _, _ in drawn))
    low, left = min(low, high - 1), min(left, right - 1)
    rows = [[" "] * width for _ in range(height)]
    for x, y, point in sorted(drawn, key=lambda d: d[2].pareto):
        column = round((x - left) / (right - left) * (width - 1))
        row = round((high - y) / (high - low) * (height - 1))
        letter = letters[point.setting.method]
        rows[row][column] = letter.upper() if point.pareto else letter
    return [
        "error",
        *_with_axis(rows, low, high),
        f"{'':7}+{'-' * width}",
        f"{'':7}{f'1e{left:+03d}':<{width - 6}}{f'1e{right:+03d} s':>7}",
        "  " + "  ".join(f"{letter} {name}" for name, letter in letters.items()),
    ]


def _letters(points: Sequence[WorkPrecisionPoint]) -> dict[str, str]:
    names = dict.fromkeys(p.setting.method for p in points)
    return dict(zip(names, _LETTERS, strict=False))


def _with_axis(rows: Sequence[Sequence[str]], low: int, high: int) -> list[str]:
    """Write each power of ten before the row that is nearest to it."""
    last = len(rows) - 1
    labels = {round((high - y) / (high - low) * last): f"1e{y:+03d}" for y in range(low, high + 1)}
    return [f"{labels.get(k, ''):>6} |{''.join(row)}".rstrip() for k, row in enumerate(rows)]
