"""Static helpers of emitted C: functions that ``<math.h>`` lacks, eliminations, tables of indices.

Indices of loops that do not advance evenly are looked up in static arrays of the source file, which
functions share.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from lagrange_cli.emit.c.target import EPSILON_NAME, CTarget, Real, wrapped
from lagrange_cli.emit.template_files import c_template, filled
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.program.solvers.sparse_factorization import BandFactors, SupernodalFactors
from lagrange_cli.program.solvers.tolerances import (
    LARGEST_EXPONENT,
    LEAST_INERTIA,
    UNEVEN_PIVOT,
)
from lagrange_cli.program.systems.loops import SparseSolve, Total, table_name, tables_of

#: Functions that ``<math.h>`` lacks.
_HELPERS = ("sign", "min", "max")


def helper_text(used: Collection[str], target: CTarget) -> str:
    """Return definitions of the helpers among the functions that are used."""
    return "\n".join(target.fill(c_template(name)) for name in _HELPERS if name in used)


def solver_text(blocks: Sequence[MatrixBlock], target: CTarget) -> str:
    """Write what solving the blocks needs: the bound for pivots and the loops."""
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
        parts.append(target.fill(_saddle_template(real)))
    if any(block.band is not None for block in blocks):
        parts.append(target.fill(c_template("solve_banded")))
    return "\n".join(parts)


def loop_helpers(programs: Mapping[str, Program], target: CTarget) -> str:
    """Write what the loops of a source file need: solvers, sums, tables."""
    parts = [part for program in programs.values() for part in program.parts]
    solved = [part.factors for part in parts if isinstance(part, SparseSolve)]
    texts = []
    if any(isinstance(factors, BandFactors) for factors in solved):
        texts.append(target.fill(c_template("solve_banded")))
    if any(isinstance(factors, SupernodalFactors) for factors in solved):
        texts.append(target.fill(c_template("solve_sparse")))
    if any(isinstance(part, Total) for part in parts):
        texts.append(target.fill(c_template("total")))
    tables = dict.fromkeys(t for program in programs.values() for t in tables_of(program.parts))
    texts += [_table_text(target.prefix, table) for table in tables]
    return "\n".join(filter(None, texts))


def _table_text(prefix: str, table: tuple[int, ...]) -> str:
    rows = wrapped(", ".join(map(str, table)), 1, 0)
    name = table_name(prefix, table)
    return "\n".join([f"static const int {name}[] = {{", *rows, "};", ""])


def columns_solver_text(programs: Iterable[Program], target: CTarget) -> str:
    """Write what solves for derivatives; empty if no program needs it."""
    jacobians = (program.jacobian for program in programs)
    if any(jacobian is not None and jacobian.blocks for jacobian in jacobians):
        return target.fill(c_template("solve_columns"))
    return ""


#: Below the exponent of every number.
_LEAST = -65536.0


def _saddle_template(real: Real) -> str:
    """``PREFIX_solve_saddle`` and what it calls, but for names and type.

    Mass matrices may be singular by themselves where closures make the whole regular; then
    scales are taken from both, and the solution is refined.
    """
    replacements = {
        "@LEAST@": real.value(_LEAST),
        "@SMALL@": real.value(LEAST_INERTIA),
        "@UNEVEN@": real.value(UNEVEN_PIVOT),
        "@WIDEST@": str(LARGEST_EXPONENT),
    }
    return filled(c_template("solve_saddle"), replacements)
