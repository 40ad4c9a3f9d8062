"""Static helpers of emitted C: functions that ``<math.h>`` lacks, and elimination loops."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lagrange_cli.emit.c_names import CNames, Real
from lagrange_cli.emit.solve import Block

__all__ = ["EPSILON_NAME", "helper_text", "solver_text", "work_size"]

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

_BACK_SUBSTITUTION = """\
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

#: Rows are updated along memory, which compilers turn into vector instructions.
_DEFINITE = (
    """\
/*
 * Solve a x = b for a symmetric positive definite matrix whose upper triangle
 * is given by rows; x replaces b. The first column below the diagonal holds
 * the diagonal before elimination, against which pivots are judged.
 */
static int @NAME@_solve_definite(int n, @REAL@ *a, @REAL@ *b)
{
    int i, j, k;
    for (i = 1; i < n; ++i) {
        a[i*n] = a[i*n + i];
    }
    for (j = 0; j < n; ++j) {
        const @REAL@ *row = a + j*n;
        const @REAL@ pivot = row[j];
        if (!(pivot > (j > 0 ? @NAME@_EPSILON*row[0] : @ZERO@))) {
            return 1;
        }
        for (i = j + 1; i < n; ++i) {
            @REAL@ *other = a + i*n;
            const @REAL@ ratio = row[i]/pivot;
            for (k = i; k < n; ++k) {
                other[k] -= ratio*row[k];
            }
            b[i] -= ratio*b[j];
        }
    }
"""
    + _BACK_SUBSTITUTION
)

_PIVOTED = (
    """\
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
"""
    + _BACK_SUBSTITUTION
)


def work_size(blocks: Sequence[Block]) -> int:
    """Numbers of workspace: matrix and right-hand side of the largest block
    that a loop solves (at least 1, so that an array of that size exists)."""
    sizes = [len(block.coordinates) for block in blocks if not block.unrolled]
    return max((n * n + n for n in sizes), default=1)


def helper_text(used: Collection[str], names: CNames, real: Real) -> str:
    """Definitions of the helpers among the functions that are used."""
    return "\n".join(_fill(_HELPERS[name], names, real) for name in _HELPERS if name in used)


def solver_text(blocks: Sequence[Block], names: CNames, real: Real) -> str:
    """What solving the blocks needs: the bound for pivots and the loops."""
    parts = []
    if any(b.definite and len(b.coordinates) > 1 and not b.exact for b in blocks):
        parts.append(
            "/* A pivot below this multiple of its diagonal entry is rounding error. */\n"
            f"#define {names.prefix}_{EPSILON_NAME} {real.literal(real.epsilon)}\n"
        )
    loops = [block for block in blocks if not block.unrolled]
    if any(block.definite for block in loops):
        parts.append(_fill(_DEFINITE, names, real))
    if any(not block.definite for block in loops):
        parts.append(_fill(_PIVOTED, names, real))
    return "\n".join(parts)


def _fill(template: str, names: CNames, real: Real) -> str:
    """Put type, names and constants into a template."""
    replacements = {
        "@NAME@": names.prefix,
        "@REAL@": real.name,
        "@FABS@": "fabs" + real.suffix,
        "@ZERO@": real.value(0.0),
        "@ONE@": real.value(1.0),
    }
    for token, text in replacements.items():
        template = template.replace(token, text)
    return template
