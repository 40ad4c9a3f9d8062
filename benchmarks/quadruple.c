/* Motion in numbers of 113 binary digits, by extrapolation of the modified midpoint rule.
 *
 * Gragg, SIAM J. Numer. Anal. 2 (1965) 384; Hairer, Norsett, Wanner, Solving Ordinary
 * Differential Equations I, II.9. A step of length H is made with 2, 4, 6, ... parts until two
 * neighbours on the diagonal of the scheme agree, and is halved where they do not. __float128
 * is a type of gcc; its functions are in libquadmath.
 */
#include <quadmath.h>
#include <stdlib.h>

typedef __float128 real;
typedef int (*function)(real t, const real *y, const real *u, const void *p, real *work,
                        real *out);
typedef int (*projection)(real t, real *y, const real *u, const void *p, real *work);
typedef int (*resetting)(real t, real *y, const real *u, void *p, long event, real bounce,
                         real *work);

/* Columns of the scheme at most, and those that a step of good length needs. */
enum { COLUMNS = 14, GOOD = 8 };

/* Part of the magnitude of a number that its steps can be told apart by. */
#define ROUNDING 1e-32Q

typedef struct {
    function rhs;
    projection project; /* or null */
    long n, evaluations;
    real t, step, marked;
    real *y, *mark, *scale, *p, *u, *work;
    real *slope, *one, *two, *rows; /* of the scheme, with COLUMNS rows of it */
} motion;

static real *numbers(long count)
{
    return calloc(count > 0 ? (size_t)count : 1, sizeof(real));
}

void quadruple_end(motion *m)
{
    if (m) {
        real *const all[] = {m->y, m->mark, m->scale, m->p, m->u, m->work,
                             m->slope, m->one, m->two, m->rows};
        size_t k;
        for (k = 0; k < sizeof all/sizeof all[0]; ++k) {
            free(all[k]);
        }
        free(m);
    }
}

motion *quadruple_begin(long n, long parameters, long inputs, long work)
{
    motion *const m = calloc(1, sizeof(motion));
    if (!m) {
        return 0;
    }
    m->n = n;
    m->y = numbers(n);
    m->mark = numbers(n);
    m->scale = numbers(n);
    m->p = numbers(parameters);
    m->u = numbers(inputs);
    m->work = numbers(work);
    m->slope = numbers(n);
    m->one = numbers(n);
    m->two = numbers(n);
    m->rows = numbers(COLUMNS*n);
    if (!(m->y && m->mark && m->scale && m->p && m->u && m->work && m->slope && m->one
          && m->two && m->rows)) {
        quadruple_end(m);
        return 0;
    }
    return m;
}

void quadruple_obey(motion *m, function rhs, projection project)
{
    m->rhs = rhs;
    m->project = project;
}

static void copied(long count, const double *from, real *to)
{
    long i;
    for (i = 0; i < count; ++i) {
        to[i] = from[i];
    }
}

/* Sums of doubles and what they lack. */
static void summed(long count, const double *high, const double *low, real *to)
{
    long i;
    for (i = 0; i < count; ++i) {
        to[i] = (real)high[i] + low[i];
    }
}

void quadruple_parameters(motion *m, long count, const double *p, const double *low)
{
    summed(count, p, low, m->p);
}

void quadruple_inputs(motion *m, long count, const double *u)
{
    copied(count, u, m->u);
}

/* Stand at a state y + low; errors of steps may be as large as `scale`, `step` is the first. */
int quadruple_stand(motion *m, double t, const double *y, const double *low, const double *scale,
                    double step)
{
    summed(m->n, y, low, m->y);
    copied(m->n, scale, m->scale);
    m->t = t;
    m->step = step;
    return m->project ? m->project(m->t, m->y, m->u, m->p, m->work) : 0;
}

/* The modified midpoint rule with `parts` parts of a step of length h, into `out`. */
static int midpoint(motion *m, real h, long parts, real *out)
{
    const real part = h/parts;
    real *before = m->one, *now = m->two;
    long i, k;
    for (i = 0; i < m->n; ++i) {
        before[i] = m->y[i];
        now[i] = m->y[i] + part*m->slope[i];
    }
    for (k = 1; k < parts; ++k) {
        real *const next = before;
        ++m->evaluations;
        if (m->rhs(m->t + k*part, now, m->u, m->p, m->work, out)) {
            return 1;
        }
        for (i = 0; i < m->n; ++i) {
            next[i] = before[i] + 2*part*out[i];
        }
        before = now;
        now = next;
    }
    for (i = 0; i < m->n; ++i) {
        out[i] = now[i];
    }
    return 0;
}

