"""Static helpers of emitted C: functions that ``<math.h>`` lacks, and elimination loops."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lagrange_cli.emit.c_saddle import saddle_template
from lagrange_cli.emit.c_target import CTarget
from lagrange_cli.emit.solve import Block

__all__ = [
    "BANDED",
    "EPSILON_NAME",
    "dense_size",
    "helper_text",
    "solver_text",
]

#: Tail of the macro that tells a pivot from rounding error.
EPSILON_NAME = "EPSILON"

_HELPERS = {
    "sign": """\
/* 1, 0 or -1 with the sign of x (NaN for NaN). */
static @REAL@ @NAME@_sign(@REAL@ x)
{
    return isnan(x) ? x : (x > @ZERO@ ? @ONE@ : (x < @ZERO@ ? -@ONE@ : @ZERO@));
}
""",
    "min": """\
/* The smaller of two numbers (NaN if one is). */
static @REAL@ @NAME@_min(@REAL@ a, @REAL@ b)
{
    return (a < b || isnan(a)) ? a : b;
}
""",
    "max": """\
/* The larger of two numbers (NaN if one is). */
static @REAL@ @NAME@_max(@REAL@ a, @REAL@ b)
{
    return (a > b || isnan(a)) ? a : b;
}
""",
}

_DEFINITE = """\
/*
 * Solve a x = b for a symmetric positive definite matrix whose upper triangle
 * is given by rows; x replaces b, behind which n more numbers are overwritten.
 * a = L D L^T: D L^T replaces the upper triangle, the ratios L the lower one.
 * Pivots are judged against the diagonal before elimination. Four of them at
 * a time are taken from each row below, along memory: this makes vector
 * instructions of the inner loops.
 */
static int @NAME@_solve_definite(int n, @REAL@ *a, @REAL@ *b)
{
    @REAL@ *const d = b + n; /* the diagonal, then reciprocals of the pivots */
    int i, j, k, first;
    for (i = 0; i < n; ++i) {
        d[i] = a[i*n + i];
    }
    for (first = 0; first < n; first += 4) {
        const int last = first + 4 < n ? first + 4 : n;
        const @REAL@ *const row = a + first*n;
        /* The four rows among themselves. */
        for (j = first; j < last; ++j) {
            const @REAL@ *const above = a + j*n;
            if (!(above[j] > (j > 0 ? @NAME@_EPSILON*d[j] : @ZERO@))) {
                return 1;
            }
            d[j] = @ONE@/above[j];
            for (i = j + 1; i < last; ++i) {
                @REAL@ *const below = a + i*n;
                const @REAL@ ratio = above[i]*d[j];
                for (k = i; k < n; ++k) {
                    below[k] -= ratio*above[k];
                }
                b[i] -= ratio*b[j];
                below[j] = ratio;
            }
        }
        /* All rows below them (none if fewer than four were left). */
        for (i = last; i < n; ++i) {
            @REAL@ *const below = a + i*n;
            const @REAL@ r0 = row[i]*d[first];
            const @REAL@ r1 = row[n + i]*d[first + 1];
            const @REAL@ r2 = row[2*n + i]*d[first + 2];
            const @REAL@ r3 = row[3*n + i]*d[first + 3];
            for (k = i; k < n; ++k) {
                below[k] = below[k] - r0*row[k] - r1*row[n + k] - r2*row[2*n + k]
                    - r3*row[3*n + k];
            }
            b[i] = b[i] - r0*b[first] - r1*b[first + 1] - r2*b[first + 2] - r3*b[first + 3];
            below[first] = r0;
            below[first + 1] = r1;
            below[first + 2] = r2;
            below[first + 3] = r3;
        }
    }
    for (i = 0; i < n; ++i) {
        b[i] *= d[i];
    }
    for (i = n - 1; i > 0; --i) {
        const @REAL@ *const row = a + i*n;
        const @REAL@ known = b[i];
        for (k = 0; k < i; ++k) {
            b[k] -= known*row[k];
        }
    }
    return 0;
}
"""

_PIVOTED = """\
/* Solve a x = b by elimination with partial pivoting; x replaces b. */
static int @NAME@_solve_pivoted(int n, @REAL@ *a, @REAL@ *b)
{
    int i, j, k;
    for (j = 0; j < n; ++j) {
        @REAL@ *row = a + j*n;
        int best = j;
        for (i = j + 1; i < n; ++i) {
            if (@FABS@(a[i*n + j]) > @FABS@(a[best*n + j])) {
                best = i;
            }
        }
        if (!(@FABS@(a[best*n + j]) > @ZERO@)) {
            return 1;
        }
        if (best != j) {
            @REAL@ swap = b[j];
            b[j] = b[best];
            b[best] = swap;
            for (k = j; k < n; ++k) {
                swap = row[k];
                row[k] = a[best*n + k];
                a[best*n + k] = swap;
            }
        }
        for (i = j + 1; i < n; ++i) {
            @REAL@ *other = a + i*n;
            const @REAL@ ratio = other[j]/row[j];
            for (k = j + 1; k < n; ++k) {
                other[k] -= ratio*row[k];
            }
            b[i] -= ratio*b[j];
        }
    }
    for (i = n - 1; i >= 0; --i) {
        const @REAL@ *row = a + i*n;
        @REAL@ rest = b[i];
        for (k = i + 1; k < n; ++k) {
            rest -= row[k]*b[k];
        }
        b[i] = rest/row[i];
    }
    return 0;
}
"""

BANDED = """\
/*
 * Solve a x = b for a symmetric positive definite band of m rows, each given
 * from the diagonal on to w columns right of it; x replaces b, behind which m
 * more numbers are overwritten. a = L D L^T: the ratios L replace what is right
 * of the diagonal. Pivots are judged against the diagonal before elimination.
 */
