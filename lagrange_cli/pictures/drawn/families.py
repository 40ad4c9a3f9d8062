"""Families of curves: the motions of the members of an ensemble, told apart by what they vary."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.pictures.curves import Curve, Panels
from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.drawn.motions import curve_label, over_time, panel_of
from lagrange_cli.pictures.picture import (
    Axis,
    ColourBar,
    Line,
    Panel,
    Picture,
    at_time,
    equation,
    in_dollars,
    listed,
    unit_of_column,
)
from lagrange_cli.pictures.style import COLOURS
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.store.result import Ensemble
from lagrange_cli.simulate.model.labels import Label, Labels

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members

#: Members of the largest family: more curves are a band.
_MOST_MEMBERS = 100


def require_family(members: Members) -> None:
    """Refuse more members than a picture has curves.

    Raises
    ------
    InputError
        There are too many.
    """
    if len(members) > _MOST_MEMBERS:
        message = f"{len(members):,} members are too many curves; {_MOST_MEMBERS} can be drawn"
        hint = "--map theta1,theta2 --plot map.png draws a number of each over a plane"
        raise InputError(Problem(message, hint=hint, rule="ensemble"))


@dataclass(frozen=True)
class Family:
    """The curves of an ensemble.

    Attributes
    ----------
    ensemble
        The motions, with every column that is drawn.
    panels
        The curves.
    labels
        Names and units of columns and parameters.
    starts
        Names of which the values are those at the start.
    """

    ensemble: Ensemble
    panels: Panels
    labels: Labels
    starts: frozenset[str]

    def symbol(self, name: str) -> Label:
        """Return the symbol of a value, as θ(0) where it is one at the start."""
        symbol = self.labels.symbol(name)
        return at_time(symbol, self.ensemble.t[0]) if name in self.starts else symbol

    def label(self, member: int) -> Label:
        """Name a member by its numbers, ``l = 2``."""
        numbers = ((name, float(values[member])) for name, values in self.ensemble.given.items())
        return listed(
            [equation(self.symbol(n), number, self.labels.unit(n)) for n, number in numbers]
        )


@picture_of.register
def picture_of_family(family: Family, asked: str | None = None) -> Picture:
    """Draw the curves of all members, by a bar of colours if there are many of one number."""
    levels, bar = _levels(family)
    panels = tuple(_panel(family, curves, levels) for curves in family.panels)
    if all(len(curves) == 1 for curves in family.panels):
        # The legend of the first panel is that of all.
        panels = (panels[0], *(replace(panel, has_legend=False) for panel in panels[1:]))
    title = family.labels.title or family.ensemble.name
    stacked = all(panel.is_tight for panel in panels)
    return Picture(title, panels, is_stacked=stacked, bar=bar)


def _levels(family: Family) -> tuple[Array | None, ColourBar | None]:
    """Return the levels of the members, shape (members,), and their bar.

    None where members are told apart by a legend, or not at all.
    """
    names = list(family.ensemble.given)
    if len(family.ensemble) <= len(COLOURS) or len(names) != 1:
        return None, None
    numbers = np.asarray(family.ensemble.given[names[0]], dtype=float)
    low, high = float(np.nanmin(numbers)), float(np.nanmax(numbers))
    if not high > low:
        return None, None
    axis = Axis(in_dollars(family.symbol(names[0])), unit_of_column(family.labels, names[0]))
    return np.nan_to_num((numbers - low) / (high - low)), ColourBar(axis, low, high)


def _panel(family: Family, curves: Sequence[Curve], levels: Array | None) -> Panel:
    lines = tuple(line for curve in curves for line in _lines(family, curve, curves, levels))
    return panel_of(family.labels, curves, lines)


def _lines(
    family: Family, curve: Curve, curves: Sequence[Curve], levels: Array | None
) -> Iterator[Line]:
    """Yield a curve of each member that could be begun."""
    members = len(family.ensemble)
    x, y = (
        np.broadcast_to(family.ensemble.arrays[name], (members, len(family.ensemble.t)))
        for name in (curve.abscissa, curve.ordinate)
    )
    for member, known in enumerate(np.isfinite(x) & np.isfinite(y)):
        label = family.label(member)
        if len(curves) > 1:
            label = listed([curve_label(family.labels, curve, alone=over_time(curves)), label])
        if known.any():
            yield Line(
                label,
                x[member, known],
                y[member, known],
                has_ends=levels is None and curve.abscissa != "t",
                level=None if levels is None else levels[member],
            )
