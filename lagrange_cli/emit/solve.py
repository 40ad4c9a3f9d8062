"""How emitted code solves M a = f: block by block, by the cheapest stable way.

The zero pattern of M splits the coordinates into blocks that do not couple.
A block of one is a division. A small block whose mass matrix is proven
positive definite becomes straight-line code, M = L D Lᵀ. Larger blocks are
eliminated by a loop in the emitted code, without pivoting where M is proven
positive definite (as stable as Cholesky's method; Higham, Accuracy and
Stability of Numerical Algorithms, 2nd ed., ch. 10), else with partial pivoting.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.emit.values import Scaled, Values

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Facts

__all__ = ["LARGEST_UNROLLED", "Block", "solve_blocks"]

#: Positive definite blocks up to this size are written out.
LARGEST_UNROLLED = 4


@dataclass(frozen=True)
class Block:
    """Coordinates (indices, ascending) whose accelerations are found together.

    ``unrolled``: by straight-line code whose pivots are to be checked, else by
    a loop. ``definite``: the mass matrix is proven positive definite; a loop
    needs partial pivoting where it is not.
    """

    coordinates: tuple[int, ...]
    unrolled: bool
    definite: bool


def solve_blocks(
    values: Values, matrix: list[list[Scaled]], forcing: list[Scaled], facts: Facts
) -> tuple[tuple[Block, ...], list[tuple[str, list[Scaled]]]]:
    """Blocks of the system M a = f and the outputs that solve it.

    The outputs are ``acceleration`` (of the coordinates of unrolled blocks, by
    block), ``pivots`` and ``scales`` (of the same: a pivot that is not above
    its rounding error, ε times the diagonal entry in ``scales``, means a
    singular matrix), ``dense_matrix`` (the upper triangles of the other
    blocks, by rows) and ``dense_forcing``.
    """
    definite = facts.positive_definite_mass_matrix
    blocks = tuple(
        Block(members, _unrolled(len(members), definite), definite)
        for members in _components(matrix, facts.diagonal_mass_matrix)
    )
    names = ("acceleration", "pivots", "scales", "dense_matrix", "dense_forcing")
    outputs: dict[str, list[Scaled]] = {name: [] for name in names}
    for block in blocks:
        of = block.coordinates
        right = [forcing[i] for i in of]
        if block.unrolled:
            square = [[matrix[i][j] for j in of] for i in of]
            accelerations, pivots = _ldl_solve(values, square, right)
            outputs["acceleration"].extend(accelerations)
            outputs["pivots"].extend(pivots)
            outputs["scales"].extend(square[i][i] for i in range(len(of)))
        else:
            outputs["dense_matrix"].extend(matrix[i][j] for k, i in enumerate(of) for j in of[k:])
            outputs["dense_forcing"].extend(right)
    return blocks, list(outputs.items())


def _unrolled(size: int, definite: bool) -> bool:
    return size == 1 or (definite and size <= LARGEST_UNROLLED)


def _components(matrix: list[list[Scaled]], diagonal: bool) -> list[tuple[int, ...]]:
    """The connected components of the graph whose edges are nonzero entries."""
    n = len(matrix)
    left = set(range(n))
    components = []
    for start in range(n):
        if start not in left:
            continue
        left.discard(start)
        members, stack = [start], [start]
        while stack and not diagonal:
            row = matrix[stack.pop()]
            found = [j for j in sorted(left) if row[j][0] != 0]
            left.difference_update(found)
            members.extend(found)
            stack.extend(found)
        components.append(tuple(sorted(members)))
    return components


def _ldl_solve(
    values: Values, matrix: list[list[Scaled]], right: list[Scaled]
) -> tuple[list[Scaled], list[Scaled]]:
    """Straight-line solution by M = L D Lᵀ: accelerations and pivots D.

    Entries that are zero cost nothing.
    """
    n = len(matrix)
    rows = [list(row) for row in matrix]
    y = list(right)
    for j in range(n):
        for i in range(j + 1, n):
            ratio = _divide(values, rows[j][i], rows[j][j])
            for k in range(i, n):
                rows[i][k] = _less(values, rows[i][k], ratio, rows[j][k])
            y[i] = _less(values, y[i], ratio, y[j])
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            y[i] = _less(values, y[i], rows[i][k], y[k])
        y[i] = _divide(values, y[i], rows[i][i])
    return y, [rows[i][i] for i in range(n)]


def _divide(values: Values, a: Scaled, b: Scaled) -> Scaled:
    return values.multiply([(a, 1), (b, -1)])


def _less(values: Values, a: Scaled, b: Scaled, c: Scaled) -> Scaled:
    """a − b·c."""
    coefficient, number = values.multiply([(b, 1), (c, 1)])
    return values.add([a, (-coefficient, number)])
