/* Kutta's classical method of order 4 with a fixed step; hi + low as in dop853.c. */
#include "fixed.h"

enum { SLOPES = FIRST_OF_METHOD, POINT = SLOPES + 4, CHANGE, ROWS };

#define K(j) k[(j)*n + i]

/* Slope j at t, from the start of the step plus `by` times slope j - 1. */
static int next_slope(lagrange_run *run, double t, double by, int64_t j)
{
    const int64_t n = DIM(run);
    const double *const hi = lagrange_row(run, HI), *const k = lagrange_row(run, SLOPES);
    double *const point = lagrange_row(run, POINT);
    int64_t i;
    for (i = 0; i < n; ++i) {
        point[i] = hi[i] + by*K(j - 1);
    }
    return lagrange_slope(run, t, point, SLOPES + j);
}

static int step(lagrange_run *run, double limit)
{
    const int64_t n = DIM(run);
    const double t = run->t, t_new = fixed_end(run, limit);
    const double h = t_new - t; /* what t really moves by, rounding included */
    const double *const low = lagrange_row(run, LOW), *const k = lagrange_row(run, SLOPES);
    double *const change = lagrange_row(run, CHANGE);
    int64_t i;
    if (lagrange_slope(run, t, lagrange_row(run, HI), SLOPES) ||
        next_slope(run, t + h/2.0, h/2.0, 1) || next_slope(run, t + h/2.0, h/2.0, 2) ||
        next_slope(run, t + h, h, 3)) {
        return LAGRANGE_NOT_FINITE;
    }
    for (i = 0; i < n; ++i) {
        change[i] = low[i] + h/6.0*(K(0) + 2.0*K(1) + 2.0*K(2) + K(3));
    }
    return fixed_arrive(run, t_new, change, lagrange_row(run, POINT));
}

LAGRANGE_METHOD(rk4, 0, step, 0)
