/* knife_edge_on_incline: see knife_edge_on_incline.h, which documents every function. */

#include "knife_edge_on_incline.h"

#if knife_edge_on_incline_EMISSION != 0x92da26d8UL
#error "knife_edge_on_incline.c and knife_edge_on_incline.h are not of one emission: emit both once more"
#endif

#include <math.h>

/* A pivot below this multiple of its diagonal entry is rounding error. */
#define knife_edge_on_incline_EPSILON 1.1102230246251565e-16

/* The largest power of two that is not above a positive number. */
static double knife_edge_on_incline_power_of_two(double x)
{
    int exponent;
    (void)frexp(x, &exponent);
    return ldexp(1.0, exponent - 1);
}

/* The power of two whose square brings a positive number to between 1/4 and 1. */
static double knife_edge_on_incline_root_scale_of(double x)
{
    int exponent;
    (void)frexp(x, &exponent);
    return ldexp(1.0, -((exponent + (exponent > 0))/2));
}

/* The power of two that brings a positive number to between 1/2 and 1. */
static double knife_edge_on_incline_scale_of(double x)
{
    int exponent;
    (void)frexp(x, &exponent);
    return ldexp(1.0, -exponent);
}

/*
 * Tell whether elimination leaves little of the inertia of a coordinate.
 *
 * c is overwritten. Coordinates without any inertia do not count.
 */
static int knife_edge_on_incline_is_uneven(int n, int s, const double *a, double *c)
{
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            c[i*n + j] = a[i*s + j];
        }
    }
    for (int k = 0; k < n; ++k) {
        const int row = k*n;
        const double inertia = a[k*s + k];
        if (inertia > 7.888609052210118e-31) {
            if (!(c[row + k] > 0.00390625*inertia)) {
                return 1;
            }
        } else {
            for (int i = 0; i < n; ++i) {
                if (i != k && a[i*s + k] != 0.0) {
                    return 1;
                }
            }
        }
        for (int i = k + 1; i < n; ++i) {
            if (c[row + i] != 0.0) {
                const double ratio = c[row + i]/c[row + k];
                for (int j = i; j < n; ++j) {
                    c[i*n + j] -= ratio*c[row + j];
                }
            }
        }
    }
    return 0;
}

/*
 * Store factors d of the n coordinates for the matrix of solve_saddle.
 *
 * They are one over the root of the inertia, or of w g^2 where that is more, for the gradient g
 * of each closure. w is the second smallest inertia over g^2 that it meets, if there are two: a
 * coordinate that a closure holds need not have inertia at every state. 0 without either.
 */
static void knife_edge_on_incline_scale_inertia(int n, int s, const double *a, double *d)
{
    for (int j = 0; j < n; ++j) {
        d[j] = 0.0;
        if (a[j*s + j] != 0.0) {
            d[j] = knife_edge_on_incline_power_of_two(fabs(a[j*s + j]));
        }
    }
    for (int i = n; i < s; ++i) {
        double first = 2.535301200456459e+30;
        double second = 2.535301200456459e+30;
        int count = 0;
        for (int j = 0; j < n; ++j) {
            if (a[i*s + j] != 0.0 && a[j*s + j] != 0.0) {
                const double gradient = knife_edge_on_incline_power_of_two(fabs(a[i*s + j]));
                const double inertia = knife_edge_on_incline_power_of_two(fabs(a[j*s + j]));
                double ratio = 2.535301200456459e+30;
                if (gradient*2.535301200456459e+30*gradient > inertia) {
                    ratio = inertia/gradient/gradient;
                }
                if (ratio < first) {
                    second = first;
                    first = ratio;
                } else if (ratio < second) {
                    second = ratio;
                }
                count += 1;
            }
        }
        if (count == 1) {
            second = first;
        }
        for (int j = 0; j < n; ++j) {
            if (count > 0 && a[i*s + j] != 0.0) {
                const double gradient = knife_edge_on_incline_power_of_two(fabs(a[i*s + j]));
                const double size = gradient*second*gradient;
                if (size > d[j]) {
                    d[j] = size;
                }
            }
        }
    }
    for (int j = 0; j < n; ++j) {
        if (d[j] > 0.0) {
            d[j] = knife_edge_on_incline_root_scale_of(d[j]);
        }
    }
}

/*
 * Equilibrate a symmetric matrix of s rows by powers of two (Bunch, J. ACM 18 (1971) 566).
 *
 * a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is 0 start from the diagonal,
 * or follow from those that they touch. A row of zeros has no scale.
 */
static int knife_edge_on_incline_equilibrate(int s, const double *a, double *d)
{
    int left = 0;
    for (int i = 0; i < s; ++i) {
        if (!(d[i] > 0.0)) {
            left += 1;
        }
    }
    int before = s + 1;
    while (left > 0) {
        int stuck = left == before;
        before = left;
        for (int i = 0; i < s; ++i) {
            if (!(d[i] > 0.0)) {
                double size = sqrt(fabs(a[i*s + i]));
                for (int j = 0; j < s; ++j) {
                    double entry = fabs(a[i*s + j]);
                    if (!stuck) {
                        entry *= d[j];
                    }
                    if (entry > size) {
                        size = entry;
                    }
                }
                if (size > 0.0) {
                    d[i] = knife_edge_on_incline_scale_of(size);
                    if (stuck) {
                        d[i] = 1.0;
                    }
                    stuck = 0;
                    left -= 1;
                }
            }
        }
        if (stuck) {
            return 0;
        }
    }
    return 1;
}

