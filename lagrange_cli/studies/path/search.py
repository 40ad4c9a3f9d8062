"""Candidates: paths that solve the two-point problem roughly, from many starts.

Each start is a path between the ends: a straight one that is bent by sines, or a motion with some
initial velocity that is turned to the end. Newton's method on a polynomial that obeys
the equations of motion at Chebyshev points (:mod:`.collocation`) leads it to a path of stationary
action, if it finds one. With several degrees of freedom those that are known are then deflated, and
some of the starts lead to others (:mod:`.deflation`).
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.studies.chebyshev import points_of
from lagrange_cli.studies.path.collocation import (
    LARGEST_DEGREE,
    TwoPointProblem,
    solved,
)
from lagrange_cli.studies.path.deflation import Solutions, deflated

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.motions import Motions

#: Least degree of polynomials.
_LEAST_DEGREE = 32

#: Degree for each half wave that bends a start.
_POINTS_A_WAVE = 8

#: Least and most half waves that bend starts.
_FEWEST_WAVES, _MOST_WAVES = 4, 32

#: Sizes of bends over the scale of coordinates, of which each start has one by chance.
_SIZES = 0.3, 3.0

#: Size of further bends over the main one.
_FURTHER = 0.3

#: Starts from which further solutions are sought by deflation.
_SEEDS = 16

#: Accuracy of motions that are starts.
_FLIGHT = 1e-4


def candidates(motions: Motions, first: End, last: End, starts: int) -> Iterator[Array | None]:
    """Yield, for each start, the initial velocity of the path it leads to, or None.

    The first start is straight. The same starts are made every time.
    """
    problem = TwoPointProblem(motions, first, last, scales_of(motions, first, last))
    waves = _waves(motions, first, last)
    degree = min(max(_LEAST_DEGREE, _POINTS_A_WAVE * waves), LARGEST_DEGREE)
    ends = np.array([first.q, last.q]) / problem.scales
    s = points_of(degree).s[:, None]
    straight = ends[0] + s * (ends[1] - ends[0])
    known = Solutions()
    seeds: list[Array] = []
    for number in range(starts):
        bend = _bend(number, motions.size, waves, s)
        start = _flown(problem, s, bend) if number % 2 else straight + bend
        with np.errstate(all="ignore"):
            path = None if start is None else solved(problem, start)
        if path is not None:
            known.add(path)
        if start is not None and len(seeds) < _SEEDS:
            seeds.append(start)
        yield None if path is None else problem.velocity(path)
    if motions.size > 1:
        for path in deflated(problem, known, seeds):
            yield problem.velocity(path)


def scales_of(motions: Motions, first: End, last: End) -> Array:
    """Return sizes by which coordinates are bent: 1 of angles; of others the largest of the ends, a
    fall between them and the scene's start, or else 1."""
    model, span = motions.models.motion, last.t - first.t
    middle, mean = (first.q + last.q) / 2, (last.q - first.q) / span
    falls = motions.accelerations(np.array([first.t]), middle[None], mean[None])[0] * span**2 / 8
    sizes = np.maximum(np.maximum(np.abs(first.q), np.abs(last.q)), np.abs(np.nan_to_num(falls)))
    if model.initial is not None:
        sizes = np.maximum(sizes, np.abs(model.initial[: len(sizes)]))
    kinds = np.array(model.kinds)
    scales = np.ones(len(sizes))
    for kind in {*model.kinds} - {"angle"}:
        scales[kinds == kind] = np.max(sizes[kinds == kind]) or 1.0
    return scales


def _waves(motions: Motions, first: End, last: End) -> int:
    """Return a number of half waves above that of small oscillations between the ends."""
    span, q = last.t - first.t, np.array([first.q, (first.q + last.q) / 2, last.q])
    t = first.t + span * np.array([0, 0.5, 1])
    # Where coordinates at rest have no inertia, nothing is known of oscillations.
    stiffness = np.nan_to_num(motions.slopes(t, q, np.zeros_like(q))[0], posinf=0.0, neginf=0.0)
    frequency = math.sqrt(np.max(np.abs(np.linalg.eigvals(stiffness))))
    counted = min(frequency * span / math.pi, _MOST_WAVES)
    return min(max(_FEWEST_WAVES, math.ceil(counted) + 2), _MOST_WAVES)


def _bend(number: int, size: int, waves: int, s: Array) -> Array:
    """Return the bend of a start, shape (m, size); the main waves take turns."""
    if number == 0:
        return np.zeros((len(s), size))
    chance = random.Random(number)
    amplitudes = np.array([[chance.gauss(0, 1) for _ in range(size)] for _ in range(waves)])
    amplitudes *= _FURTHER / (1 + np.arange(waves)[:, None])
    direction = np.array([chance.gauss(0, 1) for _ in range(size)])
    amplitudes[number // 2 % waves] = direction / (np.linalg.norm(direction) or 1.0)
    size_of_all = math.exp(chance.uniform(*map(math.log, _SIZES)))
    return np.asarray(size_of_all * np.sin(np.pi * s * (1 + np.arange(waves))) @ amplitudes)


def _flown(problem: TwoPointProblem, s: Array, bend: Array) -> Array | None:
    """Return the motion that begins like the straight path with a bend, less its miss of the end in
    proportion to the time; None if it does not come so far."""
    first, last, scales = problem.first, problem.last, problem.scales
    v = (last.q - first.q + (bend[1] - bend[0]) / s[1] * scales) / problem.span
    times = first.t + problem.span * s[:, 0]
    times[-1] = last.t
    shot = problem.motions.shot(times, first.q, v, _FLIGHT)
    if shot is None:
        return None
    return np.asarray((shot.q + s * (last.q - shot.q[-1])) / scales)
