"""Constraint forces at the samples of a motion, from accelerations and multipliers there."""

from __future__ import annotations

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.simulate.system.tables import ParameterTable
from lagrange_cli.simulate.system.tracing import functions_of


def constraint_force_columns(
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
    known = _known(model, functions, t, states)
    give = functions.forces or _interpreted(model, functions)
    table = give(t, states, known)
    return {name: table[:, k].copy() for k, name in enumerate(model.forces)}


def _known(model: Model, functions: RightHandSide, t: Array, states: Array) -> Array:
    """Evaluate what forces read besides the state: parameters, accelerations, multipliers."""
    n = len(model.coordinates)
    slopes = [functions.rhs(*state)[n:] for state in zip(t.tolist(), states, strict=True)]
    rows = np.tile(model.numbers, (len(t), 1)).reshape(len(t), len(model.parameters))
    return np.hstack([rows, np.reshape(slopes, (len(t), n)), functions.multipliers(t, states)])


def _interpreted(model: Model, functions: RightHandSide) -> ParameterTable:
    """Make the interpreted table of forces."""
    forces, recorded = functions_of(model.code.forces), functions.recorded_inputs

    def row(time: float, state: Array, known: Array) -> Array:
        inputs = [lambda t, *_: recorded.pieces.values(t)] if recorded else []
        return np.asarray(forces["outputs"](time, state, known.tolist(), *inputs))

    def rows(t: Array, y: Array, known: Array) -> Array:
        table = [row(*sample) for sample in zip(t.tolist(), y, known, strict=True)]
        return np.array(table, dtype=float).reshape(len(t), len(model.forces))

    return rows