static int @NAME@_solve_banded(int m, int w, @REAL@ *a, @REAL@ *b)
{
    @REAL@ *const d = b + m; /* the diagonal, then reciprocals of the pivots */
    int i, j, k;
    for (k = 0; k < m; ++k) {
        d[k] = a[k*(w + 1)];
    }
    for (k = 0; k < m; ++k) {
        @REAL@ *const row = a + k*(w + 1);
        const int last = w < m - 1 - k ? w : m - 1 - k;
        if (!(row[0] > (@REAL@)m*@NAME@_EPSILON*d[k])) {
            return 1;
        }
        d[k] = @ONE@/row[0];
        for (i = 1; i <= last; ++i) {
            @REAL@ *const below = row + i*(w + 1) - i;
            const @REAL@ ratio = row[i]*d[k];
            for (j = i; j <= last; ++j) {
                below[j] -= ratio*row[j];
            }
            b[k + i] -= ratio*b[k];
            row[i] = ratio;
        }
    }
    for (k = m - 1; k >= 0; --k) {
        const @REAL@ *const row = a + k*(w + 1);
        const int last = w < m - 1 - k ? w : m - 1 - k;
        @REAL@ rest = b[k]*d[k];
        for (i = 1; i <= last; ++i) {
            rest -= row[i]*b[k + i];
        }
        b[k] = rest;
    }
    return 0;
}
"""


def dense_size(blocks: Sequence[Block]) -> int:
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
    return "\n".join(target.fill(_HELPERS[name]) for name in _HELPERS if name in used)


def solver_text(blocks: Sequence[Block], target: CTarget) -> str:
    """What solving the blocks needs: the bound for pivots and the loops."""
    real, parts = target.real, []
    if any((b.definite and b.size > 1 and not b.exact) or b.closures for b in blocks):
        parts.append(
            "/* A pivot below this multiple of its diagonal entry is rounding error. */\n"
            f"#define {target.prefix}_{EPSILON_NAME} {real.literal(real.epsilon)}\n"
        )
    loops = [block for block in blocks if not block.unrolled and block.band is None]
    if any(block.definite for block in loops):
        parts.append(target.fill(_DEFINITE))
    if any(not block.definite for block in loops):
        parts.append(target.fill(_PIVOTED))
    if any(block.closures for block in loops):
        compliant = any(block.compliant for block in loops)
        parts.append(target.fill(saddle_template(real, compliant=compliant)))
    if any(block.band is not None for block in blocks):
        parts.append(target.fill(BANDED))
    return "\n".join(parts)
