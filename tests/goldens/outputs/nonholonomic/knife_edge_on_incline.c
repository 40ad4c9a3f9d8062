/* knife_edge_on_incline: see knife_edge_on_incline.h, which documents every function. */

#include "knife_edge_on_incline.h"

#if knife_edge_on_incline_EMISSION != 0xdb1a3ddbUL
#error "knife_edge_on_incline.c and knife_edge_on_incline.h are not of one emission: emit both once more"
#endif

#include <math.h>

/* A pivot below this multiple of its diagonal entry is rounding error. */
#define knife_edge_on_incline_EPSILON 1.1102230246251565e-16

/* Solve a x = b by elimination with partial pivoting; x replaces b. */
static int knife_edge_on_incline_solve_pivoted(int n, double *a, double *b)
{
    int i, j, k;
    for (j = 0; j < n; ++j) {
        double *row = a + j*n;
        int best = j;
        for (i = j + 1; i < n; ++i) {
            if (fabs(a[i*n + j]) > fabs(a[best*n + j])) {
                best = i;
            }
        }
        if (!(fabs(a[best*n + j]) > 0.0)) {
            return 1;
        }
        if (best != j) {
            double swap = b[j];
            b[j] = b[best];
            b[best] = swap;
            for (k = j; k < n; ++k) {
                swap = row[k];
                row[k] = a[best*n + k];
                a[best*n + k] = swap;
            }
        }
        for (i = j + 1; i < n; ++i) {
            double *other = a + i*n;
            const double ratio = other[j]/row[j];
            for (k = j + 1; k < n; ++k) {
                other[k] -= ratio*row[k];
            }
            b[i] -= ratio*b[j];
        }
    }
    for (i = n - 1; i >= 0; --i) {
        const double *row = a + i*n;
        double rest = b[i];
        for (k = i + 1; k < n; ++k) {
            rest -= row[k]*b[k];
        }
        b[i] = rest/row[i];
    }
    return 0;
}

/* The power of two that brings a positive number to between 1/2 and 1. */
static double knife_edge_on_incline_scale(double size)
{
    int exponent;
    (void)frexp(size, &exponent);
    return ldexp(1.0, -exponent);
}

/* The exponent of two of a number that is not 0. */
static int knife_edge_on_incline_exponent(double x)
{
    int exponent;
    (void)frexp(x, &exponent);
    return exponent;
}

/*
 * Whether elimination leaves little of the inertia of a coordinate; c is overwritten.
 * Coordinates without any do not count.
 */
static int knife_edge_on_incline_is_uneven(int n, int s, const double *a, double *c)
{
    int i, j, k;
    for (i = 0; i < n; ++i) {
        for (j = 0; j < n; ++j) {
            c[i*n + j] = a[i*s + j];
        }
    }
    for (k = 0; k < n; ++k) {
        const double *const row = c + k*n;
        const double own = a[k*s + k];
        if (own > 7.888609052210118e-31 && !(row[k] > 0.00390625*own)) {
            return 1;
        }
        for (i = 0; i < n; ++i) {
            if (!(own > 7.888609052210118e-31) && i != k && a[i*s + k] != 0.0) {
                return 1;
            }
        }
        for (i = k + 1; i < n; ++i) {
            for (j = i; j < n && row[i] != 0.0; ++j) {
                c[i*n + j] -= row[i]/row[k]*row[j];
            }
        }
    }
    return 0;
}

/*
 * Factors of the n coordinates for the matrix of knife_edge_on_incline_solve_saddle: one over the
 * root of the inertia, or of w g^2 where that is more, for the gradient g of each
 * closure. w is the second smallest inertia over g^2 that it meets, if there are two:
 * a coordinate that a closure holds need not have inertia at every state. 0 without either.
 */
static void knife_edge_on_incline_scale_inertia(int n, int s, const double *a, double *d)
{
    int i, j;
    for (j = 0; j < n; ++j) {
        d[j] = a[j*s + j] != 0.0 ? (double)knife_edge_on_incline_exponent(a[j*s + j]) : -65536.0;
    }
    for (i = n; i < s; ++i) {
        const double *const g = a + i*s;
        int first = 100, second = 100, count = 0;
        for (j = 0; j < n; ++j) {
            if (g[j] != 0.0 && a[j*s + j] != 0.0) {
                const int w = knife_edge_on_incline_exponent(a[j*s + j]) - 2*knife_edge_on_incline_exponent(g[j]);
                second = w < first ? first : (w < second ? w : second);
                first = w < first ? w : first;
                ++count;
            }
        }
        second = count > 1 ? second : first;
        for (j = 0; j < n && count > 0; ++j) {
            if (g[j] != 0.0) {
                const double size = (double)(second + 2*knife_edge_on_incline_exponent(g[j]));
                d[j] = size > d[j] ? size : d[j];
            }
        }
    }
    for (j = 0; j < n; ++j) {
        d[j] = d[j] > -65536.0 ? ldexp(1.0, -(int)ceil(d[j]/2)) : 0.0;
    }
}

