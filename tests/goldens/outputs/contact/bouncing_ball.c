/* bouncing_ball: see bouncing_ball.h, which documents every function. */

#include "bouncing_ball.h"

#if bouncing_ball_EMISSION != 0x49af2369UL
#error "bouncing_ball.c and bouncing_ball.h are not of one emission: emit both once more"
#endif

#include <math.h>

/* A pivot below this multiple of its diagonal entry is rounding error. */
#define bouncing_ball_EPSILON 1.1102230246251565e-16

/* The largest power of two that is not above a positive number. */
static double bouncing_ball_power_of_two(double x)
{
    int exponent;
    (void)frexp(x, &exponent);
    return ldexp(1.0, exponent - 1);
}

/* The power of two whose square brings a positive number to between 1/4 and 1. */
static double bouncing_ball_root_scale_of(double x)
{
    int exponent;
    (void)frexp(x, &exponent);
    return ldexp(1.0, -((exponent + (exponent > 0))/2));
}

/* The power of two that brings a positive number to between 1/2 and 1. */
static double bouncing_ball_scale_of(double x)
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
static int bouncing_ball_is_uneven(int n, int s, const double *a, double *c)
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
static void bouncing_ball_scale_inertia(int n, int s, const double *a, double *d)
{
    for (int j = 0; j < n; ++j) {
        d[j] = 0.0;
        if (a[j*s + j] != 0.0) {
            d[j] = bouncing_ball_power_of_two(fabs(a[j*s + j]));
        }
    }
    for (int i = n; i < s; ++i) {
        double first = 2.535301200456459e+30;
        double second = 2.535301200456459e+30;
        int count = 0;
        for (int j = 0; j < n; ++j) {
            if (a[i*s + j] != 0.0 && a[j*s + j] != 0.0) {
                const double gradient = bouncing_ball_power_of_two(fabs(a[i*s + j]));
                const double inertia = bouncing_ball_power_of_two(fabs(a[j*s + j]));
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
                const double gradient = bouncing_ball_power_of_two(fabs(a[i*s + j]));
                const double size = gradient*second*gradient;
                if (size > d[j]) {
                    d[j] = size;
                }
            }
        }
    }
    for (int j = 0; j < n; ++j) {
        if (d[j] > 0.0) {
            d[j] = bouncing_ball_root_scale_of(d[j]);
        }
    }
}

/*
 * Equilibrate a symmetric matrix of s rows by powers of two (Bunch, J. ACM 18 (1971) 566).
 *
 * a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is 0 start from the diagonal,
 * or follow from those that they touch. A row of zeros has no scale.
 */
