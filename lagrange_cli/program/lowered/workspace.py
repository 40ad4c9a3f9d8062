"""Workspace of functions, for languages whose functions allocate nothing."""

from __future__ import annotations

from collections.abc import Sequence

from lagrange_cli.program.graph.operands import array_named
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.program.systems.loops import columns_of


def program_workspace_size(program: Program) -> int:
    """Return numbers of workspace: what the solver needs, then values and parameters of loops
    (at least 1, so that an array of that size exists)."""
    if program.parts:
        indexed = any(c.array == "p" and not c.is_fixed for c in columns_of(program.parts))
        return max(program.work + (program.parameters if indexed else 0), 1)
    values = len(program.assignments) + program.parameters if program.is_large else 0
    return max(solver_workspace(program) + values, 1)


def given_size(program: Program) -> int:
    """Return numbers of workspace that hold accelerations and multipliers that a program reads."""
    letters = set(map(array_named, program.reads))
    if letters.isdisjoint("al"):
        return 0
    return program.layout.size + ("l" in letters) * program.multipliers


def solver_workspace(program: Program) -> int:
    """Return numbers of workspace that the solvers of a program take."""
    if program.jacobian is not None:
        return program.jacobian.workspace
    if program.composite_numbers:
        return program.composite_numbers
    return _largest(program.blocks)


def _largest(blocks: Sequence[MatrixBlock]) -> int:
    """Numbers of workspace for the largest block that a loop solves: matrix, right-hand side,
    as many numbers again, and what refinement takes. Bands have places of their own."""
    loops = [block for block in blocks if not block.unrolled and block.band is None]
    sizes = [_of_block(block.size, refined=bool(block.closures)) for block in loops]
    ends = [block.start + 2 * len(block.closures) for block in blocks if block.band is not None]
    return max(sizes + ends, default=0)


def _of_block(size: int, *, refined: bool) -> int:
    """Numbers for the matrix and two vectors, and for a copy and a rest where it is refined."""
    return size * size + 2 * size + (size * size + size) * refined
