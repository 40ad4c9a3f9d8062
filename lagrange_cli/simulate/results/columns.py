"""Columns of a trajectory at some samples, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.results.forces import constraint_force_columns
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.simulate.verification.contact_history import MotionFunctions


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
    """Coordinates, their ``dot``, Cartesian names, their ``dot``, outputs; each name once."""
    columns = dict(zip(model.state_names, states.T.copy(), strict=True))
    for table, form in ((functions.positions, "{}"), (functions.velocities, "dot({})")):
        for name, column in zip(model.cartesian, table(t, states).T.copy(), strict=True):
            columns.setdefault(form.format(name), column)
    named = functions.outputs(t, states)[:, : len(model.outputs)]
    return columns | dict(zip(model.outputs, named.T.copy(), strict=True))
