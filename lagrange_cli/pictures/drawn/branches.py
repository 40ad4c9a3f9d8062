"""Branches of equilibria over a parameter: bifurcation diagrams, and root loci of the poles.

In a diagram stable parts are solid, unstable ones dashed, undecided ones dotted; marked points have
the numbers that tables give them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lagrange_cli.analysis.branches.values import Branch, Branches, Stretch
from lagrange_cli.analysis.result import Analysis
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.picture import (
    NO_LABEL,
    Axis,
    Line,
    MarkedPlace,
    Panel,
    Picture,
    axis_of,
    equation,
)
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label, Labels, labels_of

#: Coordinates that have a panel.
_PANELS = 6

#: Marked points whose kinds are written; of more there are numbers alone.
_NAMED = 6

#: Group of verdicts → number of its dash pattern.
_DASHES = {"stable": 0, "unstable": 1, "undecided": 2}


@picture_of.register
def picture_of_branches(analysis: Analysis, asked: str | None = None) -> Picture:
    """Draw each coordinate that branches have over the parameter."""
    branches, labels = _branches(analysis), labels_of(analysis.equations)
    coordinates = enumerate(analysis.equations.system.coordinates)
    names = [(k, c.name) for k, c in coordinates if c.name not in branches.free]
    panels = tuple(_panel(branches, labels, k, name) for k, name in names[:_PANELS])
    return Picture(labels.title, panels, is_stacked=True)


def _branches(analysis: Analysis) -> Branches:
    if analysis.branches is None:
        hint = "branches={NAME: (FROM, TO)}"
        raise InputError(Problem("there are no branches to draw", hint=hint, rule="no-picture"))
    return analysis.branches


def _panel(branches: Branches, labels: Labels, number: int, name: str) -> Panel:
    turns = name in branches.periodic
    lines: list[Line] = []
    for line in _lines(branches, number, turns=turns):
        seen = any(line.dash == before.dash for before in lines)
        lines.append(Line(line.label, line.x, line.y, dash=line.dash, is_again=seen))
    if not lines:
        # A line at zero gives an empty panel its width.
        lines.append(Line(NO_LABEL, np.array([branches.low, branches.high]), np.zeros(2), "faint"))
    return Panel(
        tuple(lines),
        axis_of(labels, [branches.parameter]),
        axis_of(labels, [name]),
        is_tight=True,
        places=tuple(_places(branches, number, turns=turns)),
    )


def _lines(branches: Branches, number: int, *, turns: bool) -> Iterator[Line]:
    for branch in branches.branches:
        for stretch in branch.stretches:
            group = _group(stretch)
            x, y = _points(branch, stretch, number)
            for part in _pieces(y) if turns else [slice(None)]:
                shown = _within_turn(y[part]) if turns else y[part]
                yield Line(Label(group, group), x[part], shown, dash=_DASHES[group])


def _group(stretch: Stretch) -> str:
    verdict = stretch.stability.verdict
    if verdict in ("unstable", "undecided"):
        return verdict
    return "stable"


def _points(branch: Branch, stretch: Stretch, number: int) -> tuple[Array, Array]:
    part = slice(stretch.first, stretch.last + 1)
    return branch.values[part], branch.positions[part, number]


def _pieces(angles: Array) -> Iterator[slice]:
    """Cut a curve where an angle passes from one turn to the next."""
    whole = _turn_of(angles)
    cuts = [0, *(np.flatnonzero(np.diff(whole)) + 1).tolist(), len(angles)]
    yield from (slice(a, b) for a, b in pairwise(cuts) if b - a > 1)


def _turn_of(angles: Array) -> Array:
    return np.asarray(np.ceil((angles - np.pi) / (2 * np.pi) - 1e-12))


def _within_turn(angles: Array) -> Array:
    return np.asarray(angles - 2 * np.pi * _turn_of(angles))


def _places(branches: Branches, number: int, *, turns: bool) -> Iterator[MarkedPlace]:
    """Yield the marked points; of several at one place all numbers together."""
    together: dict[tuple[float, float], list[str]] = {}
    for k, mark in enumerate(branches.marks, 1):
        y = np.array([mark.position[number]])
        height = float((_within_turn(y) if turns else y)[0])
        text = f"{k} {mark.kind}" if len(branches.marks) <= _NAMED else str(k)
        together.setdefault((mark.value, round(height, 9)), []).append(text)
    for (x, height), numbers in together.items():
        text = ", ".join(numbers)
        yield MarkedPlace(x, height, Label(text, text))


# Root loci.


@dataclass(frozen=True)
class RootLoci:
    """The poles along the branches of an analysis."""

    analysis: Analysis


@picture_of.register
def picture_of_loci(loci: RootLoci, asked: str | None = None) -> Picture:
    """Draw the poles of each branch; dots stand at its ends and at its marked points."""
    branches = _branches(loci.analysis)
    drawn = [k for k, b in enumerate(branches.branches) if b.locus.poles.size][:_PANELS]
    if not drawn:
        raise InputError(Problem("no branch has poles to draw", rule="no-picture"))
    labels = labels_of(loci.analysis.equations)
    alone = len(branches.branches) == 1
    return Picture(labels.title, tuple(_locus(branches, labels, k, alone=alone) for k in drawn))


def _locus(branches: Branches, labels: Labels, number: int, *, alone: bool) -> Panel:
    branch = branches.branches[number]
    suffix = "" if alone else f", branch {number + 1}"
    height = float(np.nanmax(np.abs(branch.locus.poles.imag)))
    axis = Line(NO_LABEL, np.zeros(2), np.array([-height, height]), "faint")
    return Panel(
        (axis, *_poles(branch)),
        Axis(Label(r"$\mathrm{Re}\,s$", "Re s")),
        Axis(Label(rf"$\mathrm{{Im}}\,s${suffix}", f"Im s{suffix}")),
        places=tuple({_rounded(p): p for p in _marked_poles(branches, branch, labels)}.values()),
    )


def _poles(branch: Branch) -> Iterator[Line]:
    """Yield the curve of each pole, in the parts between points with another number of poles."""
    for column in branch.locus.poles.T:
        known = np.isfinite(column)
        cuts = np.flatnonzero(np.diff(known.astype(int))) + 1
        for part in np.split(np.arange(len(column)), cuts):
            if known[part[0]] and len(part) > 1:
                poles = column[part]
                yield Line(NO_LABEL, poles.real, poles.imag, dash=0, is_again=True)


def _rounded(place: MarkedPlace) -> tuple[str, str, str]:
    """Return a key that is the same for places which look the same."""
    return f"{place.x:.6g}", f"{place.y:.6g}", place.label.latex


def _marked_poles(branches: Branches, branch: Branch, labels: Labels) -> Iterator[MarkedPlace]:
    """Yield the upper poles at both ends, and at marked points those nearest to the axis.

    The farthest pole at each end is labelled with the parameter; of two equally far ones it is the
    left one at the start and the right one at the end, so that texts stand apart.
    """
    locus = branch.locus
    for row, side in ((0, -1), (len(locus.values) - 1, 1)):
        name = branches.parameter
        value = equation(labels.symbol(name), locus.values[row], labels.unit(name), 4)
        upper = _upper(locus.poles[row])
        farthest = [(float(f"{abs(p):.6g}"), side * p.real) for p in upper]
        for pole, far in zip(upper, farthest, strict=True):
            label = value if far == max(farthest) else NO_LABEL
            yield MarkedPlace(pole.real, pole.imag, label)
    for _, number in branch.marks:
        mark = branches.marks[number]
        row = int(np.argmin(np.abs(locus.values - mark.value)))
        upper = _upper(locus.poles[row])
        if upper:
            nearest = min(upper, key=lambda pole: abs(pole.real))
            text = f"{number + 1} {mark.kind}"
            yield MarkedPlace(nearest.real, nearest.imag, Label(text, text))


def _upper(poles: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> list[complex]:
    """Return the poles that are not below the real axis."""
    size = float(np.abs(poles).max(initial=0.0))
    return [complex(pole) for pole in poles.tolist() if pole.imag >= -1e-9 * size]
