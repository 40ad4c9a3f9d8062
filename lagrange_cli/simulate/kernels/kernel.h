/* Shared by the compiled integrators: a run, its right-hand side, and exact sums.
 *
 * Compile with -DLAGRANGE_DIM=N for states of N numbers, so that every loop over
 * a state has a constant length; without it the length is that of the run.
 * Nothing here is global: runs in several threads do not see each other.
 */
#ifndef LAGRANGE_KERNEL_H
#define LAGRANGE_KERNEL_H

#include "numbers.h"

#include <stdint.h>

/* y' = f(t, y) with inputs u, parameters p and workspace; not 0: it does not exist there. */
typedef int (*lagrange_function)(double t, const double *y, const double *u, const void *p,
                                 double *work, double *out);

/* The same at LAGRANGE_LANES states at once; the lane is the last index of t, y and out. */
typedef int (*lagrange_lanes)(const double *t, const double *y, const double *u, const void *p,
                              double *work, double *out);
#define LAGRANGE_LANES 8

/* Moves y onto the constraints that it obeys at t; not 0: they cannot be met from there. */
typedef int (*lagrange_projection)(double t, double *y, const double *u, const void *p,
                                   double *work);

/* Coefficients 1 to order of a motion's Taylor series, coefficient k of number i at
 * c[k*series_rows + i]: of the state, behind it of time, then of what it takes to find them. */
typedef void (*lagrange_series)(int order, const double *p, double *c);

/* Why a call came back. */
enum {
    LAGRANGE_OK = 0,       /* samples filled, or a limit of the call reached */
    LAGRANGE_UNDERFLOW,    /* no step is small enough */
    LAGRANGE_NOT_FINITE,   /* the state has overflowed */
    LAGRANGE_ENDED,        /* a terminal event: t and y are there */
    LAGRANGE_UNMET,        /* the state cannot be moved onto the constraints */
    LAGRANGE_DIVERGES      /* the equations of a step are not solved by iteration */
};

struct lagrange_events;

/* Exponents of sharp functions (landmarks.c). */
typedef struct {
    lagrange_function function; /* all of them at once */
    const void *p;
    double *work;
    double *level;  /* count: where each is next to nothing, if it is active */
    double *active; /* count: whether a peak of each is passed now */
    double *values; /* 8 rows of count */
    double *state;  /* n */
    int64_t count;
    int64_t remade; /* steps that were made again */
} lagrange_landmarks;

/* What is seen of a motion step by step (observed.c), of n coordinates and N numbers of a state. */
typedef struct {
    const double *origin; /* n: where it began */
    const double *angle;  /* n: not 0 for angles */
    const int64_t *kind;  /* n: number of its kind, from 0 */
    double *moved;        /* N: largest distances from there, and largest speeds */
    double *scales;       /* N: of the motion so far */
    double *way;          /* n: how far each coordinate went, back and forth */
    double *closest;      /* n: least distance from the origin in short steps, over its scale */
    double *ends;         /* the ends of steps, as many as there is room for, */
    double *lengths;      /* and their lengths */
    double *size;         /* n, and */
    double *state;        /* N: workspace */
    double tolerance;     /* absolute tolerances over scales, */
    double least;         /* and the least of them */
    double span;          /* of the whole run */
    double brief;         /* steps are short below this part of the longest so far, */
    double longest;       /* which is this */
    double nearest;       /* closer than this the run ends */
    double slowest;       /* so does one that comes no further in `window` steps */
    double since;         /* time at which these began */
    int64_t coordinates;  /* n */
    int64_t recorded;     /* steps in these */
    int64_t passed;       /* steps in all */
    int64_t settling;     /* first steps, whose lengths say nothing */
    int64_t window;
    int64_t ended;
} lagrange_observed;

/* One run of a method. Its caller sets everything above `t` and may change the
 * tolerances and max_step between calls. */
typedef struct {
    lagrange_function rhs;
    lagrange_lanes lanes; /* or null */
    lagrange_projection project; /* or null */
    const double *u;
    const void *p;
    double *work;
    const double *rtol;
    double *atol;
    double *memory; /* rows of n numbers, as many as the method says */
    struct lagrange_events *events; /* or null */
    int64_t n;
    double t_end;
    double max_step;
    double t;     /* where the run stands, with y = hi + low */
    double t_old; /* the last step began here */
    double t_new; /* and ended here, where a terminal event may have cut it */
    double h;     /* the next step, as the method would like it */
    int64_t steps;
    int64_t rejections;
    int64_t evaluations;
    int64_t dense; /* whether the last step's interpolant is ready */
    int64_t mode; /* of the method, as are the next two */
    double rate;
    double noise;
    /* Inputs that are other numbers in each piece of time: u is row `piece` of `inputs`, which
     * holds from starts[piece] to the next start, and there anew. */
    const double *starts;
    const double *inputs;
    int64_t width;
    int64_t pieces;
    int64_t piece;
    /* The change that leads positions, which stand in place of velocities, back to the constraints
     * along the gradients at the positions; or null. */
    lagrange_function shift;
    lagrange_landmarks *landmarks; /* or null */
    lagrange_series series; /* or null */
    int64_t series_rows;
    lagrange_observed *observed; /* or null */
    /* Absolute tolerances that hold from some times on, ascending; rows of n. */
    const double *since;
    const double *looser;
    int64_t stretches;
} lagrange_run;

