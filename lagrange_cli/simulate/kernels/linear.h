/* Dense linear systems, real or complex, by Gaussian elimination with row pivoting.
 *
 * Matrices have rows of m numbers; `im` is null where there are no imaginary parts. */
#ifndef LAGRANGE_LINEAR_H
#define LAGRANGE_LINEAR_H

#include "kernel.h"

static inline void linear_swap(double *x, double *y, int64_t m)
{
    int64_t i;
    for (i = 0; i < m; ++i) {
        const double kept = x[i];
        x[i] = y[i];
        y[i] = kept;
    }
}

/* The row from k on with the largest entry in column k, in units of each row's weight. */
static inline int64_t linear_pivot(int64_t m, int64_t k, const double *re, const double *im,
                                   const double *weight)
{
    double largest = -1.0;
    int64_t i, pivot = k;
    for (i = k; i < m; ++i) {
        const double size = weight[i]*(fabs(re[i*m + k]) + (im ? fabs(im[i*m + k]) : 0.0));
        if (size > largest) {
            largest = size;
            pivot = i;
        }
    }
    return pivot;
}

/* row -= factor * pivot's row, from column k on. */
static inline void linear_eliminate(int64_t m, int64_t k, double a, double b, double *restrict re,
                                    double *restrict im, const double *restrict pivot_re,
                                    const double *restrict pivot_im)
{
    int64_t j;
    if (!im) {
        for (j = k; j < m; ++j) {
            re[j] -= a*pivot_re[j];
        }
        return;
    }
    for (j = k; j < m; ++j) {
        re[j] -= a*pivot_re[j] - b*pivot_im[j];
        im[j] -= a*pivot_im[j] + b*pivot_re[j];
    }
}

/* Factors in place of the matrix; not 0 where it is singular.
 *
 * weight: m numbers, what a unit of each row counts, so that pivots do not depend on units.
 * swaps: receives the rows that are exchanged. own_weight: workspace of m numbers. */
static inline int linear_factor(int64_t m, double *re, double *im, const double *weight,
                                double *swaps, double *own_weight)
{
    int64_t i, k;
    for (i = 0; i < m; ++i) {
        own_weight[i] = weight[i];
    }
    for (k = 0; k < m; ++k) {
        const int64_t pivot = linear_pivot(m, k, re, im, own_weight);
        double x, y, size;
        swaps[k] = (double)pivot;
        linear_swap(own_weight + k, own_weight + pivot, 1);
        linear_swap(re + k*m, re + pivot*m, m);
        if (im) {
            linear_swap(im + k*m, im + pivot*m, m);
        }
        x = re[k*m + k];
        y = im ? im[k*m + k] : 0.0;
        size = x*x + y*y;
        if (!(size > 0.0) || !(size < HUGE_VAL)) {
            return 1;
        }
        for (i = k + 1; i < m; ++i) {
            const double u = re[i*m + k], v = im ? im[i*m + k] : 0.0;
            const double a = (u*x + v*y)/size, b = (v*x - u*y)/size;
            if (u == 0.0 && v == 0.0) {
                continue; /* in chains and nets most are */
            }
            linear_eliminate(m, k + 1, a, b, re + i*m, im ? im + i*m : 0, re + k*m,
                             im ? im + k*m : 0);
            re[i*m + k] = a;
            if (im) {
                im[i*m + k] = b;
            }
        }
    }
    return 0;
}

/* Solve in place with those factors. */
static inline void linear_solve(int64_t m, const double *re, const double *im, const double *swaps,
                                double *x, double *y)
{
    int64_t i, j;
    for (i = 0; i < m; ++i) {
        const int64_t pivot = (int64_t)swaps[i];
        linear_swap(x + i, x + pivot, 1);
        if (im) {
            linear_swap(y + i, y + pivot, 1);
        }
    }
    for (i = 0; i < m; ++i) {
        for (j = 0; j < i; ++j) {
            x[i] -= re[i*m + j]*x[j] - (im ? im[i*m + j]*y[j] : 0.0);
            if (im) {
                y[i] -= re[i*m + j]*y[j] + im[i*m + j]*x[j];
            }
        }
    }
    for (i = m - 1; i >= 0; --i) {
        double a, b, u, v;
        for (j = i + 1; j < m; ++j) {
            x[i] -= re[i*m + j]*x[j] - (im ? im[i*m + j]*y[j] : 0.0);
            if (im) {
                y[i] -= re[i*m + j]*y[j] + im[i*m + j]*x[j];
            }
        }
        a = re[i*m + i];
        b = im ? im[i*m + i] : 0.0;
        u = x[i];
        v = im ? y[i] : 0.0;
        x[i] = (u*a + v*b)/(a*a + b*b);
        if (im) {
            y[i] = (v*a - u*b)/(a*a + b*b);
        }
    }
}

#endif
