/* Many steps in one call, with samples filled on the way. */
#include "events.h"

/* A step whose event lies in less than this part of it is made again, to this many times the time
 * until the event, so often at most. */
#define EARLY 0.5
#define BEHIND 1.25
enum { AGAIN = 64 };

/* Binary digits of the numbers that this is compiled for; 0 if functions of them have fewer, as
 * where a library without functions of a type takes those of a shorter one. */
int64_t lagrange_digits(void)
{
    volatile double sum = 2.0, part = 1.0, angle = 0.75;
    int64_t digits = 0;
    double off;
    for (; sum != 1.0; part /= 2.0) {
        sum = 1.0 + part;
        digits += 1;
    }
    off = fabs(sin(angle)*sin(angle) + cos(angle)*cos(angle) - 1.0)
          + fabs(exp(angle)*exp(-angle) - 1.0);
    return off < 64.0*part ? digits - 1 : 0;
}

/* Functions of a system for callers that cannot pass a number of this type by its value. */
int lagrange_call(lagrange_function function, const double *t, const double *y, const double *u,
                  const void *p, double *work, double *out)
{
    return function(*t, y, u, p, work, out);
}

int lagrange_call_projection(lagrange_projection project, const double *t, double *y,
                             const double *u, const void *p, double *work)
{
    return project(*t, y, u, p, work);
}

/* out[i*columns ..]: a function at t[i] and y[i*width ..], for i below rows; not a number where it
 * does not exist. */
void lagrange_table(lagrange_function function, int64_t rows, const double *t, const double *y,
                    int64_t width, const double *u, const void *p, double *work, double *out,
                    int64_t columns)
{
    int64_t i, k;
    for (i = 0; i < rows; ++i) {
        double *const row = out + i*columns;
        if (lagrange_call(function, t + i, y + i*width, u, p, work, row)) {
            for (k = 0; k < columns; ++k) {
                row[k] = NAN;
            }
        }
    }
}

void lagrange_depart(lagrange_run *run, int64_t weights)
{
    const int64_t n = DIM(run);
    double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double *const start = lagrange_row(run, START_HI), *const rest = lagrange_row(run, START_LOW);
    double *const weight = lagrange_row(run, weights);
    int64_t i;
    lagrange_fold(hi, low, n);
    for (i = 0; i < n; ++i) {
        start[i] = hi[i];
        rest[i] = low[i];
        weight[i] = 1.0/(run->atol[i] + run->rtol[i]*fabs(hi[i]));
    }
}

static void current(const lagrange_run *run, double *out)
{
    const double *hi = lagrange_row(run, HI), *low = lagrange_row(run, LOW);
    int64_t i;
    for (i = 0; i < DIM(run); ++i) {
        out[i] = hi[i] + low[i];
    }
}

static int finite(const double *y, int64_t n)
{
    double zero = 0.0;
    int64_t i;
    for (i = 0; i < n; ++i) {
        zero += 0.0*y[i];
    }
    return zero == 0.0;
}

int lagrange_project(const lagrange_run *run, double t, const double *hi, double *low,
                     double *point)
{
    int64_t i;
    if (!run->project) {
        return 0;
    }
    for (i = 0; i < DIM(run); ++i) {
        point[i] = hi[i] + low[i];
    }
    if (run->project(t, point, run->u, run->p, run->work) || !finite(point, DIM(run))) {
        return 1;
    }
    for (i = 0; i < DIM(run); ++i) {
        low[i] += point[i] - (hi[i] + low[i]);
    }
    return 0;
}

int lagrange_between(lagrange_run *run, lagrange_interpolate interpolate, double t, double *out)
{
    if (interpolate(run, t, out) || !finite(out, DIM(run))) {
        return LAGRANGE_NOT_FINITE;
    }
    if (run->project &&
        (run->project(t, out, run->u, run->p, run->work) || !finite(out, DIM(run)))) {
        return LAGRANGE_UNMET;
    }
    return LAGRANGE_OK;
}

/* Fill the samples that the run has passed. */
static int take(lagrange_run *run, lagrange_interpolate interpolate, const double *times,
                int64_t count, double *states, int64_t *filled)
{
    int status = LAGRANGE_OK;
    while (!status && *filled < count && times[*filled] <= run->t) {
        double *out = states + *filled*DIM(run);
        if (times[*filled] == run->t || !interpolate) {
            current(run, out);
        } else {
            status = lagrange_between(run, interpolate, times[*filled], out);
        }
        *filled += !status;
    }
    return status;
}

/* The time at which the present piece of inputs ends. */
static double end_of_piece(const lagrange_run *run)
{
    return run->piece + 1 < run->pieces ? run->starts[run->piece + 1] : HUGE_VAL;
}