/*
 * Solve a x = b for n unknowns by elimination with partial pivoting; x replaces b.
 */
static int knife_edge_on_incline_solve_pivoted(int n, double *a, double *b)
{
    for (int j = 0; j < n; ++j) {
        const int row = j*n;
        int best = j;
        for (int i = j + 1; i < n; ++i) {
            if (fabs(a[i*n + j]) > fabs(a[best*n + j])) {
                best = i;
            }
        }
        if (!(fabs(a[best*n + j]) > 0.0)) {
            return 0;
        }
        if (best != j) {
            double swap = b[j];
            b[j] = b[best];
            b[best] = swap;
            for (int k = j; k < n; ++k) {
                swap = a[row + k];
                a[row + k] = a[best*n + k];
                a[best*n + k] = swap;
            }
        }
        for (int i = j + 1; i < n; ++i) {
            const int below = i*n;
            const double ratio = a[below + j]/a[row + j];
            for (int k = j + 1; k < n; ++k) {
                a[below + k] -= ratio*a[row + k];
            }
            b[i] -= ratio*b[j];
        }
    }
    for (int i = n - 1; i >= 0; --i) {
        double value = b[i];
        for (int k = i + 1; k < n; ++k) {
            value -= a[i*n + k]*b[k];
        }
        b[i] = value/a[i*n + i];
    }
    return 1;
}

/*
 * Solve M x = f + G^T l, G x + C l = g for n numbers x and m numbers l.
 *
 * Of the matrix [M, G^T; G, C] by rows, the upper triangle of M, the rows of G and the diagonal
 * C are given: C is 0, or 1 where a row of G and g are zero, which makes that number of l zero.
 * [x; l] replaces [f; g] in b; scales d, a copy of the matrix and the defect of the solution are
 * overwritten. Units do not matter: M is divided by its size, and rows and columns are scaled
 * alike, all by powers of two. Then comes elimination with pivoting; where M is nearly singular
 * the solution is refined once, so that every row holds to the rounding of its own terms (Skeel,
 * Math. Comput. 35 (1980) 817).
 */
static int knife_edge_on_incline_solve_saddle(int n, int m, double *a, double *b, double *d,
        double *copy, double *defect)
{
    const int s = n + m;
    double size = 0.0;
    double unit = 1.0;
    for (int i = 0; i < n; ++i) {
        for (int j = i; j < n; ++j) {
            if (fabs(a[i*s + j]) > size) {
                size = fabs(a[i*s + j]);
            }
        }
    }
    if (size > 0.0) {
        unit = knife_edge_on_incline_scale_of(size);
    }
    for (int i = 0; i < s; ++i) {
        for (int j = i; j < s; ++j) {
            if (j < n) {
                a[i*s + j] *= unit;
            } else if (i < n) {
                a[i*s + j] = a[j*s + i];
            } else if (i < j) {
                a[i*s + j] = 0.0;
            }
            a[j*s + i] = a[i*s + j];
        }
        if (i < n) {
            b[i] *= unit;
        }
        d[i] = 0.0;
    }
    const int uneven = knife_edge_on_incline_is_uneven(n, s, a, copy);
    if (uneven) {
        knife_edge_on_incline_scale_inertia(n, s, a, d);
    }
    if (!knife_edge_on_incline_equilibrate(s, a, d)) {
        return 0;
    }
    for (int i = 0; i < s; ++i) {
        for (int j = 0; j < s; ++j) {
            a[i*s + j] = a[i*s + j]*d[i]*d[j];
            copy[i*s + j] = a[i*s + j];
        }
        b[i] *= d[i];
        defect[i] = b[i];
    }
    if (!knife_edge_on_incline_solve_pivoted(s, a, b)) {
        return 0;
    }
    if (uneven) {
        for (int i = 0; i < s; ++i) {
            for (int j = 0; j < s; ++j) {
                defect[i] -= copy[i*s + j]*b[j];
            }
        }
        if (!knife_edge_on_incline_solve_pivoted(s, copy, defect)) {
            return 0;
        }
    }
    for (int i = 0; i < s; ++i) {
        if (!(fabs(a[i*s + i]) > (double)s*knife_edge_on_incline_EPSILON)) {
            return 0;
        }
        if (uneven) {
            b[i] += defect[i];
        }
        b[i] *= d[i];
        if (i >= n) {
            b[i] /= -unit;
        }
    }
    return 1;
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
    if (!knife_edge_on_incline_solve_saddle(2, 1, work, work + 9, work + 12, work + 15, work +
            24)) {
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
    if (!knife_edge_on_incline_solve_saddle(2, 1, work, work + 9, work + 12, work + 15, work +
            24)) {
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
    if (!knife_edge_on_incline_solve_saddle(2, 1, work, work + 9, work + 12, work + 15, work +
            24)) {
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
