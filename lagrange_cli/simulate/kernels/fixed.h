/* Shared by the methods of fixed step, whose change over a step takes the place of LOW beside HI. */
#ifndef LAGRANGE_FIXED_H
#define LAGRANGE_FIXED_H

#include "kernel.h"

/* Iterations after which a step is given up, and those without progress after which they end:
 * half of the components of a mechanical system change in turn. */
enum { ITERATIONS = 60, CALM = 2 };

/* The time at which the next step ends: a remainder of rounding size joins it. */
static inline double fixed_end(const lagrange_run *run, double limit)
{
    return limit - run->t > run->h*(1.0 + 1e-9) ? run->t + run->h : limit;
}

/* End the step with the change in a row, moved onto the constraints; `point` is memory for a state. */
static inline int fixed_arrive(lagrange_run *run, double t_new, double *change, double *point)
{
    double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double zero = 0.0;
    int64_t i;
    for (i = 0; i < DIM(run); ++i) {
        zero += 0.0*(hi[i] + change[i]);
    }
    if (zero != 0.0) {
        return LAGRANGE_NOT_FINITE;
    }
    if (lagrange_project(run, t_new, hi, change, point)) {
        return LAGRANGE_UNMET;
    }
    for (i = 0; i < DIM(run); ++i) {
        low[i] = change[i];
    }
    lagrange_fold(hi, low, DIM(run));
    return lagrange_reach(run, t_new);
}

/* `mode` is whether slopes are known from the step before; those of one piece are not those of
 * the next. */
static inline int fixed_forget(lagrange_run *run)
{
    run->mode = 0;
    return 0;
}

#endif
