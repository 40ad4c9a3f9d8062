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
    axis_of,
    equation,
    listed,
)
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.studies.fit.result import Fit, FittedColumn


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
    fitted = Line(Label("fitted", "fitted"), fit.motion.t[shown], motion[shown])
    yield Panel((fitted, _measured("measured", column, column.measured)), time, axis)
    residuals = _measured("residual", column, column.measured - column.fitted)
    zero = Line(NO_LABEL, column.times[[0, -1]], np.zeros(2), "faint")
    name = Axis(Label("residual", "residual"), axis.unit)
    yield Panel((zero, residuals), time, name, height=0.6)


def _measured(name: str, column: FittedColumn, values: Array) -> Line:
    label = Label(name, name)
    return Line(label, column.times, values, "bars", colour=1, errors=column.deviations)