#ifdef LAGRANGE_DIM
#define DIM(run) LAGRANGE_DIM
#else
#define DIM(run) ((run)->n)
#endif

/* The first rows of the memory, the same for every method. */
enum { HI, LOW, START_HI, START_LOW, FIRST_OF_METHOD };

static inline double *lagrange_row(const lagrange_run *run, int64_t k)
{
    return run->memory + k*DIM(run);
}

/* The sum of hi and low as a rounded sum and what the rounding lost (Knuth). */
static inline void lagrange_fold(double *hi, double *low, int64_t n)
{
    int64_t i;
    for (i = 0; i < n; ++i) {
        const double sum = hi[i] + low[i], part = sum - hi[i];
        low[i] = (hi[i] - (sum - part)) + (low[i] - part);
        hi[i] = sum;
    }
}

/* The slope at (t, y) into a row; not 0 where it does not exist. */
static inline int lagrange_slope(lagrange_run *run, double t, const double *y, int64_t row)
{
    run->evaluations += 1;
    return run->rhs(t, y, run->u, run->p, run->work, lagrange_row(run, row));
}

/* The step cannot be made: stand where it began. */
static inline int lagrange_stay(lagrange_run *run, int status)
{
    const double *const rest = lagrange_row(run, START_LOW);
    double *const low = lagrange_row(run, LOW);
    int64_t i;
    for (i = 0; i < DIM(run); ++i) {
        low[i] = rest[i];
    }
    return status;
}

/* The last step led from t, where the run stood, to here. */
static inline int lagrange_reach(lagrange_run *run, double t_new)
{
    run->t_old = run->t;
    run->t = run->t_new = t_new;
    return LAGRANGE_OK;
}

/* A method: standing at (t, hi + low), not 0 where there is no slope; one step no further than
 * `limit`; and states within the last step. */
typedef int (*lagrange_begin)(lagrange_run *run);
typedef int (*lagrange_step)(lagrange_run *run, double limit);
typedef int (*lagrange_interpolate)(lagrange_run *run, double t, double *out);

/* Keep where a step begins, and one over what errors may be there in a row of weights. */
void lagrange_depart(lagrange_run *run, int64_t weights);

/* Move the state hi + low at t onto the constraints, if there are any; not 0 where that fails.
 *
 * The change goes into low, so that compensated sums stay compensated; `point` receives
 * the rounded state. */
int lagrange_project(const lagrange_run *run, double t, const double *hi, double *low,
                     double *point);

/* The state at t within the last step, on the constraints. */
int lagrange_between(lagrange_run *run, lagrange_interpolate interpolate, double t, double *out);

int lagrange_advance(lagrange_run *run, lagrange_begin start, lagrange_step step,
                     lagrange_interpolate interpolate, const double *times, int64_t count,
                     double *states, int64_t *filled, int64_t most_steps,
                     int64_t most_evaluations);

/* What callers know a method by that has ROWS of memory; `start` and `interpolate` may be null. */
#define LAGRANGE_METHOD(name, start, step, interpolate)                                       \
    int64_t lagrange_##name##_rows(void)                                                      \
    {                                                                                         \
        return ROWS;                                                                          \
    }                                                                                         \
    int lagrange_##name##_advance(lagrange_run *run, const double *times, int64_t count,      \
                                  double *states, int64_t *filled, int64_t most_steps,        \
                                  int64_t most_evaluations)                                   \
    {                                                                                         \
        return lagrange_advance(run, start, step, interpolate, times, count, states, filled,  \
                                most_steps, most_evaluations);                                \
    }

/* The same of one that has both. */
#define LAGRANGE_INTERPOLATING_METHOD(name, start, step, interpolate)                         \
    LAGRANGE_METHOD(name, start, step, interpolate)                                           \
    int lagrange_##name##_start(lagrange_run *run)                                            \
    {                                                                                         \
        return start(run);                                                                    \
    }                                                                                         \
    int lagrange_##name##_interpolate(lagrange_run *run, const double *t, double *out)        \
    {                                                                                         \
        return interpolate(run, *t, out);                                                     \
    }

/* Take note of the last step; the absolute tolerances follow. */
void lagrange_observe(lagrange_run *run);

/* The length with which the last step resolves sharp functions when it is made again: its own
 * length if it does. */
double lagrange_resolved(lagrange_run *run);

/* The last step's events; LAGRANGE_ENDED where a terminal one has cut it. */
int lagrange_locate(lagrange_run *run, lagrange_interpolate interpolate);
/* Forget the last step's events. */
void lagrange_unlocate(lagrange_run *run);
/* True if the buffer cannot hold the events of another step. */
int lagrange_events_full(const lagrange_run *run);

#endif
