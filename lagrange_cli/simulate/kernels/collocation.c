/* Gauss-Legendre collocation with two and three stages and a fixed step; hi + low as in dop853.c.
 *
 * The equations of a step are iterated until rounding stops each component
 * (Antonana, Makazaga, Murua, Numer. Algorithms 76 (2017) 861). */
#include "fixed.h"

enum { MOST = 3, SLOPES = FIRST_OF_METHOD, NEW_SLOPES = SLOPES + MOST, BEFORE = NEW_SLOPES + MOST,
       POINT = BEFORE + MOST, CHANGE, ROWS };

/* Distance of converged iterations, as a part of the change over the step. */
#define CONVERGED 9.5367431640625e-7

/* Nodes, matrix and weights, and the values one step later of the polynomial through slopes. */
typedef struct {
    int64_t stages;
    double nodes[MOST], weights[MOST], matrix[MOST*MOST], ahead[MOST*MOST];
} tableau;

static const tableau GAUSS4 = {
    2,
    {0.2113248654051871177454256, 0.7886751345948128822545744, 0.0},
    {0.5, 0.5, 0.0},
    {0.25, -0.03867513459481288225457439, 0.5386751345948128822545744, 0.25,
     0.0, 0.0, 0.0, 0.0, 0.0},
    {-0.7320508075688772935274463, 1.732050807568877293527446,
     -1.732050807568877293527446, 2.732050807568877293527446, 0.0, 0.0, 0.0, 0.0, 0.0}
};

static const tableau GAUSS6 = {
    3,
    {0.1127016653792583114820735, 0.5, 0.8872983346207416885179265},
    {0.2777777777777777777777778, 0.4444444444444444444444444, 0.2777777777777777777777778},
    {0.1388888888888888888888889, -0.03597666752493890345639547, 0.009789444015308326049580042,
     0.3002631949808645924380249, 0.2222222222222222222222222, -0.02248541720308681466024717,
     0.2679883337624694517281977, 0.4804211119693833479008399, 0.1388888888888888888888889},
    {0.4603499871259164481540679, -1.502688871723444153094313, 2.042338884597527704940245,
     2.042338884597527704940245, -5.666666666666666666666667, 4.624327782069138961726422,
     4.624327782069138961726422, -11.83064446160988918023902, 8.206316679540750218512599}
};

/* Slopes to begin with: the polynomial of the last step continued, if it was as long. */
static int guess(lagrange_run *run, const tableau *method, double h)
{
    const int64_t n = DIM(run), s = method->stages;
    double *const k = lagrange_row(run, SLOPES), *const new = lagrange_row(run, NEW_SLOPES);
    int64_t i, j, l;
    if (!run->mode || run->rate != h) {
        if (lagrange_slope(run, run->t, lagrange_row(run, HI), SLOPES)) {
            return 1;
        }
        for (j = 1; j < s; ++j) {
            for (i = 0; i < n; ++i) {
                k[j*n + i] = k[i];
            }
        }
        return 0;
    }
    for (j = 0; j < s; ++j) {
        for (i = 0; i < n; ++i) {
            new[j*n + i] = 0.0;
            for (l = 0; l < s; ++l) {
                new[j*n + i] += method->ahead[j*s + l]*k[l*n + i];
            }
        }
    }
    for (i = 0; i < s*n; ++i) {
        k[i] = new[i];
    }
    return 0;
}

