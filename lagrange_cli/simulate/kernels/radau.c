/* Radau IIA with three stages, order 5, for stiff systems.
 *
 * Hairer, Wanner, Solving Ordinary Differential Equations II, IV.8: simplified Newton iterations
 * in coordinates in which the stages decouple into a real and a complex system, an embedded
 * estimate of the error, and Gustafsson's predictive choice of steps. If q' = v, the linear
 * systems have half the size. Between the ends of a step states are those of a shorter step to
 * there. The state is kept as hi + low.
 */
#include "radau.h"

enum { MOST_ITERATIONS = 7 };

/* The error that iterations may leave beside the tolerance. */
static const double LEFT = 1e-3;

/* Change in units of rounding at which iterations that stop to converge have reached the rounding
 * of the slopes, and of velocities that follow from positions. */
static const double STALLED = 2048.0, LOOSE = 4.0;

/* Jacobians are kept where iterations converge faster, factors where steps change less. */
static const double FAST = 1e-3, ALIKE = 1.2;

static const double SHRINK = 0.2, GROW = 8.0;

/* Nodes, and what leads to the real Jordan form of the stages' matrix and back. */
static const double node[3] = {0.155051025721682190180272, 0.644948974278317809819728, 1.0};
static const double to_stages[3][3] = {
    {0.0944387624889752414874901, -0.14125529502095420842799, 0.0300291941051474244918611},
    {0.250213122965333311376509, 0.204129352293799931995991, -0.382942112757261937795438},
    {1.0, 1.0, 0.0}
};
static const double from_stages[3][3] = {
    {4.17871859155190472734646, 0.327682820761062387082533, 0.523376445499449548039931},
    {-4.17871859155190472734646, -0.327682820761062387082533, 0.476623554500550451960069},
    {0.502872634945786875951247, -2.57192694985560542918679, 0.596039204828224924968822}
};
/* Matrix from Z to Q, and the weights of the estimate. */
static const double to_powers[3][3] = {
    {10.0488093998274155624603, -1.38214273316074889579366, 0.333333333333333333333333},
    {-25.6295914470766393867801, 10.2962581137433060534467, -2.66666666666666666666667},
    {15.5807820472492238243198, -8.91411538058255715765309, 3.33333333333333333333333}
};
static const double estimate[3] = {
    -10.0488093998274155624603, 1.38214273316074889579366, -0.333333333333333333333333
};

/* Rows `to` as sums of rows `from`. */
static void combine(const lagrange_run *run, const double matrix[3][3], int64_t from, int64_t to)
{
    const int64_t n = DIM(run);
    const double *const x = lagrange_row(run, from);
    double *const y = lagrange_row(run, to);
    int64_t i, j;
    for (j = 0; j < 3; ++j) {
        for (i = 0; i < n; ++i) {
            y[j*n + i] = matrix[j][0]*x[i] + matrix[j][1]*x[n + i] + matrix[j][2]*x[2*n + i];
        }
    }
}

/* The root mean square of rows beside the tolerance. */
static double mean(const lagrange_run *run, const double *x, int64_t rows)
{
    const int64_t n = DIM(run);
    const double *const weight = lagrange_row(run, WEIGHT);
    double sum = 0.0;
    int64_t i, j;
    for (j = 0; j < rows; ++j) {
        for (i = 0; i < n; ++i) {
            const double size = x[j*n + i]*weight[i];
            sum += size*size;
        }
    }
    return sqrt(sum/(double)(rows*n));
}

/* Slopes at the stages; not 0 where one does not exist. */
static int evaluate(lagrange_run *run, double t, double h)
{
    const int64_t n = DIM(run);
    const double *const hi = lagrange_row(run, START_HI), *const low = lagrange_row(run, START_LOW);
    double *const point = lagrange_row(run, POINT);
    int64_t i, j;
    for (j = 0; j < 3; ++j) {
        const double *const z = lagrange_row(run, Z + j);
        for (i = 0; i < n; ++i) {
            point[i] = hi[i] + (low[i] + z[i]);
        }
        if (lagrange_slope(run, t + node[j]*h, point, F + j)) {
            return 1;
        }
    }
    return 0;
}

/* One iteration; the size of the correction beside the tolerance. */
static double correct(const lagrange_run *run, double h)
{
    const int64_t n = DIM(run);
    double *const w = lagrange_row(run, W), *const d = lagrange_row(run, D);
    double size;
    int64_t i;
    combine(run, from_stages, F, D);
    for (i = 0; i < n; ++i) {
        const double x = w[n + i], y = w[2*n + i];
        d[i] -= gamma_real/h*w[i];
        d[n + i] -= (alpha*x + beta*y)/h;
        d[2*n + i] -= (alpha*y - beta*x)/h;
    }
    lagrange_radau_real(run, h, d);
    lagrange_radau_complex(run, h, d + n, d + 2*n);
    size = mean(run, d, 3);
    for (i = 0; i < 3*n; ++i) {
        w[i] += d[i];
    }
    combine(run, to_stages, W, Z);
    return size;
}

