"""Rounding errors of steps, below which no tolerance is of use."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Rhs
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, in_mode
from lagrange_cli.simulate.integrators.hybrid.surfaces import surfaces_of
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.system.rounding import each_off_by_one_ulp

#: Part of the noise of a step that its error estimate feels.
NOISE_PART = 1 / 16

#: Patterns in which the last places of a state are moved: numbers that are close to each other,
#: and whose difference matters, may move alike in one of them.
_PATTERNS = (0, 1, 2, 3)


def noise_of_steps(
    problem: InitialValueProblem,
    times: Array,
    states: Array,
    lengths: Array,
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
    moved = each_off_by_one_ulp(states, _PATTERNS)
    change = np.empty(states.shape)
    for alike, (rhs, *perturbed) in _smooth_parts(problem, times, states, closed):
        at, there = times[alike], states[alike]
        every = moved[:, alike].reshape(-1, states.shape[1])
        slopes = _slopes(rhs, np.concatenate([at] * len(moved)), every)
        slopes = np.concatenate([slopes, *(_slopes(side, at, there) for side in perturbed)])
        slopes = slopes.reshape(-1, *there.shape)
        change[alike] = np.abs(slopes[1:] - slopes[0]).max(axis=0)
    h = lengths[:, None]
    noise = h * change
    noise[~np.isfinite(noise)] = 0.0
    n = states.shape[1] // 2
    noise[:, :n] += h * noise[:, n:]
    return noise


def _slopes(rhs: Rhs, t: Array, y: Array) -> Array:
    """Evaluate a right-hand side at many states, shapes (m,), (m, 2n) → (m, 2n)."""
    if isinstance(rhs, NativeRhs) and rhs.kernels is not None:
        return rhs.table(t, y, y.shape[1])
    return np.array([rhs(s, state) for s, state in zip(t.tolist(), y, strict=True)])


def _smooth_parts(
    problem: InitialValueProblem, t: Array, y: Array, closed: Sequence[ContactMode]
) -> Iterable[tuple[list[int] | slice, list[Rhs]]]:
    """Divide states into those of one mode, with the right-hand side and the perturbed ones in it,
    without the jumps that a last place may cross."""
    sides = [problem.rhs, *(problem.perturbed or ())]
    surfaces = [surfaces_of(rhs) for rhs in sides]
    if surfaces[0] is None and not any(closed):
        return [(slice(None), sides)]
    parts: dict[Any, tuple[list[int], list[Rhs]]] = {}
    for k, mode in enumerate(closed):
        around = None if mode or surfaces[0] is None else surfaces[0].around(float(t[k]), y[k])
        if (mode, around) not in parts:
            smooth = [in_mode(rhs, mode) for rhs in sides]
            if around is not None:
                smooth = [every.side(around) for every in surfaces if every is not None]
            parts[mode, around] = [], smooth
        parts[mode, around][0].append(k)
    return parts.values()
