"""Elimination for accelerations and multipliers together, as text of C.

Mass matrices may be singular by themselves where closures make the whole regular; then
scales are taken from both, and the solution is refined.
"""

from __future__ import annotations

from lagrange_cli.emit.c_names import Real
from lagrange_cli.emit.constants import LARGEST_EXPONENT, LEAST_INERTIA, UNEVEN

__all__ = ["saddle_template"]

#: Below the exponent of every number.
_LEAST = -65536.0


_SADDLE = """\
/* The power of two that brings a positive number to between 1/2 and 1. */
static @REAL@ @NAME@_scale(@REAL@ size)
{
    int exponent;
    (void)@FREXP@(size, &exponent);
    return @LDEXP@(@ONE@, -exponent);
}

/* The exponent of two of a number that is not 0. */
static int @NAME@_exponent(@REAL@ x)
{
    int exponent;
    (void)@FREXP@(x, &exponent);
    return exponent;
}

/*
 * Whether elimination leaves little of the inertia of a coordinate; c is overwritten.
 * Coordinates without any do not count.
 */
static int @NAME@_is_uneven(int n, int s, const @REAL@ *a, @REAL@ *c)
{
    int i, j, k;
    for (i = 0; i < n; ++i) {
        for (j = 0; j < n; ++j) {
            c[i*n + j] = a[i*s + j];
        }
    }
    for (k = 0; k < n; ++k) {
        const @REAL@ *const row = c + k*n;
        const @REAL@ own = a[k*s + k];
        if (own > @SMALL@ && !(row[k] > @UNEVEN@*own)) {
            return 1;
        }
        for (i = 0; i < n; ++i) {
            if (!(own > @SMALL@) && i != k && a[i*s + k] != @ZERO@) {
                return 1;
            }
        }
        for (i = k + 1; i < n; ++i) {
            for (j = i; j < n && row[i] != @ZERO@; ++j) {
                c[i*n + j] -= row[i]/row[k]*row[j];
            }
        }
    }
    return 0;
}

/*
 * Factors of the n coordinates for the matrix of @NAME@_solve_saddle: one over the
 * root of the inertia, or of w g^2 where that is more, for the gradient g of each
 * closure. w is the second smallest inertia over g^2 that it meets, if there are two:
 * a coordinate that a closure holds need not have inertia at every state. 0 without either.
 */
static void @NAME@_scale_inertia(int n, int s, const @REAL@ *a, @REAL@ *d)
{
    int i, j;
    for (j = 0; j < n; ++j) {
        d[j] = a[j*s + j] != @ZERO@ ? (@REAL@)@NAME@_exponent(a[j*s + j]) : @LEAST@;
    }
    for (i = n; i < s; ++i) {
        const @REAL@ *const g = a + i*s;
        int first = @WIDEST@, second = @WIDEST@, count = 0;
        for (j = 0; j < n; ++j) {
            if (g[j] != @ZERO@ && a[j*s + j] != @ZERO@) {
                const int w = @NAME@_exponent(a[j*s + j]) - 2*@NAME@_exponent(g[j]);
                second = w < first ? first : (w < second ? w : second);
                first = w < first ? w : first;
                ++count;
            }
        }
        second = count > 1 ? second : first;
        for (j = 0; j < n && count > 0; ++j) {
            if (g[j] != @ZERO@) {
                const @REAL@ size = (@REAL@)(second + 2*@NAME@_exponent(g[j]));
                d[j] = size > d[j] ? size : d[j];
            }
        }
    }
    for (j = 0; j < n; ++j) {
        d[j] = d[j] > @LEAST@ ? @LDEXP@(@ONE@, -(int)@CEIL@(d[j]/2)) : @ZERO@;
    }
}

/*
 * The equilibration of a symmetric matrix by powers of two (Bunch, J. ACM 18
 * (1971) 566): a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is
 * 0 start from the diagonal, or follow from those they touch.
 */
static int @NAME@_equilibrate(int s, const @REAL@ *a, @REAL@ *d)
{
    int i, j, left = 0, before = s + 1;
    for (i = 0; i < s; ++i) {
        left += !(d[i] > @ZERO@);
    }
    while (left > 0) {
        int stuck = left == before;
        before = left;
        for (i = 0; i < s; ++i) {
            @REAL@ size = @SQRT@(@FABS@(a[i*s + i]));
            if (d[i] > @ZERO@) {
                continue;
            }
            for (j = 0; j < s; ++j) {
                const @REAL@ entry = @FABS@(a[i*s + j])*(stuck ? @ONE@ : d[j]);
                size = entry > size ? entry : size;
            }
            if (size > @ZERO@) {
                d[i] = stuck ? @ONE@ : @NAME@_scale(size);
                stuck = 0;
                --left;
            }
        }
        if (left == before && stuck) {
            return 1; /* a row of zeros */
        }
    }
    return 0;
}

/*
 * Solve M x = f + G^T l, G x = g for n numbers x and m numbers l. Of the matrix
 * [M, G^T; G, 0] by rows, the upper triangle of M and the rows of G are given;
 * [x; l] replaces [f; g] in b, behind which (n + m)(n + m + 2) more numbers are
 * overwritten: scales, a copy of the matrix, what an equation is off by.
 * Units do not matter: M is divided by its size, and rows and columns are
 * scaled alike, all by powers of two. Then comes elimination with pivoting; where
 * M is nearly singular the solution is refined once, so that every row holds to the
 * rounding of its own terms (Skeel, Math. Comput. 35 (1980) 817).
@COMPLIANT@ */
static int @NAME@_solve_saddle(int n, int m, @REAL@ *a, @REAL@ *b)
{
    const int s = n + m;
    @REAL@ *const d = b + s, *const copy = d + s, *const rest = copy + s*s;
    @REAL@ size = @ZERO@, unit = @ONE@;
    int i, j, uneven;
    for (i = 0; i < n; ++i) {
        for (j = i; j < n; ++j) {
            size = @FABS@(a[i*s + j]) > size ? @FABS@(a[i*s + j]) : size;
        }
    }
    if (size > @ZERO@) {
        unit = @NAME@_scale(size);
    }
    for (i = 0; i < s; ++i) {
        for (j = i; j < s; ++j) {
            a[i*s + j] = j < n ? a[i*s + j]*unit : (i < n ? a[j*s + i] : @CORNER@);
            a[j*s + i] = a[i*s + j];
        }
        b[i] *= i < n ? unit : @ONE@;
        d[i] = @ZERO@;
    }
    uneven = @NAME@_is_uneven(n, s, a, copy);
    if (uneven) {
        @NAME@_scale_inertia(n, s, a, d);
    }
    if (@NAME@_equilibrate(s, a, d) != 0) {
        return 1;
    }
    for (i = 0; i < s; ++i) {
        for (j = 0; j < s; ++j) {
            a[i*s + j] = a[i*s + j]*d[i]*d[j];
            copy[i*s + j] = a[i*s + j];
        }
        b[i] *= d[i];
        rest[i] = b[i];
    }
    if (@NAME@_solve_pivoted(s, a, b) != 0) {
        return 1;
    }
    if (uneven) {
        for (i = 0; i < s; ++i) {
            for (j = 0; j < s; ++j) {
                rest[i] -= copy[i*s + j]*b[j];
            }
        }
        if (@NAME@_solve_pivoted(s, copy, rest) != 0) {
            return 1;
        }
    }
    for (i = 0; i < s; ++i) {
        if (!(@FABS@(a[i*s + i]) > (@REAL@)s*@NAME@_EPSILON)) {
            return 1;
        }
        b[i] = (uneven ? b[i] + rest[i] : b[i])*(i < n ? d[i] : -d[i]/unit);
    }
    return 0;
}
"""

#: More of the comment where the diagonal of the closures is given.
_COMPLIANT = """\
 * The diagonal behind M is given too: 0, or 1 where a row of G and g are zero,
 * which makes that number of l zero.
"""


def saddle_template(real: Real, *, compliant: bool) -> str:
    """``PREFIX_solve_saddle`` and what it calls, but for names and type.

    Parameters
    ----------
    compliant
        Whether the diagonal of the closures is given too.
    """
    text = _SADDLE
    for token, value in {
        "@CORNER@": "(i == j ? a[i*s + i] : @ZERO@)" if compliant else "@ZERO@",
        "@COMPLIANT@": _COMPLIANT if compliant else "",
        "@LEAST@": real.value(_LEAST),
        "@SMALL@": real.value(LEAST_INERTIA),
        "@UNEVEN@": real.value(UNEVEN),
        "@WIDEST@": str(LARGEST_EXPONENT),
    }.items():
        text = text.replace(token, value)
    return text