/* The rounding error of stages beside the tolerance: velocities follow from positions, over the
 * step, as precisely as these are known. */
static double rounding(const lagrange_run *run, double h)
{
    const int64_t half = DIM(run)/2;
    const double *const q = lagrange_row(run, START_HI);
    const double *const weight = lagrange_row(run, WEIGHT) + half;
    double sum = 0.0;
    int64_t i;
    for (i = 0; i < half && run->mode & SECOND_ORDER; ++i) {
        const double size = q[i]*weight[i];
        sum += size*size;
    }
    return STALLED*run->noise + LOOSE*0x1p-51*gamma_real/h*sqrt(sum/(double)DIM(run));
}

/* Solve for Z from what stands there; the number of iterations, 0 without convergence, which is
 * not judged by the first ones, as many as patience says. */
static int solve(lagrange_run *run, double t, double h, int patience)
{
    const double noise = run->noise;
    double before = 0.0, rate = 0.5;
    int k;
    combine(run, from_stages, Z, W);
    for (k = 0; k < MOST_ITERATIONS; ++k) {
        double size;
        if (evaluate(run, t, h)) {
            return 0;
        }
        size = correct(run, h);
        rate = k ? fmax(size/before, 1e-8) : rate;
        if ((k && (size*rate < LEFT*(1.0 - rate) || size < noise)) || size == 0.0 ||
            (k > 1 && rate > 0.5 && size < rounding(run, h))) {
            run->rate = k ? rate : 0.0;
            return k + 1;
        }
        if (k > patience && !(size < LEFT) &&
            (!(rate < 1.0) || size*pow(rate, MOST_ITERATIONS - 1 - k) > LEFT*(1.0 - rate))) {
            return 0;
        }
        before = size;
    }
    run->rate = 1.0;
    return before < LEFT ? k : 0;
}

/* Stages at parts c of h from where the last step began, on its polynomial; `ahead`: from its end. */
static void predict(const lagrange_run *run, double h, int ahead)
{
    const int64_t n = DIM(run);
    const double *const q = lagrange_row(run, Q);
    double *const z = lagrange_row(run, Z);
    const double ratio = run->mode & STARTED ? h/(run->t_new - run->t_old) : 0.0;
    int64_t i, j;
    for (j = 0; j < 3; ++j) {
        const double x = ratio*node[j] + (ahead ? 1.0 : 0.0);
        for (i = 0; i < n; ++i) {
            const double end = ahead ? q[i] + q[n + i] + q[2*n + i] : 0.0;
            const double at = x*(q[i] + x*(q[n + i] + x*q[2*n + i]));
            z[j*n + i] = run->mode & STARTED ? at - end : 0.0;
        }
    }
}

/* Into ERROR what the embedded method differs by; its size beside the
 * tolerance, or beside the rounding of the state where that is larger. `again`: seen
 * from a state that it has moved, where it would be too pessimistic. */
static double embedded(lagrange_run *run, double t, double h, int again)
{
    const int64_t n = DIM(run);
    const double *const z = lagrange_row(run, Z), *const f = lagrange_row(run, again ? F : SLOPE);
    const double *const hi = lagrange_row(run, START_HI);
    double *const error = lagrange_row(run, ERROR), *const point = lagrange_row(run, POINT);
    int64_t i;
    if (again) {
        for (i = 0; i < n; ++i) {
            point[i] = hi[i] + error[i];
        }
        if (lagrange_slope(run, t, point, F)) {
            return NAN;
        }
    }
    for (i = 0; i < n; ++i) {
        error[i] = f[i] + (estimate[0]*z[i] + estimate[1]*z[n + i] + estimate[2]*z[2*n + i])/h;
    }
    lagrange_radau_real(run, h, error);
    return mean(run, error, 1)/fmax(1.0, run->noise);
}

static void begin(lagrange_run *run)
{
    double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double *const start = lagrange_row(run, START_HI), *const rest = lagrange_row(run, START_LOW);
    double *const weight = lagrange_row(run, WEIGHT), *const moved = lagrange_row(run, MOVED);
    const double *const first = lagrange_row(run, FIRST);
    int64_t i;
    lagrange_fold(hi, low, DIM(run));
    for (i = 0; i < DIM(run); ++i) {
        start[i] = hi[i];
        rest[i] = low[i];
        weight[i] = 1.0/(run->atol[i] + run->rtol[i]*fabs(hi[i]));
        moved[i] = fmax(moved[i], fabs(hi[i] - first[i]));
    }
    run->noise = 0x1p-51*mean(run, hi, 1);
}

/* The end of the step into LOW, on the constraints, and its slope; not 0 where they do not exist. */
static int settle(lagrange_run *run, double t)
{
    const double *const hi = lagrange_row(run, START_HI), *const rest = lagrange_row(run, START_LOW);
    const double *const z = lagrange_row(run, Z + 2);
    double *const low = lagrange_row(run, LOW), *const point = lagrange_row(run, POINT);
    double zero = 0.0;
    int64_t i;
    for (i = 0; i < DIM(run); ++i) {
        low[i] = rest[i] + z[i];
        point[i] = hi[i] + low[i];
        zero += 0.0*point[i];
    }
    return zero != 0.0 || lagrange_project(run, t, hi, low, point) || lagrange_slope(run, t, point, F);
}

