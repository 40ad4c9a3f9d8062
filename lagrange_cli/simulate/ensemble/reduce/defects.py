"""Errors of polynomials between samples, from how far they are from the equations of motion.

Samples do not show all that happens between them: an oscillation of which they meet the same phase
looks like rest, and a coordinate that goes and comes back leaves no trace. The polynomials through
them then do not obey the equations of motion, by what is called their defect (W. H. Enright, *Appl.
Math. Comput.* 31 (1989) 288). It is evaluated at some places of each panel. Where forces are sharp,
it is bounded over panels as a whole, which are divided until the bound tells it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.reduce.dense_motion import WIDTH, Motions, Panels
from lagrange_cli.simulate.ensemble.reduce.expression_graph import (
    Domain,
    Node,
    evaluated,
    outputs_of,
)
from lagrange_cli.simulate.ensemble.reduce.interval_series import Series
from lagrange_cli.simulate.ensemble.reduce.motion_series import (
    Intervals,
    MotionSeries,
    in_middle,
    over_whole,
    rough_range,
)
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.inputs import read_recorded_inputs
from lagrange_cli.state_layout import StateLayout

#: Places of a panel: none at which the error of a polynomial through samples around is stationary.
#: Each costs as much as the bounds of the expression do.
_PLACES = (-0.6, 0.35)

#: Degree of Taylor polynomials over whole panels; parts of these that are divided, how often.
_DEGREE, _PARTS, _DIVISIONS = 5, 4, 10

#: Intervals that are divided at a time; more of them are taken as they are.
_MOST_INTERVALS = 20_000

#: Bound of the error in a panel over half of its length times the largest defect at the places:
#: the error grows from both ends, by no more than cosh(3/4) where samples are closer than one and a
#: half radians; between the places the defect is larger.
_LARGER = 2.0

#: Part of the error of the state beside which bounds of the defect are close enough. Not tuned.
_CLOSE = 0.1


def series_along(model: Model, motions: Motions) -> MotionSeries | None:
    """Return the series of motions of a model, whose errors are no less than defects cause.

    None if the outputs of the model need more than numbers. Where contacts close or equations
    switch, the right-hand side is not that of all pieces, and constraints that stay are solved by
    loops over numbers: errors are then those of :mod:`.dense_motion` alone.
    """
    recorded = read_recorded_inputs(model.recordings)
    pieces = None if recorded is None else recorded.pieces
    outputs = outputs_of(model, 0 if pieces is None else pieces.rows.shape[1])
    if outputs is None:
        return None
    along = MotionSeries(outputs, motions, Panels.of_motions(motions), pieces)
    if outputs.rates is None or model.contacts or model.surfaces or model.controllers:
        return along
    return _checked(along, outputs.rates, model.layout, sharp=model.landmarks > 0)


def _checked(
    along: MotionSeries, graphs: tuple[Node | float, ...], layout: StateLayout, *, sharp: bool
) -> MotionSeries:
    """Enlarge the errors of panels to what defects cause; sharp forces may act for less."""
    panels = along.panels
    defects = _Defects(along, graphs, _rates(panels))
    with np.errstate(all="ignore"):
        largest = defects.over_panels() if sharp else defects.at_places()
        moved = _LARGER * largest * _half_lengths(panels)
    # The defect of a velocity moves the coordinate as well.
    moved[layout.positions] += moved[layout.velocities] * _half_lengths(panels)
    moved = np.where(np.isnan(moved), np.inf, moved)
    panels = replace(panels, left_out=np.maximum(panels.left_out, moved))
    return replace(along, panels=panels)


def _half_lengths(panels: Panels) -> Array:
    return np.asarray((panels.edges[:, 1] - panels.edges[:, 0]) / 2)


def _rates(panels: Panels) -> Array:
    """Return the derivatives of the polynomials by the time, as coefficients in the place."""
    rates = np.zeros_like(panels.coefficients)
    degrees = np.arange(1, WIDTH)[:, None, None, None]
    rates[:-1] = panels.coefficients[1:] * degrees / _half_lengths(panels)
    return rates


@dataclass(frozen=True)
class _Defects:
    """Defects of the polynomials in panels.

    Attributes
    ----------
    along
        The motions.
    graphs
        Time derivatives of the state, by the equations of motion.
    rates
        The same of the polynomials, as coefficients in the place.
    """

    along: MotionSeries
    graphs: tuple[Node | float, ...]
    rates: Array

    @property
    def _panels(self) -> Intervals:
        return Intervals.whole(*self.rates.shape[2:])

    def at_places(self) -> Array:
        """Return the largest at some places of panels, shape (2n, members, panels)."""
        whole = self._panels
        at_places = []
        for place in _PLACES:
            there = np.full(len(whole), place)
            at_place = replace(whole, left=there, right=there)
            at_places.append(_sizes(self._differences(in_middle, at_place, 1)))
        return np.asarray(np.max(at_places, axis=0).reshape(self.rates.shape[1:]))

    def over_panels(self) -> Array:
        """Return bounds over whole panels, shape (2n, members, panels)."""
        largest = np.zeros(self.rates.shape[1:])
        close = self.along.panels.left_out + self.along.motions.errors.T[:, :, None]
        close = _CLOSE * close / _half_lengths(self.along.panels)
        intervals = self._panels
        for division in range(_DIVISIONS + 1):
            middle = self._differences(in_middle, intervals, _DEGREE + 1)
            over = self._differences(over_whole, intervals, _DEGREE + 2)
            pairs = zip(middle, over, strict=True)
            bound = np.array([np.maximum(*map(np.abs, rough_range(*pair))) for pair in pairs])
            bound = np.fmin(bound, _sizes(over))
            at = intervals.member, intervals.panel
            enough = np.maximum(close[:, *at], 2 * _sizes(middle))
            ends = (bound <= enough).all(axis=0)
            ends |= (division == _DIVISIONS) | (len(intervals) > _MOST_INTERVALS)
            for row, bounds in zip(largest, bound, strict=True):
                np.maximum.at(row, (at[0][ends], at[1][ends]), bounds[ends])
            intervals = intervals.only(~ends).divided(_PARTS)
            if not len(intervals):
                break
        return largest

    def _differences(
        self, series: Callable[[Array, int], Series], intervals: Intervals, count: int
    ) -> list[Series]:
        """Return series of the defects of all components of the state."""
        state = series(self.along.taylor(intervals), count)
        rates = series(self.along.taylor(intervals, self.rates), count)
        leaves = self.along.leaves(intervals, state)
        true_rates = evaluated(self.graphs, leaves, Domain.whole(len(intervals)))
        return [
            Series(rates.low[:, i], rates.high[:, i]) - true_rate
            for i, true_rate in enumerate(true_rates)
        ]


def _sizes(series: list[Series]) -> Array:
    """Return the largest magnitudes of values, shape (series, m)."""
    return np.array([each.size[0] for each in series])
