/* Shared by the two files of Radau IIA: rows of the memory, and the systems of a step. */
#ifndef LAGRANGE_RADAU_H
#define LAGRANGE_RADAU_H

#include "kernel.h"

/* Rows of the memory; behind them there are 4 n more, for matrices. */
enum {
    SLOPE = FIRST_OF_METHOD, /* at the start of the step, then at its end */
    Q,                       /* coefficients of x, x^2, x^3 of the collocation polynomial */
    WEIGHT = Q + 3,          /* one over what an error may be */
    FIRST,                   /* where the run began */
    MOVED,                   /* how far each number has come from there */
    MOVES,                   /* what differences move it by */
    FACTORED_FOR,            /* first number: the step of the factors */
    ERROR_BEFORE,            /* first number: of the last step */
    /* From here on nothing is kept for the next Jacobian, which takes 16 rows to be found. */
    Z,             /* how far stages are from the start */
    W = Z + 3,     /* the same, decoupled */
    F = W + 3,     /* slopes at the stages */
    D = F + 3,     /* residuals, then corrections of W */
    POINT = D + 3,
    CHANGE,        /* a correction of positions */
    ERROR,
    SWAPS,         /* two rows: pivots of the real and the complex system */
    JACOBIAN = SWAPS + 2,
    ROWS = JACOBIAN
};

/* Bits of the mode: there is a last step; the Jacobian is that at the start of the step, or is
 * to be taken anew; its factors are there; q' = v. */
enum { STARTED = 1, CURRENT = 2, WORN = 4, FACTORED = 8, SECOND_ORDER = 16 };

/* Eigenvalues gamma and alpha -+ i beta of the inverse of the stages' matrix. */
static const double gamma_real = 3.63783425274449573220842;
static const double alpha = 2.68108287362775213389579, beta = 3.05043019924741056942638;

/* Factors of gamma/h - J and (alpha - i beta)/h - J; not 0 where they do not exist. */
int lagrange_radau_factor(lagrange_run *run, double h);

/* The same of a new Jacobian at t and the start of the step. */
int lagrange_radau_renew(lagrange_run *run, double t, double h);

/* Solve those systems in place. */
void lagrange_radau_real(const lagrange_run *run, double h, double *x);
void lagrange_radau_complex(const lagrange_run *run, double h, double *re, double *im);

#endif
