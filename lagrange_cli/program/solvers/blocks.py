"""Solution of M a = f in emitted code: by blocks, the cheapest stable way each.

The zero pattern of M splits the coordinates into blocks that do not couple.
Closure equations couple those that they hold; such a block is solved for its
accelerations and multipliers together, M a = f + Σ λ·gradient with
gradient·a + bias = 0, by elimination with pivoting; a large one whose mass
matrix is diagonal for the multipliers alone, whose matrix is a band
(:mod:`lagrange_cli.program.solvers.sparse_factorization`), from which the accelerations follow.
A block of one is a division. A small block whose mass matrix is proven
positive definite becomes straight-line code: the exact solution where that is
known to lose no digits (:mod:`lagrange_cli.mechanics.dynamics.solve_exactly`), else
M = L D Lᵀ. Long chains of bodies are solved by articulated bodies in straight-line
code (:mod:`lagrange_cli.program.solvers.articulated_bodies`), for which M is not
needed. Larger blocks are eliminated by a loop in the emitted code, without
pivoting where M is proven positive definite (as stable as Cholesky's method;
Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., ch. 10), else
with partial pivoting.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import sympy

from lagrange_cli.mechanics.dynamics.solve_exactly import ExactSolution, solve_exactly
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.program.graph.value_graph import ONE, InputNode, ScaledNode, ValueGraph
from lagrange_cli.program.solvers.articulated_bodies import solve_tree
from lagrange_cli.program.solvers.composite_bodies import inertia_of_motions
from lagrange_cli.program.solvers.sparse_factorization import (
    bandwidth,
    elimination_order,
    is_banded,
)

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.elements.tree import BodyTree
    from lagrange_cli.mechanics.equations import Equations

#: Positive definite blocks up to this size are written out.
LARGEST_UNROLLED = 4

_ZERO: ScaledNode = (0, ONE)

#: The rank of multipliers (see :class:`lagrange_cli.program.graph.value_graph.ValueGraph`).
_FOUND = 5

_Rows: TypeAlias = list[dict[int, ScaledNode]]
"""The entries of a matrix that are not zero, row by row."""


@dataclass(frozen=True)
class MatrixBlock:
    """Coordinates whose accelerations are solved for together.

    Attributes
    ----------
    coordinates
        Indices, ascending.
    unrolled
        Straight-line code solves the block, whose pivots are to be checked; else a loop.
    definite
        The mass matrix is proven positive definite; a loop needs partial pivoting if not.
    exact
        No digits cancel in the pivots, so that each that is positive is known to be so.
    closures
        Indices of the closures solved with the coordinates; their block is never unrolled.
    band
        The multipliers alone are solved for, closures as far apart as this having
        coordinates in common; None: all unknowns are.
    start
        Index of the multipliers in the workspace, behind the band.
    compliant
        The diagonal of the closures is an output too (see :class:`MassMatrixSystem`).
    """

    coordinates: tuple[int, ...]
    unrolled: bool
    definite: bool
    exact: bool = False
    closures: tuple[int, ...] = ()
    band: int | None = None
    start: int = 0
    compliant: bool = False

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return len(self.coordinates) + len(self.closures)

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of a band's multipliers in the accelerations that follow from them."""
        if self.band is None:
            return ()
        return tuple(f"d{self.start + k}" for k in range(len(self.closures)))


@dataclass(frozen=True)
class MassMatrixSystem:
    """M x = ``right`` + Σ λ·gradient and gradient·x + bias = 0 for each of ``closures``.

    Attributes
    ----------
    right
        One expression for each coordinate.
    closures
        (gradient, bias) each.
    whole
        Blocks without closures are solved too; else only those with closures are.
    multipliers
        λ alone is asked for.
    compliance
        c of each closure, for gradient·x + bias + c·λ = 0: 0, or 1 where gradient and bias
        are zero.
    """

    right: Sequence[Expr]
    closures: Sequence[tuple[Sequence[Expr], Expr]] = ()
    whole: bool = True
    multipliers: bool = False
    compliance: Sequence[Expr] = ()

    def compliance_of(self, closure: int) -> Expr:
        return self.compliance[closure] if self.compliance else sympy.S.Zero


