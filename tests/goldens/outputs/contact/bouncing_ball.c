/* bouncing_ball: see bouncing_ball.h, which documents every function. */

#include "bouncing_ball.h"

#if bouncing_ball_EMISSION != 0x8c278f21UL
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

/*
 * Store what falls through zero where one of c contacts opens or closes.
 *
 * It is the multiplier of a closed one, behind those of m closures, and the gap of an open one.
 * gap and force are overwritten. Tell whether all are known.
 */
static int bouncing_ball_falling(int c, int m, double t, const double *u, const
        bouncing_ball_params *p, double *work, const double *y, const double *mode, double *out,
        double *gap, double *force)
{
    if (!(bouncing_ball_gaps(t, y, u, p, mode, work, gap) == 0)) {
        return 0;
    }
    int closed = 0;
    for (int k = 0; k < c; ++k) {
        out[k] = gap[k];
        if (mode[k] > 0.0) {
            closed = 1;
        }
    }
    if (closed) {
        if (!(bouncing_ball_contact_multipliers(t, y, u, p, mode, work, force) == 0)) {
            return 0;
        }
        for (int k = 0; k < c; ++k) {
            if (mode[k] > 0.0) {
                out[k] = force[m + k];
            }
        }
    }
    return 1;
}

/*
 * Return the rate of gap k.
 */
static double bouncing_ball_gap_rate(int n, int c, int k, const double *y, const double *terms)
{
    double rate = terms[c*n + k];
    for (int i = 0; i < n; ++i) {
        rate += terms[k*n + i]*y[n + i];
    }
    return rate;
}

/*
 * Return the sum of the magnitudes of the terms of the rate of gap k.
 */
static double bouncing_ball_gap_size(int n, int c, int k, const double *y, const double *terms)
{
    double size = fabs(terms[c*n + k]);
    for (int i = 0; i < n; ++i) {
        size += fabs(terms[k*n + i]*y[n + i]);
    }
    return size;
}

/*
 * Store gaps and terms at a state, what was closed and is now, and rates of the gaps.
 *
 * Tell whether all are known.
 */
static int bouncing_ball_look(int n, int c, double t, const double *u, const
        bouncing_ball_params *p, double *work, int event, double late, const double *y, const
        double *mode, double *gap, double *terms, double *before, double *closed, double *speed,
        double *size)
{
    if (!(bouncing_ball_gaps(t, y, u, p, mode, work, gap) == 0)) {
        return 0;
    }
    if (!(bouncing_ball_gap_terms(t, y, u, p, mode, work, terms) == 0)) {
        return 0;
    }
    for (int k = 0; k < c; ++k) {
        speed[k] = bouncing_ball_gap_rate(n, c, k, y, terms);
        size[k] = bouncing_ball_gap_size(n, c, k, y, terms);
        double near = 1e-12*gap[c + k];
        if (speed[k] < 0.0) {
            near -= late*speed[k];
        }
        before[k] = mode[k];
        closed[k] = 0.0;
        if (before[k] > 0.0 || k == event || gap[k] <= near) {
            closed[k] = 1.0;
        }
    }
    return 1;
}

/*
 * Open all contacts of a mode.
 */
static void bouncing_ball_clear(int c, double *mode)
{
    for (int k = 0; k < 2*c; ++k) {
        mode[k] = 0.0;
    }
}

/*
 * Store by columns what a unit impulse of each closed contact adds to the rates of all gaps.
 */
static void bouncing_ball_respond(int n, int c, double t, const double *u, const
        bouncing_ball_params *p, double *work, const double *y, double *mode, const double
        *terms, const double *closed, double *d, double *change)
{
    for (int k = 0; k < c; ++k) {
        bouncing_ball_clear(c, mode);
        mode[k] = 1.0;
        mode[c + k] = 1.0;
        int moves = 0;
        if (closed[k] > 0.0) {
            moves = (bouncing_ball_impulse(t, y, u, p, mode, work, change) == 0);
        }
        /* One that the closures alone hold back takes no impulse. */
        for (int j = 0; j < c; ++j) {
            d[j*c + k] = 0.0;
            for (int i = 0; i < n; ++i) {
                if (moves) {
                    d[j*c + k] += terms[j*n + i]*change[i];
                }
            }
        }
    }
}

/*
 * Solve d x = r for active pushes alone; x replaces r, and a is overwritten.
 *
 * What is zero costs nothing (contacts that act on their neighbours). Tell whether all pivots are
 * larger than the least one.
 */
