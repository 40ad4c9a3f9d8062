"""Columns of a trajectory at some samples, by name, constraint forces among them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.simulate.system.tables import ParameterTable
from lagrange_cli.simulate.system.tracing import functions_of
from lagrange_cli.simulate.verification.contact_history import MotionFunctions


def constraint_force_columns(
    model: Model, functions: RightHandSide, t: Array, states: Array
) -> dict[str, Array]:
    """Evaluate the columns of all forces of the model, by name; NaN without acceleration.

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
    n, accelerations = len(model.coordinates), model.layout.velocities
    slopes = [
        functions.rhs(*state)[accelerations] for state in zip(t.tolist(), states, strict=True)
    ]
    rows = np.tile(model.numbers, (len(t), 1)).reshape(len(t), len(model.parameters))
    return np.hstack([rows, np.reshape(slopes, (len(t), n)), functions.multipliers(t, states)])


def _interpreted(model: Model, functions: RightHandSide) -> ParameterTable:
    """Make the interpreted table of forces."""
    forces = functions_of(model.code.functions)["forces"]
    recorded = functions.recorded_inputs

    def row(time: float, state: Array, known: Array) -> Array:
        inputs = recorded.pieces.values(time) if recorded else []
        return np.asarray(forces(time, state, known.tolist(), inputs))

    def rows(t: Array, y: Array, known: Array) -> Array:
        table = [row(*sample) for sample in zip(t.tolist(), y, known, strict=True)]
        return np.array(table, dtype=float).reshape(len(t), len(model.forces))

    return rows


@dataclass(frozen=True)
class Sampled:
    """Fields of a :class:`.trajectory.Trajectory` that have one entry a sample.

    Attributes
    ----------
    t
        Times of the samples, shape (m,).
    columns, energy, multipliers, forces
        As there, each array of shape (m,).
    """

    t: Array
    columns: Mapping[str, Array]
    energy: Array
    multipliers: Mapping[str, Array]
    forces: Mapping[str, Array]


def sampled(
    model: Model, seen: MotionFunctions, t: Array, states: Array, energy: Array | None = None
) -> Sampled:
    """Evaluate the columns of some samples of a motion.

    Parameters
    ----------
    t, states
        Shapes (m,), ascending, and (m, 2n).
    energy
        Energies there, shape (m,), if they are known.
    """
    functions = seen.functions
    names = (*model.multipliers, *model.contacts)
    return Sampled(
        t=t,
        columns=state_columns(model, functions, t, states),
        energy=functions.energy(t, states)[:, 0] if energy is None else energy,
        multipliers=dict(zip(names, functions.multipliers(t, states).T, strict=True)),
        forces=constraint_force_columns(model, functions, t, states),
    )


def state_columns(
    model: Model, functions: RightHandSide, t: Array, states: Array
) -> dict[str, Array]:
    """Evaluate coordinates and Cartesian names, each with their ``dot``, and outputs, once each."""
    columns = dict(zip(model.state_names, states.T.copy(), strict=True))
    for table, form in ((functions.positions, "{}"), (functions.velocities, "dot({})")):
        for name, column in zip(model.cartesian, table(t, states).T.copy(), strict=True):
            columns.setdefault(form.format(name), column)
    named = functions.outputs(t, states)[:, : len(model.outputs)]
    return columns | dict(zip(model.outputs, named.T.copy(), strict=True))
