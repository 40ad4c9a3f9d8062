/* A lane for each of many motions: operations on all lanes of a vector register at once.
 *
 * No operation mixes lanes, so that what one gives does not depend on the others. With
 * LAGRANGE_WIDE, for numbers that have no vectors, there is one lane.
 */
#ifndef LAGRANGE_LANE_H
#define LAGRANGE_LANE_H

#include "numbers.h"

#include <stdint.h>

#ifdef LAGRANGE_WIDE

#define LAGRANGE_INLINE static inline
#define LAGRANGE_WIDTH 1
#define LANE(x, l) (*((void)(l), &(x)))

typedef double lagrange_lane;

#define LAGRANGE_EACH(name, function)                                        \
    LAGRANGE_INLINE lagrange_lane name(lagrange_lane x)                      \
    {                                                                        \
        return function(x);                                                  \
    }

LAGRANGE_EACH(lagrange_each_sin, sin)
LAGRANGE_EACH(lagrange_each_cos, cos)
LAGRANGE_EACH(lagrange_each_sqrt, sqrt)
LAGRANGE_EACH(lagrange_each_exp, exp)
LAGRANGE_EACH(lagrange_size, fabs)
LAGRANGE_EACH(lagrange_logarithm, log2)

/* 0 where x > y, not a number elsewhere. */
LAGRANGE_INLINE lagrange_lane lagrange_require_above(lagrange_lane x, lagrange_lane y)
{
    return x > y ? 0.0 : NAN;
}

LAGRANGE_INLINE lagrange_lane lagrange_larger(lagrange_lane x, lagrange_lane y)
{
    return x > y ? x : y;
}

LAGRANGE_INLINE lagrange_lane lagrange_smaller(lagrange_lane x, lagrange_lane y)
{
    return x < y ? x : y;
}

/* y where x is 0, else x. */
LAGRANGE_INLINE lagrange_lane lagrange_unless_zero(lagrange_lane x, lagrange_lane y)
{
    return x != 0.0 ? x : y;
}

LAGRANGE_INLINE lagrange_lane lagrange_power_of_two(lagrange_lane x)
{
    return exp2(fmin(fmax(x, -1000.0), 1000.0));
}

#else

#include "lanes.h"

#ifdef __AVX512F__
#define LAGRANGE_WIDTH 8
#elif defined __AVX__
#define LAGRANGE_WIDTH 4
#else
#define LAGRANGE_WIDTH 2
#endif

#define LANE(x, l) ((x)[l])

/* One number of each motion, and the result of comparing two of them. */
typedef double lagrange_lane __attribute__((vector_size(8*LAGRANGE_WIDTH)));
typedef int64_t lagrange_flags __attribute__((vector_size(8*LAGRANGE_WIDTH)));

/* A function of one number, of each lane. */
#define LAGRANGE_EACH(name, function)                                        \
    LAGRANGE_INLINE lagrange_lane name(lagrange_lane x)                      \
    {                                                                        \
        lagrange_lane out;                                                   \
        int l;                                                               \
        for (l = 0; l < LAGRANGE_WIDTH; ++l) {                               \
            out[l] = function(x[l]);                                         \
        }                                                                    \
        return out;                                                          \
    }

LAGRANGE_EACH(lagrange_each_sin, lagrange_lane_sin)
LAGRANGE_EACH(lagrange_each_cos, lagrange_lane_cos)
LAGRANGE_EACH(lagrange_each_sqrt, sqrt)
LAGRANGE_EACH(lagrange_each_exp, exp)

LAGRANGE_INLINE lagrange_lane lagrange_require_above(lagrange_lane x, lagrange_lane y)
{
    return (lagrange_lane)~(x > y);
}

LAGRANGE_INLINE lagrange_lane lagrange_size(lagrange_lane x)
{
    return (lagrange_lane)((lagrange_flags)x & INT64_MAX);
}

LAGRANGE_INLINE lagrange_lane lagrange_chosen(lagrange_flags first, lagrange_lane x,
                                              lagrange_lane y)
{
    return (lagrange_lane)((first & (lagrange_flags)x) | (~first & (lagrange_flags)y));
}

LAGRANGE_INLINE lagrange_lane lagrange_larger(lagrange_lane x, lagrange_lane y)
{
    return lagrange_chosen(x > y, x, y);
}

LAGRANGE_INLINE lagrange_lane lagrange_smaller(lagrange_lane x, lagrange_lane y)
{
    return lagrange_chosen(x < y, x, y);
}

LAGRANGE_INLINE lagrange_lane lagrange_unless_zero(lagrange_lane x, lagrange_lane y)
{
    const lagrange_lane zero = {0.0};
    return lagrange_chosen(x != zero, x, y);
}

/* log2(x) and 2^x within some thousandths, by the bits of numbers that are not negative. */
LAGRANGE_INLINE lagrange_lane lagrange_logarithm(lagrange_lane x)
{
    const lagrange_flags one = (lagrange_flags){0} + 0x3ff0000000000000;
    const lagrange_flags bits = (lagrange_flags)x;
    const lagrange_lane part = (lagrange_lane)((bits & 0x000fffffffffffff) | one) - 1.0;
    lagrange_lane whole;
    int l;
    for (l = 0; l < LAGRANGE_WIDTH; ++l) {
        whole[l] = (double)((bits[l] >> 52) - 1023);
    }
    return whole + part*(1.3437 - 0.3437*part);
}

LAGRANGE_INLINE lagrange_lane lagrange_power_of_two(lagrange_lane x)
{
    const lagrange_lane zero = {0.0}, shift = zero + 0x1.8p52;
    const lagrange_lane bounded =
        lagrange_larger(lagrange_smaller(x, zero + 1000.0), zero - 1000.0);
    /* A sum with 1.5 * 2^52 cannot hold a fraction; its last bits are the integer. */
    const lagrange_lane sum = bounded + shift, part = bounded - (sum - shift);
    const lagrange_flags whole = (lagrange_flags)sum - (lagrange_flags)shift;
    const lagrange_flags bits = (whole + 1023) << 52;
    return (1.0 + part*(0.6931 + 0.2402*part))*(lagrange_lane)bits;
}

#endif

#endif
