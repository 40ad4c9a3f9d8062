/* Stoermer's and Verlet's method of order 2 with a fixed step; hi + low as in dop853.c.
 *
 * The state is [q, v]; accelerations, the second half of a slope, must not depend on v. */
#include "kernel.h"

#include <math.h>

enum { SLOPE = FIRST_OF_METHOD, CHANGE, POINT, ROWS };

/* The slope at (t, y) into row SLOPE. */
static int slope(lagrange_run *run, double t, const double *y)
{
    run->evaluations += 1;
    return run->rhs(t, y, run->u, run->p, run->work, lagrange_row(run, SLOPE));
}

static int step(lagrange_run *run, double limit)
{
    const int64_t n = DIM(run), half = DIM(run)/2;
    const double t = run->t;
    /* A remainder of rounding size joins the step rather than becoming one. */
    const double t_new = limit - t > run->h*(1.0 + 1e-9) ? t + run->h : limit;
    const double h = t_new - t; /* what t really moves by, rounding included */
    double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double *const change = lagrange_row(run, CHANGE), *const point = lagrange_row(run, POINT);
    const double *const a = lagrange_row(run, SLOPE) + half;
    double zero = 0.0;
    int64_t i;
    /* mode: whether the slope is that of the state. */
    if (!run->mode && slope(run, t, hi)) {
        return LAGRANGE_NOT_FINITE;
    }
    run->mode = 0;
    for (i = 0; i < half; ++i) {
        change[half + i] = h/2.0*a[i];
        change[i] = h*(hi[half + i] + low[half + i] + change[half + i]);
        point[i] = hi[i] + (low[i] + change[i]);
        point[half + i] = hi[half + i];
    }
    if (slope(run, t + h, point)) {
        return LAGRANGE_NOT_FINITE;
    }
    for (i = 0; i < half; ++i) {
        change[half + i] += h/2.0*a[i];
    }
    for (i = 0; i < n; ++i) {
        zero += 0.0*(hi[i] + change[i]);
    }
    if (zero != 0.0) {
        return LAGRANGE_NOT_FINITE;
    }
    for (i = 0; i < n; ++i) {
        low[i] += change[i];
    }
    lagrange_fold(hi, low, n);
    run->mode = 1;
    run->t_old = t;
    run->t = run->t_new = t_new;
    return LAGRANGE_OK;
}

/* The slope of one piece is not that of the next. */
static int begin(lagrange_run *run)
{
    run->mode = 0;
    return 0;
}

int64_t lagrange_verlet_rows(void)
{
    return ROWS;
}

int lagrange_verlet_advance(lagrange_run *run, const double *times, int64_t count, double *states,
                            int64_t *filled, int64_t most_steps, int64_t most_evaluations)
{
    return lagrange_advance(run, begin, step, 0, times, count, states, filled, most_steps,
                            most_evaluations);
}
