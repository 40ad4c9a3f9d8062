/* Taylor coefficients of many motions at once: one motion a lane, lanes in a vector register.
 *
 * Coefficient k of row i is at [k*rows + i]. The recurrences are those of
 * Moore, Interval Analysis, 1966, chapter 11, and of Jorba and Zou, Experiment. Math. 14 (2005)
 * 99, section 2. */
#ifndef LAGRANGE_TAYLOR_H
#define LAGRANGE_TAYLOR_H

#include "lane.h"

/* Coefficients 1 to order of motions: their state, and behind it the time, are in the first rows
 * of c, of which the first coefficients are given; p are parameters. Coefficients are not numbers
 * if the right-hand side does not exist. */
typedef void (*lagrange_series)(int order, const lagrange_lane *p, lagrange_lane *c);

#endif
