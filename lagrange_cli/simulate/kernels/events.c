/* The first zero that an event function falls through within a step, on the interpolant. */
#include "events.h"

/* Few calls a step: made to be compiled fast. */
#ifdef __GNUC__
#ifndef __clang__
#pragma GCC optimize("O1")
#endif
#endif

#include <string.h>

enum { PARTS = LAGRANGE_PARTS, EXTRA = PARTS + 3, MOST = PARTS + 1 };

/* An event function along the last step. */
typedef struct {
    lagrange_run *run;
    lagrange_interpolate interpolate;
    int64_t index;
} along;

/* All event functions at t into out, not a number where they do not exist. */
static void evaluate(lagrange_run *run, lagrange_interpolate interpolate, double t, double *out)
{
    lagrange_events *e = run->events;
    int64_t j;
    if (lagrange_between(run, interpolate, t, e->state) || e->function(t, e->state, e->u, e->p, e->work, out)) {
        for (j = 0; j < e->count; ++j) {
            out[j] = NAN;
        }
    }
}

static double value(const along *g, double t)
{
    double *out = g->run->events->values + EXTRA*g->run->events->count;
    evaluate(g->run, g->interpolate, t, out);
    return out[g->index];
}

static double sign_of(double x)
{
    return (double)((x > 0.0) - (x < 0.0));
}

static double ulp(double t)
{
    return nextafter(fabs(t), HUGE_VAL) - fabs(t);
}

/* The zero between a and b, where g has opposite signs, to two units in the last place.
 *
 * Oliveira and Takahashi's ITP, ACM Trans. Math. Softw. 47 (2020) 5: never more
 * evaluations than bisection plus one, and superlinear where g is smooth.
 */
static double zero_between(const along *g, double a, double ga, double b, double gb)
{
    const double eps = ulp(fmax(fabs(a), fabs(b))), k1 = 0.2/(b - a);
    const double most = ceil(log2((b - a)/(2.0*eps))) + 1.0;
    double j;
    if (ga == 0.0) {
        return a;
    }
    for (j = 0.0; b - a > 2.0*eps && j < 200.0; j += 1.0) {
        const double middle = a + (b - a)/2.0, falsi = (gb*a - ga*b)/(gb - ga);
        const double side = sign_of(middle - falsi), step = k1*(b - a)*(b - a);
        const double radius = fmax(eps*exp2(most - j) - (b - a)/2.0, 0.0);
        double t = step <= fabs(middle - falsi) ? falsi + side*step : middle, gt;
        t = fabs(t - middle) <= radius ? t : middle - side*radius;
        t = t > a && t < b ? t : middle;
        gt = value(g, t);
        if (gt == 0.0) {
            return t;
        }
        if (sign_of(gt) == sign_of(gb)) {
            b = t;
            gb = gt;
        } else {
            a = t;
            ga = gt;
        }
    }
    return a + (b - a)/2.0;
}

/* A point between a and b where g, positive at both, is negative or closest to zero, and its value
 * there.
 *
 * Golden section towards the extremum, whose value is then known to rounding. */
