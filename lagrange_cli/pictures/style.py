"""The one style of all pictures: looks of lines in the order of a panel, and the legend.

:func:`looks` gives each line of a panel its colour, dashes and symbols, which both writers draw;
:func:`legend_corner` looks for room for the legend.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from lagrange_cli.pictures.picture import DASHES, SYMBOLS, Line, Look, Panel
from lagrange_cli.simulate.arrays import Array

#: Colours that differ in lightness too, for print in black and white (M. Okabe and K. Ito, Color
#: Universal Design, 2002).
COLOURS = ("#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")

#: Colours of a bar, dark to light: those of viridis but for its yellow, which paper swallows.
BAR_COLOURS = ("#440154", "#3b528b", "#21918c", "#5ec962")

_GREY, _PALE = "#b3b3b3", "#dedede"

#: Dots of a line that are drawn large, since they stand alone.
_FEW_DOTS = 100

#: Lines of the longest legend.
_LONGEST_LEGEND = 24


def legend_lines(panel: Panel) -> tuple[Line, ...]:
    """List the lines that a legend names; none if there is nothing to tell apart, or too much."""
    named = tuple(
        line
        for line in panel.lines
        if line.style != "faint" and line.look is None and not line.is_again and line.level is None
    )
    most = len(COLOURS) if any(line.style == "dots" for line in named) else _LONGEST_LEGEND
    return named if panel.has_legend and 1 < len(named) <= most else ()


def looks(panel: Panel) -> Iterator[tuple[Line, Look]]:
    """Yield the lines of a panel with their looks, in which lines of one panel differ."""
    named = {id(line) for line in legend_lines(panel)}
    number = 0
    for line in panel.lines:
        place = number if line.colour is None else line.colour
        look = line.look or _look(line, place, is_named=id(line) in named)
        number += line.style in ("line", "dots", "marked", "bars") and line.dash is None
        yield line, look


def _look(line: Line, number: int, *, is_named: bool) -> Look:
    colour = None if line.level is not None else COLOURS[number % len(COLOURS)]
    match line.style:
        case "faint":
            return Look(_GREY, 0.5, is_named=False)
        case "rule":
            return Look("#808080", 0.9, 2, is_named=is_named)
        case "band":
            return Look(_PALE, 5.0, is_named=is_named)
        case "dots":
            size = 2.5 if len(line.x) <= _FEW_DOTS else 1.3
            return Look(colour, 0.0, 0, 0, size, is_named)
        case "bars":
            return Look(colour, 0.0, 0, 0, 3.0, is_named)
        case "marked":
            return Look(colour, 1.0, 0, number % SYMBOLS, 4.0, is_named)
        case "crosses":
            return Look(COLOURS[0], 0.0, 0, -1, 9.0, is_named)
    if line.dash is not None:
        return Look(COLOURS[0], 1.0, line.dash % DASHES, is_named=is_named)
    return Look(colour, 1.0, 0 if colour is None else number % DASHES, is_named=is_named)


# Room for the legend.

#: Centimetres of the sample of a line with the space beside it, of a letter, of a row, around all.
_SAMPLE, _LETTER, _ROW, _AROUND = 1.1, 0.18, 0.46, 0.35

#: Part of the extent of lines that axes show beside them.
_MARGIN = 0.05

#: Points that stand for the shortest line.
_FEWEST = 200

#: Places of a legend within axes.
_CORNERS = (
    *("upper right", "upper left", "lower right", "lower left"),
    *("upper center", "lower center", "center right", "center left"),
)


def legend_corner(panel: Panel, width: float, height: float) -> str | None:
    """Return the corner or side of axes where a legend covers nothing; None if it would in all.

    ``width`` and ``height`` are those of the axes in centimetres.
    """
    named = legend_lines(panel)
    longest = max((len(line.label.plain) for line in named), default=0)
    across = (_SAMPLE + _LETTER * longest + _AROUND) / width
    tall = (_ROW * len(named) + _AROUND) / height
    x, y = _places(panel, width / height).T
    for corner in _CORNERS:
        is_beside = x < across if "left" in corner else x > 1 - across
        if corner in ("upper center", "lower center"):
            is_beside = abs(x - 0.5) < across / 2
        is_above = y > 1 - tall if "upper" in corner else y < tall
        if corner in ("center right", "center left"):
            is_above = abs(y - 0.5) < tall / 2
        if max(across, tall) < 1 and not (is_beside & is_above).any():
            return corner
    return None


def legend_columns(panel: Panel, height: float) -> int:
    """Return the columns of a legend beside axes, so that it is hardly taller than they are.

    ``height`` is that of the axes in centimetres.
    """
    return math.ceil((_ROW * len(legend_lines(panel))) / (height + _ROW))


#: Sides of a text beside a marked place, 1 for right and above, in the order of preference.
_SIDES = ((1, 1), (-1, 1), (1, -1), (-1, -1))

#: Centimetres of a letter and of the height of such a text, with the space around it.
_SMALL_LETTER, _SMALL_ROW = 0.15, 0.45


def text_sides(panel: Panel, width: float, height: float) -> list[tuple[int, int]]:
    """Return the sides of the texts of marked places on which they cover least.

    ``width`` and ``height`` are those of the axes in centimetres.
    """
    if not panel.places:
        return []
    parts, sides = _places(panel, width / height), []
    for mark, place in zip(parts[len(parts) - len(panel.places) :], panel.places, strict=True):
        letters = max(2, len(place.label.plain))
        box = np.array([(_SMALL_LETTER * letters) / width, _SMALL_ROW / height])
        steps = np.stack([np.linspace(0.1, 1, letters), np.full(letters, 0.5)], 1)
        covered = []
        for side in _SIDES:
            within = (parts - mark) * side / box
            end = mark + box * side
            is_outside = ((end < 0) | (end > 1)).any()
            count = ((within > 0.05) & (within < 1)).all(axis=1).sum()
            covered.append(count + len(parts) * is_outside)
        side = _SIDES[int(np.argmin(covered))]
        parts = np.concatenate([parts, mark + steps * box * side])
        sides.append(side)
    return sides


def _places(panel: Panel, ratio: float) -> Array:
    """Return points along all lines as parts of the axes, shape (points, 2)."""
    marks = np.array([(place.x, place.y) for place in panel.places]).reshape(-1, 2)
    points = np.concatenate(
        [*(_dense(panel, line) for line in panel.lines), _on_axes(panel, marks)]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = (low + high) / 2, np.where(high > low, high - low, 1.0)
    size = size * (1 + 2 * np.array([0.0 if panel.is_tight else _MARGIN, _MARGIN]))
    if panel.is_equal:
        size = np.array([max(size[0], size[1] * ratio), max(size[1], size[0] / ratio)])
    parts: Array = 0.5 + (points - middle) / size
    if panel.x.is_reversed:
        parts[:, 0] = 1 - parts[:, 0]
    return parts


def _dense(panel: Panel, line: Line) -> Array:
    """Return points of a line along its axes, many enough that no legend lies between two."""
    points = _on_axes(panel, np.stack([line.x, line.y], axis=1))
    points = points[np.isfinite(points).all(axis=1)]
    parts = len(points) - 1
    if not 0 < parts < _FEWEST or line.style in ("dots", "bars", "crosses"):
        return points
    steps = np.linspace(0, parts, parts * math.ceil(_FEWEST / parts) + 1)
    return np.stack([np.interp(steps, np.arange(len(points)), c) for c in points.T], axis=1)


def _on_axes(panel: Panel, points: Array) -> Array:
    return np.stack([panel.x.scaled(points[:, 0]), panel.y.scaled(points[:, 1])], axis=1)
