/* What is seen of a motion step by step while no scales are known: these, the way that coordinates
 * go, the lengths of steps, and how close bodies come to the origin where steps are short. The
 * tolerance of the run follows the scales. Python has the same in integrators/observed_motion.py.
 */
#include "kernel.h"


/* A coordinate or speed is measured by this part of the largest of its kind at least. */
#define BESIDE_OTHERS 1e-3

static double magnitude(const lagrange_observed *o, int64_t i)
{
    return o->angle[i] != 0 ? 1.0 : o->moved[i];
}

/* Scales of the motion so far: of coordinates, of speeds, of states of first order. */
static void measure(lagrange_observed *o, int64_t n, int64_t size)
{
    int64_t i;
    for (i = 0; i < n; ++i) {
        o->size[i] = 0.0;
    }
    for (i = 0; i < n; ++i) {
        double *const largest = o->size + o->kind[i];
        *largest = fmax(*largest, magnitude(o, i));
    }
    for (i = 0; i < n; ++i) {
        const double largest = o->size[o->kind[i]];
        const double scale = fmax(magnitude(o, i), BESIDE_OTHERS*largest);
        o->scales[i] = largest == 0.0 ? 1.0 : scale;
        o->scales[n + i] = fmax(o->moved[n + i], o->scales[i]/o->span);
    }
    for (i = 2*n; i < size; ++i) {
        o->scales[i] = o->moved[i] == 0.0 ? 1.0 : o->moved[i];
    }
}

/* Distance from the origin in a short step, of all coordinates of a kind together. */
static void approach(lagrange_observed *o, const double *y, double h, int64_t n)
{
    int64_t i, k;
    for (k = 0; k < n; ++k) {
        double size = 0.0, scale = 0.0;
        for (i = 0; i < n; ++i) {
            if (o->kind[i] == k) {
                size = fmax(size, fmax(fabs(y[i]), h*fabs(y[n + i])));
                scale = fmax(scale, o->scales[i]);
            }
        }
        for (i = 0; i < n && size > 0.0; ++i) {
            if (o->kind[i] == k) {
                o->closest[i] = fmin(o->closest[i], size/scale);
                o->ended |= o->angle[i] == 0 && o->closest[i] < o->nearest;
            }
        }
    }
}

void lagrange_observe(lagrange_run *run)
{
    lagrange_observed *const o = run->observed;
    const int64_t n = o->coordinates;
    const double *const old = lagrange_row(run, START_HI), *const rest = lagrange_row(run, START_LOW);
    const double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    const double h = run->t - run->t_old;
    int64_t i;
    for (i = 0; i < n; ++i) {
        const double before = old[i] + rest[i], here = hi[i] + low[i];
        const double first = old[n + i] + rest[n + i], last = hi[n + i] + low[n + i];
        o->state[i] = here;
        o->state[n + i] = last;
        /* Of a motion to and fro, as between two bounces, the slower end counts: the faster one
         * would take a rush at the end of a step for a way. */
        o->way[i] += fmax(fabs(here - before), h*fmin(fabs(first), fabs(last)));
        o->moved[i] = fmax(o->moved[i], fabs(here - o->origin[i]));
        o->moved[n + i] = fmax(o->moved[n + i], fabs(last));
    }
    for (i = 2*n; i < DIM(run); ++i) {
        o->state[i] = hi[i] + low[i];
        o->moved[i] = fmax(o->moved[i], fabs(o->state[i]));
    }
    measure(o, n, DIM(run));
    for (i = 0; i < DIM(run); ++i) {
        run->atol[i] = fmax(o->tolerance*o->scales[i], o->least);
    }
    o->ends[o->recorded] = run->t;
    o->lengths[o->recorded] = h;
    o->recorded += 1;
    o->passed += 1;
    /* As long as the motion lets it be: not one of the first, nor cut by an event. */
    if (run->steps > o->settling && !(run->t < run->t_new)) {
        o->longest = fmax(o->longest, h);
        if (h < o->brief*o->longest) {
            approach(o, o->state, h, n);
        }
    }
    if (o->passed%o->window == 0) {
        o->ended |= run->t - o->since < o->slowest;
        o->since = run->t;
    }
}
