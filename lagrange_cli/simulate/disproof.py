"""What a result shows to be wrong with it, whatever its estimate says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lagrange_cli.simulate.accuracy import Disproof, Measured
from lagrange_cli.simulate.along import Along, first_penetration
from lagrange_cli.simulate.conservation import first_contradiction
from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.model import Model

__all__ = ["energies", "energy_is_conserved", "undisproved"]

#: What a run with a method and tolerances is believed to keep of its scales.
BELIEVED = 1e-3


def undisproved(
    model: Model, seen: Along, t: Array, measured: Measured, accuracy: float | None
) -> Measured:
    """What is not disproved: by the energy, where it is conserved and an accuracy promised, by
    a gap that is negative, by an impact that adds energy."""
    found = list(_disproofs(model, seen, t, measured, accuracy))
    if not found:
        return measured
    first, disproof = min(found, key=lambda of: of[0])
    return replace(measured, states=measured.states[:first], disproved=disproof)


def _disproofs(
    model: Model, seen: Along, t: Array, measured: Measured, accuracy: float | None
) -> Iterator[tuple[int, Disproof]]:
    """Number of the first sample that does not hold, and why, for each reason there is."""
    if accuracy is not None and energy_is_conserved(model):
        first = _contradicted(seen, t, measured, accuracy)
        if first is not None:
            yield first, Disproof(float(t[first]), "energy")
    if seen.contact is not None:
        kept = accuracy or BELIEVED
        met = first_penetration(seen.contact, t, measured.states, kept, measured.scales)
        if met is not None:
            yield met[0], Disproof(float(t[met[0]]), "gap", met[1])
    if seen.gained is not None and seen.gained[0] <= t[-1]:
        time, contacts = seen.gained
        yield max(int(np.searchsorted(t, time)), 1), Disproof(time, "impact", contacts)


def _contradicted(seen: Along, t: Array, measured: Measured, accuracy: float) -> int | None:
    _, kinetic = energies(seen, t, measured.states)
    return first_contradiction(
        lambda times, states: (
            seen.functions.energy(times, states)
            - seen.lost[np.searchsorted(t, times, side="right") - 1][:, None]
        ),
        t,
        measured.states,
        accuracy,
        measured.scales,
        kinetic,
    )


def energy_is_conserved(model: Model) -> bool:
    return "energy" in model.conserved or "jacobi" in model.conserved


def energies(seen: Along, t: Array, states: Array) -> tuple[Array, Array]:
    """The energy function at the samples, and its part that depends on velocities."""
    still = states.copy()
    still[:, states.shape[1] // 2 :] = 0.0
    total = seen.functions.energy(t, states)[:, 0]
    return total, total - seen.functions.energy(t, still)[:, 0]