static int bouncing_ball_equilibrate(int s, const double *a, double *d)
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
                    d[i] = bouncing_ball_scale_of(size);
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
static int bouncing_ball_solve_pivoted(int n, double *a, double *b)
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
static int bouncing_ball_solve_saddle(int n, int m, double *a, double *b, double *d, double
        *copy, double *defect)
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
        unit = bouncing_ball_scale_of(size);
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
    const int uneven = bouncing_ball_is_uneven(n, s, a, copy);
    if (uneven) {
        bouncing_ball_scale_inertia(n, s, a, d);
    }
    if (!bouncing_ball_equilibrate(s, a, d)) {
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
    if (!bouncing_ball_solve_pivoted(s, a, b)) {
        return 0;
    }
    if (uneven) {
        for (int i = 0; i < s; ++i) {
            for (int j = 0; j < s; ++j) {
                defect[i] -= copy[i*s + j]*b[j];
            }
        }
        if (!bouncing_ball_solve_pivoted(s, copy, defect)) {
            return 0;
        }
    }
    for (int i = 0; i < s; ++i) {
        if (!(fabs(a[i*s + i]) > (double)s*bouncing_ball_EPSILON)) {
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

void bouncing_ball_defaults(bouncing_ball_params *p)
{
    p->m = 1.0;
    p->g = 9.81;
    p->h = 1.0;
    p->u = 0.5;
    p->e = 0.8;
}

static int bouncing_ball_flight_rhs(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *dydt)
{
    int i;
    const double v_x = y[2];
    const double v_z = y[3];
    (void)t;
    (void)u;
    (void)work;
    if (!(p->m > 0.0)) {
        return 1;
    }
    if (!(p->m > 0.0)) {
        return 1;
    }
    dydt[0] = v_x;
    dydt[1] = v_z;
    dydt[2] = 0.0;
    dydt[3] = -p->m*p->g/p->m;
    for (i = 0; i < 4; ++i) {
        if (!isfinite(dydt[i])) {
            return 2;
        }
    }
    return 0;
}

int bouncing_ball_mass_matrix(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)work;
    out[0] = p->m;
    out[1] = 0.0;
    out[3] = p->m;
    out[2] = out[1];
    for (i = 0; i < 4; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int bouncing_ball_forcing(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)work;
    out[0] = 0.0;
    out[1] = -p->m*p->g;
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int bouncing_ball_energy(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *out)
{
    int i;
    const double q_z = y[1];
    const double v_x = y[2];
    const double v_z = y[3];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = v_x*v_x + v_z*v_z;
    const double w1 = p->g*q_z;
    out[0] = 0.5*p->m*w0;
    out[1] = p->m*w1;
    out[2] = p->m*(0.5*w0 + w1);
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int bouncing_ball_positions(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *out)
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

static int bouncing_ball_contact_rhs(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *dydt)
{
    int i;
    const double v_x = y[2];
    const double v_z = y[3];
    (void)t;
    (void)u;
    if (!(p->m > 0.0)) {
        return 1;
    }
    dydt[0] = v_x;
    dydt[1] = v_z;
    dydt[2] = 0.0;
    work[0] = p->m;
    work[2] = contact[0];
    work[3] = 1.0 - contact[0];
    work[4] = -p->m*p->g;
    work[5] = 0.0;
    if (!bouncing_ball_solve_saddle(1, 1, work, work + 4, work + 6, work + 8, work + 12)) {
        return 1;
    }
    dydt[3] = work[4];
    for (i = 0; i < 4; ++i) {
        if (!isfinite(dydt[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_contact_multipliers(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    work[0] = p->m;
    work[2] = contact[0];
    work[3] = 1.0 - contact[0];
    work[4] = -p->m*p->g;
    work[5] = 0.0;
    if (!bouncing_ball_solve_saddle(1, 1, work, work + 4, work + 6, work + 8, work + 12)) {
        return 1;
    }
    out[0] = work[5];
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_contact_constraints(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    const double q_z = y[1];
    const double v_z = y[3];
    (void)t;
    (void)u;
    (void)p;
    (void)work;
    out[0] = contact[0]*q_z;
    out[1] = contact[0]*v_z;
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_contact_position_error(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    const double q_z = y[1];
    (void)t;
    (void)u;
    (void)p;
    (void)work;
    out[0] = contact[0]*q_z;
    out[1] = 2.0*contact[0]*fabs(q_z);
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_contact_position_reach(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)work;
    out[0] = contact[0]*contact[0]/p->m;
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_contact_position_change(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    const double q_z = y[1];
    (void)t;
    (void)u;
    out[0] = 0.0;
    work[0] = p->m;
    work[2] = contact[0];
    work[3] = 1.0 - contact[0];
    work[4] = 0.0;
    work[5] = -contact[0]*q_z;
    if (!bouncing_ball_solve_saddle(1, 1, work, work + 4, work + 6, work + 8, work + 12)) {
        return 1;
    }
    out[1] = work[4];
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_contact_velocity_error(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    const double v_z = y[3];
    (void)t;
    (void)u;
    (void)p;
    (void)work;
    out[0] = contact[0]*v_z;
    out[1] = contact[0]*fabs(v_z);
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_contact_velocity_change(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    const double v_z = y[3];
    (void)t;
    (void)u;
    out[0] = 0.0;
    work[0] = p->m;
    work[2] = contact[0];
    work[3] = 1.0 - contact[0];
    work[4] = 0.0;
    work[5] = -contact[0]*v_z;
    if (!bouncing_ball_solve_saddle(1, 1, work, work + 4, work + 6, work + 8, work + 12)) {
        return 1;
    }
    out[1] = work[4];
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_gaps(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    const double q_z = y[1];
    (void)t;
    (void)u;
    (void)p;
    (void)contact;
    (void)work;
    out[0] = q_z;
    out[1] = 2.0*fabs(q_z);
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_gap_terms(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)contact;
    (void)work;
    out[0] = 0.0;
    out[1] = 1.0;
    out[2] = 0.0;
    out[3] = 0.0;
    out[4] = p->e;
    for (i = 0; i < 5; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

static int bouncing_ball_impulse(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    out[0] = 0.0;
    work[0] = p->m;
    work[2] = contact[0];
    work[3] = 1.0 - contact[0];
    work[4] = 0.0;
    work[5] = contact[0]*contact[1];
    if (!bouncing_ball_solve_saddle(1, 1, work, work + 4, work + 6, work + 8, work + 12)) {
        return 1;
    }
    out[1] = work[4];
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

/* The largest of m residuals, each in units of the last place of the magnitude m behind it. */
static double bouncing_ball_residual(int m, const double *out)
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

/*
 * The same, where changes of all coordinates are found together, and rounded together: the
 * magnitude of one residual counts for another as far as a change of the coordinates that
 * makes the one does the other. One that is the difference of nothing (a height that is zero)
 * has no magnitude of its own. Behind the magnitudes stand squares of gradients.
 */
static double bouncing_ball_coupled_residual(int m, double *out)
{
    const double *const square = out + 2*m;
    double reach = 0.0;
    int k;
    for (k = 0; k < m; ++k) {
        const double length = square[k] > 0.0 ? out[m + k]/sqrt(square[k]) : 0.0;
        reach = length > reach ? length : reach;
    }
    for (k = 0; k < m; ++k) {
        const double beside = reach*sqrt(square[k]);
        out[m + k] = beside > out[m + k] && beside < (double)INFINITY ? beside : out[m + k];
    }
    return bouncing_ball_residual(m, out);
}

static int bouncing_ball_contact_project(double t, double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work)
{
    double *const out = work + 14;
    double size, last = INFINITY;
    int i, round, status;
    for (round = 0; ; ++round) {
        status = bouncing_ball_contact_position_error(t, y, u, p, contact, work, out);
        if (status != 0) {
            return status;
        }
        size = bouncing_ball_residual(1, out);
        /* Only rounding is left, or little more that no change makes smaller. */
        if (size <= 1.0) {
            break;
        }
        if (round > 0) {
            status = bouncing_ball_contact_position_reach(t, y, u, p, contact, work, out + 2*1);
            if (status != 0) {
                return status;
            }
            size = bouncing_ball_coupled_residual(1, out);
            if (size <= 1.0 || (size <= 1024.0 && 2.0*size > last)) {
                break;
            }
        }
        if (round == 50) {
            return 3;
        }
        last = size;
        status = bouncing_ball_contact_position_change(t, y, u, p, contact, work, out);
        if (status != 0) {
            return status;
        }
        for (i = 0; i < 2; ++i) {
            y[i] += out[i];
        }
    }
    status = bouncing_ball_contact_velocity_error(t, y, u, p, contact, work, out);
    if (status != 0 || bouncing_ball_residual(1, out) <= 1.0) {
        return status;
    }
    status = bouncing_ball_contact_velocity_change(t, y, u, p, contact, work, out);
    for (i = 0; status == 0 && i < 2; ++i) {
        y[2 + i] += out[i];
    }
    return status;
}

static int bouncing_ball_contact_events(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, double *work, double *out)
{
    double *const found = work + 14;
    int k, closed = 0, status = bouncing_ball_gaps(t, y, u, p, contact, work, found);
    for (k = 0; k < 1; ++k) {
        closed = closed || contact[k] > 0.0;
        out[k] = found[k];
    }
    if (status != 0 || !closed) {
        return status;
    }
    status = bouncing_ball_contact_multipliers(t, y, u, p, contact, work, found);
    for (k = 0; k < 1; ++k) {
        out[k] = contact[k] > 0.0 ? found[0 + k] : out[k];
    }
    return status;
}

/*
 * What is known of the contacts at an event: gaps with their magnitudes; terms
 * (gradients by rows, rates, biases, restitutions); which were in contact and
 * which are closed (1 or 0); rates or accelerations w of the gaps, with the
 * magnitudes they are the sum of, and the pushes x that they take; d[j, k], what
 * a unit of push k adds to w[j]; which pushes are active.
 */
typedef struct {
    double *gap, *gradient, *rate, *bias, *restitution;
    double *held, *closed, *speed, *w, *size, *x, *active, *d, *change, *more;
} bouncing_ball_closing;

/* more[0..n-1] becomes r of d r = more, for active pushes alone; what is zero costs nothing
 * (contacts that act on their neighbours). 1: a pivot is not larger than smallest, if that
 * is positive. */
static int bouncing_ball_among_active(int n, double smallest, bouncing_ball_closing *c)
{
    double *const r = c->more, *const a = r + n;
    int i, j, l;
    for (i = 0; i < n; ++i) {
        for (j = 0; j < n; ++j) {
            const int both = c->active[i] > 0.0 && c->active[j] > 0.0;
            a[i*n + j] = both ? c->d[i*n + j] : (i == j ? 1.0 : 0.0);
        }
    }
    for (j = 0; j < n; ++j) {
        if (smallest > 0.0 && !(a[j*n + j] > smallest)) {
            return 1;
        }
        for (i = j + 1; i < n; ++i) {
            const double ratio = a[i*n + j]/a[j*n + j];
            if (ratio < 0.0 || ratio > 0.0) {
                for (l = j; l < n; ++l) {
                    a[i*n + l] -= ratio*a[j*n + l];
                }
                r[i] -= ratio*r[j];
            }
        }
    }
    for (i = n - 1; i >= 0; --i) {
        for (j = i + 1; j < n; ++j) {
            r[i] -= a[i*n + j]*r[j];
        }
        r[i] /= a[i*n + i];
    }
    return 0;
}

/* more[0..n-1]: how active pushes give way to a unit of push k. */
static void bouncing_ball_giving_way(int n, int k, bouncing_ball_closing *c)
{
    int i;
    for (i = 0; i < n; ++i) {
        c->more[i] = c->active[i] > 0.0 ? c->d[i*n + k] : 0.0;
    }
    (void)bouncing_ball_among_active(n, 0.0, c);
}

/*
 * Raises push k until w[k] is zero; active pushes that are used up end. Returns 1 if it
 * has no effect; active are then those that take all of it.
 */
static int bouncing_ball_raise(int n, int k, bouncing_ball_closing *c)
{
    int j;
    for (;;) {
        const double *const r = c->more;
        double rise = c->d[k*n + k], least = 0.0, full;
        int first = -1;
        bouncing_ball_giving_way(n, k, c);
        for (j = 0; j < n; ++j) {
            if (c->active[j] > 0.0) {
                rise -= c->d[k*n + j]*r[j];
                if (r[j] > 0.0 && (first < 0 || c->x[j]/r[j] < least)) {
                    first = j;
                    least = c->x[j]/r[j];
                }
            }
        }
        full = rise > 1e-12 ? -c->w[k]/rise : INFINITY;
        if (first < 0 && !(full < INFINITY)) {
            for (j = 0; j < n; ++j) {
                c->active[j] = j == k || r[j] < -1e-12 ? 1.0 : 0.0;
            }
            return 1;
        }
        if (first < 0 || full <= least) {
            least = full;
            first = -1;
        }
        for (j = 0; j < n; ++j) {
            if (c->active[j] > 0.0) {
                c->x[j] = fmax(c->x[j] - least*r[j], 0.0);
            }
        }
        c->x[k] += least;
        if (first < 0) {
            c->active[k] = 1.0;
            return 0;
        }
        c->w[k] = fmin(c->w[k] + least*rise, 0.0);
        c->active[first] = c->x[first] = 0.0;
    }
}

/*
 * Pushes x >= 0 with w + d x >= 0, one of both zero for each contact that is
 * closed, by the dual method of Goldfarb and Idnani (Math. Programming 27
 * (1983) 1). w and size become w + d x and its magnitudes; w is zero where it is
 * rounding. Returns 1 if there are no such pushes; active are then contacts that
 * cannot all be met, none where that is not known.
 */
static int bouncing_ball_push(int n, bouncing_ball_closing *c)
{
    double *const w = c->more + n + n*n, *const size = w + n;
    int j, k, step;
    for (k = 0; k < n; ++k) {
        c->x[k] = c->active[k] = 0.0;
        w[k] = fabs(c->w[k]) > 1e-12*c->size[k] ? c->w[k] : 0.0;
        size[k] = c->size[k];
    }
    for (step = 0; step < 64*(n + 1); ++step) {
        int violated = -1;
        for (k = n - 1; k >= 0; --k) {
            c->w[k] = w[k];
            c->size[k] = size[k];
            for (j = 0; j < n; ++j) {
                c->w[k] += c->d[k*n + j]*c->x[j];
                c->size[k] += fabs(c->d[k*n + j]*c->x[j]);
            }
            if (c->active[k] > 0.0 || fabs(c->w[k]) <= 1e-12*c->size[k]) {
                c->w[k] = 0.0;
            }
            violated = c->closed[k] > 0.0 && c->w[k] < 0.0 ? k : violated;
        }
        if (violated < 0) {
            return 0;
        }
        if (bouncing_ball_raise(n, violated, c) != 0) {
            return 1;
        }
    }
    for (k = 0; k < n; ++k) {
        c->active[k] = 0.0;
    }
    return 1;
}

/* contact: those that leave no motion behind an event, which is the error 4. */
static int bouncing_ball_deadlock(double *contact, const bouncing_ball_closing *c)
{
    int k;
    for (k = 0; k < 1; ++k) {
        contact[k] = c != 0 ? c->active[k] : 0.0;
    }
    return 4;
}

/* The rate of gap k, and the magnitudes it is the sum of. */
static double bouncing_ball_speed(int k, const double *y, const bouncing_ball_closing *c, double *size)
{
    double speed = c->rate[k];
    int i;
    *size = fabs(speed);
    for (i = 0; i < 2; ++i) {
        const double term = c->gradient[k*2 + i]*y[2 + i];
        speed += term;
        *size += fabs(term);
    }
    return speed;
}

/* gap and terms at a state; what is closed; rates of the gaps with their magnitudes. */
static int bouncing_ball_look(double t, const double *y, const double *u, const bouncing_ball_params *p, const double *contact, int event, double *work, bouncing_ball_closing *c)
{
    int k, status = bouncing_ball_gaps(t, y, u, p, contact, work, c->gap);
    if (status == 0) {
        status = bouncing_ball_gap_terms(t, y, u, p, contact, work, c->gradient);
    }
    for (k = 0; k < 1 && status == 0; ++k) {
        const double speed = bouncing_ball_speed(k, y, c, &c->size[k]);
        /* What closes within the rounding error of the time closes now. */
        const double late = 1.4210854715202004e-14*fabs(t)*fmin(speed, 0.0);
        const double near = 1e-12*c->gap[1 + k] - late;
        c->held[k] = contact[k] > 0.0 ? 1.0 : 0.0;
        c->closed[k] = contact[k] > 0.0 || k == event || c->gap[k] <= near ? 1.0 : 0.0;
        c->speed[k] = speed;
    }
    return status;
}

/* d: the rates that a unit impulse of each closed contact adds, as parts of its own. */
static int bouncing_ball_respond(double t, const double *y, const double *u, const bouncing_ball_params *p, double *contact, double *work, bouncing_ball_closing *c)
{
    int i, j, k;
    for (k = 0; k < 1; ++k) {
        int status = 1;
        for (j = 0; j < 1; ++j) {
            contact[j] = contact[1 + j] = j == k ? 1.0 : 0.0;
        }
        if (c->closed[k] > 0.0) {
            status = bouncing_ball_impulse(t, y, u, p, contact, work, c->change);
        }
        if (status > 1) {
            return status;
        }
        /* One that the closures alone hold back (1) takes no impulse. */
        for (j = 0; j < 1; ++j) {
            double *const of = c->d + j*1 + k;
            *of = 0.0;
            for (i = 0; i < 2 && status == 0; ++i) {
                *of += c->gradient[j*2 + i]*c->change[i];
            }
        }
    }
    return 0;
}

/* The impact of what is closed: v changes, and speed becomes the rates after it. */
static int bouncing_ball_hit(double t, double *y, const double *u, const bouncing_ball_params *p, double *contact, double bounce, double *work, bouncing_ball_closing *c)
{
    int i, k, round, status;
    for (k = 0; k < 1; ++k) {
        const double e = c->restitution[k];
        if (c->closed[k] > 0.0 && !(e >= 0.0 && e <= 1.0 + 1e-12)) {
            return bouncing_ball_deadlock(contact, 0);
        }
        c->speed[k] = c->held[k] > 0.0 ? 0.0 : c->speed[k];
        c->w[k] = c->speed[k] + bounce*e*fmin(c->speed[k], 0.0);
    }
    if (bouncing_ball_push(1, c) != 0) {
        return bouncing_ball_deadlock(contact, c);
    }
    for (k = 0; k < 1; ++k) {
        contact[k] = c->active[k];
        /* The least rate after the impact, and that of active contacts. */
        c->speed[k] = -bounce*c->restitution[k]*fmin(c->speed[k], 0.0);
        (void)bouncing_ball_speed(k, y, c, &c->size[k]);
    }
    /* A second time for what rounding has left of the first. */
    for (round = 0; round < 2; ++round) {
        for (k = 0; k < 1; ++k) {
            double size;
            contact[1 + k] = c->speed[k] - bouncing_ball_speed(k, y, c, &size);
        }
        status = bouncing_ball_impulse(t, y, u, p, contact, work, c->change);
        if (status != 0) {
            return status;
        }
        for (i = 0; i < 2; ++i) {
            y[2 + i] += c->change[i];
        }
    }
    for (k = 0; k < 1; ++k) {
        double size;
        const double speed = bouncing_ball_speed(k, y, c, &size), off = speed - c->speed[k];
        const int active = c->active[k] > 0.0;
        c->size[k] += size;
        if (c->closed[k] > 0.0
            && !((active ? fabs(off) : -off) <= 1000.0*1e-12*c->size[k])) {
            return bouncing_ball_deadlock(contact, 0);
        }
        c->speed[k] = active ? c->speed[k] : speed;
    }
    return 0;
}

/* The contacts among what is closed that have to push now. */
static int bouncing_ball_settle(double t, const double *y, const double *u, const bouncing_ball_params *p, double *contact, double *work, bouncing_ball_closing *c)
{
    int i, k, pushing = 0, status = bouncing_ball_gap_terms(t, y, u, p, contact, work, c->gradient);
    if (status == 0) {
        status = bouncing_ball_flight_rhs(t, y, u, p, work, c->change);
    }
    if (status != 0) {
        return status;
    }
    for (k = 0; k < 1; ++k) {
        c->w[k] = c->bias[k];
        c->size[k] = fabs(c->bias[k]);
        for (i = 0; i < 2; ++i) {
            const double term = c->gradient[k*2 + i]*c->change[2 + i];
            c->w[k] += term;
            c->size[k] += fabs(term);
        }
    }
    if (bouncing_ball_push(1, c) != 0) {
        return bouncing_ball_deadlock(contact, c);
    }
    for (k = 0; k < 1; ++k) {
        contact[k] = c->active[k];
        contact[1 + k] = 0.0;
        pushing = pushing || contact[k] > 0.0;
    }
    return pushing ? bouncing_ball_contact_multipliers(t, y, u, p, contact, work, c->change) : 0;
}

static int bouncing_ball_contact_reset(double t, double *y, const double *u, const bouncing_ball_params *p, double *contact, int event, double bounce, double *work)
{
    bouncing_ball_closing c;
    int k, any = 0, approaching = 0, status;
    c.gap = work + 14;
    c.gradient = c.gap + 2*1;
    c.rate = c.gradient + 1*2;
    c.bias = c.rate + 1;
    c.restitution = c.bias + 1;
    c.held = c.restitution + 1;
    c.closed = c.held + 1;
    c.speed = c.closed + 1;
    c.w = c.speed + 1;
    c.size = c.w + 1;
    c.x = c.size + 1;
    c.active = c.x + 1;
    c.d = c.active + 1;
    c.change = c.d + 1*1;
    c.more = c.change + 4;
    status = bouncing_ball_look(t, y, u, p, contact, (int)event, work, &c);
    if (status == 0) {
        status = bouncing_ball_respond(t, y, u, p, contact, work, &c);
    }
    if (status != 0) {
        return status;
    }
    for (k = 0; k < 1; ++k) {
        const int comes = c.held[k] == 0.0 && c.speed[k] < -1e-12*c.size[k];
        any = any || c.closed[k] > 0.0;
        approaching = approaching || (c.closed[k] > 0.0 && comes);
    }
    if (approaching) {
        status = bouncing_ball_hit(t, y, u, p, contact, bounce, work, &c);
        if (status != 0) {
            return status;
        }
    }
    for (k = 0; k < 1; ++k) {
        const int stays = c.speed[k] <= 1e-12*c.size[k]
            || (!approaching && c.held[k] > 0.0);
        const int released = !approaching && k == (int)event && c.held[k] > 0.0;
        c.closed[k] = stays && !released ? c.closed[k] : 0.0;
    }
    return bouncing_ball_settle(t, y, u, p, contact, work, &c);
}

/* contact[0..2*1-1]: 1 for what is closed, then zeros; whether anything is closed. */
static int bouncing_ball_flags(const int *mode, double *contact)
{
    int k, any = 0;
    for (k = 0; k < 1; ++k) {
        const int closed = mode != 0 && mode[k] != 0;
        contact[k] = closed ? 1.0 : 0.0;
        contact[1 + k] = 0.0;
        any = any || closed;
    }
    return any;
}

int bouncing_ball_rhs(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *dydt)
{
    double *const contact = work + 37;
    if (!bouncing_ball_flags(mode, contact)) {
        return bouncing_ball_flight_rhs(t, y, u, p, work, dydt);
    }
    return bouncing_ball_contact_rhs(t, y, u, p, contact, work, dydt);
}

int bouncing_ball_multipliers(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out)
{
    double *const contact = work + 37;
    (void)bouncing_ball_flags(mode, contact);
    return bouncing_ball_contact_multipliers(t, y, u, p, contact, work, out);
}

int bouncing_ball_constraints(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out)
{
    double *const contact = work + 37;
    (void)bouncing_ball_flags(mode, contact);
    return bouncing_ball_contact_constraints(t, y, u, p, contact, work, out);
}

int bouncing_ball_events(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out)
{
    double *const contact = work + 37;
    (void)bouncing_ball_flags(mode, contact);
    return bouncing_ball_contact_events(t, y, u, p, contact, work, out);
}

int bouncing_ball_project(double t, double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work)
{
    double *const contact = work + 37;
    (void)bouncing_ball_flags(mode, contact);
    return bouncing_ball_contact_project(t, y, u, p, contact, work);
}

int bouncing_ball_reset(double t, double *y, const double *u, const bouncing_ball_params *p, int *mode, int event, double bounce, double *work)
{
    double *const contact = work + 37;
    int k, status;
    (void)bouncing_ball_flags(mode, contact);
    status = bouncing_ball_contact_reset(t, y, u, p, contact, event, bounce, work);
    for (k = 0; status == 0 && k < 1; ++k) {
        mode[k] = contact[k] > 0.0;
    }
    return status;
}
