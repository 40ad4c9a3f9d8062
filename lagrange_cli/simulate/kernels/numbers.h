/* The numbers of all files: doubles, or those of a wider type.
 *
 * LAGRANGE_WIDE is 80 for long doubles and 128 for _Float128. Then functions are those of
 * <tgmath.h>, which go by the type of their arguments. R(x) is the constant x in all digits of the
 * type; constants that are thresholds, or that doubles hold exactly, stand without it.
 */
#ifndef LAGRANGE_NUMBERS_H
#define LAGRANGE_NUMBERS_H

#ifdef LAGRANGE_WIDE
/* Without the macro <tgmath.h> has no functions of _Float128. */
#define __STDC_WANT_IEC_60559_TYPES_EXT__ 1
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <tgmath.h>
/* A keyword may have another meaning behind the headers (C99, 7.1.2). */
#if LAGRANGE_WIDE == 128
#define double _Float128
#define R(constant) constant##f128
#else
#define double long double
#define R(constant) constant##L
#endif
#else
#include <math.h>
#define R(constant) constant
#endif

#endif
