/* Jacobians and linear systems of Radau IIA (radau.c).
 *
 * Jacobians are finite differences, each number moved on the scale of its own motion, eight
 * states at once where the right-hand side has that form.
 */
#include "linear.h"
#include "radau.h"

/* By what differences move each number: between its motion and its size, so that neither
 * curvature nor rounding has a large part in them. */
static void choose_moves(const lagrange_run *run, double h)
{
    const double *const y = lagrange_row(run, START_HI), *const f = lagrange_row(run, SLOPE);
    const double *const moved = lagrange_row(run, MOVED), *const weight = lagrange_row(run, WEIGHT);
    double *const moves = lagrange_row(run, MOVES);
    int64_t j;
    for (j = 0; j < DIM(run); ++j) {
        const double size = fabs(y[j]), motion = fmax(fmax(moved[j], h*fabs(f[j])), 1.0/weight[j]);
        const double least = fmax(0x1p-40*size, 0x1p-26*fmax(motion, sqrt(motion)*sqrt(size)));
        const double by = least > 0.0 ? least : 0x1p-26;
        moves[j] = (y[j] + (f[j] < 0.0 ? -by : by)) - y[j];
    }
}

/* A column from the slope of a moved state and that of the state. */
static void set_column(const lagrange_run *run, int64_t j, const double *moved, const double *f,
                       int64_t stride)
{
    const int64_t n = DIM(run);
    const double by = lagrange_row(run, MOVES)[j];
    double *const jacobian = lagrange_row(run, JACOBIAN);
    int64_t i;
    for (i = 0; i < n; ++i) {
        jacobian[i*n + j] = (moved[i*stride] - f[i*stride])/by;
    }
}

/* Columns one by one; not 0 where a moved state has no slope, on neither side. */
static int columns_one_by_one(lagrange_run *run, double at)
{
    const int64_t n = DIM(run);
    double *const point = lagrange_row(run, POINT), *const moves = lagrange_row(run, MOVES);
    const double *const y = lagrange_row(run, START_HI), *const f = lagrange_row(run, D);
    const double *const moved = lagrange_row(run, ERROR);
    int64_t i, j;
    if (lagrange_slope(run, at, y, D)) {
        return 1;
    }
    for (i = 0; i < n; ++i) {
        point[i] = y[i];
    }
    for (j = 0; j < n; ++j) {
        point[j] = y[j] + moves[j];
        if (lagrange_slope(run, at, point, ERROR)) {
            moves[j] = -moves[j];
            point[j] = y[j] + moves[j];
            if (lagrange_slope(run, at, point, ERROR)) {
                return 1;
            }
        }
        set_column(run, j, moved, f, 1);
        point[j] = y[j];
    }
    return 0;
}

/* Seven columns at a time beside the state itself; not 0 where they have to be taken one by one. */
static int columns_at_once(lagrange_run *run, double at)
{
    enum { L = LAGRANGE_LANES };
    const int64_t n = DIM(run);
    const double *const y = lagrange_row(run, START_HI), *const moves = lagrange_row(run, MOVES);
    double *const states = lagrange_row(run, Z), *const slopes = states + n*L;
    double t[L];
    int64_t i, j, l;
    if (!run->lanes) {
        return 1;
    }
    for (l = 0; l < L; ++l) {
        t[l] = at;
    }
    for (j = 0; j < n; j += L - 1) {
        const int64_t count = n - j < L - 1 ? n - j : L - 1;
        for (i = 0; i < n; ++i) {
            for (l = 0; l < L; ++l) {
                states[i*L + l] = y[i];
            }
        }
        for (l = 0; l < count; ++l) {
            states[(j + l)*L + l + 1] = y[j + l] + moves[j + l];
        }
        run->evaluations += count + 1;
        if (run->lanes(t, states, run->u, run->p, run->work, slopes)) {
            return 1;
        }
        for (l = 0; l < count; ++l) {
            set_column(run, j + l, slopes + l + 1, slopes, L);
        }
    }
    return 0;
}

/* True if the Jacobian is that of q' = v, and finite. */
static int inspect(lagrange_run *run)
{
    const int64_t n = DIM(run), half = n/2;
    const double *const jacobian = lagrange_row(run, JACOBIAN);
    double zero = 0.0;
    int64_t i, j;
    int second = n == 2*half;
    for (i = 0; i < half; ++i) {
        for (j = 0; j < n; ++j) {
            second = second && jacobian[i*n + j] == (double)(j == half + i);
        }
    }
    for (i = 0; i < n*n; ++i) {
        zero += 0.0*jacobian[i];
    }
    run->mode = second ? run->mode | SECOND_ORDER : run->mode & ~SECOND_ORDER;
    return zero != 0.0;
}

static int differentiate(lagrange_run *run, double at, double h)
{
    choose_moves(run, h);
    if (columns_at_once(run, at) && columns_one_by_one(run, at)) {
        return 1;
    }
    run->mode = (run->mode | CURRENT) & ~(FACTORED | WORN);
    return inspect(run);
}

