/* Collocation at the eight Gauss points, order 16, its equations solved by iteration.
 *
 * Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7; the
 * eight stages of an iteration are evaluated side by side, one a lane, after
 * Antonana, Makazaga, Murua, Numer. Algorithms 76 (2017) 861. Where q' = v the
 * positions follow from the accelerations by A A in place of A, which halves
 * the iterations. The state is kept as hi + low.
 */
#include "gauss.h"
#include "kernel.h"

#include <math.h>

enum { S = LAGRANGE_LANES };

/* Rows of the memory; blocks of S rows hold n x S numbers, the stage last. */
enum {
    SHAPE = FIRST_OF_METHOD, /* coefficients of the slope as a polynomial over the step */
    NEW_SHAPE = SHAPE + S,
    STAGES = NEW_SHAPE + S,
    OTHER_STAGES = STAGES + S,
    SLOPES = OTHER_STAGES + S,
    SCALE = SLOPES + S,
    WEIGHT,
    SPARE, /* two rows */
    ROWS = SPARE + 2
};

enum { FIRST_ORDER = 1, STARTED = 2 };

/* Most iterations of a step, and the error that they may leave beside the tolerance. */
enum { MOST_ITERATIONS = 16 };
static const double LEFT = 0.02;

/* The error beside the estimate, which is the last coefficient of the slope. */
static const double CAUTION = 0.01;

/* Most growth of a step. */
static const double GROW = 4.0;

/* An error after one iteration that more iterations do not mend. */
static const double HOPELESS = 4.0;

static double square(double x)
{
    return x*x;
}

/* The stages t[l], y[.][l] to out[.][l], one after the other. */
static int one_by_one(lagrange_run *run, const double *t, const double *y, double *out)
{
    const int64_t n = DIM(run);
    double *const state = lagrange_row(run, SPARE), *const slope = state + n;
    int64_t i;
    int l;
    for (l = 0; l < S; ++l) {
        for (i = 0; i < n; ++i) {
            state[i] = y[S*i + l];
        }
        if (run->rhs(t[l], state, run->u, run->p, run->work, slope)) {
            return 1;
        }
        for (i = 0; i < n; ++i) {
            out[S*i + l] = slope[i];
        }
    }
    return 0;
}

/* Slopes at the stages; lanes that give up are computed one by one. */
static int evaluate(lagrange_run *run, double h, const double *y)
{
    double *const out = lagrange_row(run, SLOPES);
    double t[S];
    int l;
    for (l = 0; l < S; ++l) {
        t[l] = run->t + h*gauss_node[l];
    }
    run->evaluations += S;
    if (run->lanes && !run->lanes(t, y, run->u, run->p, run->work, out)) {
        return 0;
    }
    return one_by_one(run, t, y, out);
}

/* out[l] = sum over j of matrix[j][l] x[j] */
static inline void multiply(const double matrix[S][S], const double *x, double *out)
{
    double even[S], odd[S];
    int j, l;
    for (l = 0; l < S; ++l) {
        even[l] = matrix[0][l]*x[0];
        odd[l] = matrix[1][l]*x[1];
    }
    for (j = 2; j < S; j += 2) {
        for (l = 0; l < S; ++l) {
            even[l] += matrix[j][l]*x[j];
            odd[l] += matrix[j + 1][l]*x[j + 1];
        }
    }
    for (l = 0; l < S; ++l) {
        out[l] = even[l] + odd[l];
    }
}

/* The first of the rows that follow from slopes; those before it are integrals of them. */
static int64_t first_row(const lagrange_run *run)
{
    return run->mode & FIRST_ORDER ? 0 : DIM(run)/2;
}

/* What one unit of a row, and of the row that it integrates to, is beside the tolerance. */
static void weigh(lagrange_run *run, double h)
{
    const int64_t first = first_row(run);
    const double *const scale = lagrange_row(run, SCALE);
    double *const weight = lagrange_row(run, WEIGHT);
    int64_t i;
    for (i = first; i < DIM(run); ++i) {
        const double integral = first ? h*scale[i - first] : 0.0;
        weight[i] = scale[i] > integral ? scale[i] : integral;
    }
}

