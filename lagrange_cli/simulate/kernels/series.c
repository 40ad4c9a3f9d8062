/* Taylor series of one order, for arithmetic in which methods of low order make too many steps.
 *
 * Jorba, Zou, Experiment. Math. 14 (2005) 99: the step follows from the last two coefficients.
 * It is halved where the slope at its end is not that of the series. hi + low as in dop853.c.
 */
#include "kernel.h"

/* The order, the best one for tolerances from 1e-17 to 1e-33 within a tenth; and rows of the
 * memory: coefficient k of number i is at c[k*series_rows + i]. */
enum { ORDER = 28, SLOPE = FIRST_OF_METHOD, POINT, COEFFICIENTS, ROWS = COEFFICIENTS };

/* Difference of slopes at the end of a step, as a multiple of the tolerance and of rounding. */
#define DIFFERENCE 64.0
#define ROUNDING 1024.0

static double *coefficients(const lagrange_run *run)
{
    return lagrange_row(run, COEFFICIENTS);
}

static void begin(lagrange_run *run)
{
    const int64_t n = DIM(run), rows = run->series_rows;
    double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double *const start = lagrange_row(run, START_HI), *const rest = lagrange_row(run, START_LOW);
    double *const c = coefficients(run);
    int64_t i;
    lagrange_fold(hi, low, n);
    for (i = 0; i < n; ++i) {
        start[i] = c[i] = hi[i];
        rest[i] = low[i];
    }
    c[n] = run->t;
    c[rows + n] = 1.0;
    run->series(ORDER, (const double *)run->p, c);
    run->evaluations += ORDER;
}

static double weight(const lagrange_run *run, int64_t i)
{
    return run->atol[i] + run->rtol[i]*fabs(lagrange_row(run, START_HI)[i]);
}

/* The step at whose end neither of the last two terms is larger than the tolerance; not a number
 * where the series does not exist. */
static double length(const lagrange_run *run)
{
    const int64_t n = DIM(run), rows = run->series_rows;
    const double *const c = coefficients(run) + ORDER*rows;
    double last = 0.0, before = 0.0, zero = 0.0;
    int64_t i;
    for (i = 0; i < n; ++i) {
        last = fmax(last, fabs(c[i])/weight(run, i));
        before = fmax(before, fabs(c[i - rows])/weight(run, i));
        zero += 0.0*(c[i] + c[i - rows]);
    }
    return fmin(pow(last, -1.0/ORDER), pow(before, -1.0/(ORDER - 1))) + zero;
}

/* The change of number i in a time x from the start of the step. */
static double change(const lagrange_run *run, int64_t i, double x)
{
    const double *const c = coefficients(run) + i;
    double sum = c[ORDER*run->series_rows];
    int64_t k;
    for (k = ORDER - 1; k > 0; --k) {
        sum = sum*x + c[k*run->series_rows];
    }
    return sum*x;
}

/* The slope of number i at that time. */
static double slope(const lagrange_run *run, int64_t i, double x)
{
    const double *const c = coefficients(run) + i;
    double sum = ORDER*c[ORDER*run->series_rows];
    int64_t k;
    for (k = ORDER - 1; k > 0; --k) {
        sum = sum*x + (double)k*c[k*run->series_rows];
    }
    return sum;
}

/* The end of a step of length h into LOW; not 0 where the series does not hold until there. */
static int finish(lagrange_run *run, double h)
{
    const int64_t n = DIM(run);
    const double *const hi = lagrange_row(run, HI), *const rest = lagrange_row(run, START_LOW);
    double *const low = lagrange_row(run, LOW), *const point = lagrange_row(run, POINT);
    const double *const end = lagrange_row(run, SLOPE);
    const double rounding = ROUNDING*(nextafter(1.0, 2.0) - 1.0);
    int64_t i;
    for (i = 0; i < n; ++i) {
        low[i] = rest[i] + change(run, i, h);
        point[i] = hi[i] + low[i];
    }
    if (lagrange_slope(run, run->t + h, point, SLOPE)) {
        return 1;
    }
    for (i = 0; i < n; ++i) {
        const double off = h*fabs(end[i] - slope(run, i, h));
        if (!(off <= DIFFERENCE*weight(run, i) + rounding*fabs(h*end[i]))) {
            return 1;
        }
    }
    return lagrange_project(run, run->t + h, hi, low, point);
}

static int step(lagrange_run *run, double limit)
{
    const double t = run->t, smallest = 10.0*(nextafter(t, HUGE_VAL) - t);
    double h;
    begin(run);
    h = length(run);
    h = h >= run->max_step ? run->max_step : h;
    for (;;) {
        double t_new;
        if (!(h >= smallest)) {
            return lagrange_stay(run, LAGRANGE_UNDERFLOW);
        }
        t_new = fmin(t + h, limit);
        h = t_new - t;
        if (!finish(run, h)) {
            run->h = h;
            return lagrange_reach(run, t_new);
        }
        h *= 0.5;
        run->rejections += 1;
    }
}

static int interpolate(lagrange_run *run, double t, double *out)
{
    const double *const hi = lagrange_row(run, START_HI);
    const double *const low = lagrange_row(run, START_LOW);
    int64_t i;
    for (i = 0; i < DIM(run); ++i) {
        out[i] = hi[i] + (low[i] + change(run, i, t - run->t_old));
    }
    return 0;
}

/* Stand at (t, hi + low); not 0 where the right-hand side does not exist there. */
static int stand(lagrange_run *run)
{
    return lagrange_slope(run, run->t, lagrange_row(run, HI), SLOPE);
}

LAGRANGE_INTERPOLATING_METHOD(series, stand, step, interpolate)