/* Slopes of all stages anew; 0: they go on changing, 1: rounding has stopped them, 2: they end. */
static int iterate(lagrange_run *run, const tableau *method, double h)
{
    const int64_t n = DIM(run), s = method->stages;
    const double *const hi = lagrange_row(run, HI), *const low = lagrange_row(run, LOW);
    double *const k = lagrange_row(run, SLOPES), *const new = lagrange_row(run, NEW_SLOPES);
    double *const before = lagrange_row(run, BEFORE), *const point = lagrange_row(run, POINT);
    double zero = 0.0;
    int64_t i, j, l;
    int done = 1;
    for (j = 0; j < s; ++j) {
        for (i = 0; i < n; ++i) {
            double sum = 0.0;
            for (l = 0; l < s; ++l) {
                sum += method->matrix[j*s + l]*k[l*n + i];
            }
            point[i] = hi[i] + (low[i] + h*sum);
        }
        if (lagrange_slope(run, run->t + h*method->nodes[j], point, NEW_SLOPES + j)) {
            return 2;
        }
    }
    for (i = 0; i < s*n; ++i) {
        const double change = fabs(new[i] - k[i]);
        zero += 0.0*new[i];
        done = done && (change == 0.0 || change >= before[i]);
        before[i] = change > 0.0 && change < before[i] ? change : before[i];
        /* The change itself takes the place of the old slope until all are looked at. */
        k[i] = change;
    }
    return zero != 0.0 ? 2 : done;
}

/* Take the new slopes; not 0: the last changes, of what is at its end, are not rounding. */
static int settle(lagrange_run *run, const tableau *method, double h, int ended)
{
    const int64_t n = DIM(run), s = method->stages;
    const double *const hi = lagrange_row(run, HI);
    double *const k = lagrange_row(run, SLOPES), *const new = lagrange_row(run, NEW_SLOPES);
    int64_t i, j;
    int large = 0;
    for (i = 0; i < n; ++i) {
        double size = 0.0, change = 0.0;
        for (j = 0; j < s; ++j) {
            size = fmax(size, fabs(new[j*n + i]));
            change = fmax(change, k[j*n + i]);
            k[j*n + i] = new[j*n + i];
        }
        size = CONVERGED*h*size + 64.0*(nextafter(fabs(hi[i]), HUGE_VAL) - fabs(hi[i]));
        large = large || h*change > size;
    }
    return ended && large;
}

static int solve(lagrange_run *run, const tableau *method, double h)
{
    double *const before = lagrange_row(run, BEFORE);
    int64_t i;
    int round, done, calm = 0;
    for (i = 0; i < method->stages*DIM(run); ++i) {
        before[i] = HUGE_VAL;
    }
    if (guess(run, method, h)) {
        return LAGRANGE_NOT_FINITE;
    }
    for (round = 0; round < ITERATIONS; ++round) {
        done = iterate(run, method, h);
        if (done == 2) {
            return LAGRANGE_NOT_FINITE;
        }
        calm = done ? calm + 1 : 0;
        if (settle(run, method, h, calm == CALM)) {
            return LAGRANGE_DIVERGES;
        }
        if (calm == CALM) {
            return LAGRANGE_OK;
        }
    }
    return LAGRANGE_DIVERGES;
}

static int step(lagrange_run *run, const tableau *method, double limit)
{
    const int64_t n = DIM(run);
    const double t_new = fixed_end(run, limit);
    const double h = t_new - run->t; /* what t really moves by, rounding included */
    const double *const low = lagrange_row(run, LOW), *const k = lagrange_row(run, SLOPES);
    double *const change = lagrange_row(run, CHANGE);
    int64_t i, j;
    int status = solve(run, method, h);
    run->mode = 0;
    if (status) {
        return status;
    }
    for (i = 0; i < n; ++i) {
        double sum = 0.0;
        for (j = 0; j < method->stages; ++j) {
            sum += method->weights[j]*k[j*n + i];
        }
        change[i] = low[i] + h*sum;
    }
    status = fixed_arrive(run, t_new, change, lagrange_row(run, POINT));
    run->mode = !status && !run->project;
    run->rate = h;
    return status;
}

static int step_of_order_4(lagrange_run *run, double limit)
{
    return step(run, &GAUSS4, limit);
}

static int step_of_order_6(lagrange_run *run, double limit)
{
    return step(run, &GAUSS6, limit);
}

LAGRANGE_METHOD(gauss4, fixed_forget, step_of_order_4, 0)
LAGRANGE_METHOD(gauss6, fixed_forget, step_of_order_6, 0)