static int bouncing_ball_solve_active(int n, double least, const double *d, const double
        *active, double *r, double *a)
{
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            a[i*n + j] = 0.0;
            if (active[i] > 0.0 && active[j] > 0.0) {
                a[i*n + j] = d[i*n + j];
            } else if (i == j) {
                a[i*n + j] = 1.0;
            }
        }
    }
    for (int j = 0; j < n; ++j) {
        if (!(a[j*n + j] > least)) {
            return 0;
        }
        for (int i = j + 1; i < n; ++i) {
            const double ratio = a[i*n + j]/a[j*n + j];
            if (ratio < 0.0 || ratio > 0.0) {
                for (int k = j; k < n; ++k) {
                    a[i*n + k] -= ratio*a[j*n + k];
                }
                r[i] -= ratio*r[j];
            }
        }
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int j = i + 1; j < n; ++j) {
            r[i] -= a[i*n + j]*r[j];
        }
        r[i] /= a[i*n + i];
    }
    return 1;
}

/*
 * Store x and active of what pushes at first sight: zeros where that does not end soon.
 *
 * It is all that is violated, without what would pull, with what is violated then
 * (Hintermueller, Ito and Kunisch, SIAM J. Optim. 13 (2002) 865). r and a are overwritten.
 */
static void bouncing_ball_guess_pushes(int n, const double *d, const double *closed, const
        double *start, const double *size, double *x, double *active, double *r, double *a)
{
    for (int k = 0; k < n; ++k) {
        active[k] = 0.0;
        if (closed[k] > 0.0 && start[k] < 0.0) {
            active[k] = 1.0;
        }
    }
    int rounds = 12;
    int changing = 1;
    while (changing && rounds > 0) {
        rounds -= 1;
        for (int k = 0; k < n; ++k) {
            r[k] = 0.0;
            if (active[k] > 0.0) {
                r[k] = -start[k];
            }
        }
        if (!bouncing_ball_solve_active(n, 1e-06, d, active, r, a)) {
            break;
        }
        changing = 0;
        for (int k = 0; k < n; ++k) {
            double rate = start[k];
            double magnitude = size[k];
            for (int j = 0; j < n; ++j) {
                rate += d[k*n + j]*r[j];
                magnitude += fabs(d[k*n + j]*r[j]);
            }
            int pushes = closed[k] > 0.0 && rate < (-1e-12)*magnitude;
            if (active[k] > 0.0) {
                pushes = r[k] > 0.0;
            }
            x[k] = 0.0;
            if (pushes) {
                x[k] = 1.0;
            }
            if (x[k] != active[k]) {
                changing = 1;
            }
        }
        for (int k = 0; k < n; ++k) {
            if (changing) {
                active[k] = x[k];
            }
            x[k] = r[k];
        }
    }
    if (changing) {
        for (int k = 0; k < n; ++k) {
            active[k] = 0.0;
            x[k] = 0.0;
        }
    }
}

/*
 * Raise push k until w[k] is zero; active pushes that are used up end.
 *
 * r and a are overwritten. Tell whether that has an effect; else active are the contacts that
 * take all of it.
 */
static int bouncing_ball_raise_push(int n, int k, const double *d, double *w, double *x, double
        *active, double *r, double *a)
{
    while (!(active[k] > 0.0)) {
        for (int j = 0; j < n; ++j) {
            r[j] = 0.0;
            if (active[j] > 0.0) {
                r[j] = d[j*n + k];
            }
        }
        if (!bouncing_ball_solve_active(n, 0.0, d, active, r, a)) {
            for (int j = 0; j < n; ++j) {
                active[j] = 0.0;
            }
            return 0;
        }
        double rise = d[k*n + k];
        int first = n;
        double least = 0.0;
        for (int j = 0; j < n; ++j) {
            if (active[j] > 0.0) {
                rise -= d[k*n + j]*r[j];
                if (r[j] > 0.0 && (first == n || x[j]/r[j] < least)) {
                    first = j;
                    least = x[j]/r[j];
                }
            }
        }
        if (first == n && !(rise > 1e-12)) {
            for (int j = 0; j < n; ++j) {
                active[j] = 0.0;
                if (j == k || r[j] < (-1e-12)) {
                    active[j] = 1.0;
                }
            }
            return 0;
        }
        if (rise > 1e-12 && (first == n || (-w[k])/rise <= least)) {
            first = n;
            least = (-w[k])/rise;
        }
        for (int j = 0; j < n; ++j) {
            if (active[j] > 0.0) {
                x[j] -= least*r[j];
                if (!(x[j] > 0.0)) {
                    x[j] = 0.0;
                }
            }
        }
        x[k] += least;
        if (first == n) {
            active[k] = 1.0;
        } else {
            w[k] += least*rise;
            if (w[k] > 0.0) {
                w[k] = 0.0;
            }
            active[first] = 0.0;
            x[first] = 0.0;
        }
    }
    return 1;
}

