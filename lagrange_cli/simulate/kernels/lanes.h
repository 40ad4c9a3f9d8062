/* Sine and cosine without branches or calls, so that loops over states become vectors.
 *
 * Within one unit in the last place for |x| up to LAGRANGE_LARGEST_ANGLE; beyond
 * it, not a number. Reduction by multiples of pi/2 in three parts after Cody and
 * Waite; the polynomials on [-pi/4, pi/4] are those of fdlibm (K. C. Ng).
 */
#ifndef LAGRANGE_LANES_H
#define LAGRANGE_LANES_H

#include "numbers.h"

/* 2^19 pi/2, so that products with the first parts of pi/2, of 33 bits, are exact. */
#define LAGRANGE_LARGEST_ANGLE 823549.0

/* A loop with a call left in it is none over vectors. */
#ifdef __GNUC__
#define LAGRANGE_INLINE static inline __attribute__((always_inline))
#else
#define LAGRANGE_INLINE static inline
#endif

/* a*b + c, rounded once where the machine does that as fast as one product. */
#ifdef __FP_FAST_FMA
#define LAGRANGE_FMA(a, b, c) fma(a, b, c)
#else
#define LAGRANGE_FMA(a, b, c) ((a)*(b) + (c))
#endif

/* The nearest integer; a sum with 1.5 * 2^52 cannot hold a fraction. */
LAGRANGE_INLINE double lagrange_nearest(double x)
{
    return (x + 0x1.8p52) - 0x1.8p52;
}

/* sin(r + low) and cos(r + low) for |r| up to pi/4. */
LAGRANGE_INLINE double lagrange_small_sine(double r, double low)
{
    const double z = r*r, w = z*z, cube = z*r;
    const double start = LAGRANGE_FMA(z, -1.98412698298579493134e-04, 8.33333333332248946124e-03);
    const double inner = LAGRANGE_FMA(z, -2.50507602534068634195e-08, 2.75573137070700676789e-06);
    const double end = LAGRANGE_FMA(w, 1.58969099521155010221e-10, inner);
    const double tail = LAGRANGE_FMA(w, end, start);
    const double correction = LAGRANGE_FMA(z, LAGRANGE_FMA(-cube, tail, 0.5*low), -low);
    return r - LAGRANGE_FMA(1.66666666666666324348e-01, cube, correction);
}

LAGRANGE_INLINE double lagrange_small_cosine(double r, double low)
{
    const double z = r*r, w = z*z, half = 0.5*z, rest = 1.0 - half;
    const double start = LAGRANGE_FMA(z, -1.38888888888741095749e-03, 4.16666666666666019037e-02);
    const double inner = LAGRANGE_FMA(z, -2.75573143513906633035e-07, 2.48015872894767294178e-05);
    const double end = LAGRANGE_FMA(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09);
    const double tail = LAGRANGE_FMA(w, LAGRANGE_FMA(w, end, inner), start);
    return rest + (((1.0 - rest) - half) + LAGRANGE_FMA(w, tail, -r*low));
}

/* The sine of x plus a quarter turn times `turn`, which is 0 or 1. */
LAGRANGE_INLINE double lagrange_turned_sine(double x, double turn)
{
    const double k = lagrange_nearest(6.36619772367581382433e-01*x);
    const double first = LAGRANGE_FMA(-k, 1.57079632673412561417e+00, x);
    const double part = k*6.07710050630396597660e-11;
    const double second = first - part;
    const double lost = LAGRANGE_FMA(-k, 2.02226624879595063154e-21, (first - second) - part);
    const double r = second + lost, low = (second - r) + lost;
    const double sine = lagrange_small_sine(r, low), cosine = lagrange_small_cosine(r, low);
    /* Quarter turns from -2 to 2: with an odd number sine and cosine change places. */
    const double count = k + turn, turns = LAGRANGE_FMA(-4.0, lagrange_nearest(0.25*count), count);
    const double size = fabs(turns), odd = turns*cosine, even = (1.0 - size)*sine;
    const double rotated = size == 1.0 ? odd : even;
    return fabs(x) <= LAGRANGE_LARGEST_ANGLE ? rotated : NAN;
}

LAGRANGE_INLINE double lagrange_lane_sin(double x)
{
    return lagrange_turned_sine(x, 0.0);
}

LAGRANGE_INLINE double lagrange_lane_cos(double x)
{
    return lagrange_turned_sine(x, 1.0);
}

#endif
