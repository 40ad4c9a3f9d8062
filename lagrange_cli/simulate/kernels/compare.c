/* How far a run is from two others at the same samples. */
#include "kernel.h"


/* The larger one, and not a number where either is none. */
static inline double larger(double a, double b)
{
    return (b > a) | (b != b) ? b : a;
}

/* Of some samples of `width` numbers, n coordinates and as many velocities first: the largest errors, by the weighted distances of two other
 * runs, the largest motions of coordinates from the start and speeds, and the largest sizes of
 * coordinates, where they are more than those before, which `largest` has in this order. */
void lagrange_compare(int64_t samples, int64_t n, int64_t width, const double *run, const double *one,
                      const double *two, const double *weights, const double *start,
                      double *largest)
{
    double *const moved = largest + width, *const size = moved + width;
    const double first = weights[0], second = weights[1];
    const double *const end = run + width*samples;
    int64_t i;
    for (; run < end; run += width, one += width, two += width) {
        for (i = 0; i < width; ++i) {
            /* Rounded by itself: what is chosen is fused with no sum. The first weight is a power
             * of two, with which a fused sum rounds as two operations do. */
            const double other = larger(0.0, second*fabs(two[i] - run[i]));
            largest[i] = larger(largest[i], first*fabs(one[i] - run[i]) + other);
        }
        for (i = 0; i < n; ++i) {
            moved[i] = larger(moved[i], fabs(run[i] - start[i]));
            size[i] = larger(size[i], fabs(run[i]));
        }
        for (i = n; i < width; ++i) {
            moved[i] = larger(moved[i], fabs(run[i]));
        }
    }
}
