"""Rounding errors of steps, below which no tolerance is of use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Rhs
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, in_mode
from lagrange_cli.simulate.integrators.hybrid.surfaces import surfaces_of
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.system.rounding import each_off_by_one_ulp

#: Part of the noise of a step that its error estimate feels.
NOISE_PART = 1 / 16

#: Patterns in which the last places of a state are moved: numbers that are close to each other,
#: and whose difference matters, may move alike in one of them.
_PATTERNS = (1, 2, 3)


def noise_of_steps(
    problem: InitialValueProblem,
    times: Sequence[float],
    states: Array,
    lengths: Sequence[float],
    closed: Sequence[ContactMode],
) -> Array:
    """Return the changes of steps from some states by rounding of the right-hand side.

    The largest change that the perturbed right-hand sides make, or the last places of the
    state, each by itself: together they may cancel, as in k*(r - l) where both move alike.
    Errors of velocities move positions within the step.

    Parameters
    ----------
    times, states, lengths
        Of the beginning of each step, and its length, shapes (m,), (m, 2n), (m,).
    closed
        Contacts that are closed at each; empty for a system without contacts.

    Returns
    -------
    Shape (m, 2n), 0 where the right-hand side does not exist.
    """
    if problem.perturbed is None:
        return np.zeros(states.shape)
    moved = [each_off_by_one_ulp(states, pattern) for pattern in _PATTERNS]
    values = []
    for k, (t, y) in enumerate(zip(times, states, strict=True)):
        rhs, *perturbed = _smooth(problem.rhs, *problem.perturbed, t=t, y=y, closed=closed[k])
        exact = rhs(t, y)
        values.append([exact, *(off(t, y) for off in perturbed), *(rhs(t, m[k]) for m in moved)])
    rates, h = np.array(values), np.asarray(lengths)[:, None]
    noise = h * np.abs(rates[:, 1:] - rates[:, :1]).max(axis=1)
    noise = np.where(np.isfinite(noise), noise, 0.0)
    n = states.shape[1] // 2
    noise[:, :n] += h * noise[:, n:]
    return noise


def _smooth(*sides: Rhs, t: float, y: Array, closed: ContactMode) -> list[Rhs]:
    """Take right-hand sides of one mode, without the jumps that a last place may cross."""
    if closed:
        return [in_mode(rhs, closed) for rhs in sides]
    surfaces = surfaces_of(sides[0])
    if surfaces is None:
        return list(sides)
    around = surfaces.around(t, y)
    every = [surfaces_of(rhs) for rhs in sides]
    return [surface.side(around) for surface in every if surface is not None]