/* Stages from slopes; returns the largest change from those `before` beside the tolerance. */
static double stages(const lagrange_run *run, double h, const double *before, double *y)
{
    const int64_t n = DIM(run), first = first_row(run);
    const double *const hi = lagrange_row(run, START_HI), *const low = lagrange_row(run, START_LOW);
    const double *const f = lagrange_row(run, SLOPES), *const weight = lagrange_row(run, WEIGHT);
    double most[S] = {0.0}, sum[S], largest = 0.0;
    int64_t i;
    int l;
    for (i = first; i < n; ++i) {
        const double unit = weight[i];
        multiply(gauss_a, f + S*i, sum);
        for (l = 0; l < S; ++l) {
            const double now = hi[i] + (low[i] + h*sum[l]);
            const double change = fabs(now - before[S*i + l])*unit;
            most[l] = change > most[l] ? change : most[l];
            y[S*i + l] = now;
        }
    }
    for (i = 0; i < first; ++i) {
        const double v = h*(hi[first + i] + low[first + i]);
        multiply(gauss_aa, f + S*(first + i), sum);
        for (l = 0; l < S; ++l) {
            y[S*i + l] = hi[i] + (low[i] + (v*gauss_node[l] + h*h*sum[l]));
        }
    }
    for (l = 0; l < S; ++l) {
        largest = most[l] > largest ? most[l] : largest;
    }
    return largest;
}

/* Slopes to begin with: those of the last step continued, or the slope at the start. */
static int predict(lagrange_run *run, double h)
{
    const double ratio = h/(run->t_new - run->t_old);
    const double *const shape = lagrange_row(run, SHAPE);
    double *const f = lagrange_row(run, SLOPES);
    double x[S];
    int64_t i;
    int k, l;
    for (l = 0; l < S; ++l) {
        x[l] = run->mode & STARTED ? 1.0 + 2.0*ratio*gauss_node[l] : 0.0;
    }
    for (i = first_row(run); i < DIM(run); ++i) {
        double sum[S];
        for (l = 0; l < S; ++l) {
            sum[l] = shape[S*i + S - 1];
        }
        for (k = S - 2; k >= 0; --k) {
            for (l = 0; l < S; ++l) {
                sum[l] = sum[l]*x[l] + shape[S*i + k];
            }
        }
        for (l = 0; l < S; ++l) {
            f[S*i + l] = sum[l];
        }
    }
    return 0;
}

/* The slope as a polynomial, and how its expansion in Legendre polynomials ends: the error
 * beside the tolerance. */
static double estimate(lagrange_run *run, double h)
{
    const int64_t n = DIM(run), first = first_row(run);
    const double *const f = lagrange_row(run, SLOPES), *const weight = lagrange_row(run, WEIGHT);
    double *const shape = lagrange_row(run, NEW_SHAPE);
    double last = 0.0, before = 0.0;
    int64_t i;
    for (i = first; i < n; ++i) {
        multiply(gauss_power, f + S*i, shape + S*i);
        last += square(shape[S*i + S - 1]*weight[i]);
        before += square(shape[S*i + S - 2]*weight[i]);
    }
    last = gauss_last*h*sqrt(last/(double)(n - first));
    before = gauss_before*h*sqrt(before/(double)(n - first));
    return CAUTION*last*(last < before ? last/before : 1.0);
}

/* Solve the equations of a step of h; the stages they were last evaluated at are *at, those that
 * follow *next. Returns the error beside the tolerance, not a number where it does not converge. */
static double solve(lagrange_run *run, double h, double **at, double **next)
{
    double change, before = HUGE_VAL, rate = run->rate, error;
    int k;
    *at = lagrange_row(run, STAGES);
    *next = lagrange_row(run, OTHER_STAGES);
    weigh(run, h);
    predict(run, h);
    stages(run, h, *next, *at);
    for (k = 0; k < MOST_ITERATIONS; ++k) {
        if (evaluate(run, h, *at)) {
            return NAN;
        }
        if (k == 0 && (error = estimate(run, h)) > HOPELESS) {
            return error;
        }
        change = stages(run, h, *at, *next);
        rate = k ? change/before : rate;
        if (change*rate < LEFT*(1.0 - rate) || change < run->noise) {
            run->rate = rate > 1e-3 ? rate : 1e-3;
            return k ? estimate(run, h) : error;
        }
        if (!(rate < 0.9)) {
            return NAN;
        }
        {
            double *const other = *at;
            *at = *next;
            *next = other;
        }
        before = change;
    }
    return NAN;
}

/* Whether the first half of the slopes is the second half of the stages they belong to. */
static int second_order(const lagrange_run *run, const double *y)
{
    const int64_t n = DIM(run), half = n/2;
    const double *const f = lagrange_row(run, SLOPES);
    int differ = 0;
    int64_t i;
    for (i = 0; i < S*half; ++i) {
        differ |= f[i] != y[S*half + i];
    }
    return !differ && n == 2*half;
}