class _Unrolled(NamedTuple):
    """The values that straight-line code for one block computes.

    Attributes
    ----------
    exact
        True if no digits cancel in the pivots, so that each that is positive is known to be so.
    accelerations
        Accelerations of the block's coordinates.
    pivots, scales
        As the outputs of :func:`solve_blocks` of these names.
    """

    exact: bool
    accelerations: list[ScaledNode]
    pivots: list[ScaledNode]
    scales: list[ScaledNode]


def solve_blocks(
    values: ValueGraph,
    equations: Equations,
    system: MassMatrixSystem,
    largest_unrolled: int = LARGEST_UNROLLED,
    tree: BodyTree | None = None,
) -> tuple[tuple[MatrixBlock, ...], list[tuple[str, list[ScaledNode]]]]:
    """Blocks of a system with the mass matrix and the outputs that solve it.

    The outputs are ``acceleration`` (of the coordinates of unrolled blocks, by
    block), ``pivots`` and ``scales`` (as many numbers: a pivot that is not
    above its rounding error, ε times the diagonal entry in ``scales`` or 0 in an
    exact block, means a singular matrix), ``dense_matrix`` (the upper triangles
    of the other blocks, by rows, each followed by the gradients of the block's
    closures, and their compliance in a compliant block) and ``dense_forcing``
    (right-hand sides, followed by −bias).
    With ``tree``, whose mass matrix is proven positive definite, all are one unrolled block.
    """
    if tree is not None:
        return _by_articulated_bodies(values, system, tree)
    facts = equations.derivation.facts
    matrix = inertia_rows(values, equations)
    gradients = converted_rows(values, [gradient for gradient, _ in system.closures])
    definite = facts.positive_definite_mass_matrix
    names = ("acceleration", "pivots", "scales", "dense_matrix", "dense_forcing")
    outputs: dict[str, list[ScaledNode]] = {name: [] for name in names}
    blocks: list[MatrixBlock] = []
    for members, closures in components(matrix, gradients):
        if not (closures or system.whole):
            continue
        if not closures and is_unrolled(len(members), definite, largest_unrolled):
            exact, *solution = _unroll(values, equations, system.right, members)
            blocks.append(MatrixBlock(members, unrolled=True, definite=definite, exact=exact))
            for name, nodes in zip(names, solution, strict=False):
                outputs[name].extend(nodes)
            continue
        block = _banded(members, closures, matrix, gradients, blocks) if definite else None
        if block is not None:
            blocks.append(block)
            _Band(values, equations, system, block, gradients).write(outputs)
        else:
            compliant = bool(closures and equations.system.contacts)
            block = MatrixBlock(members, False, definite and not closures, closures=closures)
            blocks.append(replace(block, compliant=compliant))
            dense, forcing = outputs["dense_matrix"], outputs["dense_forcing"]
            dense += (matrix[i].get(j, _ZERO) for k, i in enumerate(members) for j in members[k:])
            dense += (gradients[k].get(j, _ZERO) for k in closures for j in members)
            dense += (values.convert(system.compliance_of(k)) for k in closures if compliant)
            forcing += (values.convert(system.right[i]) for i in members)
            biases = [values.convert(system.closures[k][1]) for k in closures]
            forcing += ((-c, number) for c, number in biases)
    return tuple(blocks), list(outputs.items())


def _by_articulated_bodies(
    values: ValueGraph, system: MassMatrixSystem, tree: BodyTree
) -> tuple[tuple[MatrixBlock, ...], list[tuple[str, list[ScaledNode]]]]:
    """Blocks and outputs of a tree of bodies; the first pivot is that in which nothing cancels."""
    solved = solve_tree(values, tree, [values.convert(e) for e in system.right])
    scales = inertia_of_motions(values, tree)
    order = [*reversed(solved.pivots)]
    outputs = [
        ("acceleration", [solved.solution[i] for i in range(len(order))]),
        ("pivots", [solved.pivots[i] for i in order]),
        ("scales", [scales[i] for i in order]),
        ("dense_matrix", []),
        ("dense_forcing", []),
    ]
    return (MatrixBlock(tuple(range(len(order))), unrolled=True, definite=True),), outputs