/*
 * Find pushes x of the n contacts of which some are closed, and which of them are active.
 *
 * start are the numbers w without pushes, size the magnitudes that they are sums of: what is
 * rounding becomes zero. The arrays behind are overwritten. Tell whether there are such pushes;
 * else active are contacts that cannot all be met, none where that is not known.
 */
static int bouncing_ball_push(int n, const double *d, const double *closed, double *start, const
        double *size, double *w, double *x, double *active, double *r, double *a)
{
    for (int k = 0; k < n; ++k) {
        x[k] = 0.0;
        active[k] = 0.0;
        if (!(fabs(start[k]) > 1e-12*size[k])) {
            start[k] = 0.0;
        }
    }
    if (n >= 8) {
        bouncing_ball_guess_pushes(n, d, closed, start, size, x, active, r, a);
    }
    int steps = 64*(n + 1);
    while (steps > 0) {
        steps -= 1;
        int violated = n;
        for (int k = n - 1; k >= 0; --k) {
            w[k] = start[k];
            double magnitude = size[k];
            for (int j = 0; j < n; ++j) {
                w[k] += d[k*n + j]*x[j];
                magnitude += fabs(d[k*n + j]*x[j]);
            }
            if (active[k] > 0.0 || fabs(w[k]) <= 1e-12*magnitude) {
                w[k] = 0.0;
            }
            if (closed[k] > 0.0 && w[k] < 0.0) {
                violated = k;
            }
        }
        if (violated == n) {
            return 1;
        }
        if (!bouncing_ball_raise_push(n, violated, d, w, x, active, r, a)) {
            return 0;
        }
    }
    for (int k = 0; k < n; ++k) {
        active[k] = 0.0;
    }
    return 0;
}

/*
 * Change velocities by the impact of what is closed, and the rates of the gaps with them.
 *
 * Return 0, or why that is impossible.
 */
static int bouncing_ball_collide(int n, int c, double t, const double *u, const
        bouncing_ball_params *p, double *work, double bounce, double *y, double *mode, const
        double *terms, const double *before, const double *closed, double *speed, double *size,
        double *start, double *w, double *x, const double *d, double *change, double *r, double
        *a)
{
    for (int k = 0; k < c; ++k) {
        const double e = terms[c*n + 2*c + k];
        if (closed[k] > 0.0 && !(e >= 0.0 && e <= 1.0 + 1e-12)) {
            return 4;
        }
        if (before[k] > 0.0) {
            speed[k] = 0.0;
        }
        start[k] = speed[k];
        if (speed[k] < 0.0) {
            start[k] += bounce*e*speed[k];
        }
    }
    if (!bouncing_ball_push(c, d, closed, start, size, w, x, mode, r, a)) {
        return 4;
    }
    /* The least rate after the impact, and that of active contacts. */
    for (int k = 0; k < c; ++k) {
        double least = 0.0;
        if (speed[k] < 0.0) {
            least = (-bounce)*terms[c*n + 2*c + k]*speed[k];
        }
        speed[k] = least;
    }
    /* A second time for what rounding has left of the first. */
    int rounds = 2;
    while (rounds > 0) {
        rounds -= 1;
        for (int k = 0; k < c; ++k) {
            mode[c + k] = speed[k] - bouncing_ball_gap_rate(n, c, k, y, terms);
        }
        if (!(bouncing_ball_impulse(t, y, u, p, mode, work, change) == 0)) {
            bouncing_ball_clear(c, mode);
            return 1;
        }
        for (int i = 0; i < n; ++i) {
            y[n + i] += change[i];
        }
    }
    for (int k = 0; k < c; ++k) {
        const double rate = bouncing_ball_gap_rate(n, c, k, y, terms);
        size[k] += bouncing_ball_gap_size(n, c, k, y, terms);
        double error = speed[k] - rate;
        if (mode[k] > 0.0) {
            error = fabs(error);
        }
        if (closed[k] > 0.0 && !(error <= 1000.0*1e-12*size[k])) {
            bouncing_ball_clear(c, mode);
            return 4;
        }
        if (!(mode[k] > 0.0)) {
            speed[k] = rate;
        }
    }
    return 0;
}

/*
 * Store the mode in which those of the closed contacts are closed that have to push now.
 *
 * Return 0, or why nothing follows.
 */
