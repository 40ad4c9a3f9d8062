/* Functions of the samples of many motions: states of n numbers, coordinates first. */
#include "numbers.h"
#include <stdint.h>

typedef int (*lagrange_function)(double t, const double *y, const double *u, const void *p,
                                 double *work, double *out);

/* The same at EIGHT states at once; the state is the last index of t, y and out. */
typedef int (*lagrange_lanes)(const double *t, const double *y, const double *u, const void *p,
                              double *work, double *out);
enum { EIGHT = 8 };

/* Values of one state after the other; what does not exist becomes no number. */
static void one_by_one(lagrange_function f, int64_t count, const double *t, const double *y,
                       int64_t n, const double *p, double *work, double *out, int64_t columns)
{
    double *const state = work, *const row = state + n;
    int64_t j, k;
    for (j = 0; j < count; ++j) {
        int bad;
        for (k = 0; k < n; ++k) {
            state[k] = y[EIGHT*k + j];
        }
        bad = f(t[j], state, 0, p, row + columns, row);
        for (k = 0; k < columns; ++k) {
            out[EIGHT*k + j] = bad ? NAN : row[k];
        }
    }
}

/* A function at all samples of all members, the column the first index of out; velocities are
 * taken times `moving`. `lanes` may be null; the workspace has (EIGHT + 1)(n + columns) + EIGHT
 * numbers more than the function's. */
void lagrange_members_table(lagrange_function f, lagrange_lanes lanes, int64_t members,
                            int64_t samples, const double *times, const double *states, int64_t n,
                            double moving, const double *p, int64_t parameters, double *work,
                            double *out, int64_t columns)
{
    double *const t = work, *const y = t + EIGHT, *const row = y + EIGHT*n;
    double *const function_work = row + EIGHT*columns;
    int64_t i, j, k, l;
    for (i = 0; i < members; ++i) {
        const double *const member = states + i*samples*n, *const member_p = p + i*parameters;
        for (j = 0; j < samples; j += EIGHT) {
            const int64_t count = samples - j < EIGHT ? samples - j : EIGHT;
            for (l = 0; l < EIGHT; ++l) {
                const int64_t at = l < count ? j + l : j;
                t[l] = times[at];
                for (k = 0; k < n; ++k) {
                    y[EIGHT*k + l] = k < n/2 ? member[at*n + k] : moving*member[at*n + k];
                }
            }
            if (!lanes || lanes(t, y, 0, member_p, function_work, row)) {
                one_by_one(f, count, t, y, n, member_p, function_work, row, columns);
            }
            for (k = 0; k < columns; ++k) {
                for (l = 0; l < count; ++l) {
                    out[(k*members + i)*samples + j + l] = row[EIGHT*k + l];
                }
            }
        }
    }
}

/* The largest distance of each number of each member: of coordinates from `origin`, 0 or 1 times
 * the start, of velocities from 0. Not a number where one is none. */
void lagrange_members_extent(int64_t members, int64_t samples, int64_t n, const double *states,
                             double origin, double *extent)
{
    int64_t i, j, k;
    for (i = 0; i < members; ++i) {
        const double *const member = states + i*samples*n;
        for (k = 0; k < n; ++k) {
            const double from = k < n/2 ? origin*member[k] : 0.0;
            double largest = 0.0, zero = 0.0;
            for (j = 0; j < samples; ++j) {
                const double size = fabs(member[j*n + k] - from);
                largest = size > largest ? size : largest;
                zero += 0.0*size;
            }
            extent[i*n + k] = largest + zero;
        }
    }
}

/* The largest weighted sum of distances of companions from each run, of each number. */
void lagrange_members_errors(int64_t members, int64_t samples, int64_t n, const double *states,
                             int64_t companions, const double *const *others,
                             const double *weights, double *errors)
{
    int64_t i, j, k, l;
    for (i = 0; i < members; ++i) {
        for (k = 0; k < n; ++k) {
            double largest = 0.0, zero = 0.0;
            for (j = 0; j < samples; ++j) {
                const int64_t at = (i*samples + j)*n + k;
                double error = 0.0;
                for (l = 0; l < companions; ++l) {
                    error += weights[l]*fabs(others[l][at] - states[at]);
                }
                largest = error > largest ? error : largest;
                zero += 0.0*error;
            }
            errors[i*n + k] = largest + zero;
        }
    }
}
