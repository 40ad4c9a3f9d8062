"""Coordinates that a model's have replaced, along a run of it, with their columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.charts.angles import angles_of_turn
from lagrange_cli.simulate.charts.continuation import (
    AngleReversal,
    ContinuedCoordinates,
    KnownMotion,
    continue_coordinates,
)
from lagrange_cli.simulate.charts.detection import NEAR_SINGULAR
from lagrange_cli.simulate.model.model import FormerChart, Model
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.system.tracing import functions_of


def follow(
    model: Model, chart: FormerChart, run: Trajectory, deadline: float
) -> ContinuedCoordinates:
    """Continue former coordinates along a run."""
    if chart.turns:
        return _angles(chart, run)
    functions, parameters = functions_of(chart.functions), model.numbers
    return continue_coordinates(
        _samples(run, model.coordinates),
        _start(chart),
        len(chart.coordinates),
        lambda t, y: functions["positions"](t, y, parameters),
        lambda t, y: functions["velocities"](t, y, parameters),
        deadline,
        _turning(chart),
    )


def _start(chart: FormerChart) -> Array | None:
    return None if chart.start is None else np.array(chart.start)


def _samples(run: Trajectory, names: Sequence[str]) -> KnownMotion:
    """Return coordinates of these names along a run, with their uncertainties."""
    relative = (run.estimated or 0.0) + float(np.finfo(float).eps)
    return KnownMotion(
        run.t,
        np.column_stack([run.columns[name] for name in names]),
        np.column_stack([run.columns[f"dot({name})"] for name in names]),
        relative * np.array([run.scales[name] for name in names]),
    )


def _angles(chart: FormerChart, run: Trajectory) -> ContinuedCoordinates:
    """Return the angles of all turns for which quaternions stand."""
    starts = None if chart.start is None else np.array(chart.start).reshape(2, -1, 3)
    turns = [
        angles_of_turn(
            _samples(run, turn.parts), turn.axes, None if starts is None else starts[:, k].ravel()
        )
        for k, turn in enumerate(chart.turns)
    ]
    return ContinuedCoordinates(
        np.hstack([turn.q for turn in turns]),
        np.hstack([turn.v for turn in turns]),
        np.hstack([turn.amplification for turn in turns]),
        tuple(sorted(interval for turn in turns for interval in turn.lost)),
    )


def _turning(chart: FormerChart) -> AngleReversal | None:
    """Return the facts that decide past a singular configuration; None without a known start."""
    if chart.start is None:
        return None
    return AngleReversal(
        np.array([kind == "angle" for kind in chart.kinds]),
        np.array([name in chart.steady for name in chart.coordinates]),
        np.array(chart.start[len(chart.coordinates) :]),
    )


def former_columns(
    chart: FormerChart, names: list[str], continued: ContinuedCoordinates, run: Trajectory
) -> dict[str, Array]:
    """Return columns of former coordinates, NaN if not known to the accuracy asked for."""
    values, rates = {}, {}
    eps = run.requested or NEAR_SINGULAR
    speeds = np.nan_to_num(np.abs(continued.v)).max(axis=1)
    for name in names:
        j = chart.coordinates.index(name)
        q, v, off = continued.q[:, j], continued.v[:, j], continued.amplification[:, j]
        size = 1.0
        if chart.kinds[j] != "angle":
            size = float(np.nanmax(np.abs(q), initial=0.0))
        known = off <= eps * size
        fastest = max(float(np.abs(v[known]).max(initial=0.0)), size)
        steady = known & (np.where(known, off, 0.0) * speeds <= eps * fastest)
        values[name] = np.where(known, q, np.nan)
        rates[f"dot({name})"] = np.where(steady, v, np.nan)
    return values | rates


def radians_moved(chart: FormerChart, continued: ContinuedCoordinates, run: Trajectory) -> Array:
    """Return the angle turned from sample to sample by the fastest coordinate, shape (m,)."""
    turning = [j for j, kind in enumerate(chart.kinds) if kind == "angle"]
    step = float(run.t[-1] - run.t[0]) / max(len(run.t) - 1, 1)
    moves = np.nan_to_num(np.abs(continued.v[:, turning]) * step)
    return np.asarray(moves.max(axis=1, initial=0.0))


def first_not_positive(
    chart: FormerChart, continued: ContinuedCoordinates
) -> tuple[int, str] | None:
    """Return the number of samples before a coordinate declared positive is not, and its name."""
    numbers = [chart.coordinates.index(name) for name in chart.positive]
    below = np.argwhere(continued.q[:, numbers] <= 0)
    if not len(below):
        return None
    return max(int(below[0, 0]), 1), chart.positive[below[0, 1]]
