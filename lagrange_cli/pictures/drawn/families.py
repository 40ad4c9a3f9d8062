"""Families of curves: the motions of the members of an ensemble, told apart by what they vary."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files.rows import DECIMAL_NUMBER
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
    values
        For each member its values by name, as texts.
    panels
        The curves.
    labels
        Names and units of columns and parameters.
    starts
        Names of which the values are those at the start.
    """

    ensemble: Ensemble
    values: Sequence[Mapping[str, str]]
    panels: Panels
    labels: Labels
    starts: frozenset[str]

    def symbol(self, name: str) -> Label:
        """Return the symbol of a value, as θ(0) where it is one at the start."""
        symbol = self.labels.symbol(name)
        return at_time(symbol, self.ensemble.t[0]) if name in self.starts else symbol


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
    names = list(family.values[0])
    if len(family.values) <= len(COLOURS) or len(names) != 1:
        return None, None
    numbers = np.asarray(family.ensemble.given[names[0]], dtype=float)
    low, high = float(np.nanmin(numbers)), float(np.nanmax(numbers))
    if not high > low:
        return None, None
    axis = Axis(in_dollars(family.symbol(names[0])), unit_of_column(family.labels, names[0]))
    return np.nan_to_num((numbers - low) / (high - low)), ColourBar(axis, low, high)


def _panel(family: Family, curves: Sequence[Curve], levels: Array | None) -> Panel:
    lines = tuple(
        _line(family, curve, member, None if levels is None else levels[member], curves)
        for curve in curves
        for member in range(len(family.values))
    )
    return panel_of(family.labels, curves, lines)


def _line(
    family: Family, curve: Curve, member: int, level: float | None, curves: Sequence[Curve]
) -> Line:
    columns, labels = family.ensemble.columns, family.labels
    x, y = (
        family.ensemble.t if name == "t" else np.asarray(columns[name][member])
        for name in (curve.abscissa, curve.ordinate)
    )
    known = np.isfinite(x) & np.isfinite(y)
    label = member_label(labels, member, family.values[member], family.symbol)
    if len(curves) > 1:
        name = curve_label(labels, curve, alone=over_time(curves))
        label = listed([name, label])
    has_ends = level is None and curve.abscissa != "t"
    return Line(label, x[known], y[known], has_ends=has_ends, level=level)


def member_label(
    labels: Labels,
    member: int,
    values: Mapping[str, str],
    symbol: Callable[[str], Label] | None = None,
) -> Label:
    """Name a member by its numbers, ``l = 2``; by its own number if it has others than numbers."""
    if not values or not all(map(DECIMAL_NUMBER.fullmatch, values.values())):
        return Label(str(member), str(member))
    symbols = labels.symbol if symbol is None else symbol
    return listed([equation(symbols(n), float(text), labels.unit(n)) for n, text in values.items()])