static double lowest(const along *g, double a, double b, double *least)
{
    const double golden = 0.3819660112501051, width = b - a;
    double x = a + golden*(b - a), y = b - golden*(b - a);
    double gx = value(g, x), gy = value(g, y);
    while (!(gx < 0.0) && !(gy < 0.0) && b - a > 1e-9*width && y - x > ulp(b)) {
        if (gx < gy) {
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
    *least = gx < 0.0 || gx < gy ? gx : gy;
    return gx < 0.0 || gx < gy ? x : y;
}

/* Keep what happens at t, in order of time within this step. */
static void keep(const along *g, double t, int64_t index)
{
    lagrange_run *run = g->run;
    lagrange_events *e = run->events;
    const int64_t n = DIM(run);
    int64_t k;
    for (k = e->located; k > e->first && e->times[k - 1] > t; --k) {
        e->times[k] = e->times[k - 1];
        e->indices[k] = e->indices[k - 1];
        memcpy(e->states + k*n, e->states + (k - 1)*n, (size_t)n*sizeof(double));
    }
    e->times[k] = t;
    e->indices[k] = index;
    lagrange_between(run, g->interpolate, t, e->states + k*n);
    e->located += 1;
}

/* Keep the zero between a and b. */
static void keep_zero(const along *g, double a, double ga, double b, double gb)
{
    keep(g, zero_between(g, a, ga, b, gb), g->index);
}

/* True if the value at one end of the part from v[-1] to v[0], all around it being positive, is
 * less than beside it: there may be two zeros in the part. */
static int may_dip(const double *v)
{
    return v[0] > 0.0 && v[-1] > 0.0 &&
           ((v[-1] < v[-2] && v[-1] < v[0]) || (v[0] < v[-1] && v[0] < v[1]));
}

/* Keep the zero before t[2] of a function that is zero at t[1] and rises from there: values in
 * between tell it from rounding. */
static void falls_back(const along *g, const double *t, const double *v)
{
    double a = t[1], b = t[2], inside = 0.0;
    while (!(inside > 0.0) && b - t[1] > 2.0*ulp(b)) {
        a = t[1] + (b - t[1])/2.0;
        inside = value(g, a);
        b = inside > 0.0 ? b : a;
    }
    keep_zero(g, inside > 0.0 ? a : t[1], inside > 0.0 ? inside : 0.0, b,
              b == t[2] ? v[2] : value(g, b));
}

/* Keep where one event function falls through zero, and where it comes close to that before; t
 * and its values v run from one part before the step (where the interpolant is continued) to one
 * after it. */
static void follow(const along *g, const double *t, const double *v)
{
    const lagrange_events *e = g->run->events;
    const double noise = e->noise[g->index];
    double *const sign = e->sign + g->index;
    int k = 1, last = 1;
    for (; *sign == LAGRANGE_RISES && k <= PARTS; ++k) {
        if (v[k + 1] > noise) {
            *sign = 1.0;
        } else if (v[k + 1] < -noise) {
            falls_back(g, t + k - 1, v + k - 1);
            return;
        }
        last = k + 1;
    }
    for (; *sign != LAGRANGE_RISES && k <= PARTS + 1; ++k) {
        if (v[k] < 0.0) {
            keep_zero(g, t[last], fmax(v[last], 0.0), t[k], v[k]);
            return;
        }
        if (k > 1 && may_dip(v + k)) {
            double least;
            const double inside = lowest(g, t[k - 1], t[k], &least);
            if (least < 0.0) {
                keep_zero(g, t[k - 1], v[k - 1], inside, -1.0);
                return;
            }
            if (least < e->reach[g->index]) {
                keep(g, inside, e->count + g->index);
            }
        }
        last = v[k] > 0.0 ? k : last;
    }
}

/* Forget what lies after the first zero, and stand there. */
static int cut(lagrange_run *run)
{
    lagrange_events *e = run->events;
    const int64_t n = DIM(run);
    int64_t k, i;
    for (k = e->first; k < e->located; ++k) {
        if (e->indices[k] < e->count) {
            for (i = 0; i < n; ++i) {
                lagrange_row(run, HI)[i] = e->states[k*n + i];
                lagrange_row(run, LOW)[i] = 0.0;
            }
            run->t = e->times[k];
            e->located = k + 1;
            return LAGRANGE_ENDED;
        }
    }
    return LAGRANGE_OK;
}

int lagrange_events_full(const lagrange_run *run)
{
    return run->events->capacity - run->events->located < MOST*run->events->count;
}

void lagrange_unlocate(lagrange_run *run)
{
    lagrange_events *e = run->events;
    memcpy(e->sign, e->before, (size_t)e->count*sizeof(double));
    e->located = e->first;
}

int lagrange_locate(lagrange_run *run, lagrange_interpolate interpolate)
{
    lagrange_events *e = run->events;
    const double part = (run->t_new - run->t_old)/PARTS;
    double t[PARTS + 3], v[PARTS + 3];
    along g;
    int k;
    memcpy(e->before, e->sign, (size_t)e->count*sizeof(double));
    e->first = e->located;
    for (k = 0; k < PARTS + 3; ++k) {
        t[k] = k == PARTS + 1 ? run->t_new : run->t_old + part*(k - 1);
        evaluate(run, interpolate, t[k], e->values + k*e->count);
    }
    g.run = run;
    g.interpolate = interpolate;
    for (g.index = 0; g.index < e->count; ++g.index) {
        for (k = 0; k < PARTS + 3; ++k) {
            v[k] = e->values[k*e->count + g.index];
        }
        follow(&g, t, v);
    }
    return cut(run);
}