static int bouncing_ball_settle(int n, int c, double t, const double *u, const
        bouncing_ball_params *p, double *work, const double *y, double *mode, double *terms,
        const double *closed, double *size, double *start, double *w, double *x, const double
        *d, double *slope, double *force, double *r, double *a)
{
    if (!(bouncing_ball_gap_terms(t, y, u, p, mode, work, terms) == 0)) {
        return 1;
    }
    if (!(bouncing_ball_flight_rhs(t, y, u, p, work, slope) == 0)) {
        return 1;
    }
    for (int k = 0; k < c; ++k) {
        start[k] = terms[c*n + c + k];
        size[k] = fabs(start[k]);
        for (int i = 0; i < n; ++i) {
            start[k] += terms[k*n + i]*slope[n + i];
            size[k] += fabs(terms[k*n + i]*slope[n + i]);
        }
    }
    if (!bouncing_ball_push(c, d, closed, start, size, w, x, mode, r, a)) {
        return 4;
    }
    int pushing = 0;
    for (int k = 0; k < c; ++k) {
        mode[c + k] = 0.0;
        if (mode[k] > 0.0) {
            pushing = 1;
        }
    }
    if (!pushing) {
        return 0;
    }
    if (!(bouncing_ball_contact_multipliers(t, y, u, p, mode, work, force) == 0)) {
        bouncing_ball_clear(c, mode);
        return 1;
    }
    return 0;
}

/*
 * Change state and mode behind an event of a contact, or at a start, where event is c.
 *
 * bounce is 1, or 0 for an impact without restitution; what closes within the time late closes
 * now. The arrays behind the mode are overwritten. Return 0, or why nothing follows: 1 in a
 * singular configuration or where a number is not finite, 4 where contacts leave no motion, which
 * are then those of the mode.
 */
static int bouncing_ball_reset_contacts(int n, int c, double t, const double *u, const
        bouncing_ball_params *p, double *work, int event, double bounce, double late, double *y,
        double *mode, double *gap, double *terms, double *before, double *closed, double *speed,
        double *size, double *start, double *w, double *x, double *d, double *change, double
        *slope, double *force, double *r, double *a)
{
    if (!bouncing_ball_look(n, c, t, u, p, work, event, late, y, mode, gap, terms, before,
        closed, speed, size)) {
        bouncing_ball_clear(c, mode);
        return 1;
    }
    bouncing_ball_respond(n, c, t, u, p, work, y, mode, terms, closed, d, change);
    bouncing_ball_clear(c, mode);
    int approaching = 0;
    for (int k = 0; k < c; ++k) {
        if (closed[k] > 0.0 && !(before[k] > 0.0) && speed[k] < (-1e-12)*size[k]) {
            approaching = 1;
        }
    }
    if (approaching) {
        const int outcome = bouncing_ball_collide(n, c, t, u, p, work, bounce, y, mode, terms,
            before, closed, speed, size, start, w, x, d, change, r, a);
        if (outcome > 0) {
            return outcome;
        }
    }
    for (int k = 0; k < c; ++k) {
        int stays = speed[k] <= 1e-12*size[k];
        if (before[k] > 0.0 && !approaching) {
            stays = k != event;
        }
        if (!stays) {
            closed[k] = 0.0;
        }
    }
    return bouncing_ball_settle(n, c, t, u, p, work, y, mode, terms, closed, size, start, w, x, d, slope, force, r, a);
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
    double *const contact = work + 38;
    if (!bouncing_ball_flags(mode, contact)) {
        return bouncing_ball_flight_rhs(t, y, u, p, work, dydt);
    }
    return bouncing_ball_contact_rhs(t, y, u, p, contact, work, dydt);
}

int bouncing_ball_multipliers(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out)
{
    double *const contact = work + 38;
    (void)bouncing_ball_flags(mode, contact);
    return bouncing_ball_contact_multipliers(t, y, u, p, contact, work, out);
}

int bouncing_ball_constraints(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out)
{
    double *const contact = work + 38;
    (void)bouncing_ball_flags(mode, contact);
    return bouncing_ball_contact_constraints(t, y, u, p, contact, work, out);
}

int bouncing_ball_events(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out)
{
    double *const contact = work + 38;
    (void)bouncing_ball_flags(mode, contact);
    return bouncing_ball_falling(1, 0, t, u, p, work, y, contact, out, work + 14, work + 16) ? 0
        : 1;
}

int bouncing_ball_project(double t, double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work)
{
    double *const contact = work + 38;
    (void)bouncing_ball_flags(mode, contact);
    return bouncing_ball_contact_project(t, y, u, p, contact, work);
}

int bouncing_ball_reset(double t, double *y, const double *u, const bouncing_ball_params *p, int *mode, int event, double bounce, double *work)
{
    double *const contact = work + 38;
    int k, status;
    (void)bouncing_ball_flags(mode, contact);
    status = bouncing_ball_reset_contacts(2, 1, t, u, p, work, event < 0 ? 1 : (int)event,
        bounce, 1.4210854715202004e-14*fabs(t), y, contact, work + 14, work + 16, work + 21,
        work + 22, work + 23, work + 24, work + 25, work + 26, work + 27, work + 28, work + 29,
        work + 31, work + 35, work + 36, work + 37);
    for (k = 0; status == 0 && k < 1; ++k) {
        mode[k] = contact[k] > 0.0;
    }
    return status;
}
