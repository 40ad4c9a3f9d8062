"""Evidence in a result against it, whatever its estimate says."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from lagrange_cli.simulate.accuracy.measured import Disproof, Measured
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import UnfitError
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.samples import RowSequence, first_rows, windows
from lagrange_cli.simulate.system.rounding import parameter_values
from lagrange_cli.simulate.system.singular_guard import positive_values
from lagrange_cli.simulate.system.tracing import in_mpmath
from lagrange_cli.simulate.verification.contact_history import MotionFunctions, first_penetration
from lagrange_cli.simulate.verification.drifts import (
    EnergyDrift,
    ExactEnergy,
    first_contradiction,
)

#: Accuracy, relative to scales, that a run with a method and tolerances is believed to have.
_BELIEVED = 1e-3

#: Digits in which an energy is evaluated before it convicts.
_DIGITS = 60


def cut_at_disproof(
    model: Model, seen: MotionFunctions, t: RowSequence, measured: Measured, accuracy: float | None
) -> tuple[Measured, EnergyDrift | None]:
    """Cut a motion at the first disproof: a conserved energy that changes although an accuracy is
    promised, a value that is not positive although it is declared to be, a negative gap, or an
    impact that adds energy.

    Parameters
    ----------
    t
        Times of all samples that were asked for.

    Returns
    -------
    What is kept of the motion, and the drift of its energy; None if that is not conserved.
    """
    drift = energy_drift(model, seen, t, measured.states)
    disproofs = list(_disproofs(model, seen, t, measured, accuracy, drift))
    if not disproofs:
        return measured, drift
    first, disproof = min(disproofs, key=lambda numbered: numbered[0])
    trusted = replace(measured, states=first_rows(measured.states, first), disproved=disproof)
    return trusted, energy_drift(model, seen, t, trusted.states)


def _disproofs(
    model: Model,
    seen: MotionFunctions,
    t: RowSequence,
    measured: Measured,
    accuracy: float | None,
    drift: EnergyDrift | None,
) -> Iterator[tuple[int, Disproof]]:
    """Yield the number of the first sample that does not hold, and why, for each reason."""
    if accuracy is not None and drift is not None:
        first = _contradicted(model, seen, t, measured, accuracy, drift)
        if first is not None:
            yield first, Disproof(float(t[first]), "energy")
    if model.borders:
        left = _not_positive(model, t, measured.states)
        if left is not None:
            by = model.border_kind(left[1])
            yield left[0], Disproof(float(t[left[0] - 1]), by, where=left[1])
    if seen.contact is not None:
        believed = accuracy or _BELIEVED
        met = first_penetration(seen.contact, t, measured.states, believed, measured.scales)
        if met is not None:
            yield met[0], Disproof(float(t[met[0]]), "gap", met[1])
    if seen.gained is not None:
        time, contacts = seen.gained
        first = max(bisect_left(t, time), 1)
        if first < len(measured.states):
            yield first, Disproof(time, "impact", contacts)


def _not_positive(model: Model, t: RowSequence, states: RowSequence) -> tuple[int, str] | None:
    """Find the first sample beyond a border of the equations, and the name of that.

    Right-hand sides do not exist there, but those that are evaluated as expressions, or while a
    contact pushes, do not know that.
    """
    values, first = positive_values(model), 0
    for times, part in windows(t, states):
        rows = [values(s, y) > 0 for s, y in zip(times.tolist(), part, strict=True)]
        below = np.argwhere(~np.array(rows))
        if len(below):
            return first + int(below[0, 0]), model.borders[below[0, 1]]
        first += len(part)
    return None


def _contradicted(
    model: Model,
    seen: MotionFunctions,
    t: RowSequence,
    measured: Measured,
    accuracy: float,
    drift: EnergyDrift,
) -> int | None:
    return first_contradiction(
        lambda times, states: (
            seen.functions.energy(times, states) - seen.lost(np.asarray(times))[:, None]
        ),
        t,
        measured.states,
        accuracy,
        measured.scales,
        drift,
        lambda: _in_digits(model, seen, float(t[0]), np.asarray(measured.states[0])),
    )


def _in_digits(
    model: Model, seen: MotionFunctions, begun: float, start: Array
) -> ExactEnergy | None:
    """Make the energy in ``_DIGITS`` digits, less what impacts took, infinite where there is none;
    None if that at the start is not known."""
    if model.recordings or model.driven:
        return None
    # Imported where a conviction is looked at again: most runs need none of it.
    from mpmath import mp, mpf

    energy, parameters = in_mpmath(model.code.functions, "energy"), parameter_values(model)

    def exact(t: float, y: Array, moved: Array | None) -> Any:
        with mp.workdps(_DIGITS):
            change = np.zeros(len(y)) if moved is None else moved
            state = [mpf(a) + mpf(b) for a, b in zip(y.tolist(), change.tolist(), strict=True)]
            try:
                value = energy(mpf(t), state, [mpf(p) for p in parameters.tolist()])
            except UnfitError:
                return mp.inf
            return value - mpf(float(seen.lost(np.array([t]))[0]))

    return exact if mp.isfinite(exact(begun, start, None)) else None


def energy_is_conserved(model: Model) -> bool:
    return "energy" in model.conserved or "jacobi" in model.conserved


def energies(seen: MotionFunctions, t: Array, states: Array) -> tuple[Array, Array]:
    """Evaluate the energy at the samples, and its part that depends on velocities."""
    still = states.copy()
    still[:, seen.layout.velocities] = 0.0
    total = seen.functions.energy(t, states)[:, 0]
    return total, total - seen.functions.energy(t, still)[:, 0]


def energy_drift(
    model: Model, seen: MotionFunctions, t: RowSequence, states: RowSequence
) -> EnergyDrift | None:
    """Measure the change of the energy relative to its parts; None if it is not conserved."""
    if not energy_is_conserved(model):
        return None
    running = EnergyDrift()
    for times, part in windows(t, states):
        running.add(times, part, *energies(seen, times, part), seen.lost(times))
    return running
