/* RATTLE: Stoermer's and Verlet's method on constraints, of order 2 with a fixed step.
 *
 * Andersen, J. Comput. Phys. 52 (1983) 24; Hairer, Lubich, Wanner, Geometric Numerical
 * Integration, VII.1.4. Positions are led back along the gradients where the step began, which
 * makes it symmetric in time and symplectic. hi + low as in dop853.c. The state is [q, v];
 * accelerations must not depend on v but for the forces of constraints. */
#include "fixed.h"

enum { SLOPE = FIRST_OF_METHOD, CHANGE, POINT, SHIFT, BEFORE, ROWS };

/* One change of the positions of CHANGE, and of the velocities that lead there; 0: changes go on
 * to shrink, 1: rounding stops them, 2: there is none. */
static int shift(lagrange_run *run, double h)
{
    const int64_t half = DIM(run)/2;
    const double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double *const change = lagrange_row(run, CHANGE), *const point = lagrange_row(run, POINT);
    double *const by = lagrange_row(run, SHIFT), *const before = lagrange_row(run, BEFORE);
    int64_t i;
    int done = 1;
    for (i = 0; i < half; ++i) {
        point[i] = hi[i];
        point[half + i] = hi[i] + (low[i] + change[i]);
    }
    if (run->shift(run->t, point, run->u, run->p, run->work, by)) {
        return 2;
    }
    for (i = 0; i < half; ++i) {
        const double size = fabs(by[i]);
        done = done && (size == 0.0 || size >= before[i]);
        before[i] = size > 0.0 && size < before[i] ? size : before[i];
        change[i] += by[i];
        change[half + i] += by[i]/h;
    }
    return done;
}

/* Lead the positions of CHANGE back to the constraints, if there are any. */
static int constrain(lagrange_run *run, double h)
{
    double *const before = lagrange_row(run, BEFORE);
    int64_t i;
    int round, done, calm = 0;
    if (!run->project) {
        return LAGRANGE_OK;
    }
    for (i = 0; i < DIM(run)/2; ++i) {
        before[i] = HUGE_VAL;
    }
    for (round = 0; round < ITERATIONS; ++round) {
        done = shift(run, h);
        if (done == 2) {
            return LAGRANGE_UNMET;
        }
        calm = done ? calm + 1 : 0;
        if (calm == CALM) {
            return LAGRANGE_OK;
        }
    }
    return LAGRANGE_DIVERGES;
}

/* Half of the step's change of velocities at its start, and that of positions. */
static void kick(lagrange_run *run, double h)
{
    const int64_t half = DIM(run)/2;
    const double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    const double *const a = lagrange_row(run, SLOPE) + half;
    double *const change = lagrange_row(run, CHANGE);
    int64_t i;
    for (i = 0; i < half; ++i) {
        change[half + i] = h/2.0*a[i];
        change[i] = h*(hi[half + i] + low[half + i] + change[half + i]);
    }
}

/* The other half at its end, and the end of the step. */
static int settle(lagrange_run *run, double t, double h)
{
    const int64_t n = DIM(run), half = n/2;
    const double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    const double *const a = lagrange_row(run, SLOPE) + half;
    double *const change = lagrange_row(run, CHANGE), *const point = lagrange_row(run, POINT);
    int64_t i;
    for (i = 0; i < n; ++i) {
        change[i] += low[i];
        point[i] = hi[i] + change[i];
    }
    if (lagrange_slope(run, t, point, SLOPE)) {
        return LAGRANGE_NOT_FINITE;
    }
    for (i = 0; i < half; ++i) {
        change[half + i] += h/2.0*a[i];
    }
    return fixed_arrive(run, t, change, point);
}

static int step(lagrange_run *run, double limit)
{
    const double t = run->t, t_new = fixed_end(run, limit);
    const double h = t_new - t; /* what t really moves by, rounding included */
    int status;
    if (!run->mode && lagrange_slope(run, t, lagrange_row(run, HI), SLOPE)) {
        return LAGRANGE_NOT_FINITE;
    }
    kick(run, h);
    status = constrain(run, h);
    status = status ? status : settle(run, t_new, h);
    run->mode = !status;
    return status;
}

LAGRANGE_METHOD(rattle, fixed_forget, step, 0)
