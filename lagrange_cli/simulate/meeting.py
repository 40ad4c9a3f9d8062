"""Places where the coordinates of a run are singular: whether it begins, passes or ends there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.model import Model, SingularPlace
from lagrange_cli.simulate.right_hand_side import functions_of
from lagrange_cli.simulate.trajectory import Trajectory

__all__ = ["NEAR", "Meeting", "parameters_of", "place_at_start", "place_met"]

#: A factor this small beside its largest value has vanished at the start.
VANISHED = 1e-12

#: How many more steps between samples, at the last pace, count as having arrived.
ARRIVED = 3.0

#: A factor this small beside its largest value is near the place as well.
NEAR = 1e-3


@dataclass(frozen=True)
class Meeting:
    """A place, the samples before it, and whether the run went past it."""

    place: SingularPlace
    samples: int
    passed: bool


def parameters_of(model: Model) -> list[float]:
    return [0.0 if p.value is None else p.value for p in model.parameters]


def _factors(model: Model, t: Array, states: Array) -> Array:
    """Numbers that vanish where the coordinates are singular, shape (m, places)."""
    given, function = parameters_of(model), functions_of(model.code.singular)["outputs"]
    rows = [function(s, y, given) for s, y in zip(t.tolist(), states, strict=True)]
    return np.array(rows, dtype=float).reshape(len(t), -1)


def place_at_start(model: Model) -> SingularPlace | None:
    """The place at which the motion begins, if it does."""
    if model.initial is None:
        return None
    start = np.array([model.initial])
    values = _factors(model, np.array([model.defaults.start]), start)[0]
    for place, value in zip(model.singular, values, strict=True):
        if not abs(value) > VANISHED:
            return place
    return None


def place_met(model: Model, run: Trajectory) -> Meeting | None:
    """The first place that a run passed or ended at."""
    names = [*model.coordinates, *(f"dot({name})" for name in model.coordinates)]
    states = np.column_stack([run.columns[name] for name in names])
    values = _factors(model, run.t, states)
    found = []
    for number, (place, factor) in enumerate(zip(model.singular, values.T, strict=True)):
        rates = np.column_stack([run.columns[f"dot({name})"] for name in place.lost])
        changes = np.flatnonzero(np.signbit(factor[1:]) != np.signbit(factor[:-1]))
        passed = [k for k in changes.tolist() if _is_barred(factor, rates, k)]
        if rates.any():
            passed += _unresolved(model, run, states, factor, number)
        if passed:
            found.append(Meeting(place, min(passed) + 1, passed=True))
        elif run.status not in ("ok", "stopped") and _ends_there(factor):
            found.append(Meeting(place, len(run.t), passed=False))
    return min(found, key=lambda met: met.samples, default=None)


def _unresolved(
    model: Model, run: Trajectory, states: Array, factor: Array, number: int
) -> list[int]:
    """The sample closest to a place, where the last place of a coordinate changes its factor by
    more than the accuracy.

    All runs that estimate the error hold coordinates there with the same few bits.
    """
    n, closest = len(model.coordinates), int(np.abs(factor).argmin())
    state = states[closest]
    beside = [state + row for row in np.diag(np.spacing(np.abs(state)))[:n]]
    times = np.full(n + 1, run.t[closest])
    own, *others = _factors(model, times, np.array([state, *beside]))[:, number].tolist()
    change = sum(abs(other - own) for other in others)
    return [closest] if change > (run.requested or NEAR) * abs(own) else []


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
