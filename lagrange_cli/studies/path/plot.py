"""Picture of stationary paths: the paths, variations beside the first, and their actions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.simulate.results.picture import Line, Panel, Picture
from lagrange_cli.studies.path.variations import Variation, actions, deviation, modes

if TYPE_CHECKING:
    from lagrange_cli.studies.path.result import Paths, StationaryPath

#: Variations that are drawn, and paths whose actions are.
_VARIATIONS, _PATHS = 3, 3

#: Sizes of variations in the panels of actions, and in those of paths over the largest.
_POINTS = 61
_DRAWN = (-1.0, -0.5, 0.5, 1.0)

_NO_LABEL = Label("", "")


def picture_of_paths(paths: Paths) -> Picture:
    """Draw coordinates over the time, and the actions of varied paths."""
    labels = paths.motions.models.motion.labels
    shown = [_shown_modes(paths, path) for path in paths.solutions[:_PATHS]]
    panels = [_path_panel(paths, number, shown[0]) for number in range(len(paths.coordinates))]
    panels += [
        _action_panel(paths, path, number, variations)
        for number, (path, variations) in enumerate(zip(paths.solutions, shown, strict=False), 1)
    ]
    return Picture(labels.title or paths.name, tuple(panels), stacked=True)


def _shown_modes(paths: Paths, path: StationaryPath) -> Sequence[Variation]:
    """Choose modes: the lowest; of a saddle the last that lowers the action, and those after."""
    first = max((path.conjugacy.index or 0) - 1, 0)
    return modes(paths.motions, path)[first : first + _VARIATIONS]


def _path_panel(paths: Paths, number: int, variations: Sequence[Variation]) -> Panel:
    """Draw one coordinate of all paths, and of what the first is varied to."""
    labels, name = paths.motions.models.motion.labels, paths.coordinates[number]
    first = paths.solutions[0]
    largest = deviation(first)
    beside = (
        Line(_NO_LABEL, first.shot.t, q[:, number], faint=True)
        for variation in variations
        for share in _DRAWN
        for q in [first.shot.q + share * largest * variation.values]
    )
    lines = (
        Line(_named(path, place), path.shot.t, path.shot.q[:, number])
        for place, path in enumerate(paths.solutions, 1)
    )
    symbol, unit = labels.symbol(name), labels.unit(name)
    axis = Label(f"${symbol.latex}$", symbol.plain)
    if unit is not None:
        axis = Label(f"{axis.latex} in ${unit.latex}$", f"{axis.plain} in {unit.plain}")
    return Panel((*lines, *beside), _time_label(paths), axis, over_time=False, equal=False)


def _time_label(paths: Paths) -> Label:
    unit = paths.motions.models.motion.labels.unit("t")
    if unit is None:
        return Label("$t$", "t")
    return Label(f"$t$ in ${unit.latex}$", f"t in {unit.plain}")


def _named(path: StationaryPath, number: int) -> Label:
    text = f"{number}: {path.conjugacy.kind}"
    return Label(text, text)


def _action_panel(
    paths: Paths, path: StationaryPath, number: int, variations: Sequence[Variation]
) -> Panel:
    """Draw the action over the size of variations."""
    sizes = deviation(path) * np.linspace(-1, 1, _POINTS)
    lines = tuple(_action_lines(paths, path, variations, sizes))
    own = f"q_{{{number}}}"
    label = Label(rf"$S[{own} + \varepsilon\eta] - S[{own}]$", f"S[q{number} + εη] − S[q{number}]")
    units = [paths.motions.models.motion.labels.unit(name) for name in ("energy", "t")]
    energy, time = units
    if energy is not None and time is not None:
        unit = Label(rf"${energy.latex}\,{time.latex}$", f"{energy.plain} {time.plain}")
        label = Label(f"{label.latex} in {unit.latex}", f"{label.plain} in {unit.plain}")
    return Panel(lines, Label(r"$\varepsilon$", "ε"), label, over_time=False, equal=False)


def _action_lines(
    paths: Paths, path: StationaryPath, variations: Sequence[Variation], sizes: Array
) -> Iterator[Line]:
    for number, variation in enumerate(variations, 1):
        changes = actions(paths.motions, path, variation, sizes)
        known = np.isfinite(changes)
        label = Label(rf"$\eta_{{{number}}}$", f"η{number}")
        yield Line(label, sizes[known], changes[known])
    yield Line(_NO_LABEL, sizes[[0, -1]], np.zeros(2), faint=True)