def inertia_rows(values: ValueGraph, equations: Equations) -> _Rows:
    """Rows of the mass matrix; where it is proven diagonal, all other entries count as zero."""
    rows = equations.system.mass_matrix
    if not equations.derivation.facts.diagonal_mass_matrix:
        return converted_rows(values, rows)
    diagonal = [values.convert(row[i]) for i, row in enumerate(rows)]
    return [{i: value} if value[0] else {} for i, value in enumerate(diagonal)]


def converted_rows(values: ValueGraph, rows: Iterable[Sequence[Expr]]) -> _Rows:
    converted = []
    for row in rows:
        nodes = {j: values.convert(e) for j, e in entries(row).items()}
        converted.append({j: value for j, value in nodes.items() if value[0]})
    return converted


def _banded(
    members: tuple[int, ...],
    closures: tuple[int, ...],
    matrix: _Rows,
    gradients: _Rows,
    before: Sequence[MatrixBlock],
) -> MatrixBlock | None:
    """Order the closures of a block so that S is a band, where that saves operations."""
    if not closures or any(matrix[i].keys() != {i} for i in members):
        return None
    closures = tuple(closures[k] for k in elimination_order([gradients[k] for k in closures]))
    band = bandwidth([gradients[k] for k in closures])
    if not is_banded(len(members), len(closures), band):
        return None
    end = max((b.start + len(b.closures) for b in before if b.band is not None), default=0)
    start = end + len(closures) * (band + 1)
    return MatrixBlock(members, False, False, closures=closures, band=band, start=start)


class _Band:
    """S λ = r and the accelerations that follow, for one block."""

    def __init__(
        self,
        values: ValueGraph,
        equations: Equations,
        system: MassMatrixSystem,
        block: MatrixBlock,
        gradients: _Rows,
    ) -> None:
        self.values = values
        self.system = system
        self.block = block
        self.gradients = [gradients[k] for k in block.closures]
        mass = {i: equations.system.mass_matrix[i][i] for i in block.coordinates}
        # Reciprocals are nodes of their own: one division for all that has one mass.
        inverse = {i: values.multiply([(values.convert(m), -1)]) for i, m in mass.items()}
        self.directions = [
            {i: values.multiply([(g, 1), (inverse[i], 1)]) for i, g in row.items()}
            for row in self.gradients
        ]
        self.free = {i: values.convert(system.right[i] / m) for i, m in mass.items()}

    def write(self, outputs: dict[str, list[ScaledNode]]) -> None:
        """Write the band by rows from the diagonal on, r, and the accelerations."""
        band = self.block.band or 0
        for k, row in enumerate(self.gradients):
            others = self.directions[k : k + band + 1]
            entries = [self._dot(row, direction) for direction in others]
            compliance = self.values.convert(self.system.compliance_of(self.block.closures[k]))
            entries[0] = self.values.add([entries[0], compliance])
            outputs["dense_matrix"].extend([*entries, *[_ZERO] * (band + 1 - len(others))])
        for k, row in zip(self.block.closures, self.gradients, strict=True):
            outputs["dense_forcing"].append(self._drive(row, self.system.closures[k][1]))
        if not self.system.multipliers:
            outputs["acceleration"].extend(self._accelerations())

    def _dot(self, a: Mapping[int, ScaledNode], b: Mapping[int, ScaledNode]) -> ScaledNode:
        """a·b over the coordinates that both hold."""
        pairs = [(a[i], b[i]) for i in a if i in b]
        return self.values.add(self.values.multiply([(x, 1), (y, 1)]) for x, y in pairs)

    def _drive(self, row: Mapping[int, ScaledNode], bias: Expr) -> ScaledNode:
        """−bias − gradient·(f/M) of one closure."""
        work = self._dot(row, {i: self.free[i] for i in row if self.free[i][0]})
        coefficient, number = self.values.add([work, self.values.convert(bias)])
        return -coefficient, number

    def _accelerations(self) -> Iterator[ScaledNode]:
        """(f + Σ λ·gradient)/M of each coordinate."""
        values = self.values
        terms = {i: [free] for i, free in self.free.items()}
        for name, row in zip(self.block.multipliers, self.directions, strict=True):
            multiplier = 1, values.intern(InputNode(name), _FOUND)
            for i, direction in row.items():
                terms[i].append(values.multiply([(direction, 1), (multiplier, 1)]))
        return map(values.add, terms.values())


