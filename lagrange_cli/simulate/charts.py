"""Simulations past places where the coordinates of a scene are singular.

At such a place (the pole of spherical angles) no accelerations follow from the
equations, and close to it a motion may be stepped over it unseen: the angles are then
not those of the motion. A run that ends there, begins there, or changes sides there
is made again in Cartesian coordinates with multipliers, from the start; the scene's
coordinates are read off its positions (:mod:`following`). Where there is no such form
the result is cut off before the place.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from lagrange_cli.errors import InputError
from lagrange_cli.simulate.following import Followed, Samples, follow
from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.model import FormerChart, Model, SingularPlace
from lagrange_cli.simulate.request import DEFAULT_SAMPLES
from lagrange_cli.simulate.right_hand_side import functions_of
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.trajectory import Trajectory

__all__ = ["simulate_past_charts"]

#: A factor this small beside its largest value has vanished at the start.
VANISHED = 1e-12

#: How many more steps between samples, at the last pace, count as having arrived.
ARRIVED = 3.0

#: A factor this small beside its largest value is near the place as well.
NEAR = 1e-3

#: Samples in which coordinates are followed, at least.
FOLLOWED = 4000


def simulate_past_charts(
    model: Model, other: Callable[[], Model] | None = None, **how: Any
) -> Trajectory:
    """Simulate a model, in other coordinates where its own are singular on the way.

    Parameters
    ----------
    model
        What is to be simulated.
    other
        Makes the model of the same scene with multipliers, or refuses; None where
        the scene's coordinates are to be kept.
    how
        Options of :func:`.simulation.simulate`.

    Raises
    ------
    InputError
        As :func:`.simulation.simulate`.
    """
    if model.chart is not None:
        return _with_chart(model, model.chart, how)
    if not model.singular:
        return simulate(model, **how)
    started = time.perf_counter()
    try:
        first = simulate(model, **how)
    except InputError as refusal:
        return _from_start(model, other, how, refusal)
    met = _met(model, first)
    if met is None:
        return first
    rest = _rest(how, time.perf_counter() - started)
    second = None if other is None or rest is None else _in_other(other, met.place, rest)
    if second is not None and (second.status == "ok" or len(second.t) > len(first.t)):
        return second
    return _cut(first, met)


def _rest(how: Mapping[str, Any], seconds: float) -> dict[str, Any] | None:
    """Options of a second run; None where the first has used up the budget."""
    budget = how.get("budget")
    if budget is not None and seconds >= budget:
        return None
    left = None if budget is None else budget - seconds
    return {**how, "budget": left, "functions": None, "progress": None}


def _from_start(
    model: Model, other: Callable[[], Model] | None, how: Mapping[str, Any], refusal: InputError
) -> Trajectory:
    """The motion in other coordinates where it begins at a singular place of its own."""
    problem = refusal.problems[0]
    place = _at_start(model) if problem.rule == "singular" else None
    if place is None:
        raise refusal
    second = None if other is None else _in_other(other, place, {**how, "functions": None})
    if second is None:
        said = f"the coordinates are singular where {place.where}"
        raise InputError(replace(problem, hint=f"{said}\n{problem.hint}")) from refusal
    return second


@dataclass(frozen=True)
class _Meeting:
    """A place, the samples before it, and whether the run went past it."""

    place: SingularPlace
    samples: int
    passed: bool


def _parameters(model: Model) -> list[float]:
    return [0.0 if p.value is None else p.value for p in model.parameters]


def _factors(model: Model, t: Array, states: Array) -> Array:
    """Numbers that vanish where the coordinates are singular, shape (m, places)."""
    given, function = _parameters(model), functions_of(model.code.singular)["outputs"]
    rows = [function(s, y, given) for s, y in zip(t.tolist(), states, strict=True)]
    return np.array(rows, dtype=float).reshape(len(t), -1)


def _at_start(model: Model) -> SingularPlace | None:
    """The place at which the motion begins, if it does."""
    if model.initial is None:
        return None
    start = np.array([model.initial])
    values = _factors(model, np.array([model.defaults.start]), start)[0]
    for place, value in zip(model.singular, values, strict=True):
        if not abs(value) > VANISHED:
            return place
    return None


def _met(model: Model, run: Trajectory) -> _Meeting | None:
    """The first place that a run passed or ended at."""
    names = [*model.coordinates, *(f"dot({name})" for name in model.coordinates)]
    states = np.column_stack([run.columns[name] for name in names])
    values = _factors(model, run.t, states)
    found = []
    for place, factor in zip(model.singular, values.T, strict=True):
        rates = np.column_stack([run.columns[f"dot({name})"] for name in place.lost])
        changes = np.flatnonzero(np.signbit(factor[1:]) != np.signbit(factor[:-1]))
        passed = [k for k in changes.tolist() if _is_barred(factor, rates, k)]
        if passed:
            found.append(_Meeting(place, passed[0] + 1, passed=True))
        elif run.status not in ("ok", "stopped") and _ends_there(factor):
            found.append(_Meeting(place, len(run.t), passed=False))
    return min(found, key=lambda met: met.samples, default=None)


def _is_barred(factor: Array, rates: Array, before: int) -> bool:
    """Whether a motion that changed sides after a sample cannot have done so.

    The momentum of a coordinate that loses its inertia as the factor's square keeps its
    value: then the rate grows without bound, and the motion turns round. If instead the
    rate is steady, the momentum goes to zero as the inertia does.
    """
    around = slice(max(before - 2, 0), before + 4)
    inertia = factor[around] ** 2
    near = (rate for rate in rates[around].T if rate.any())
    return any(_spread(rate * inertia) < _spread(rate) for rate in near)


def _spread(values: Array) -> float:
    """How much numbers differ, beside their size."""
    size = float(np.abs(values).mean())
    return float(values.std()) / size if size > 0 else 0.0


def _ends_there(factor: Array) -> bool:
    """Whether a factor is about to vanish at its last sample."""
    last = abs(float(factor[-1]))
    if last <= NEAR * float(np.abs(factor).max()):
        return True
    pace = abs(float(factor[-2])) - last if len(factor) > 1 else 0.0
    return pace > 0 and last <= ARRIVED * pace


def _cut(run: Trajectory, met: _Meeting) -> Trajectory:
    """What is known before a place that was met."""
    where, last = met.place.where, float(run.t[met.samples - 1])
    said = (
        f"the coordinates are singular where {where}, which is met after t = {last:.9g};"
        " --formulation multiplier goes on where it has no such place"
    )
    if not met.passed:
        return replace(run, reason=f"{run.reason}; {said}")
    kept = slice(met.samples)
    promised = run.requested is not None
    return replace(
        run,
        status="accuracy_not_reached",
        reason=said,
        t=run.t[kept],
        columns=_sliced(run.columns, kept),
        energy=run.energy[kept],
        multipliers=_sliced(run.multipliers, kept),
        forces=_sliced(run.forces, kept),
        holds_until=last if promised else None,
    )


def _sliced(columns: Mapping[str, Array], kept: slice) -> dict[str, Array]:
    return {name: values[kept] for name, values in columns.items()}


# The same motion in other coordinates.


def _in_other(
    other: Callable[[], Model], place: SingularPlace, how: Mapping[str, Any]
) -> Trajectory | None:
    """The motion with multipliers; None where that form has the same coordinates."""
    try:
        model = other()
    except InputError:
        return None
    kept = set(place.lost) & set(model.coordinates)
    if model.chart is None or (kept and not place.ends):
        return None
    found = _with_chart(model, model.chart, how)
    said = f"in {model.formulation} form: the coordinates are singular where {place.where}"
    return replace(found, remarks=(said, *found.remarks))


def _with_chart(model: Model, chart: FormerChart, how: Mapping[str, Any]) -> Trajectory:
    """A simulation whose results hold the coordinates that have been replaced as well."""
    run = simulate(model, **how)
    gone = [name for name in chart.coordinates if name not in run.columns]
    if not gone:
        return run
    found, every = _follow(model, chart, run), 1
    finer = _finer(model, how)
    if found.lost and finer is not None and run.status == "ok":
        # The motion between samples has to be known better, close to singular places.
        run = simulate(model, **{**how, "samples": finer.samples})
        found, every = _follow(model, chart, run), finer.every
    own = _own_columns(chart, gone, found, run)
    remarks = run.remarks
    if found.lost:
        remarks = (*remarks, _choice(gone, found.lost[0][0]))
    kept = slice(None, None, every)
    return replace(
        run,
        t=run.t[kept],
        columns=_sliced(own | dict(run.columns), kept),
        energy=run.energy[kept],
        multipliers=_sliced(run.multipliers, kept),
        forces=_sliced(run.forces, kept),
        remarks=remarks,
    )


def _choice(names: list[str], t: float) -> str:
    listed = ", ".join(names)
    return (
        f"{listed}: the motion passes t = {t:.9g} closer to where they have no meaning than it is"
        " known; from there on they are one choice of several for the position"
    )


class _Finer(NamedTuple):
    """More samples, of which every so many are those that are asked for."""

    samples: int
    every: int


def _finer(model: Model, how: Mapping[str, Any]) -> _Finer | None:
    """Samples close enough to follow coordinates; None where steps are given, or they are."""
    number, step = how.get("samples"), how.get("step")
    if number is None and step is None:
        number, step = model.defaults.samples, model.defaults.step
    if step is not None:
        return None
    intervals = (DEFAULT_SAMPLES if number is None else number) - 1
    every = -(-FOLLOWED // intervals)
    return _Finer(intervals * every + 1, every) if every > 1 else None


def _follow(model: Model, chart: FormerChart, run: Trajectory) -> Followed:
    """Former coordinates along a run."""
    functions, given = functions_of(chart.python), _parameters(model)
    names = model.coordinates
    relative = (run.estimated or 0.0) + float(np.finfo(float).eps)
    samples = Samples(
        run.t,
        np.column_stack([run.columns[name] for name in names]),
        np.column_stack([run.columns[f"dot({name})"] for name in names]),
        relative * np.array([run.scales[name] for name in names]),
    )
    return follow(
        samples,
        None if chart.start is None else np.array(chart.start),
        len(chart.coordinates),
        lambda t, y: functions["positions"](t, y, given),
        lambda t, y: functions["velocities"](t, y, given),
    )


def _own_columns(
    chart: FormerChart, names: list[str], found: Followed, run: Trajectory
) -> dict[str, Array]:
    """Columns of former coordinates, NaN where they are not known to the accuracy asked for."""
    places, rates = {}, {}
    eps = run.requested or NEAR
    speeds = np.nan_to_num(np.abs(found.v)).max(axis=1)
    for name in names:
        j = chart.coordinates.index(name)
        q, v, off = found.q[:, j], found.v[:, j], found.amplification[:, j]
        size = 1.0
        if chart.kinds[j] != "angle":
            size = float(np.nanmax(np.abs(q), initial=0.0))
        known = off <= eps * size
        fastest = max(float(np.abs(v[known]).max(initial=0.0)), size)
        steady = known & (np.where(known, off, 0.0) * speeds <= eps * fastest)
        places[name] = np.where(known, q, np.nan)
        rates[f"dot({name})"] = np.where(steady, v, np.nan)
    return places | rates
