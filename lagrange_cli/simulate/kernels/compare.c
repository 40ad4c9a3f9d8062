/* How far a run is from two others at the same samples. */
#include "kernel.h"

#include <math.h>

/* The larger one, and not a number where either is none. */
static inline double larger(double a, double b)
{
    return (b > a) | (b != b) ? b : a;
}

/* Of some samples of n + n numbers: the largest errors, by the weighted distances of two other
 * runs, the largest motions of coordinates from the start and speeds, and the largest sizes of
 * coordinates, where they are more than those before, which `largest` has in this order. */
void lagrange_compare(int64_t samples, int64_t n, const double *run, const double *one,
                      const double *two, const double *weights, const double *start,
                      double *largest)
{
    double *const moved = largest + 2*n, *const size = moved + 2*n;
    const double first = weights[0], second = weights[1];
    const double *const end = run + 2*n*samples;
    int64_t i;
    for (; run < end; run += 2*n, one += 2*n, two += 2*n) {
        for (i = 0; i < 2*n; ++i) {
            /* Rounded by itself: what is chosen is fused with no sum. The first weight is a power
             * of two, with which a fused sum rounds as two operations do. */
            const double other = larger(0.0, second*fabs(two[i] - run[i]));
            largest[i] = larger(largest[i], first*fabs(one[i] - run[i]) + other);
        }
        for (i = 0; i < n; ++i) {
            moved[i] = larger(moved[i], fabs(run[i] - start[i]));
            moved[n + i] = larger(moved[n + i], fabs(run[n + i]));
            size[i] = larger(size[i], fabs(run[i]));
        }
    }
}
