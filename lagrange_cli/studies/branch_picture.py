"""Bifurcation diagrams: branches of equilibria over a parameter as a picture.

Stable parts are solid, unstable ones dashed, undecided ones dotted; marked points have the numbers
that tables give them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.simulate.model.labels import Label, Labels, labels_of
from lagrange_cli.simulate.results.picture import Line, MarkedPlace, Panel, Picture, axis_label

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import Branch, Branches, Stretch
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate.arrays import Array

#: Coordinates that have a panel.
_PANELS = 6

#: Marked points whose kinds are written; of more there are numbers alone.
_NAMED = 6

#: Group of verdicts → number of its dash pattern.
_DASHES = {"stable": 0, "unstable": 1, "undecided": 2}


def picture_of_branches(equations: Equations, branches: Branches) -> Picture:
    """Draw each coordinate that branches have over the parameter."""
    labels = labels_of(equations)
    coordinates = enumerate(equations.system.coordinates)
    names = [(k, c.name) for k, c in coordinates if c.name not in branches.free]
    panels = tuple(_panel(branches, labels, k, name) for k, name in names[:_PANELS])
    return Picture(labels.title, panels, stacked=True)


def _panel(branches: Branches, labels: Labels, number: int, name: str) -> Panel:
    turns = name in branches.periodic
    lines: list[Line] = []
    for line in _lines(branches, number, turns=turns):
        seen = any(line.dash == before.dash for before in lines)
        lines.append(Line(line.label, line.x, line.y, dash=line.dash, again=seen))
    if not lines:
        # A line at zero gives an empty panel its width.
        lines.append(Line(Label("", ""), np.array([branches.low, branches.high]), np.zeros(2)))
    return Panel(
        tuple(lines),
        axis_label(labels, [branches.parameter]),
        axis_label(labels, [name]),
        over_time=False,
        equal=False,
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
