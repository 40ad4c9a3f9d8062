"""Runs that watch the exponents of sharp functions, so that their peaks are resolved."""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import partial

from lagrange_cli.simulate.integrators.base import Rhs
from lagrange_cli.simulate.integrators.hybrid.surfaces import surfaces_of
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.native.landmarks import NativeLandmarks
from lagrange_cli.simulate.runs.problem import InitialValueProblem


def watching(problem: InitialValueProblem) -> InitialValueProblem:
    """The same problem, whose compiled integrators resolve the peaks of sharp functions."""
    if problem.landmarks is None:
        return problem
    watched = partial(_watching, landmarks=problem.landmarks)
    perturbed = problem.perturbed
    return replace(
        problem,
        rhs=watched(problem.rhs),
        perturbed=None if perturbed is None else (watched(perturbed[0]), watched(perturbed[1])),
        wider=lambda: _wider(problem),
        landmarks=None,
    )


def _wider(problem: InitialValueProblem) -> InitialValueProblem | None:
    wider = problem.wider()
    return None if wider is None else watching(wider)


def _watching(rhs: Rhs, landmarks: NativeLandmarks) -> Rhs:
    if not isinstance(rhs, NativeRhs):
        return rhs
    copied = copy.copy(rhs)
    copied.landmarks = landmarks
    surfaces = surfaces_of(rhs)
    if surfaces is not None:
        copied.surfaces = surfaces.through(partial(_watching, landmarks=landmarks))
    return copied