/* Begin the next piece, with slopes of its own, if one has ended. */
static int next_piece(lagrange_run *run, lagrange_begin start)
{
    if (!(run->t >= end_of_piece(run))) {
        return LAGRANGE_OK;
    }
    run->piece += 1;
    run->u = run->inputs + run->piece*run->width;
    if (run->events) {
        run->events->u = run->u;
    }
    lagrange_fold(lagrange_row(run, HI), lagrange_row(run, LOW), DIM(run));
    return start && start(run) ? LAGRANGE_NOT_FINITE : LAGRANGE_OK;
}

/* Let absolute tolerances be those that hold by now. */
static void loosen(lagrange_run *run)
{
    const double *row = 0;
    int64_t i;
    for (; run->stretches > 0 && run->t >= *run->since; run->stretches -= 1) {
        row = run->looser;
        run->since += 1;
        run->looser += DIM(run);
    }
    for (i = 0; row && i < DIM(run); ++i) {
        run->atol[i] = row[i];
    }
}

/* One step within the piece. A step that the end of a piece has cut is no reason for short ones. */
static int step_in_piece(lagrange_run *run, lagrange_step step, double limit)
{
    const double end = end_of_piece(run), wanted = run->h;
    const int status = step(run, fmin(limit, end));
    if (!status && run->t == end) {
        run->h = fmax(run->h, wanted);
    }
    return status;
}

/* True if a terminal event lies so early in the last step that its state, which is read off the
 * interpolant, need not be as accurate as a step: the motion behind it may be much steeper. */
static int early(const lagrange_run *run)
{
    const double part = run->t - run->t_old, smallest = 32.0*(nextafter(run->t, HUGE_VAL) - run->t);
    return part < EARLY*(run->t_new - run->t_old) && part > smallest;
}

/* Make the last step again, so that it ends no later than a time. */
static int again_until(lagrange_run *run, lagrange_begin start, lagrange_step step, double end)
{
    const int64_t n = DIM(run);
    int64_t i;
    for (i = 0; i < n; ++i) {
        lagrange_row(run, HI)[i] = lagrange_row(run, START_HI)[i];
        lagrange_row(run, LOW)[i] = lagrange_row(run, START_LOW)[i];
    }
    run->t = run->t_new = run->t_old;
    if (start && start(run)) {
        return LAGRANGE_NOT_FINITE;
    }
    run->h = end - run->t;
    return step(run, end);
}

/* Make the last step again where a sharp function has its peak in it, until that is resolved. */
static int resolve(lagrange_run *run, lagrange_begin start, lagrange_step step)
{
    int status = LAGRANGE_OK, again = 0;
    for (; !status && again < AGAIN; ++again) {
        const double h = lagrange_resolved(run);
        if (!(h < run->t_new - run->t_old)) {
            break;
        }
        status = again_until(run, start, step, run->t_old + h);
    }
    return status;
}

/* Find the events of the last step; make it again until none is early in it. */
static int locate(lagrange_run *run, lagrange_begin start, lagrange_step step,
                  lagrange_interpolate interpolate, int *ended)
{
    int status = LAGRANGE_OK, again = 0;
    *ended = lagrange_locate(run, interpolate);
    for (; !status && *ended == LAGRANGE_ENDED && early(run) && again < AGAIN; ++again) {
        const double end = run->t_old + BEHIND*(run->t - run->t_old);
        lagrange_unlocate(run);
        status = again_until(run, start, step, end);
        *ended = status ? status : lagrange_locate(run, interpolate);
    }
    return status;
}

/* Step on until all samples are filled or a limit is reached.
 *
 * times: ascending, none before the start of the last step. states: count rows.
 * No further step begins after most_steps or most_evaluations in this call.
 * A null start: the method keeps no slope from step to step.
 * A null interpolate: steps end on the sample times.
 */
int lagrange_advance(lagrange_run *run, lagrange_begin start, lagrange_step step,
                     lagrange_interpolate interpolate, const double *times, int64_t count,
                     double *states, int64_t *filled, int64_t most_steps,
                     int64_t most_evaluations)
{
    const int64_t steps = run->steps, evaluations = run->evaluations;
    int status;
    *filled = 0;
    status = take(run, interpolate, times, count, states, filled);
    while (!status && *filled < count && run->steps - steps < most_steps &&
           !(run->observed && run->observed->ended) &&
           run->evaluations - evaluations < most_evaluations) {
        if (run->events && run->t < run->t_new) {
            return LAGRANGE_ENDED;
        }
        if (run->events && lagrange_events_full(run)) {
            break;
        }
        status = next_piece(run, start);
        if (!status) {
            loosen(run);
            status = step_in_piece(run, step, interpolate ? run->t_end : times[*filled]);
        }
        if (!status) {
            int ended = LAGRANGE_OK;
            if (run->landmarks && interpolate) {
                status = resolve(run, start, step);
            }
            if (!status && run->events) {
                status = locate(run, start, step, interpolate, &ended);
            }
            run->steps += 1;
            if (!status && run->observed) {
                lagrange_observe(run);
            }
            status = status ? status : take(run, interpolate, times, count, states, filled);
            status = status ? status : ended;
        }
    }
    return status;
}
