"""How emitted code solves M a = f: block by block, by the cheapest stable way.

The zero pattern of M splits the coordinates into blocks that do not couple.
Closure equations couple those that they hold; such a block is solved for its
accelerations and multipliers together, M a = f + Σ λ·gradient with
gradient·a + bias = 0, by elimination with pivoting.
A block of one is a division. A small block whose mass matrix is proven
positive definite becomes straight-line code: the exact solution where that is
known to lose no digits (:mod:`lagrange_cli.mechanics.closed_form`), else
M = L D Lᵀ. Larger blocks are eliminated by a loop in the emitted code, without
pivoting where M is proven positive definite (as stable as Cholesky's method;
Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., ch. 10), else
with partial pivoting.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from lagrange_cli.emit.values import ONE, Scaled, Values
from lagrange_cli.mechanics.closed_form import Solution, solve_exactly

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

__all__ = ["LARGEST_UNROLLED", "Block", "System", "solve_blocks"]

#: Positive definite blocks up to this size are written out.
LARGEST_UNROLLED = 4

_ZERO: Scaled = (Fraction(0), ONE)


@dataclass(frozen=True)
class Block:
    """Coordinates (indices, ascending) whose accelerations are found together.

    ``unrolled``: by straight-line code whose pivots are to be checked, else by
    a loop. ``definite``: the mass matrix is proven positive definite; a loop
    needs partial pivoting where it is not. ``exact``: no digits cancel in the
    pivots, so that each that is positive is known to be so. ``closures``
    (indices, ascending) are solved with them; their block is never unrolled.
    """

    coordinates: tuple[int, ...]
    unrolled: bool
    definite: bool
    exact: bool = False
    closures: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return len(self.coordinates) + len(self.closures)


@dataclass(frozen=True)
class System:
    """M x = ``right`` + Σ λ·gradient and gradient·x + bias = 0 for each of ``closures``.

    ``closures``: (gradient, bias) each. ``whole``: blocks without closures are
    solved too; else only those with closures are.
    """

    right: Sequence[Expr]
    closures: Sequence[tuple[Sequence[Expr], Expr]] = ()
    whole: bool = True


class _Unrolled(NamedTuple):
    """What straight-line code for one block computes."""

    exact: bool
    accelerations: list[Scaled]
    pivots: list[Scaled]
    scales: list[Scaled]


def solve_blocks(
    values: Values, equations: Equations, system: System
) -> tuple[tuple[Block, ...], list[tuple[str, list[Scaled]]]]:
    """Blocks of a system with the mass matrix and the outputs that solve it.

    The outputs are ``acceleration`` (of the coordinates of unrolled blocks, by
    block), ``pivots`` and ``scales`` (as many numbers: a pivot that is not
    above its rounding error, ε times the diagonal entry in ``scales`` or 0 in an
    exact block, means a singular matrix), ``dense_matrix`` (the upper triangles
    of the other blocks, by rows, each followed by the gradients of the block's
    closures) and ``dense_forcing`` (right-hand sides, followed by −bias).
    """
    facts = equations.facts
    matrix = [[values.convert(m) for m in row] for row in equations.mass_matrix]
    gradients = [[values.convert(g) for g in gradient] for gradient, _ in system.closures]
    definite = facts.positive_definite_mass_matrix
    names = ("acceleration", "pivots", "scales", "dense_matrix", "dense_forcing")
    outputs: dict[str, list[Scaled]] = {name: [] for name in names}
    blocks = []
    for of, closures in _components(matrix, gradients, facts.diagonal_mass_matrix):
        if not (closures or system.whole):
            continue
        if not closures and _unrolled(len(of), definite):
            exact, *solution = _unroll(values, equations, system.right, of)
            blocks.append(Block(of, unrolled=True, definite=definite, exact=exact))
            for name, found in zip(names, solution, strict=False):
                outputs[name].extend(found)
        else:
            definitely = definite and not closures
            blocks.append(Block(of, unrolled=False, definite=definitely, closures=closures))
            outputs["dense_matrix"].extend(matrix[i][j] for k, i in enumerate(of) for j in of[k:])
            outputs["dense_matrix"].extend(gradients[k][j] for k in closures for j in of)
            outputs["dense_forcing"].extend(values.convert(system.right[i]) for i in of)
            biases = [values.convert(system.closures[k][1]) for k in closures]
            outputs["dense_forcing"].extend((-c, number) for c, number in biases)
    return tuple(blocks), list(outputs.items())


def _unrolled(size: int, definite: bool) -> bool:
    return size == 1 or (definite and size <= LARGEST_UNROLLED)


def _components(
    matrix: list[list[Scaled]], gradients: list[list[Scaled]], diagonal: bool
) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """The connected components of the graph whose edges are nonzero entries:
    coordinates and closures of each."""
    n = len(matrix)
    held = [[j for j, g in enumerate(gradient) if g[0] != 0] for gradient in gradients]
    closures_at = [[k for k, of in enumerate(held) if i in of] for i in range(n)]
    left = set(range(n))
    components = []
    for start in range(n):
        if start not in left:
            continue
        left.discard(start)
        members, closures, stack = [start], set[int](), [start]
        while stack:
            i = stack.pop()
            found = [] if diagonal else [j for j in sorted(left) if matrix[i][j][0] != 0]
            for k in closures_at[i]:
                found.extend(j for j in held[k] if j in left and j not in found)
            closures.update(closures_at[i])
            left.difference_update(found)
            members.extend(found)
            stack.extend(found)
        components.append((tuple(sorted(members)), tuple(sorted(closures))))
    return components


def _unroll(
    values: Values, equations: Equations, right: Sequence[Expr], of: tuple[int, ...]
) -> _Unrolled:
    """A block in straight-line code: exact where that is known to be stable and short."""
    mass = [[equations.mass_matrix[i][j] for j in of] for i in of]
    forcing = [right[i] for i in of]
    if len(of) > 1:
        solution = solve_exactly(mass, forcing, [c.q for c in equations.coordinates])
        if solution is not None:
            return _substitute(values, solution)
    matrix = [[values.convert(m) for m in row] for row in mass]
    return _ldl_solve(values, matrix, [values.convert(f) for f in forcing])


def _substitute(values: Values, solution: Solution) -> _Unrolled:
    """The exact solution, step by step."""
    found: dict[int, Scaled] = {}
    for step in solution.steps:
        rest = values.convert(step.numerator)
        for other, coupling in step.coupling:
            rest = _less(values, rest, values.convert(coupling), found[other])
        found[step.coordinate] = _divide(values, rest, values.convert(step.denominator))
    pivots = [values.convert(pivot) for pivot in solution.pivots]
    return _Unrolled(True, [found[i] for i in sorted(found)], pivots, [_ZERO] * len(pivots))


def _ldl_solve(values: Values, matrix: list[list[Scaled]], right: list[Scaled]) -> _Unrolled:
    """Straight-line solution by M = L D Lᵀ. Entries that are zero cost nothing."""
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
    diagonal = [matrix[i][i] for i in range(n)]
    return _Unrolled(False, y, [rows[i][i] for i in range(n)], diagonal)


def _divide(values: Values, a: Scaled, b: Scaled) -> Scaled:
    return values.multiply([(a, 1), (b, -1)])


def _less(values: Values, a: Scaled, b: Scaled, c: Scaled) -> Scaled:
    """a − b·c."""
    coefficient, number = values.multiply([(b, 1), (c, 1)])
    return values.add([a, (-coefficient, number)])
