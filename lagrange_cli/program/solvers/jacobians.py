"""Derivatives of the state's rates: columns of systems with the matrix of the accelerations.

The rates of the coordinates are the velocities, whose derivatives are 1 or 0.

Accelerations a and multipliers λ solve M a = f + Σ λ·gradient, gradient·a + bias = 0.
Differentiated by a number x of which M, f, gradients and biases depend,

    M a' = −∂/∂x (M a − f − Σ λ·gradient) + Σ λ'·gradient,
    gradient·a' = −∂/∂x (gradient·a + bias),

with a and λ kept on the right: each x is a column of right-hand sides of one matrix, whose
blocks are those of :mod:`lagrange_cli.program.solvers.blocks`. What depends on no such x in a block
is zero, and where most is, the numbers alone that need not be zero are stored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.program.graph.derivatives import UNIT, Tangent, derivatives, product, scaled
from lagrange_cli.program.graph.value_graph import InputNode, ScaledNode, ValueGraph
from lagrange_cli.program.solvers.blocks import (
    MassMatrixSystem,
    components,
    converted_rows,
    factored,
    inertia_rows,
    is_unrolled,
    substituted,
)

if TYPE_CHECKING:
    from sympy import Symbol

    from lagrange_cli.mechanics.equations import Equations

#: A large matrix with fewer than one number in so many that need not be zero is stored sparse.
_SPARSE = 8

#: Matrices of fewer coordinates than this are stored whole.
_SMALL = 16

#: The rank of accelerations and multipliers as inputs (see :class:`.value_graph.ValueGraph`).
_GIVEN = 5

_MINUS = -1

#: Outputs of a program of derivatives, in their order.
Outputs: TypeAlias = "list[tuple[str, list[ScaledNode]]]"


@dataclass(frozen=True)
class ColumnBlock:
    """A block of the matrix with its right-hand sides, for a loop to solve.

    Attributes
    ----------
    coordinates, closures
        Their indices.
    compliant
        The diagonal of the closures is given (see :class:`MassMatrixSystem`).
    columns
        Columns of the Jacobian whose right-hand sides are not all zero.
    places
        Row and number among ``columns`` of each right-hand side that is given; others are 0.
    """

    coordinates: tuple[int, ...]
    closures: tuple[int, ...]
    compliant: bool
    columns: tuple[int, ...]
    places: tuple[tuple[int, int], ...]

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return len(self.coordinates) + len(self.closures)

    @property
    def workspace(self) -> int:
        """Numbers for the matrix, the right-hand sides and the scales."""
        return self.size * (self.size + len(self.columns) + 1)


@dataclass(frozen=True)
class Jacobian:
    """Layout of the stored derivatives of the state's rates or of outputs.

    Attributes
    ----------
    rows, columns
        Number of functions that are differentiated, and of variables of the derivatives.
    first
        Row of the first acceleration.
    multipliers
        Number of multipliers that may be read.
    entries
        Row and column of each number of the output ``entries``.
    blocks
        Blocks that a loop solves.
    pattern
        Row and column of each number that is stored, by rows; None where all are.
    """

    rows: int
    columns: int
    first: int
    multipliers: int
    entries: tuple[tuple[int, int], ...]
    blocks: tuple[ColumnBlock, ...]
    pattern: tuple[tuple[int, int], ...] | None

    @property
    def size(self) -> int:
        """Number of entries that are stored."""
        return self.rows * self.columns if self.pattern is None else len(self.pattern)

    @property
    def stored(self) -> dict[tuple[int, int], int]:
        """Row and column → place in the result."""
        if self.pattern is not None:
            return {place: k for k, place in enumerate(self.pattern)}
        return {(i, k): i * self.columns + k for i, k in self.nonzero}

    @property
    def nonzero(self) -> tuple[tuple[int, int], ...]:
        """Rows and columns of entries that need not be zero, by rows."""
        solved = (
            (self.first + i, k) for b in self.blocks for i in b.coordinates for k in b.columns
        )
        return tuple(sorted([*self.entries, *solved]))

    @property
    def workspace(self) -> int:
        """Numbers of workspace that the largest block takes."""
        return max((block.workspace for block in self.blocks), default=0)


def solve_jacobian(
    values: ValueGraph,
    equations: Equations,
    system: MassMatrixSystem,
    by: Sequence[Symbol],
    *,
    sparse: bool,
) -> tuple[Jacobian, Outputs]:
    """Differentiate the state's rates: velocities, the accelerations that a system gives, and the
    rates of states.

    Accelerations ``a0, a1, …`` and multipliers ``l0, l1, …`` are inputs of the program.

    Parameters
    ----------
    by
        Symbols of coordinates, velocities, inputs or parameters, one for each column.
    sparse
        Store the numbers alone that need not be zero where they are few.

    Returns
    -------
    Where the results are stored, and the outputs ``entries`` (of unrolled blocks), ``dense_matrix``
    (the upper triangles of the other blocks, by rows, each followed by the gradients of the
    block's closures, and their compliance in a compliant block) and ``dense_forcing`` (their
    right-hand sides, as ``places`` has them).
    """
    matrix = inertia_rows(values, equations)
    rates = [values.convert(state.rate) for state in equations.system.states]
    gradients = converted_rows(values, [gradient for gradient, _ in system.closures])
    seeds = {values.convert(symbol)[1]: {k: UNIT} for k, symbol in enumerate(by)}
    changes = changes_along(values, system, matrix, gradients, seeds)
    definite = equations.derivation.facts.positive_definite_mass_matrix
    outputs: dict[str, list[ScaledNode]] = {
        name: [] for name in ("entries", "dense_matrix", "dense_forcing")
    }
    layout = equations.system.layout
    first, columns_by = layout.velocities.start, {symbol: k for k, symbol in enumerate(by)}
    velocities = [columns_by.get(c.v) for c in equations.system.coordinates]
    written = [(i, k) for i, k in enumerate(velocities) if k is not None]
    outputs["entries"] += [UNIT] * len(written)
    blocks: list[ColumnBlock] = []
    for members, closures in components(matrix, gradients):
        rows = [*members, *(len(matrix) + k for k in closures)]
        right = [changes[row] for row in rows]
        columns = tuple(sorted(set().union(*right)))
        if not columns:
            continue
        if not closures and is_unrolled(len(members), definite):
            solved, nodes = _unrolled(values, matrix, members, columns, right)
            written += ((first + i, column) for i, column in solved)
            outputs["entries"] += nodes
            continue
        compliant = bool(closures and equations.system.contacts)
        number = {column: k for k, column in enumerate(columns)}
        stored_entries = [
            (i, number[k], x) for i, row in enumerate(right) for k, x in sorted(row.items())
        ]
        places = tuple((i, k) for i, k, _ in stored_entries)
        blocks.append(ColumnBlock(members, closures, compliant, columns, places))
        outputs["dense_forcing"] += (x for _, _, x in stored_entries)
        dense, none = outputs["dense_matrix"], (0, 0)
        dense += (matrix[i].get(j, none) for k, i in enumerate(members) for j in members[k:])
        dense += (gradients[k].get(j, none) for k in closures for j in members)
        dense += (values.convert(system.compliance_of(k)) for k in closures if compliant)
    for row, tangent in enumerate(derivatives(values, rates, seeds), layout.first_order.start):
        written += [(row, k) for k in sorted(tangent) if tangent[k][0]]
        outputs["entries"] += [tangent[k] for k in sorted(tangent) if tangent[k][0]]
    jacobian = Jacobian(
        layout.size, len(by), first, len(gradients), tuple(written), tuple(blocks), None
    )
    nonzero = jacobian.nonzero
    if (
        sparse
        and len(matrix) >= _SMALL
        and _SPARSE * len(nonzero) < jacobian.rows * jacobian.columns
    ):
        jacobian = replace(jacobian, pattern=nonzero)
    return jacobian, list(outputs.items())


def slopes_of(
    values: ValueGraph, nodes: Sequence[ScaledNode], by: Sequence[Symbol]
) -> tuple[Jacobian, Outputs]:
    """Differentiate values of a graph by symbols, one for each column; all are stored."""
    seeds = {values.convert(symbol)[1]: {k: UNIT} for k, symbol in enumerate(by)}
    tangents = derivatives(values, nodes, seeds)
    slopes = {(i, k): x for i, row in enumerate(tangents) for k, x in sorted(row.items()) if x[0]}
    jacobian = Jacobian(len(nodes), len(by), 0, 0, tuple(slopes), (), None)
    return jacobian, [("entries", [*slopes.values()]), ("dense_matrix", []), ("dense_forcing", [])]


def changes_along(
    values: ValueGraph,
    system: MassMatrixSystem,
    matrix: Sequence[Mapping[int, ScaledNode]],
    gradients: Sequence[Mapping[int, ScaledNode]],
    seeds: Mapping[int, Tangent],
) -> list[dict[int, ScaledNode]]:
    """Right-hand sides of the coordinates' rows, then of the closures': direction → value.

    ``seeds``: derivatives of input nodes along the directions.
    """
    a = [input_value(values, f"a{i}") for i in range(len(matrix))]
    residuals = [
        [product(values, entry, a[j]) for j, entry in row.items()]
        + [scaled(values.convert(f), _MINUS)]
        for row, f in zip(matrix, system.right, strict=True)
    ]
    for k, row in enumerate(gradients):
        push = scaled(input_value(values, f"l{k}"), _MINUS)
        for j, entry in row.items():
            residuals[j].append(product(values, push, entry))
    for row, (_, bias) in zip(gradients, system.closures, strict=True):
        terms = [product(values, entry, a[j]) for j, entry in row.items()]
        residuals.append([*terms, values.convert(bias)])
    tangents = derivatives(values, [values.add(terms) for terms in residuals], seeds)
    return [{k: scaled(x, _MINUS) for k, x in tangent.items()} for tangent in tangents]


def input_value(values: ValueGraph, name: str) -> ScaledNode:
    """Return the input of a program that is an acceleration or a multiplier."""
    return 1, values.intern(InputNode(name), _GIVEN)


def _unrolled(
    values: ValueGraph,
    matrix: Sequence[dict[int, ScaledNode]],
    members: tuple[int, ...],
    columns: tuple[int, ...],
    right: Sequence[Tangent],
) -> tuple[list[tuple[int, int]], list[ScaledNode]]:
    """Solve for all columns in straight-line code; return places and values of the results."""
    none = (0, 0)
    rows = factored(values, [[matrix[i].get(j, none) for j in members] for i in members])
    places, nodes = [], []
    for column in columns:
        solved = substituted(values, rows, [row.get(column, none) for row in right])
        for i, value in zip(members, solved, strict=True):
            if value[0]:
                places.append((i, column))
                nodes.append(value)
    return places, nodes
