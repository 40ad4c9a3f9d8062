/* Collocation at the eight Gauss points, order 16, its equations solved by iteration.
 *
 * Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7; the
 * eight stages of an iteration are evaluated side by side, one a lane, after
 * Antonana, Makazaga, Murua, Numer. Algorithms 76 (2017) 861. If q' = v, the
 * positions follow from the accelerations by A A in place of A, which halves
 * the iterations. The state is kept as hi + low.
 */
#include "gauss.h"
#include "kernel.h"

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

/* Most iterations of a step, and the error that they may leave beside the tolerance: it adds up,
 * where the error of the method itself, of order 16, is only seen between the ends of steps. */
enum { MOST_ITERATIONS = 16 };
static const double LEFT = 1e-3;

/* Change in units of rounding at which iterations that stop to converge have reached the rounding
 * of the slopes. */
static const double STALLED = 2048.0;

/* The error beside the estimate, which is the last coefficient of the slope. */
static const double CAUTION = 0.01;

/* Most growth of a step. */
static const double GROW = 2.0;

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

/* Four lanes at a time: compilers make vectors of these, and not of loops of length S. */
typedef double quad __attribute__((vector_size(32), aligned(8), may_alias));
enum { QUADS = S/4 };

static inline quad *quads(double *x)
{
    return (quad *)x;
}

static inline const quad *const_quads(const double *x)
{
    return (const quad *)x;
}

/* Lanes k of the sum over j of matrix[j][.] x[j]. */
static inline void multiply(const double matrix[S][S], const double *x, int k, quad *sum)
{
    quad even = const_quads(matrix[0])[k]*x[0], odd = const_quads(matrix[1])[k]*x[1];
    int j;
    for (j = 2; j < S; j += 2) {
        even += const_quads(matrix[j])[k]*x[j];
        odd += const_quads(matrix[j + 1])[k]*x[j + 1];
    }
    *sum = even + odd;
}

/* The first of the rows that follow from slopes; those before it are integrals of them. */
static int64_t first_row(const lagrange_run *run)
{
    return run->mode & FIRST_ORDER ? 0 : DIM(run)/2;
}

/* The weight of a unit of a row, and of the row that it integrates to, beside the tolerance. */
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

/* The root mean square over lanes and rows. */
static double mean(quad squares, int64_t rows)
{
    return sqrt((squares[0] + squares[1] + squares[2] + squares[3])/(double)(S*rows));
}

/* Stages of the rows that follow from slopes; returns how far they are from those `before`,
 * beside the tolerance, and leaves their rounding error in `noise`. */
static double stages(lagrange_run *run, double h, const double *before, double *y)
{
    const int64_t n = DIM(run), first = first_row(run);
    const double *const hi = lagrange_row(run, START_HI), *const low = lagrange_row(run, START_LOW);
    const double *const f = lagrange_row(run, SLOPES), *const weight = lagrange_row(run, WEIGHT);
    quad changes = {0.0}, sizes = {0.0}, sum;
    int64_t i;
    int k;
    for (i = first; i < n; ++i) {
        for (k = 0; k < QUADS; ++k) {
            quad now, change, size;
            multiply(gauss_a, f + S*i, k, &sum);
            now = hi[i] + (low[i] + h*sum);
            change = (now - const_quads(before + S*i)[k])*weight[i];
            size = now*weight[i];
            changes += change*change;
            sizes += size*size;
            quads(y + S*i)[k] = now;
        }
    }
    run->noise = 0x1p-51*mean(sizes, n - first);
    return mean(changes, n - first);
}

/* Stages of the rows that are integrals of the others. */
static void integrals(const lagrange_run *run, double h, double *y)
{
    const int64_t first = first_row(run);
    const double *const hi = lagrange_row(run, START_HI), *const low = lagrange_row(run, START_LOW);
    const double *const f = lagrange_row(run, SLOPES);
    quad sum;
    int64_t i;
    int k;
    for (i = 0; i < first; ++i) {
        const double v = h*(hi[first + i] + low[first + i]);
        for (k = 0; k < QUADS; ++k) {
            multiply(gauss_aa, f + S*(first + i), k, &sum);
            quads(y + S*i)[k] = hi[i] + (low[i] + (v*const_quads(gauss_node)[k] + h*h*sum));
        }
    }
}

