"""Constraint forces at the samples of a motion, from accelerations and multipliers there."""

from __future__ import annotations

import numpy as np

from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.right_hand_side import RightHandSide, functions_of

__all__ = ["constraint_forces"]


def constraint_forces(
    model: Model, functions: RightHandSide, t: Array, states: Array
) -> dict[str, Array]:
    """Column → values for each force of the model; NaN where there is no acceleration.

    Parameters
    ----------
    t, states
        Samples, shapes (m,) and (m, 2n).
    """
    if not model.forces:
        return {}
    found, driven = functions_of(model.code.forces), functions.drive
    given = [0.0 if p.value is None else p.value for p in model.parameters]
    n = len(model.coordinates)
    multipliers = functions.multipliers(t, states)

    def row(time: float, state: Array, unknowns: Array) -> Array:
        known = [*given, *functions.rhs(time, state)[n:], *unknowns]
        inputs = [lambda *_: driven.pieces.rows[driven.pieces.at(time)]] if driven else []
        return np.asarray(found["outputs"](time, state, known, *inputs))

    rows = [row(*of) for of in zip(t.tolist(), states, multipliers, strict=True)]
    table = np.array(rows, dtype=float).reshape(len(t), len(model.forces))
    return {name: table[:, k].copy() for k, name in enumerate(model.forces)}
