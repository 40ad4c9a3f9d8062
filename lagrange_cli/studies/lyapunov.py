"""Lyapunov exponents: how fast neighbouring motions part.

The variational equations are integrated beside the motion from every unit displacement of the
state, interval by interval; after each, the displacements are made orthogonal again, and the
logarithms of their lengths are averaged (G. Benettin, L. Galgani, A. Giorgilli and J.-M.
Strelcyn, Lyapunov characteristic exponents for smooth dynamical systems, Meccanica 15 (1980) 9 and
21). Lengths are measured in the units of coordinates and of their rates, on which averages over
long times do not depend.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.analysis.result import Exponents
from lagrange_cli.drawn import Reported
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.charts.simulation import simulate_with_sensitivities
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import required_start
from lagrange_cli.simulate.simulation import RunContext
from lagrange_cli.simulate.system.functions import KeptFunctions
from lagrange_cli.state_layout import StateLayout

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.model.model import Model

#: Intervals after which displacements are made orthogonal.
_INTERVALS = 1000

#: Part of the time that is not counted: displacements turn into their directions at first.
_TRANSIENT = 0.1

#: Blocks of intervals whose averages give the spread of the whole.
_BLOCKS = 20

#: Shortest interval, as a part of the time.
_SHORTEST = 1e-6

#: Largest logarithm by which a displacement may grow in an interval: then some are lost beside it.
_MOST_GROWTH = 12.0


@dataclass(frozen=True)
class Lyapunov(Reported):
    """Lyapunov exponents of a motion.

    Attributes
    ----------
    name
        Name of the scene.
    exponents
        From the largest, two a coordinate, in the inverse unit of time.
    spreads
        The standard error of each, from averages over blocks of the time.
    start, until
        The time over which they were averaged.
    times, averages
        Ends of intervals, and the average of the largest exponent until then.
    """

    name: str
    exponents: tuple[float, ...]
    spreads: tuple[float, ...]
    start: float
    until: float
    times: Array
    averages: Array

    @property
    def summary(self) -> Exponents:
        """The exponents as a part of an analysis."""
        return Exponents(self.exponents, self.spreads, self.start, self.until)

    def __repr__(self) -> str:
        """Return one line for a terminal."""
        return f"<Lyapunov of {self.name}: {self.exponents[0]:.4g} ± {self.spreads[0]:.2g}>"


def lyapunov_exponents(
    model: Model,
    until: float,
    *,
    accuracy: float = 1e-8,
    progress: Callable[[float], None] | None = None,
) -> Lyapunov:
    """Compute the exponents of the motion of a model.

    Parameters
    ----------
    model
        With the derivatives of the motion by every start, in the order of ``state_names``.
    until
        The end.
    accuracy
        Accuracy of the motion and of displacements, in each interval.
    progress
        Called with the part of the time that is done.

    Raises
    ------
    InputError
        The motion cannot begin, does not go so far, or the end is not after the start.
    """
    begin = model.defaults.start
    if not until > begin:
        raise InputError(Problem(f"the end, {until:.6g}, is not after the start", rule="lyapunov"))
    follow = _Follow(model, accuracy)
    logs: list[Array] = []
    times = [begin]
    state, frame = follow.start, np.eye(follow.size)
    length = (until - begin) / _INTERVALS
    while times[-1] < until:
        end = times[-1] + length
        if until - end < _SHORTEST * length:
            end = until
        moved, displaced = follow.run(times[-1], end, state, frame)
        turned, triangle = np.linalg.qr(displaced)
        growth = np.log(np.abs(np.diag(triangle)))
        if np.abs(growth).max() > _MOST_GROWTH and length > _SHORTEST * (until - begin):
            length /= 2  # displacements become parallel in so long an interval
            continue
        state, frame = moved, turned
        logs.append(growth)
        times.append(end)
        if progress is not None:
            progress((end - begin) / (until - begin))
    return _result(model.name, np.array(times), np.array(logs))


class _Follow:
    """The motion and all displacements, over one interval after the other."""

    def __init__(self, model: Model, accuracy: float) -> None:
        self._model, self._kept = model, KeptFunctions()
        self._options = SimulationOptions(accuracy=accuracy, samples=2)
        whole = model.layout
        # As many displacements as numbers of the motion, each with as many numbers.
        self.size = round((math.sqrt(1 + 4 * whole.size) - 1) / 2)
        ways = 1 + self.size
        self._layout = StateLayout(whole.coordinates // ways, whole.states // ways)
        initial = required_start(model)
        self.start = np.concatenate([part[0] for part in self._parts(initial)])

    def _parts(self, numbers: Array) -> list[Array]:
        """Divide numbers by kind: rows of the motion, then of each displacement."""
        ways, whole, layout = 1 + self.size, self._model.layout, self._layout
        kinds = (whole.positions, layout.coordinates), (whole.velocities, layout.coordinates)
        return [
            numbers[places].reshape(ways, count)
            for places, count in (*kinds, (whole.first_order, layout.states))
        ]

    def run(self, begin: float, end: float, state: Array, frame: Array) -> tuple[Array, Array]:
        """Return the state and the displacements, in columns, at the end of an interval.

        Raises
        ------
        InputError
            The motion does not reach the end.
        """
        layout = self._layout
        parts = (layout.positions, layout.velocities, layout.first_order)
        initial = (x for part in parts for x in (*state[part], *frame[part].T.ravel()))
        model = replace(
            self._model,
            initial=tuple(map(float, initial)),
            initial_decimals=(),
            defaults=replace(self._model.defaults, start=begin, until=end),
        )
        options = replace(self._options, until=end)
        motion = simulate_with_sensitivities(model, options, RunContext(kept_functions=self._kept))
        if motion.status != "ok":
            message = f"exponents are found until t = {begin:.6g} only: {motion.reason}"
            raise InputError(Problem(message, hint=f"--until {begin:.6g}", rule="lyapunov"))
        last = np.array([motion.columns[name][-1] for name in model.state_names])
        kinds = self._parts(last)
        displaced = np.concatenate([part[1:].T for part in kinds])
        return np.concatenate([part[0] for part in kinds]), displaced


def _result(name: str, times: Array, logs: Array) -> Lyapunov:
    spans = np.diff(times)
    first = int(_TRANSIENT * len(logs))
    counted, lengths = logs[first:], spans[first:]
    blocks = zip(np.array_split(counted, _BLOCKS), np.array_split(lengths, _BLOCKS), strict=True)
    means = np.array([part.sum(axis=0) / span.sum() for part, span in blocks if len(part)])
    exponents = counted.sum(axis=0) / lengths.sum()
    spreads = means.std(axis=0, ddof=1) / math.sqrt(len(means))
    order = np.argsort(-exponents)
    averages = np.cumsum(counted[:, order[0]]) / np.cumsum(lengths)
    return Lyapunov(
        name,
        tuple(float(exponents[k]) for k in order),
        tuple(float(spreads[k]) for k in order),
        float(times[first]),
        float(times[-1]),
        times[first + 1 :],
        averages,
    )
