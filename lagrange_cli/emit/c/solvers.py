"""Static helpers of emitted C: functions that ``<math.h>`` lacks, and elimination loops."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lagrange_cli.emit.c.saddle_point import saddle_template
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.solvers.blocks import MatrixBlock

__all__ = [
    "EPSILON_NAME",
    "helper_text",
    "solver_text",
    "solver_workspace_size",
]

#: Functions that ``<math.h>`` lacks.
_HELPERS = ("sign", "min", "max")

#: Tail of the macro that tells a pivot from rounding error.
EPSILON_NAME = "EPSILON"


def solver_workspace_size(blocks: Sequence[MatrixBlock]) -> int:
    """Numbers of workspace for the largest block that a loop solves: matrix, right-hand side,
    as many numbers again, and what refinement takes. Bands have places of their own."""
    loops = [block for block in blocks if not block.unrolled and block.band is None]
    sizes = [_workspace(block.size, refined=bool(block.closures)) for block in loops]
    ends = [block.start + 2 * len(block.closures) for block in blocks if block.band is not None]
    return max(sizes + ends, default=0)


def _workspace(size: int, *, refined: bool) -> int:
    """Numbers for the matrix and two vectors, and for a copy and a rest where it is refined."""
    return size * size + 2 * size + (size * size + size) * refined


def helper_text(used: Collection[str], target: CTarget) -> str:
    """Definitions of the helpers among the functions that are used."""
    return "\n".join(target.fill(c_template(name)) for name in _HELPERS if name in used)


def solver_text(blocks: Sequence[MatrixBlock], target: CTarget) -> str:
    """What solving the blocks needs: the bound for pivots and the loops."""
    real, parts = target.real, []
    if any((b.definite and b.size > 1 and not b.exact) or b.closures for b in blocks):
        parts.append(
            "/* A pivot below this multiple of its diagonal entry is rounding error. */\n"
            f"#define {target.prefix}_{EPSILON_NAME} {real.literal(real.epsilon)}\n"
        )
    loops = [block for block in blocks if not block.unrolled and block.band is None]
    if any(block.definite for block in loops):
        parts.append(target.fill(c_template("solve_definite")))
    if any(not block.definite for block in loops):
        parts.append(target.fill(c_template("solve_pivoted")))
    if any(block.closures for block in loops):
        compliant = any(block.compliant for block in loops)
        parts.append(target.fill(saddle_template(real, compliant=compliant)))
    if any(block.band is not None for block in blocks):
        parts.append(target.fill(c_template("solve_banded")))
    return "\n".join(parts)
