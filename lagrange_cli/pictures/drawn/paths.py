"""Paths of stationary action: the paths, variations beside the first, and their actions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.picture import NO_LABEL, Axis, Line, Panel, Picture, axis_of
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.studies.path.measure import (
    StationaryPath,
    Variation,
    actions,
    deviation,
    modes,
)
from lagrange_cli.studies.path.result import Paths

#: Variations that are drawn, and paths whose actions are.
_VARIATIONS, _PATHS = 3, 3

#: Sizes of variations in the panels of actions, and in those of paths over the largest.
_POINTS = 61
_DRAWN = (-1.0, -0.5, 0.5, 1.0)


@picture_of.register
def picture_of_paths(paths: Paths, asked: str | None = None) -> Picture:
    """Draw coordinates over the time, and the actions of varied paths."""
    model = paths.motions.models.motion
    shown = [_shown_modes(paths, path) for path in paths.solutions[:_PATHS]]
    panels = [_path_panel(paths, k, shown[0]) for k in range(len(paths.coordinates))]
    panels += [
        _action_panel(paths, path, number, variations)
        for number, (path, variations) in enumerate(zip(paths.solutions, shown, strict=False), 1)
    ]
    return Picture(model.labels.title or model.name, tuple(panels), is_stacked=True)


def _shown_modes(paths: Paths, path: StationaryPath) -> Sequence[Variation]:
    """Return the lowest modes; of a saddle the last that lowers the action, and the next ones."""
    first = max((path.conjugacy.index or 0) - 1, 0)
    return modes(paths.motions, path)[first : first + _VARIATIONS]


def _path_panel(paths: Paths, number: int, variations: Sequence[Variation]) -> Panel:
    """Draw one coordinate of all paths, and of the variations of the first."""
    labels, first = paths.motions.models.motion.labels, paths.solutions[0]
    largest = deviation(first)
    varied = (
        Line(NO_LABEL, first.shot.t, q[:, number], "faint")
        for variation in variations
        for share in _DRAWN
        for q in [first.shot.q + share * largest * variation.values]
    )
    lines = (
        Line(_named(path, place), path.shot.t, path.shot.q[:, number])
        for place, path in enumerate(paths.solutions, 1)
    )
    y = axis_of(labels, [paths.coordinates[number]])
    return Panel((*varied, *lines), axis_of(labels, ["t"]), y, is_tight=True)


def _named(path: StationaryPath, number: int) -> Label:
    text = f"{number}: {path.conjugacy.kind}"
    return Label(text, text)


def _action_panel(
    paths: Paths, path: StationaryPath, number: int, variations: Sequence[Variation]
) -> Panel:
    """Draw the action over the size of variations."""
    labels = paths.motions.models.motion.labels
    sizes = deviation(path) * np.linspace(-1, 1, _POINTS)
    symbol = f"q_{{{number}}}"
    name = Label(
        rf"$S[{symbol} + \varepsilon\eta] - S[{symbol}]$", f"S[q{number} + εη] − S[q{number}]"
    )
    energy, time = labels.unit("energy"), labels.unit("t")
    unit = None
    if energy is not None and time is not None:
        unit = Label(rf"{energy.latex}\,{time.latex}", f"{energy.plain} {time.plain}")
    lines = tuple(_action_lines(paths, path, variations, sizes))
    x, y = Axis(Label(r"$\varepsilon$", "ε")), Axis(name, unit)
    # The legend of the first panel is that of all.
    return Panel(lines, x, y, has_legend=number == 1)


def _action_lines(
    paths: Paths, path: StationaryPath, variations: Sequence[Variation], sizes: Array
) -> Iterator[Line]:
    yield Line(NO_LABEL, sizes[[0, -1]], np.zeros(2), "faint")
    for number, variation in enumerate(variations, 1):
        changes = actions(paths.motions, path, variation, sizes)
        known = np.isfinite(changes)
        label = Label(rf"$\eta_{{{number}}}$", f"η{number}")
        yield Line(label, sizes[known], changes[known])