def is_unrolled(size: int, definite: bool, largest: int = LARGEST_UNROLLED) -> bool:
    """Tell whether straight-line code solves a block without closures."""
    return size == 1 or (definite and size <= largest)


def components(matrix: _Rows, gradients: _Rows) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Connected components of the graph of nonzero entries: coordinates and closures of each."""
    n = len(matrix)
    closures_at: list[list[int]] = [[] for _ in range(n)]
    for k, gradient in enumerate(gradients):
        for j in gradient:
            closures_at[j].append(k)
    left = set(range(n))
    components = []
    for start in range(n):
        if start not in left:
            continue
        left.discard(start)
        members, closures, stack = [start], set[int](), [start]
        while stack:
            i = stack.pop()
            reached = {*matrix[i], *(j for k in closures_at[i] for j in gradients[k])} & left
            closures.update(closures_at[i])
            left -= reached
            members.extend(reached)
            stack.extend(reached)
        components.append((tuple(sorted(members)), tuple(sorted(closures))))
    return components


def _unroll(
    values: ValueGraph, equations: Equations, right: Sequence[Expr], members: tuple[int, ...]
) -> _Unrolled:
    """Solve a block in straight-line code, exactly where that is known to be stable and short."""
    mass = [[equations.system.mass_matrix[i][j] for j in members] for i in members]
    forcing = [right[i] for i in members]
    if len(members) > 1:
        solution = solve_exactly(mass, forcing, [c.q for c in equations.system.coordinates])
        if solution is not None:
            return _substitute(values, solution)
    matrix = [[values.convert(m) for m in row] for row in mass]
    return _ldl_solve(values, matrix, [values.convert(f) for f in forcing])


def _substitute(values: ValueGraph, solution: ExactSolution) -> _Unrolled:
    """The exact solution, step by step."""
    solved: dict[int, ScaledNode] = {}
    for step in solution.steps:
        numerator = values.convert(step.numerator)
        for known, coupling in step.coupling:
            numerator = _less(values, numerator, values.convert(coupling), solved[known])
        solved[step.coordinate] = _divide(values, numerator, values.convert(step.denominator))
    pivots = [values.convert(pivot) for pivot in solution.pivots]
    return _Unrolled(True, [solved[i] for i in sorted(solved)], pivots, [_ZERO] * len(pivots))


def _ldl_solve(
    values: ValueGraph, matrix: list[list[ScaledNode]], right: list[ScaledNode]
) -> _Unrolled:
    """Solve in straight-line code by M = L D Lᵀ; zero entries take no operations."""
    rows = factored(values, matrix)
    places = range(len(matrix))
    pivots, diagonal = [rows[i][i] for i in places], [matrix[i][i] for i in places]
    return _Unrolled(False, substituted(values, rows, right), pivots, diagonal)


def factored(values: ValueGraph, matrix: list[list[ScaledNode]]) -> list[list[ScaledNode]]:
    """Factor M = L D Lᵀ: the rows of D Lᵀ, right of and on the diagonal."""
    n = len(matrix)
    rows = [list(row) for row in matrix]
    for j in range(n):
        for i in range(j + 1, n):
            ratio = _divide(values, rows[j][i], rows[j][j])
            for k in range(i, n):
                rows[i][k] = _less(values, rows[i][k], ratio, rows[j][k])
    return rows


def substituted(
    values: ValueGraph, rows: list[list[ScaledNode]], right: list[ScaledNode]
) -> list[ScaledNode]:
    """Solve for one right-hand side by the rows of :func:`factored`."""
    n, y = len(rows), list(right)
    for j in range(n):
        for i in range(j + 1, n):
            y[i] = _less(values, y[i], _divide(values, rows[j][i], rows[j][j]), y[j])
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            y[i] = _less(values, y[i], rows[i][k], y[k])
        y[i] = _divide(values, y[i], rows[i][i])
    return y


def _divide(values: ValueGraph, a: ScaledNode, b: ScaledNode) -> ScaledNode:
    return values.multiply([(a, 1), (b, -1)])


def _less(values: ValueGraph, a: ScaledNode, b: ScaledNode, c: ScaledNode) -> ScaledNode:
    """a − b·c."""
    coefficient, number = values.multiply([(b, 1), (c, 1)])
    return values.add([a, (-coefficient, number)])