/* One more row of the scheme by Neville's rule: rows[k] is column k of the last row. The largest
 * difference of its last two columns, over what it may be. */
static real extrapolated(motion *m, long row)
{
    real worst = 0;
    long i, k;
    for (i = 0; i < m->n; ++i) {
        real value = m->rows[row*m->n + i], difference = 0;
        const real noise = ROUNDING*fabsq(m->y[i]);
        const real most = m->scale[i] > noise ? m->scale[i] : noise;
        for (k = 0; k < row; ++k) {
            const real ratio = (real)(row + 1)/(row - k), old = m->rows[k*m->n + i];
            m->rows[k*m->n + i] = value;
            difference = (value - old)/(ratio*ratio - 1);
            value += difference;
        }
        m->rows[row*m->n + i] = value;
        difference = fabsq(difference)/most;
        if (!(difference <= worst)) {
            worst = difference == difference ? difference : HUGE_VALQ;
        }
    }
    return worst;
}

/* One step of length h: the columns that it took, 0 where it is too long. */
static long stepped(motion *m, real h)
{
    long row, i;
    ++m->evaluations;
    if (m->rhs(m->t, m->y, m->u, m->p, m->work, m->slope)) {
        return 0;
    }
    for (row = 0; row < COLUMNS; ++row) {
        if (midpoint(m, h, 2*(row + 1), m->rows + row*m->n)) {
            return 0;
        }
        if (extrapolated(m, row) <= 1 && row > 1) {
            for (i = 0; i < m->n; ++i) {
                m->y[i] = m->rows[row*m->n + i];
            }
            return row + 1;
        }
    }
    return 0;
}

/* Go on by a length, forward or back: 1 where a step would have to be too short, 2 where the
 * constraints cannot be met, 3 where it takes too many evaluations. */
static int gone(motion *m, real length, long most)
{
    const real end = m->t + length, least = 1e-25Q*(fabsq(length) + fabsq(m->step));
    const int back = length < 0;
    for (;;) {
        const real rest = fabsq(end - m->t);
        const int last = m->step >= rest;
        const real h = last ? rest : m->step;
        long columns;
        if (rest == 0) {
            return 0;
        }
        if (m->evaluations > most) {
            return 3;
        }
        columns = stepped(m, back ? -h : h);
        if (columns == 0) {
            m->step = h/2;
            if (m->step < least) {
                return 1;
            }
            continue;
        }
        m->t = last ? end : m->t + (back ? -h : h);
        if (columns > GOOD + 2) {
            m->step = 0.8Q*h;
        } else if (columns < GOOD && h == m->step) {
            m->step *= 1.5Q;
        }
        if (m->project && m->project(m->t, m->y, m->u, m->p, m->work)) {
            return 2;
        }
    }
}

int quadruple_until(motion *m, double t, long most)
{
    const int status = gone(m, (real)t - m->t, most);
    if (status == 0) {
        m->t = t;
    }
    return status;
}

int quadruple_shift(motion *m, double length, long most)
{
    return gone(m, length, most);
}

double quadruple_distance(const motion *m, double t)
{
    return (double)((real)t - m->t);
}

void quadruple_mark(motion *m)
{
    long i;
    m->marked = m->t;
    for (i = 0; i < m->n; ++i) {
        m->mark[i] = m->y[i];
    }
}

void quadruple_back(motion *m)
{
    long i;
    m->t = m->marked;
    for (i = 0; i < m->n; ++i) {
        m->y[i] = m->mark[i];
    }
}

/* t and y, each as a double and what it lacks. */
void quadruple_state(const motion *m, double *high, double *low)
{
    long i;
    for (i = 0; i <= m->n; ++i) {
        const real value = i == 0 ? m->t : m->y[i - 1];
        high[i] = (double)value;
        low[i] = (double)(value - high[i]);
    }
}

/* What another function gives here. */
int quadruple_value(motion *m, function f, long count, double *out)
{
    real *const found = numbers(count);
    const int status = found ? f(m->t, m->y, m->u, m->p, m->work, found) : 1;
    long i;
    for (i = 0; status == 0 && i < count; ++i) {
        out[i] = (double)found[i];
    }
    free(found);
    return status;
}

/* State and parameters behind an event of contacts. */
int quadruple_reset(motion *m, resetting reset, long event, long count, double *p)
{
    const int status = reset(m->t, m->y, m->u, m->p, event, 1, m->work);
    long i;
    for (i = 0; i < count; ++i) {
        p[i] = (double)m->p[i];
    }
    return status;
}

long quadruple_evaluations(const motion *m)
{
    return m->evaluations;
}
