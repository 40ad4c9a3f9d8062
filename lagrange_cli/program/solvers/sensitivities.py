"""Variational equations: derivatives of a motion along directions, integrated beside it.

With s the derivative of the coordinates by a number α, M a = f of (q, v, α) gives

    M s̈ = −d/dα (M a − f) along (s, ṡ, 1),

with a kept: one more right-hand side of the matrix of the accelerations for each α (Hairer,
Nørsett and Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., I.14). The coordinates s
stand behind those of the system, all of the first α, then those of the next. States of first order
x with ẋ = r have derivatives with the rate dr/dα, which stand behind them likewise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.graph.derivatives import (
    UNIT,
    Tangent,
    derivatives,
    replaced,
    scaled,
)
from lagrange_cli.program.graph.value_graph import ScaledNode, ValueGraph
from lagrange_cli.program.solvers.blocks import (
    MassMatrixSystem,
    MatrixBlock,
    factored,
    inertia_rows,
    substituted,
)
from lagrange_cli.program.solvers.jacobians import changes_along, input_value

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Most coupled coordinates whose system is written out for sensitivities.
LARGEST_WITH_SENSITIVITIES = 16


def with_sensitivities(
    values: ValueGraph,
    equations: Equations,
    system: MassMatrixSystem,
    blocks: tuple[MatrixBlock, ...],
    outputs: Mapping[str, list[ScaledNode]],
) -> tuple[tuple[MatrixBlock, ...], list[tuple[str, list[ScaledNode]]]]:
    """Add the accelerations of the sensitivities to a solution in straight-line code.

    Parameters
    ----------
    blocks, outputs
        As :func:`.blocks.solve_blocks` gives them; all blocks are unrolled.
    """
    if not all(block.unrolled for block in blocks):
        raise _too_coupled()
    n = len(equations.system.mass_matrix)
    matrix = inertia_rows(values, equations)
    rights = changes_along(values, system, matrix, [], _seeds(values, equations, n))
    accelerations = iter(outputs["acceleration"])
    solved = {i: next(accelerations) for block in blocks for i in block.coordinates}
    known = {input_value(values, f"a{i}")[1]: value for i, value in solved.items()}
    added = {name: list(nodes) for name, nodes in outputs.items()}
    pivots, scales = iter(outputs["pivots"]), iter(outputs["scales"])
    further = []
    for block in blocks:
        members = block.coordinates
        none = (UNIT[0] * 0, UNIT[1])
        rows = factored(values, [[matrix[i].get(j, none) for j in members] for i in members])
        tests = [(next(pivots), next(scales)) for _ in members]
        for k in range(len(equations.system.sensitivities)):
            right = replaced(values, [rights[i].get(k, none) for i in members], known)
            added["acceleration"] += substituted(values, rows, right)
            # A matrix that is singular for the motion is singular for its derivatives.
            added["pivots"] += [pivot for pivot, _ in tests]
            added["scales"] += [scale for _, scale in tests]
            further.append(replace(block, coordinates=tuple(n * (k + 1) + i for i in members)))
    return (*blocks, *further), list(added.items())


def state_rates(values: ValueGraph, equations: Equations) -> list[ScaledNode]:
    """Return the rates of the states, then those of their derivatives along each direction."""
    directions = len(equations.system.sensitivities)
    count = len(equations.system.states) // (directions + 1)
    rates = [values.convert(state.rate) for state in equations.system.states[:count]]
    if not directions:
        return rates
    tangents = derivatives(values, rates, _seeds(values, equations, _own_coordinates(equations)))
    none = (UNIT[0] * 0, UNIT[1])
    changes = [tangent.get(k, none) for k in range(directions) for tangent in tangents]
    return [*rates, *changes]


def _own_coordinates(equations: Equations) -> int:
    return len(equations.system.mass_matrix)


def _too_coupled() -> InputError:
    return InputError(
        Problem(
            "the motion's derivatives are not found where more than"
            f" {LARGEST_WITH_SENSITIVITIES} coordinates are coupled by their inertia, or the mass"
            " matrix is not proven positive definite",
            rule="sensitivity",
        )
    )


def _seeds(values: ValueGraph, equations: Equations, n: int) -> dict[int, Tangent]:
    """Derivatives of coordinates, velocities and parameters along each direction."""
    seeds: dict[int, dict[int, ScaledNode]] = {}
    states = equations.system.states
    count = len(states) // (len(equations.system.sensitivities) + 1)
    for k, parameters in enumerate(equations.system.sensitivities):
        further = equations.system.coordinates[n * (k + 1) : n * (k + 2)]
        for coordinate, change in zip(equations.system.coordinates[:n], further, strict=True):
            seeds.setdefault(values.convert(coordinate.q)[1], {})[k] = values.convert(change.q)
            seeds.setdefault(values.convert(coordinate.v)[1], {})[k] = values.convert(change.v)
        for state, moved in zip(states[:count], states[count * (k + 1) :], strict=False):
            seeds.setdefault(values.convert(state.symbol)[1], {})[k] = values.convert(moved.symbol)
        for symbol, slope in parameters.items():
            seeds.setdefault(values.convert(symbol)[1], {})[k] = scaled(UNIT, slope)
    return dict(seeds)