/*
 * The equilibration of a symmetric matrix by powers of two (Bunch, J. ACM 18
 * (1971) 566): a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is
 * 0 start from the diagonal, or follow from those they touch.
 */
static int knife_edge_on_incline_equilibrate(int s, const double *a, double *d)
{
    int i, j, left = 0, before = s + 1;
    for (i = 0; i < s; ++i) {
        left += !(d[i] > 0.0);
    }
    while (left > 0) {
        int stuck = left == before;
        before = left;
        for (i = 0; i < s; ++i) {
            double size = sqrt(fabs(a[i*s + i]));
            if (d[i] > 0.0) {
                continue;
            }
            for (j = 0; j < s; ++j) {
                const double entry = fabs(a[i*s + j])*(stuck ? 1.0 : d[j]);
                size = entry > size ? entry : size;
            }
            if (size > 0.0) {
                d[i] = stuck ? 1.0 : knife_edge_on_incline_scale(size);
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
 * [M, G^T; G, C] by rows, the upper triangle of M, the rows of G and the diagonal
 * C are given: C is 0, or 1 where a row of G and g are zero, which makes that number
 * of l zero. [x; l] replaces [f; g] in b; scales d, a copy of the matrix and the defect
 * of the solution are overwritten.
 * Units do not matter: M is divided by its size, and rows and columns are
 * scaled alike, all by powers of two. Then comes elimination with pivoting; where
 * M is nearly singular the solution is refined once, so that every row holds to the
 * rounding of its own terms (Skeel, Math. Comput. 35 (1980) 817).
 */
static int knife_edge_on_incline_solve_saddle(int n, int m, double *a, double *b, double *d,
                               double *copy, double *defect)
{
    const int s = n + m;
    double size = 0.0, unit = 1.0;
    int i, j, uneven;
    for (i = 0; i < n; ++i) {
        for (j = i; j < n; ++j) {
            size = fabs(a[i*s + j]) > size ? fabs(a[i*s + j]) : size;
        }
    }
    if (size > 0.0) {
        unit = knife_edge_on_incline_scale(size);
    }
    for (i = 0; i < s; ++i) {
        for (j = i; j < s; ++j) {
            a[i*s + j] = j < n ? a[i*s + j]*unit : (i < n ? a[j*s + i] : (i == j ? a[i*s + i] : 0.0));
            a[j*s + i] = a[i*s + j];
        }
        b[i] *= i < n ? unit : 1.0;
        d[i] = 0.0;
    }
    uneven = knife_edge_on_incline_is_uneven(n, s, a, copy);
    if (uneven) {
        knife_edge_on_incline_scale_inertia(n, s, a, d);
    }
    if (knife_edge_on_incline_equilibrate(s, a, d) != 0) {
        return 1;
    }
    for (i = 0; i < s; ++i) {
        for (j = 0; j < s; ++j) {
            a[i*s + j] = a[i*s + j]*d[i]*d[j];
            copy[i*s + j] = a[i*s + j];
        }
        b[i] *= d[i];
        defect[i] = b[i];
    }
    if (knife_edge_on_incline_solve_pivoted(s, a, b) != 0) {
        return 1;
    }
    if (uneven) {
        for (i = 0; i < s; ++i) {
            for (j = 0; j < s; ++j) {
                defect[i] -= copy[i*s + j]*b[j];
            }
        }
        if (knife_edge_on_incline_solve_pivoted(s, copy, defect) != 0) {
            return 1;
        }
    }
    for (i = 0; i < s; ++i) {
        if (!(fabs(a[i*s + i]) > (double)s*knife_edge_on_incline_EPSILON)) {
            return 1;
        }
        b[i] = (uneven ? b[i] + defect[i] : b[i])*(i < n ? d[i] : -d[i]/unit);
    }
    return 0;
}

void knife_edge_on_incline_defaults(knife_edge_on_incline_params *p)
{
    p->m = 1.0;
    p->J = 0.1;
    p->g = 9.81;
    p->alpha = 0.3;
}

int knife_edge_on_incline_rhs(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *dydt)
{
    int i;
    const double q_phi = y[2];
    const double v_x = y[3];
    const double v_y = y[4];
    const double v_phi = y[5];
    (void)t;
    (void)u;
    const double w0 = sin(q_phi);
    const double w1 = cos(q_phi);
    if (!(fabs(p->J) > 0.0)) {
        return 1;
    }
    dydt[0] = v_x;
    dydt[1] = v_y;
    dydt[2] = v_phi;
    work[0] = p->m;
    work[1] = 0.0;
    work[4] = p->m;
    work[6] = w0;
    work[7] = -w1;
    work[8] = 0.0;
    work[9] = p->m*p->g*sin(p->alpha);
    work[10] = 0.0;
    work[11] = -v_phi*(v_x*w1 + v_y*w0);
    if (knife_edge_on_incline_solve_saddle(2, 1, work, work + 9, work + 12, work + 15, work +
            24) != 0) {
        return 1;
    }
    dydt[3] = work[9];
    dydt[4] = work[10];
    dydt[5] = 0.0;
    for (i = 0; i < 6; ++i) {
        if (!isfinite(dydt[i])) {
            return 2;
        }
    }
    return 0;
}

int knife_edge_on_incline_mass_matrix(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)work;
    out[0] = p->m;
    out[1] = 0.0;
    out[2] = 0.0;
    out[4] = p->m;
    out[5] = 0.0;
    out[8] = p->J;
    out[3] = out[1];
    out[6] = out[2];
    out[7] = out[5];
    for (i = 0; i < 9; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int knife_edge_on_incline_forcing(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)work;
    out[0] = p->m*p->g*sin(p->alpha);
    out[1] = 0.0;
    out[2] = 0.0;
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int knife_edge_on_incline_energy(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out)
{
    int i;
    const double q_x = y[0];
    const double v_x = y[3];
    const double v_y = y[4];
    const double v_phi = y[5];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = 0.5*(p->J*v_phi*v_phi + p->m*(v_x*v_x + v_y*v_y));
    const double w1 = p->m*p->g*q_x*sin(p->alpha);
    out[0] = w0;
    out[1] = -w1;
    out[2] = w0 - w1;
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int knife_edge_on_incline_positions(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)p;
    (void)work;
    out[0] = 0.0;
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int knife_edge_on_incline_multipliers(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out)
{
    int i;
    const double q_phi = y[2];
    const double v_x = y[3];
    const double v_y = y[4];
    const double v_phi = y[5];
    (void)t;
    (void)u;
    const double w0 = sin(q_phi);
    const double w1 = cos(q_phi);
    work[0] = p->m;
    work[1] = 0.0;
    work[4] = p->m;
    work[6] = w0;
    work[7] = -w1;
    work[8] = 0.0;
    work[9] = p->m*p->g*sin(p->alpha);
    work[10] = 0.0;
    work[11] = -v_phi*(v_x*w1 + v_y*w0);
    if (knife_edge_on_incline_solve_saddle(2, 1, work, work + 9, work + 12, work + 15, work +
            24) != 0) {
        return 1;
    }
    out[0] = work[11];
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int knife_edge_on_incline_constraints(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out)
{
    int i;
    const double q_phi = y[2];
    const double v_x = y[3];
    const double v_y = y[4];
    (void)t;
    (void)u;
    (void)p;
    (void)work;
    out[0] = v_x*sin(q_phi) - v_y*cos(q_phi);
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int knife_edge_on_incline_velocity_error(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out)
{
    int i;
    const double q_phi = y[2];
    const double v_x = y[3];
    const double v_y = y[4];
    (void)t;
    (void)u;
    (void)p;
    (void)work;
    const double w0 = v_x*sin(q_phi);
    const double w1 = v_y*cos(q_phi);
    out[0] = w0 - w1;
    out[1] = fabs(w0) + fabs(w1);
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int knife_edge_on_incline_velocity_change(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out)
{
    int i;
    const double q_phi = y[2];
    const double v_x = y[3];
    const double v_y = y[4];
    (void)t;
    (void)u;
    const double w0 = sin(q_phi);
    const double w1 = cos(q_phi);
    out[2] = 0.0;
    work[0] = p->m;
    work[1] = 0.0;
    work[4] = p->m;
    work[6] = w0;
    work[7] = -w1;
    work[8] = 0.0;
    work[9] = 0.0;
    work[10] = 0.0;
    work[11] = -v_x*w0 + v_y*w1;
    if (knife_edge_on_incline_solve_saddle(2, 1, work, work + 9, work + 12, work + 15, work +
            24) != 0) {
        return 1;
    }
    out[0] = work[9];
    out[1] = work[10];
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

/* The largest of m residuals, each in units of the last place of the magnitude m behind it. */
static double knife_edge_on_incline_residual(int m, const double *out)
{
    double largest = 0.0;
    int k;
    for (k = 0; k < m; ++k) {
        const double one = fabs(out[k]), of = out[m + k];
        const double size = one > 0.0 ? one/(nextafter(of, INFINITY) - of) : 0.0;
        largest = size > largest ? size : largest;
    }
    return largest;
}

int knife_edge_on_incline_project(double t, double *y, const double *u, const knife_edge_on_incline_params *p, double *work)
{
    double *const out = work + 27;
    int i, status;
    status = knife_edge_on_incline_velocity_error(t, y, u, p, work, out);
    if (status != 0 || knife_edge_on_incline_residual(1, out) <= 1.0) {
        return status;
    }
    status = knife_edge_on_incline_velocity_change(t, y, u, p, work, out);
    for (i = 0; status == 0 && i < 3; ++i) {
        y[3 + i] += out[i];
    }
    return status;
}
