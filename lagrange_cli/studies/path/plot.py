"""Picture of stationary paths: the paths, variations beside the first, and their actions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.simulate.results.picture import Line, Panel, Picture

if TYPE_CHECKING:
    from lagrange_cli.studies.path.measure import StationaryPath
    from lagrange_cli.studies.path.motions import Motions

#: Variations that are drawn, and paths whose actions are.
_VARIATIONS, _PATHS = 3, 3

#: Sizes of variations in the panels of actions, and in those of paths over the largest.
_POINTS = 61
_DRAWN = (-1.0, -0.5, 0.5, 1.0)

_NO_LABEL = Label("", "")

# Variations.

#: Sines a coordinate that modes are made of, besides two for each conjugate point, and the most.
_SINES, _MOST_SINES = 8, 60

#: Largest deviation of varied paths in a picture, over the extent of the path.
_DEVIATION = 0.2


@dataclass(frozen=True)
class Variation:
    """A direction η(t) in which a path is varied, zero at both ends.

    Attributes
    ----------
    values, rates
        η and its rate at the nodes of the path, shape (m, n); over the scales of the coordinates
        its largest component is 1.
    second
        δ²S: the second derivative by ε of the action of q + ε η.
    """

    values: Array
    rates: Array
    second: float


def modes(motions: Motions, path: StationaryPath) -> list[Variation]:
    """Return the modes of the second variation in ascending order of their eigenvalues.

    Eigenfunctions of δ²S[η] = ∫ η·M(∂a/∂q η + ∂a/∂q̇ η̇ − η̈) dt beside ∫ η·M η dt, in a basis of
    sines. As many have a negative eigenvalue as there are conjugate points.
    """
    from scipy.linalg import eigh

    shot, n, span = path.shot, motions.size, path.panels.span
    count = min(_SINES + 2 * (path.conjugacy.index or 0), max(_MOST_SINES // n, _SINES))
    wave = np.pi * np.arange(1, count + 1) / span
    phases = np.outer(shot.t - shot.t[0], wave)
    sines, cosines = np.sin(phases), np.cos(phases) * wave
    scales = shot.scales[0]
    by_q, by_v = motions.slopes(shot.t, shot.q, shot.v)
    inertia = motions.action_values(shot.t, shot.q, shot.v).inertia
    # Basis: sine k of coordinate i, times its scale, in the order (k, i).
    moved = np.einsum("tk,tij->tkij", sines, by_q) + np.einsum("tk,tij->tkij", cosines, by_v)
    moved += np.einsum("tk,ij->tkij", sines * wave**2, np.eye(n))
    weights = path.panels.weights()
    forces = np.einsum("t,tij,tkjl->tkil", weights, inertia, moved)
    size = count * n
    second = np.einsum("th,tkil->hikl", sines, forces) * scales[:, None, None] * scales
    norm = np.einsum("t,th,tk,tij->hikj", weights, sines, sines, inertia)
    norm *= scales[:, None, None] * scales
    matrix = second.reshape(size, size)
    values, vectors = eigh((matrix + matrix.T) / 2, norm.reshape(size, size))
    return [
        _mode(sines, cosines, vectors[:, number].reshape(count, n), scales, value)
        for number, value in enumerate(values)
    ]


def _mode(sines: Array, cosines: Array, shares: Array, scales: Array, value: float) -> Variation:
    """Make a mode whose largest component is 1 and positive."""
    values = sines @ shares
    largest = values.ravel()[np.argmax(np.abs(values))]
    # Modes have the norm 1.
    return Variation(
        values * scales / largest, cosines @ shares * scales / largest, value / largest**2
    )


def deviation(path: StationaryPath) -> float:
    """Return how far pictures vary a path, over the scales of its coordinates."""
    extent = float(np.max(np.ptp(path.shot.q, axis=0) / path.shot.scales[0]))
    return _DEVIATION * (extent or 1.0)


def actions(motions: Motions, path: StationaryPath, variation: Variation, sizes: Array) -> Array:
    """Integrate the actions of q + ε η for some ε, less that of the path; NaN where L is not
    known."""
    shot = path.shot
    lagrangian = motions.action_values(shot.t, shot.q, shot.v).lagrangian
    stationary, _ = path.panels.integral(lagrangian)
    changed = []
    for size in sizes:
        q, v = shot.q + size * variation.values, shot.v + size * variation.rates
        action, _ = path.panels.integral(motions.action_values(shot.t, q, v).lagrangian)
        changed.append(action - stationary)
    return np.array(changed)


# The panels of a picture.


def picture_of_paths(motions: Motions, solutions: Sequence[StationaryPath]) -> Picture:
    """Draw coordinates over the time, and the actions of varied paths."""
    labels = motions.models.motion.labels
    shown = [_shown_modes(motions, path) for path in solutions[:_PATHS]]
    panels = [
        _path_panel(motions, solutions, number, shown[0])
        for number in range(len(motions.coordinates))
    ]
    panels += [
        _action_panel(motions, path, number, variations)
        for number, (path, variations) in enumerate(zip(solutions, shown, strict=False), 1)
    ]
    return Picture(labels.title or motions.models.motion.name, tuple(panels), stacked=True)


def _shown_modes(motions: Motions, path: StationaryPath) -> Sequence[Variation]:
    """Return the lowest modes; of a saddle the last that lowers the action, and the next ones."""
    first = max((path.conjugacy.index or 0) - 1, 0)
    return modes(motions, path)[first : first + _VARIATIONS]


def _path_panel(
    motions: Motions,
    solutions: Sequence[StationaryPath],
    number: int,
    variations: Sequence[Variation],
) -> Panel:
    """Draw one coordinate of all paths, and of the variations of the first."""
    labels, name = motions.models.motion.labels, motions.coordinates[number]
    first = solutions[0]
    largest = deviation(first)
    varied = (
        Line(_NO_LABEL, first.shot.t, q[:, number], faint=True)
        for variation in variations
        for share in _DRAWN
        for q in [first.shot.q + share * largest * variation.values]
    )
    lines = (
        Line(_named(path, place), path.shot.t, path.shot.q[:, number])
        for place, path in enumerate(solutions, 1)
    )
    symbol, unit = labels.symbol(name), labels.unit(name)
    axis = Label(f"${symbol.latex}$", symbol.plain)
    if unit is not None:
        axis = Label(f"{axis.latex} in ${unit.latex}$", f"{axis.plain} in {unit.plain}")
    return Panel((*lines, *varied), _time_label(motions), axis, over_time=False, equal=False)


def _time_label(motions: Motions) -> Label:
    unit = motions.models.motion.labels.unit("t")
    if unit is None:
        return Label("$t$", "t")
    return Label(f"$t$ in ${unit.latex}$", f"t in {unit.plain}")


def _named(path: StationaryPath, number: int) -> Label:
    text = f"{number}: {path.conjugacy.kind}"
    return Label(text, text)


def _action_panel(
    motions: Motions, path: StationaryPath, number: int, variations: Sequence[Variation]
) -> Panel:
    """Draw the action over the size of variations."""
    sizes = deviation(path) * np.linspace(-1, 1, _POINTS)
    lines = tuple(_action_lines(motions, path, variations, sizes))
    symbol = f"q_{{{number}}}"
    label = Label(
        rf"$S[{symbol} + \varepsilon\eta] - S[{symbol}]$", f"S[q{number} + εη] − S[q{number}]"
    )
    units = [motions.models.motion.labels.unit(name) for name in ("energy", "t")]
    energy, time = units
    if energy is not None and time is not None:
        unit = Label(rf"${energy.latex}\,{time.latex}$", f"{energy.plain} {time.plain}")
        label = Label(f"{label.latex} in {unit.latex}", f"{label.plain} in {unit.plain}")
    return Panel(lines, Label(r"$\varepsilon$", "ε"), label, over_time=False, equal=False)


def _action_lines(
    motions: Motions, path: StationaryPath, variations: Sequence[Variation], sizes: Array
) -> Iterator[Line]:
    for number, variation in enumerate(variations, 1):
        changes = actions(motions, path, variation, sizes)
        known = np.isfinite(changes)
        label = Label(rf"$\eta_{{{number}}}$", f"η{number}")
        yield Line(label, sizes[known], changes[known])
    yield Line(_NO_LABEL, sizes[[0, -1]], np.zeros(2), faint=True)
