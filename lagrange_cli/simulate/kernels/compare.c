/* How far a run is from two others at the same samples. */
#include "kernel.h"

#include <math.h>

/* The larger one, and not a number where either is none. */
static double larger(double a, double b)
{
    return b > a || isnan(b) ? b : a;
}

/* Of some samples of n + n numbers: the largest errors, by the weighted distances of two other
 * runs, the largest motions of coordinates from the start and speeds, and the largest sizes of
 * coordinates, where they are more than those before, which `largest` has in this order. */
void lagrange_compare(int64_t samples, int64_t n, const double *run, const double *one,
                      const double *two, const double *weights, const double *start,
                      double *largest)
{
    double *const moved = largest + 2*n, *const size = moved + 2*n;
    int64_t i, k;
    for (k = 0; k < samples; ++k) {
        for (i = 0; i < 2*n; ++i) {
            const double here = run[2*n*k + i], first = fabs(one[2*n*k + i] - here);
            /* Rounded by itself, whatever the compiler may fuse. */
            const volatile double second = weights[1]*fabs(two[2*n*k + i] - here);
            largest[i] = larger(largest[i], weights[0]*first + second);
            moved[i] = larger(moved[i], fabs(i < n ? here - start[i] : here));
            if (i < n) {
                size[i] = larger(size[i], fabs(here));
            }
        }
    }
}