/* Slopes to begin with: those of the last step continued, or the slope at the start. */
static void predict(lagrange_run *run, double h)
{
    const double ratio = run->mode & STARTED ? h/(run->t_new - run->t_old) : 0.0;
    const double origin = run->mode & STARTED ? 1.0 : 0.0;
    const double *const shape = lagrange_row(run, SHAPE);
    double *const f = lagrange_row(run, SLOPES);
    int64_t i;
    int j, k;
    for (i = first_row(run); i < DIM(run); ++i) {
        for (k = 0; k < QUADS; ++k) {
            const quad x = origin + 2.0*ratio*const_quads(gauss_node)[k];
            quad sum = x*shape[S*i + S - 1];
            for (j = S - 2; j > 0; --j) {
                sum = (sum + shape[S*i + j])*x;
            }
            quads(f + S*i)[k] = sum + shape[S*i];
        }
    }
}

/* Rows of SLOPES as polynomials. */
static void fit(lagrange_run *run, int64_t from, int64_t to, double *shape)
{
    const double *const f = lagrange_row(run, SLOPES);
    quad sum;
    int64_t i;
    int k;
    for (i = from; i < to; ++i) {
        for (k = 0; k < QUADS; ++k) {
            multiply(gauss_power, f + S*i, k, &sum);
            quads(shape + S*i)[k] = sum;
        }
    }
}

/* The slope as a polynomial, and how its expansion in Legendre polynomials ends: the error
 * beside the tolerance, or beside the rounding of the stages where that is larger. */
static double estimate(lagrange_run *run, double h)
{
    const int64_t n = DIM(run), first = first_row(run);
    const double *const weight = lagrange_row(run, WEIGHT);
    double *const shape = lagrange_row(run, NEW_SHAPE);
    double last = 0.0, before = 0.0;
    int64_t i;
    fit(run, first, n, shape);
    for (i = first; i < n; ++i) {
        last += square(shape[S*i + S - 1]*weight[i]);
        before += square(shape[S*i + S - 2]*weight[i]);
    }
    last = gauss_last*h*sqrt(last/(double)(n - first));
    before = gauss_before*h*sqrt(before/(double)(n - first));
    return CAUTION*last*(last < before ? last/before : 1.0)/fmax(1.0, run->noise);
}

/* The factor by which an iteration is expected to shrink errors: as in the last step, and more if
 * the step is longer. */
static double expected_rate(const lagrange_run *run, double h)
{
    const double ratio = h/(run->t_new - run->t_old);
    const double rate = run->mode & STARTED && ratio > 1.0 ? run->rate*ratio*ratio : run->rate;
    return rate < 0.5 ? rate : 0.5;
}

/* Solve the equations of a step of h: stages that slopes were last evaluated at, and those that
 * follow from these. Returns the error beside the tolerance, not a number without convergence. */
static double solve(lagrange_run *run, double h, const double **at, const double **next)
{
    double *old = lagrange_row(run, STAGES), *new = lagrange_row(run, OTHER_STAGES);
    double before = HUGE_VAL, rate = expected_rate(run, h), error = 0.0;
    int k;
    *at = *next = new;
    weigh(run, h);
    predict(run, h);
    stages(run, h, old, new);
    integrals(run, h, new);
    for (k = 0; k < MOST_ITERATIONS && rate < 0.9; ++k) {
        double *const older = old;
        double change;
        old = new;
        new = older;
        if (evaluate(run, h, old)) {
            return NAN;
        }
        if (k == 0 && run->mode & STARTED && (error = estimate(run, h)) > 1.0) {
            return error;
        }
        change = stages(run, h, old, new);
        integrals(run, h, new);
        rate = k ? change/before : rate;
        if (change*rate < LEFT*(1.0 - rate) || change < run->noise
            || (k > 1 && rate > 0.5 && change < STALLED*run->noise)) {
            run->rate = rate < 1e-3 ? 1e-3 : rate < 0.5 ? rate : 0.5;
            *at = old;
            *next = new;
            return estimate(run, h);
        }
        before = change;
    }
    return NAN;
}

