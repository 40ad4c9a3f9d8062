/* Sharp functions: a step that one of them has its peak in is made again until it is resolved. */
#include "kernel.h"

#include <string.h>

/* Few calls a step: made to be compiled fast. */
#ifdef __GNUC__
#ifndef __clang__
#pragma GCC optimize("O1")
#endif
#endif

/* Times of a step at which exponents are looked at: parts, and next to both ends. */
enum { PARTS = 4, NEAR_START = PARTS + 1, NEAR_END, TIMES };

/* Change of the exponent of a sharp function that a step may make. */
#define RESOLVED 4.0
/* Distance below the peak of an exponent at which the function is next to nothing: e^-37 is the
 * rounding error of 1. */
#define NOTHING 37.0
/* Least change of an exponent at the parts of a step that hides a peak. */
#define HINT 0.5
#define NEAR 1e-10

/* An exponent along the last step. */
typedef struct {
    lagrange_run *run;
    int64_t index;
} along;

/* The state within the last step: the cubics that have positions and velocities of its ends. */
static void between(const lagrange_run *run, double t, double *out)
{
    const int64_t n = DIM(run)/2;
    const double *const old = lagrange_row(run, START_HI), *const rest = lagrange_row(run, START_LOW);
    const double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    const double h = run->t_new - run->t_old, s = (t - run->t_old)/h;
    int64_t i;
    for (i = 0; i < n; ++i) {
        const double change = (hi[i] - old[i]) + (low[i] - rest[i]);
        const double first = h*(old[n + i] + rest[n + i]), last = h*(hi[n + i] + low[n + i]);
        const double square = 3.0*change - 2.0*first - last, cube = first + last - 2.0*change;
        out[i] = old[i] + (rest[i] + s*(first + s*(square + s*cube)));
        out[n + i] = (first + s*(2.0*square + s*3.0*cube))/h;
    }
}

static double value(const along *g, double t)
{
    lagrange_landmarks *m = g->run->landmarks;
    between(g->run, t, m->state);
    /* One that overflows says nothing of the others. */
    (void)m->function(t, m->state, g->run->u, m->p, m->work, m->values);
    return m->values[g->index];
}

static double ulp(double t)
{
    return nextafter(fabs(t), HUGE_VAL) - fabs(t);
}

/* The time between a and b of the largest value, which is stored: golden section. */
static double peak_between(const along *g, double a, double b, double *largest)
{
    const double golden = 0.3819660112501051, least = 4.0*ulp(fmax(fabs(a), fabs(b)));
    double x = a + golden*(b - a), y = b - golden*(b - a), gx = value(g, x), gy = value(g, y);
    while (b - a > least && x < y) {
        if (gx > gy) {
            b = y;
            y = x;
            gy = gx;
            x = a + golden*(b - a);
            gx = value(g, x);
        } else {
            a = x;
            x = y;
            gx = gy;
            y = b - golden*(b - a);
            gy = value(g, y);
        }
    }
    *largest = fmax(gx, gy);
    return gx > gy ? x : y;
}

/* Locate the time between a and b at which the exponent, below a level at a, comes above it. */
static double rise(const along *g, double level, double a, double b)
{
    const double least = 4.0*ulp(fmax(fabs(a), fabs(b)));
    while (b - a > least) {
        const double middle = a + (b - a)/2.0;
        if (value(g, middle) < level) {
            a = middle;
        } else {
            b = middle;
        }
    }
    return a;
}

/* The length with which the last step resolves one sharp function when it is made again: the whole
 * step if it does. */
static double resolved(const along *g, const double *v)
{
    lagrange_landmarks *m = g->run->landmarks;
    const double start = g->run->t_old, h = g->run->t_new - start;
    const double low = fmin(v[0], v[PARTS]), high = fmax(v[0], v[PARTS]);
    double t, top, least = v[0];
    int k, best = 0;
    for (k = 0; k < TIMES; ++k) {
        if (!isfinite(v[k])) {
            return h;
        }
        best = k <= PARTS && v[k] > v[best] ? k : best;
        least = fmin(least, v[k]);
    }
    if (m->active[g->index] > 0.0) {
        if (v[best] - low > RESOLVED && v[best] > m->level[g->index] - RESOLVED) {
            return h/2.0;
        }
        m->active[g->index] = v[PARTS] > m->level[g->index] || v[PARTS] > v[0] ? 1.0 : 0.0;
    }
    if (v[best] - least < HINT || (best == 0 && v[NEAR_START] < v[0]) ||
        (best == PARTS && v[NEAR_END] < v[PARTS])) {
        return h;
    }
    t = peak_between(g, start + h*fmax(best - 1, 0)/PARTS, start + h*fmin(best + 1, PARTS)/PARTS,
                     &top);
    if (!(top > high && top - low > RESOLVED)) {
        return h;
    }
    m->active[g->index] = 1.0;
    m->level[g->index] = top - NOTHING;
    return v[0] < top - NOTHING ? rise(g, top - NOTHING, start, t) - start : h/2.0;
}

double lagrange_resolved(lagrange_run *run)
{
    lagrange_landmarks *m = run->landmarks;
    const double h = run->t_new - run->t_old, least = 64.0*ulp(run->t_new);
    double shortest = h, v[TIMES];
    along g;
    int k;
    g.run = run;
    g.index = 0;
    for (k = 0; k < TIMES; ++k) {
        const double part = k == NEAR_START ? NEAR : k == NEAR_END ? 1.0 - NEAR : (double)k/PARTS;
        (void)value(&g, k == PARTS ? run->t_new : run->t_old + part*h);
        memcpy(m->values + (k + 1)*m->count, m->values, (size_t)m->count*sizeof(double));
    }
    for (g.index = 0; g.index < m->count; ++g.index) {
        for (k = 0; k < TIMES; ++k) {
            v[k] = m->values[(k + 1)*m->count + g.index];
        }
        shortest = fmin(shortest, resolved(&g, v));
    }
    if (!(shortest < h && h > least)) {
        return h;
    }
    m->remade += 1;
    return fmax(shortest, least);
}
