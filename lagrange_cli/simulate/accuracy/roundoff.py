"""Rounding error of a step, below which no tolerance is of use."""

from __future__ import annotations

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Rhs
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, in_mode
from lagrange_cli.simulate.integrators.hybrid.surfaces import surfaces_of
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.system.rounding import off_by_one_ulp

#: Part of the noise of a step that its error estimate feels.
NOISE_PART = 1 / 16

#: Patterns in which the last places of a state are moved: numbers that are close to each other,
#: and whose difference matters, may move alike in one of them.
_PATTERNS = (1, 2, 3)


def noise_of_step(
    problem: InitialValueProblem, t: float, y: Array, h: float, closed: ContactMode = ()
) -> Array:
    """Return the change of a step of length h from (t, y) by rounding of its right-hand side.

    The largest change that the perturbed right-hand sides make, or the last places of the
    state, each by itself: together they may cancel, as in k*(r - l) where both move alike.
    Errors of velocities move positions within the step.

    Parameters
    ----------
    closed
        Contacts that are closed there; empty for a system without contacts.

    Returns
    -------
    Shape (2n,), 0 where the right-hand side does not exist.
    """
    if problem.perturbed is None:
        return np.zeros(len(y))
    rhs, *perturbed = _smooth(problem.rhs, *problem.perturbed, t=t, y=y, closed=closed)
    exact = rhs(t, y)
    moved = [off(t, y) for off in perturbed]
    moved += [rhs(t, off_by_one_ulp(y, pattern)) for pattern in _PATTERNS]
    noise = h * np.abs(np.array(moved) - exact).max(axis=0)
    noise = np.where(np.isfinite(noise), noise, 0.0)
    n = len(y) // 2
    noise[:n] += h * noise[n:]
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