/* The factor by which the next step should change, after Gustafsson. */
static double change_of(const lagrange_run *run, double h, double error, int iterations)
{
    const double safety = 0.9*(2*MOST_ITERATIONS + 1)/(2*MOST_ITERATIONS + iterations);
    const double before = *lagrange_row(run, ERROR_BEFORE);
    double by = error > 0.0 ? pow(error, -0.25) : GROW;
    if (run->mode & STARTED && before > 0.0 && error > 0.0) {
        by *= fmin(1.0, h/(run->t_new - run->t_old)*pow(before/error, 0.25));
    }
    return fmin(fmax(safety*by, SHRINK), GROW);
}

static int accept(lagrange_run *run, double t_new, double h, double error, int iterations)
{
    const int64_t n = DIM(run);
    double *const f = lagrange_row(run, SLOPE), *const end = lagrange_row(run, F);
    double by = change_of(run, h, error, iterations);
    int64_t i;
    for (i = 0; i < n; ++i) {
        f[i] = end[i];
    }
    combine(run, to_powers, Z, Q);
    *lagrange_row(run, ERROR_BEFORE) = error;
    run->mode = (run->mode | STARTED) & ~CURRENT;
    if (iterations > 2 && run->rate > FAST) {
        run->mode |= WORN;
    } else if (by < ALIKE) {
        by = 1.0;
    }
    run->h = h*by;
    return lagrange_reach(run, t_new);
}

static int step(lagrange_run *run, double limit)
{
    const double t = run->t, smallest = 10.0*(nextafter(t, HUGE_VAL) - t);
    double h = fmax(fmin(run->h, run->max_step), smallest);
    int rejected = !(run->mode & STARTED);
    begin(run);
    for (;;) {
        double t_new, error = NAN;
        int iterations = 0;
        if (!(h >= smallest)) {
            return lagrange_stay(run, LAGRANGE_UNDERFLOW);
        }
        t_new = fmin(t + h, limit);
        h = t_new - t;
        if (run->mode & WORN ? !lagrange_radau_renew(run, t, h) : !lagrange_radau_factor(run, h)) {
            predict(run, h, 1);
            iterations = solve(run, t, h, 0);
        }
        if (!iterations && !(run->mode & (CURRENT | WORN))) {
            run->mode |= WORN; /* the same again with a new Jacobian */
            continue;
        }
        if (iterations) {
            error = embedded(run, t, h, 0);
            error = error >= 1.0 && rejected ? embedded(run, t, h, 1) : error;
        }
        if (error < 1.0 && !settle(run, t_new)) {
            return accept(run, t_new, h, error, iterations);
        }
        h *= error >= 1.0 ? fmin(change_of(run, h, error, iterations), 0.9) : 0.5;
        rejected = 1;
        run->rejections += 1;
    }
}

/* Z of a shorter step from where the last one began, with its Jacobian, or one taken there. */
static int shorter(lagrange_run *run, double h)
{
    const double rate = run->rate;
    int failed;
    predict(run, h, 0);
    failed = lagrange_radau_factor(run, h) || !solve(run, run->t_old, h, 2);
    if (failed) {
        failed = lagrange_radau_renew(run, run->t_old, h);
        predict(run, h, 0);
        failed = failed || !solve(run, run->t_old, h, 2);
        run->mode |= WORN;
    }
    run->rate = rate;
    return failed;
}

static int interpolate(lagrange_run *run, double t, double *out)
{
    const double *const hi = lagrange_row(run, START_HI);
    const int at_end = t == run->t_new && t == run->t, at_start = !(t > run->t_old);
    const int failed = !at_end && !at_start && shorter(run, t - run->t_old);
    const double *const z = lagrange_row(run, Z + 2), *const end = lagrange_row(run, LOW);
    const double *const low = lagrange_row(run, START_LOW);
    int64_t i;
    for (i = 0; i < DIM(run); ++i) {
        out[i] = hi[i] + (at_end ? end[i] : at_start ? low[i] : low[i] + z[i]);
    }
    return failed;
}

/* Stand at (t, hi + low); not 0 where the right-hand side does not exist there. */
static int stand(lagrange_run *run)
{
    const double *const hi = lagrange_row(run, HI);
    double *const first = lagrange_row(run, FIRST);
    int64_t i;
    if (!run->steps) {
        for (i = 0; i < DIM(run); ++i) {
            first[i] = hi[i];
        }
    }
    run->mode = WORN;
    run->rate = 0.5;
    return lagrange_slope(run, run->t, hi, SLOPE);
}

LAGRANGE_INTERPOLATING_METHOD(radau, stand, step, interpolate)
