"""Taylor series of the state along motions, over intervals of the time.

The state is a polynomial in each panel (:mod:`.dense_motion`), and with it t, parameters and
recorded inputs are series about the middle of an interval, which graphs of expressions are
evaluated with.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import comb

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.reduce.dense_motion import WIDTH, Motions, Numbers, Panels
from lagrange_cli.simulate.ensemble.reduce.expression_graph import Flags, Node, Outputs
from lagrange_cli.simulate.ensemble.reduce.interval_series import Series
from lagrange_cli.simulate.integrators.right_hand_side import InputPieces


@dataclass(frozen=True)
class Intervals:
    """Intervals of the time of some members.

    Attributes
    ----------
    member, panel
        Numbers, shape (m,).
    left, right
        Places in the panel, from −1 to 1, shape (m,).
    """

    member: Numbers
    panel: Numbers
    left: Array
    right: Array

    @classmethod
    def whole(cls, members: int, panels: int) -> Intervals:
        """Return all panels of all members."""
        member = np.repeat(np.arange(members), panels)
        panel = np.tile(np.arange(panels), members)
        return cls(member, panel, np.full(len(member), -1.0), np.ones(len(member)))

    def __len__(self) -> int:
        return len(self.member)

    def only(self, which: Flags) -> Intervals:
        return Intervals(self.member[which], self.panel[which], self.left[which], self.right[which])

    def divided(self, parts: int) -> Intervals:
        """Divide each into equal parts, in order."""
        steps = np.arange(parts + 1) / parts
        ends = self.left[:, None] + (self.right - self.left)[:, None] * steps
        ends[:, -1] = self.right
        member, panel = np.repeat(self.member, parts), np.repeat(self.panel, parts)
        return Intervals(member, panel, ends[:, :-1].ravel(), ends[:, 1:].ravel())


@dataclass(frozen=True)
class MotionSeries:
    """Series, over intervals, of all that expressions along some motions read.

    Attributes
    ----------
    outputs
        Graphs of the outputs of the model.
    motions, panels
        The motions.
    inputs
        Recorded inputs; None if there are none.
    """

    outputs: Outputs
    motions: Motions
    panels: Panels
    inputs: InputPieces | None = None

    def times(self, intervals: Intervals) -> tuple[Array, Array]:
        """Return the times of both ends."""
        begin, end = self.panels.edges[intervals.panel].T
        shares = (1 + intervals.left) / 2, (1 + intervals.right) / 2
        first, last = (begin + (end - begin) * share for share in shares)
        return first, np.where(intervals.right == 1, end, last)

    def errors(self, intervals: Intervals) -> Array:
        """Return the errors of the state, shape (2n, m)."""
        left_out = self.panels.left_out[:, intervals.member, intervals.panel]
        return np.asarray(self.motions.errors[intervals.member].T + left_out)

    def taylor(self, intervals: Intervals, coefficients: Array | None = None) -> Array:
        """Return Taylor coefficients about the middle, in units of half the interval, shape
        (WIDTH, 2n, m).

        ``coefficients``: those of polynomials in panels; None for the state.
        """
        panels = self.panels.coefficients if coefficients is None else coefficients
        whole = panels[:, :, intervals.member, intervals.panel]
        middle = (intervals.left + intervals.right) / 2
        half = (intervals.right - intervals.left) / 2
        if (half == 1).all():
            return np.asarray(whole)
        shifted = whole.copy()
        for first in range(WIDTH - 1):
            for k in range(WIDTH - 2, first - 1, -1):
                shifted[k] += middle * shifted[k + 1]
        return np.asarray(shifted * (half ** np.arange(WIDTH)[:, None])[:, None, :])

    def leaves(
        self, intervals: Intervals, state: Series, errors: Array | None = None
    ) -> Mapping[Node, Series]:
        """Return the series of all inputs of graphs; ``errors`` widen the state, shape (2n, m)."""
        count, known = len(state), self.outputs
        first, last = self.times(intervals)
        low, high = np.zeros((2, count, len(intervals)))
        if state.low is state.high:  # in the middle alone
            low[0] = high[0] = (first + last) / 2
        else:
            low[0], high[0] = first, last
        if count > 1:
            low[1] = high[1] = (last - first) / 2
        inputs_there = {known.t: Series(low, high)}
        for i, node in enumerate(known.state):
            low, high = state.low[:, i].copy(), state.high[:, i].copy()
            if errors is not None:
                low[0] -= errors[i]
                high[0] += errors[i]
            inputs_there[node] = Series(low, high)
        like = inputs_there[known.t]
        for i, node in enumerate(known.parameters):
            values = self.motions.parameters[intervals.member, i]
            inputs_there[node] = Series.constant(values, like)
        return inputs_there | self._recorded(first, last, like)

    def _recorded(self, first: Array, last: Array, like: Series) -> dict[Node, Series]:
        """Return the numbers of recorded inputs: those of all pieces in an interval."""
        pieces = self.inputs
        if pieces is None:
            return {}
        begin, end = (np.searchsorted(pieces.starts, t, side="right") - 1 for t in (first, last))
        begin = np.maximum(begin, 0)
        # reduceat takes pairs of a first row and the row behind the last one.
        ends = np.minimum(np.maximum(end, begin) + 1, len(pieces.starts))
        rows = np.vstack([pieces.rows, pieces.rows[-1:]])
        pairs = np.stack([begin, ends], 1).ravel()
        low = np.minimum.reduceat(rows, pairs)[::2]
        high = np.maximum.reduceat(rows, pairs)[::2]
        inputs_there = {}
        for i, node in enumerate(self.outputs.inputs):
            bounds = Series.constant(low[:, i], like), Series.constant(high[:, i], like)
            inputs_there[node] = bounds[0].hull(bounds[1])
        return inputs_there


def in_middle(taylor: Array, count: int) -> Series:
    """Return the series in the middle of intervals, shape (count, 2n, m)."""
    rows = taylor[:count]
    return Series(rows, rows)


def over_whole(taylor: Array, count: int) -> Series:
    """Return the series over whole intervals: their coefficients about any place in them."""
    sizes = np.abs(taylor)
    off = np.zeros((count, *taylor.shape[1:]))
    for k in range(count):
        for i in range(k + 1, len(taylor)):
            off[k] += comb(i, k) * sizes[i]
    return Series(taylor[:count] - off, taylor[:count] + off)


def remainder(over: Series) -> tuple[Array, Array]:
    """Bound the last term over an interval."""
    least, most = over.low[-1], over.high[-1]
    if len(over) % 2:
        return np.minimum(least, 0), np.maximum(most, 0)
    size = np.maximum(np.abs(least), np.abs(most))
    return -size, size


def rough_range(middle: Series, over: Series) -> tuple[Array, Array]:
    """Bound a polynomial and its remainder over an interval, term by term."""
    off = middle.size[1:].sum(axis=0)
    least, most = remainder(over)
    return middle.low[0] - off + least, middle.high[0] + off + most
