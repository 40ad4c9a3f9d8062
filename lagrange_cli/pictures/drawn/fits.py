"""Fits: measured columns with the fitted motion, and what is left of them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.picture import (
    NO_LABEL,
    Axis,
    Line,
    Panel,
    Picture,
    Style,
    axis_of,
    equation,
    listed,
)
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.studies.fit.result import Fit, FittedColumn

#: Measurements that have bars, and discs: those of more would cover each other.
_MOST_BARS, _MOST_DISCS = 100, 400


@picture_of.register
def picture_of_fit(fit: Fit, asked: str | None = None) -> Picture:
    """Draw each measured column over its residuals."""
    labels = fit.motion.labels
    values = listed(
        [equation(labels.symbol(v.name), v.value, labels.unit(v.name)) for v in fit.values]
    )
    panels = tuple(panel for column in fit.columns for panel in _panels(fit, column))
    return Picture(labels.title or fit.name, panels, is_stacked=True, caption=values)


def _panels(fit: Fit, column: FittedColumn) -> Iterator[Panel]:
    time, axis = axis_of(fit.motion.labels, ["t"]), axis_of(fit.motion.labels, [column.name])
    shown = fit.motion.t >= min(fit.motion.t[0], column.times[0])
    motion = fit.motion.columns[column.name]
    fitted = Line(Label("fitted", "fitted"), fit.motion.t[shown], motion[shown], colour=0)
    measured = _measured("measured", column, column.measured)
    yield Panel((measured, fitted), time, axis, has_legend=column is fit.columns[0])
    residuals = _measured("residual", column, column.measured - column.fitted)
    zero = Line(NO_LABEL, column.times[[0, -1]], np.zeros(2), colour=0)
    about_zero = residuals, zero, *_deviations(column)
    name = Axis(Label("residual", "residual"), axis.unit)
    yield Panel(about_zero, time, name, has_legend=False, height=0.6)


def _measured(name: str, column: FittedColumn, values: Array) -> Line:
    label = Label(name, name)
    errors = column.deviations if len(values) <= _MOST_BARS else None
    style: Style = "bars" if len(values) <= _MOST_DISCS else "dots"
    return Line(label, column.times, values, style, colour=1, errors=errors)


def _deviations(column: FittedColumn) -> tuple[Line, ...]:
    """Return lines at a standard deviation above and below zero, where no bars show it."""
    if len(column.times) <= _MOST_BARS:
        return ()
    ends = -column.deviations, column.deviations
    return tuple(Line(NO_LABEL, column.times, end, dash=2) for end in ends)