/* The end of the step, and the slope as a polynomial, from the stages that the slopes gave. */
static void finish(lagrange_run *run, double h, const double *y)
{
    const int64_t n = DIM(run), first = first_row(run);
    const double *const rest = lagrange_row(run, START_LOW);
    double *const f = lagrange_row(run, SLOPES), *const low = lagrange_row(run, LOW);
    double *const shape = lagrange_row(run, SHAPE);
    const double *const found = lagrange_row(run, NEW_SHAPE);
    int64_t i;
    int l;
    for (i = 0; i < S*first; ++i) {
        f[i] = y[S*first + i];
    }
    for (i = 0; i < n; ++i) {
        double sum = 0.0;
        for (l = 0; l < S; ++l) {
            sum += gauss_weight[l]*f[S*i + l];
        }
        low[i] = rest[i] + h*sum;
    }
    for (i = 0; i < first; ++i) {
        multiply(gauss_power, f + S*i, shape + S*i);
    }
    for (i = S*first; i < S*n; ++i) {
        shape[i] = found[i];
    }
}

static void begin(lagrange_run *run)
{
    const int64_t n = DIM(run);
    double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double *const start = lagrange_row(run, START_HI), *const rest = lagrange_row(run, START_LOW);
    double *const scale = lagrange_row(run, SCALE);
    double noise;
    int64_t i;
    lagrange_fold(hi, low, n);
    run->noise = 0.0;
    for (i = 0; i < n; ++i) {
        start[i] = hi[i];
        rest[i] = low[i];
        scale[i] = 1.0/(run->atol[i] + run->rtol[i]*fabs(hi[i]));
        noise = 0x1p-51*fabs(hi[i])*scale[i];
        run->noise = noise > run->noise ? noise : run->noise;
    }
}

static double factor(double error)
{
    return error > 0.0 ? 0.9*pow(error, -1.0/9.0) : GROW;
}

static int step(lagrange_run *run, double limit)
{
    const double t = run->t, smallest = 10.0*(nextafter(t, HUGE_VAL) - t);
    double h = fmax(fmin(run->h, run->max_step), smallest);
    begin(run);
    for (;;) {
        double *at, *next, error, t_new;
        if (!(h >= smallest)) {
            return LAGRANGE_UNDERFLOW;
        }
        t_new = fmin(t + h, limit);
        h = t_new - t;
        error = solve(run, h, &at, &next);
        if (error <= 1.0 && !(run->mode & FIRST_ORDER) && !second_order(run, at)) {
            run->mode |= FIRST_ORDER;
        } else if (error <= 1.0) {
            finish(run, h, next);
            run->t_old = t;
            run->t = run->t_new = t_new;
            run->mode |= STARTED;
            run->h = h*fmin(factor(error), GROW);
            return LAGRANGE_OK;
        } else {
            h *= isnan(error) ? 0.5 : fmax(factor(error), 0.2);
            run->rejections += 1;
        }
    }
}

static int interpolate(lagrange_run *run, double t, double *out)
{
    const int64_t n = DIM(run);
    const double *const hi = lagrange_row(run, START_HI), *const low = lagrange_row(run, START_LOW);
    const double *const shape = lagrange_row(run, SHAPE);
    const double h = run->t_new - run->t_old, x = 2.0*((t - run->t_old)/h) - 1.0;
    double power = 1.0, sign = -1.0, integral[S];
    int64_t i;
    int k;
    for (k = 0; k < S; ++k) {
        power *= x;
        integral[k] = 0.5*h*(power - sign)/(double)(k + 1);
        sign = -sign;
    }
    for (i = 0; i < n; ++i) {
        double sum = 0.0;
        for (k = 0; k < S; ++k) {
            sum += integral[k]*shape[S*i + k];
        }
        out[i] = hi[i] + (low[i] + sum);
    }
    return 0;
}

int64_t lagrange_gauss_rows(void)
{
    return ROWS;
}

/* Stand at (t, hi + low); not 0 where the right-hand side does not exist there. */
int lagrange_gauss_start(lagrange_run *run)
{
    const int64_t n = DIM(run);
    double *const shape = lagrange_row(run, SHAPE), *const slope = lagrange_row(run, SPARE);
    int64_t i;
    run->evaluations += 1;
    if (run->rhs(run->t, lagrange_row(run, HI), run->u, run->p, run->work, slope)) {
        return 1;
    }
    for (i = 0; i < n; ++i) {
        shape[S*i] = slope[i];
    }
    run->rate = 0.1;
    return 0;
}

int lagrange_gauss_interpolate(lagrange_run *run, double t, double *out)
{
    return interpolate(run, t, out);
}

int lagrange_gauss_advance(lagrange_run *run, const double *times, int64_t count, double *states,
                           int64_t *filled, int64_t most_steps, double most_evaluations)
{
    return lagrange_advance(run, step, interpolate, times, count, states, filled, most_steps,
                            most_evaluations);
}
