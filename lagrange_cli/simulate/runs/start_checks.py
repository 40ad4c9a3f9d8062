"""Checks of the initial state before anything is integrated."""

from __future__ import annotations

import numpy as np

from lagrange_cli.errors import InputError, Problem, SingularError
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import projection
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.system.singular_guard import positive_values

#: Distance that a start may have from the constraints, as a part of the largest coordinate or
#: velocity: more than the rounding of its numbers, less than anyone would call a start.
_OFF = 1e-9


def require_a_start(model: Model, problem: InitialValueProblem) -> None:
    """Refuse an initial state without accelerations, or away from the constraints.

    Raises
    ------
    InputError
        It cannot be integrated from.
    """
    values = positive_values(model)(problem.start, problem.y0) if model.positive else ()
    for name, value in zip(model.positive, values, strict=True):
        if not value > 0:
            message = f"'{name}' is declared positive, at the start it is {value:.9g}"
            raise InputError(Problem(message, hint="start elsewhere", rule="not-positive"))
    if not np.isfinite(problem.rhs(problem.start, problem.y0)).all():
        if model.massless:
            raise _massless(model)
        singular = "constraints or mass matrix are" if model.multipliers else "the mass matrix is"
        raise _refused(
            f"the equations of motion give no accelerations at the start, {_state(model, problem)}:"
            f" {singular} singular there, or a force is not finite",
            "start elsewhere, or choose coordinates and parameters that are regular there",
        )
    project = projection(problem.rhs)
    if project is not None and not _near(project(problem.start, problem.y0), problem.y0):
        raise _refused(
            f"the start is not on the constraints, {_state(model, problem)}",
            "lagrange derive shows the constraints that are kept",
        )


def _massless(model: Model) -> InputError:
    """Make the refusal of coordinates without inertia, naming parameters that may be why."""
    zeros = ", ".join(f"{p.name} = 0" for p in model.parameters if p.value == 0)
    named = ", ".join(f"'{name}'" for name in model.massless)
    return _refused(
        f"the inertia of {named} vanishes with {zeros}: no acceleration follows",
        "without it, leave the coordinate to a constraint, or give it a mass",
    )


def _near(projected: Array, y: Array) -> bool:
    """Tell if positions and velocities are those of the projected state; NaN is near nothing."""
    moved, size = (np.abs(a).reshape(2, -1).max(axis=1) for a in (projected - y, y))
    return bool((moved <= _OFF * size).all())


def _refused(message: str, hint: str) -> InputError:
    return SingularError(Problem(message, hint=hint, rule="singular"))


def _state(model: Model, problem: InitialValueProblem) -> str:
    return ", ".join(
        f"{q} = {x:.9g}" for q, x in zip(model.state_names, problem.y0.tolist(), strict=True)
    )