/* True if the first half of the slopes is the second half of the stages they belong to. */
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

/* The end of the step, and the slope as a polynomial, from the stages that the slopes gave;
 * not 0 where the end is not finite. */
static int finish(lagrange_run *run, double h, const double *y)
{
    const int64_t n = DIM(run), first = first_row(run);
    const double *const hi = lagrange_row(run, HI), *const rest = lagrange_row(run, START_LOW);
    double *const f = lagrange_row(run, SLOPES), *const low = lagrange_row(run, LOW);
    double *const shape = lagrange_row(run, SHAPE);
    const double *const new_shape = lagrange_row(run, NEW_SHAPE);
    double zero = 0.0;
    int64_t i;
    int k;
    for (i = 0; i < S*first; ++i) {
        f[i] = y[S*first + i];
    }
    for (i = 0; i < n; ++i) {
        quad sum = const_quads(gauss_weight)[0]*const_quads(f + S*i)[0];
        for (k = 1; k < QUADS; ++k) {
            sum += const_quads(gauss_weight)[k]*const_quads(f + S*i)[k];
        }
        low[i] = rest[i] + h*((sum[0] + sum[1]) + (sum[2] + sum[3]));
        zero += 0.0*(hi[i] + low[i]);
    }
    fit(run, 0, first, shape);
    for (i = S*first; i < S*n; ++i) {
        shape[i] = new_shape[i];
    }
    return zero != 0.0;
}

/* The factor by which a step may change: the interpolant is of order 9. */
static double factor(double error)
{
    return error > 0.0 ? fmin(0.9*pow(error, -1.0/9.0), GROW) : GROW;
}

static int step(lagrange_run *run, double limit)
{
    const double t = run->t, smallest = 10.0*(nextafter(t, HUGE_VAL) - t);
    double h = fmax(fmin(run->h, run->max_step), smallest);
    lagrange_depart(run, SCALE);
    for (;;) {
        const double *at, *next;
        double error, t_new;
        if (!(h >= smallest)) {
            return LAGRANGE_UNDERFLOW;
        }
        t_new = fmin(t + h, limit);
        h = t_new - t;
        error = solve(run, h, &at, &next);
        if (error <= 1.0 && !(run->mode & FIRST_ORDER) && !second_order(run, at)) {
            run->mode |= FIRST_ORDER;
        } else if (error <= 1.0) {
            if (finish(run, h, next)) {
                return lagrange_stay(run, LAGRANGE_NOT_FINITE);
            }
            if (lagrange_project(run, t_new, lagrange_row(run, START_HI), lagrange_row(run, LOW),
                                 lagrange_row(run, SPARE))) {
                return lagrange_stay(run, LAGRANGE_UNMET);
            }
            run->mode |= STARTED;
            run->h = h*factor(error);
            return lagrange_reach(run, t_new);
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

/* Stand at (t, hi + low); not 0 where the right-hand side does not exist there. */
static int stand(lagrange_run *run)
{
    const int64_t n = DIM(run);
    double *const shape = lagrange_row(run, SHAPE), *const slope = lagrange_row(run, SPARE);
    int64_t i;
    if (lagrange_slope(run, run->t, lagrange_row(run, HI), SPARE)) {
        return 1;
    }
    for (i = 0; i < n; ++i) {
        shape[S*i] = slope[i];
    }
    run->rate = 0.1;
    run->mode = n%2 ? FIRST_ORDER : 0;
    return 0;
}

LAGRANGE_INTERPOLATING_METHOD(gauss, stand, step, interpolate)
