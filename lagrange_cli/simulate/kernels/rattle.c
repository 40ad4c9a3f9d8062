/* RATTLE: Stoermer's and Verlet's method on constraints, of order 2 with a fixed step.
 *
 * Andersen, J. Comput. Phys. 52 (1983) 24; Hairer, Lubich, Wanner, Geometric Numerical
 * Integration, VII.1.4. Positions are led back along the gradients where the step began, which
 * makes it symmetric in time and symplectic. hi + low as in dop853.c. The state is [q, v];
 * accelerations must not depend on v but for the forces of constraints. */
#include "kernel.h"

#include <math.h>

enum { SLOPE = FIRST_OF_METHOD, CHANGE, POINT, SHIFT, BEFORE, ROWS };

/* Iterations after which a step is given up, and those without progress after which they end. */
enum { ITERATIONS = 60, CALM = 2 };

/* The slope at (t, y) into row SLOPE. */
static int slope(lagrange_run *run, double t, const double *y)
{
    run->evaluations += 1;
    return run->rhs(t, y, run->u, run->p, run->work, lagrange_row(run, SLOPE));
}

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

/* The other half at its end, and the end on the constraints into CHANGE. */
static int settle(lagrange_run *run, double t, double h)
{
    const int64_t n = DIM(run), half = n/2;
    const double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    const double *const a = lagrange_row(run, SLOPE) + half;
    double *const change = lagrange_row(run, CHANGE), *const point = lagrange_row(run, POINT);
    double zero = 0.0;
    int64_t i;
    for (i = 0; i < n; ++i) {
        change[i] += low[i];
        point[i] = hi[i] + change[i];
    }
    if (slope(run, t, point)) {
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
    return lagrange_project(run, t, hi, change, point) ? LAGRANGE_UNMET : LAGRANGE_OK;
}

static int step(lagrange_run *run, double limit)
{
    const double t = run->t;
    /* A remainder of rounding size joins the step rather than becoming one. */
    const double t_new = limit - t > run->h*(1.0 + 1e-9) ? t + run->h : limit;
    const double h = t_new - t; /* what t really moves by, rounding included */
    const double *const change = lagrange_row(run, CHANGE);
    double *const low = lagrange_row(run, LOW);
    int64_t i;
    int status;
    /* mode: whether the slope is that of the state. */
    if (!run->mode && slope(run, t, lagrange_row(run, HI))) {
        return LAGRANGE_NOT_FINITE;
    }
    run->mode = 0;
    kick(run, h);
    status = constrain(run, h);
    status = status ? status : settle(run, t_new, h);
    if (status) {
        return status;
    }
    for (i = 0; i < DIM(run); ++i) {
        low[i] = change[i];
    }
    lagrange_fold(lagrange_row(run, HI), low, DIM(run));
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

int64_t lagrange_rattle_rows(void)
{
    return ROWS;
}

int lagrange_rattle_advance(lagrange_run *run, const double *times, int64_t count, double *states,
                            int64_t *filled, int64_t most_steps, int64_t most_evaluations)
{
    return lagrange_advance(run, begin, step, 0, times, count, states, filled, most_steps,
                            most_evaluations);
}