/* Linear systems: (lambda/h - J) x = r. If q' = v, with J = [0 1; A B] and r = [s, r], they
 * are (lambda^2/h^2 - lambda/h B - A) x = r + lambda/h s - B s and x' = lambda/h x - s. */

static int64_t size_of(const lagrange_run *run)
{
    return run->mode & SECOND_ORDER ? DIM(run)/2 : DIM(run);
}

static double *real_factors(const lagrange_run *run)
{
    return lagrange_row(run, JACOBIAN + DIM(run));
}

static double *complex_factors(const lagrange_run *run)
{
    return lagrange_row(run, JACOBIAN + 2*DIM(run));
}

/* The real system's matrix, and real and imaginary part of the other one's. */
static void fill(const lagrange_run *run, double h)
{
    const int64_t n = DIM(run), m = size_of(run), half = n - m;
    const double *const jacobian = lagrange_row(run, JACOBIAN);
    const double g = gamma_real/h, a = alpha/h, b = -beta/h;
    double *const real = real_factors(run);
    double *const re = complex_factors(run), *const im = re + m*m;
    int64_t i, j;
    for (i = 0; i < m; ++i) {
        for (j = 0; j < m; ++j) {
            const double *const entry = jacobian + (half + i)*n + j;
            const double one = i == j ? 1.0 : 0.0, rate = half ? entry[half] : 0.0;
            real[i*m + j] = (half ? g*(one*g - rate) : one*g) - entry[0];
            re[i*m + j] = (half ? a*(one*a - rate) - one*b*b : one*a) - entry[0];
            im[i*m + j] = half ? b*(2.0*one*a - rate) : one*b;
        }
    }
}

int lagrange_radau_factor(lagrange_run *run, double h)
{
    double *const kept = lagrange_row(run, FACTORED_FOR);
    const double *const weight = lagrange_row(run, WEIGHT);
    const int64_t m = size_of(run);
    double *const swaps = lagrange_row(run, SWAPS);
    if (run->mode & FACTORED && *kept == h) {
        return 0;
    }
    fill(run, h);
    *kept = h;
    run->mode |= FACTORED;
    return linear_factor(m, real_factors(run), 0, weight, swaps, lagrange_row(run, POINT)) ||
           linear_factor(m, complex_factors(run), complex_factors(run) + m*m, weight,
                         swaps + DIM(run), lagrange_row(run, POINT));
}

/* The right side of the systems of half the size: r + lambda/h s - B s, lambda = a + ib. */
static void fold_back(const lagrange_run *run, double a, double b, const double *re,
                      const double *im, double *out, double *out_im)
{
    const int64_t n = DIM(run), m = n/2;
    const double *const jacobian = lagrange_row(run, JACOBIAN);
    int64_t i, j;
    for (i = 0; i < m; ++i) {
        double x = re[m + i] + a*re[i], y = 0.0;
        if (im) {
            x -= b*im[i];
            y = im[m + i] + a*im[i] + b*re[i];
        }
        for (j = 0; j < m; ++j) {
            const double rate = jacobian[(m + i)*n + m + j];
            x -= rate*re[j];
            y -= im ? rate*im[j] : 0.0;
        }
        out[i] = x;
        if (im) {
            out_im[i] = y;
        }
    }
}

int lagrange_radau_renew(lagrange_run *run, double t, double h)
{
    return differentiate(run, t, h) || lagrange_radau_factor(run, h);
}

void lagrange_radau_real(const lagrange_run *run, double h, double *x)
{
    const int64_t m = size_of(run);
    const double *const swaps = lagrange_row(run, SWAPS);
    double *const q = lagrange_row(run, CHANGE);
    int64_t i;
    if (!(run->mode & SECOND_ORDER)) {
        linear_solve(m, real_factors(run), 0, swaps, x, 0);
        return;
    }
    fold_back(run, gamma_real/h, 0.0, x, 0, q, 0);
    linear_solve(m, real_factors(run), 0, swaps, q, 0);
    for (i = 0; i < m; ++i) {
        x[m + i] = gamma_real/h*q[i] - x[i];
        x[i] = q[i];
    }
}

void lagrange_radau_complex(const lagrange_run *run, double h, double *re, double *im)
{
    const int64_t m = size_of(run);
    const double *const factors = complex_factors(run);
    const double *const swaps = lagrange_row(run, SWAPS) + DIM(run);
    const double a = alpha/h, b = -beta/h;
    double *const q = lagrange_row(run, CHANGE), *const p = q + m;
    int64_t i;
    if (!(run->mode & SECOND_ORDER)) {
        linear_solve(m, factors, factors + m*m, swaps, re, im);
        return;
    }
    fold_back(run, a, b, re, im, q, p);
    linear_solve(m, factors, factors + m*m, swaps, q, p);
    for (i = 0; i < m; ++i) {
        re[m + i] = a*q[i] - b*p[i] - re[i];
        im[m + i] = a*p[i] + b*q[i] - im[i];
        re[i] = q[i];
        im[i] = p[i];
    }
}
