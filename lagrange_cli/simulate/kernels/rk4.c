/* Kutta's classical method of order 4 with a fixed step; hi + low as in dop853.c. */
#include "kernel.h"

#include <math.h>

enum { SLOPES = FIRST_OF_METHOD, POINT = SLOPES + 4, END, ROWS };

#define K(j) k[(j)*n + i]

static int slope(lagrange_run *run, double t, const double *y, int64_t j)
{
    run->evaluations += 1;
    return run->rhs(t, y, run->u, run->p, run->work, lagrange_row(run, SLOPES + j));
}

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
    return slope(run, t, point, j);
}

/* The state after the step into POINT and LOW; not 0 where it is not finite. */
static int finish(lagrange_run *run, double h)
{
    const int64_t n = DIM(run);
    const double *const hi = lagrange_row(run, HI), *const k = lagrange_row(run, SLOPES);
    double *const low = lagrange_row(run, LOW), *const point = lagrange_row(run, POINT);
    double zero = 0.0;
    int64_t i;
    for (i = 0; i < n; ++i) {
        point[i] = low[i] + h/6.0*(K(0) + 2.0*K(1) + 2.0*K(2) + K(3));
        zero += 0.0*(hi[i] + point[i]);
    }
    return zero != 0.0;
}

static void accept(lagrange_run *run)
{
    double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    const double *const point = lagrange_row(run, POINT);
    int64_t i;
    for (i = 0; i < DIM(run); ++i) {
        low[i] = point[i];
    }
    lagrange_fold(hi, low, DIM(run));
}

static int step(lagrange_run *run, double limit)
{
    const double t = run->t;
    /* A remainder of rounding size joins the step rather than becoming one. */
    const double t_new = limit - t > run->h*(1.0 + 1e-9) ? t + run->h : limit;
    const double h = t_new - t; /* what t really moves by, rounding included */
    if (slope(run, t, lagrange_row(run, HI), 0) || next_slope(run, t + h/2.0, h/2.0, 1) ||
        next_slope(run, t + h/2.0, h/2.0, 2) || next_slope(run, t + h, h, 3) || finish(run, h)) {
        return LAGRANGE_NOT_FINITE;
    }
    if (lagrange_project(run, t_new, lagrange_row(run, HI), lagrange_row(run, POINT),
                         lagrange_row(run, END))) {
        return LAGRANGE_UNMET;
    }
    accept(run);
    run->t_old = t;
    run->t = run->t_new = t_new;
    return LAGRANGE_OK;
}

int64_t lagrange_rk4_rows(void)
{
    return ROWS;
}

int lagrange_rk4_advance(lagrange_run *run, const double *times, int64_t count, double *states,
                         int64_t *filled, int64_t most_steps, int64_t most_evaluations)
{
    return lagrange_advance(run, 0, step, 0, times, count, states, filled,
                            most_steps, most_evaluations);
}
