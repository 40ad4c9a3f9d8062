/* Stoermer's and Verlet's method of order 2 with a fixed step; hi + low as in dop853.c.
 *
 * The state is [q, v]; accelerations, the second half of a slope, must not depend on v. */
#include "fixed.h"

enum { SLOPE = FIRST_OF_METHOD, CHANGE, POINT, ROWS };

static int step(lagrange_run *run, double limit)
{
    const int64_t n = DIM(run), half = DIM(run)/2;
    const double t = run->t, t_new = fixed_end(run, limit);
    const double h = t_new - t; /* what t really moves by, rounding included */
    int status;
    const double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double *const change = lagrange_row(run, CHANGE), *const point = lagrange_row(run, POINT);
    const double *const a = lagrange_row(run, SLOPE) + half;
    int64_t i;
    if (!run->mode && lagrange_slope(run, t, hi, SLOPE)) {
        return LAGRANGE_NOT_FINITE;
    }
    run->mode = 0;
    for (i = 0; i < half; ++i) {
        change[half + i] = h/2.0*a[i];
        change[i] = h*(hi[half + i] + low[half + i] + change[half + i]);
        point[i] = hi[i] + (low[i] + change[i]);
        point[half + i] = hi[half + i];
    }
    if (lagrange_slope(run, t + h, point, SLOPE)) {
        return LAGRANGE_NOT_FINITE;
    }
    for (i = 0; i < half; ++i) {
        change[half + i] += h/2.0*a[i];
    }
    for (i = 0; i < n; ++i) {
        change[i] += low[i];
    }
    status = fixed_arrive(run, t_new, change, point);
    run->mode = !status;
    return status;
}

LAGRANGE_METHOD(verlet, fixed_forget, step, 0)
